"""Shards of a corpus that several machines prepare: merged, they are the corpus that one machine prepares."""

import json
import shutil
from functools import partial

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_layout import SHARD
from a2g_jax.data.corpus_writer import Item, Plan, Prepared, Skipped
from a2g_jax.data.prepare import Work, prepare_work
from a2g_jax.data.settings import Features
from a2g_jax.data.shards import Share, merge_shards, prepare_shard
from a2g_jax.errors import InputError, Interrupted
from a2g_jax.talker.skeleton import TALKER_SKELETON

FEATURES = Features(waveform=True)


def rows(number, folder):
    """A made-up recording; every fourth one is broken."""
    source = (str(folder / f"{number}.wav"),)
    if number % 4 == 3:
        return Skipped(f"take{number}", source, f"{source[0]}: is broken.")
    rng = np.random.default_rng(number)
    frames = 60 + 7 * number
    return Prepared(
        name=f"take{number}",
        audio=rng.normal(-40, 10, (frames, 64)).astype(np.float32),
        pose=rng.normal(size=(frames, 22, 6)).astype(np.float32),
        root=rng.normal(size=(frames, 3)).astype(np.float32),
        waveform=rng.integers(-99, 99, frames * 533).astype(np.int16),
        body=TALKER_SKELETON,
        speaker="ada" if number % 2 else "ben",
        emotion="happy",
        split="",
        sources=source,
        annotations={"words": [{"text": "ä", "start": 0.1, "end": 0.30000000000000004}]},
        waveform_gain=1.0 if number else 0.5,
    )


def work_of(folder, count=9, **recipe):
    for number in range(count):
        (folder / f"{number}.wav").write_bytes(bytes([number]))
    items = [Item(f"take{number}", (str(folder / f"{number}.wav"),)) for number in range(count)]
    plan = Plan(FEATURES, {"reader": "made up", **recipe}, skip_broken=True)
    return Work("preparing", items, list(range(count)), partial(rows, folder=folder), plan)


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Sources, the corpus and its three shards."""
    folder = tmp_path_factory.mktemp("shards")
    (folder / "sources").mkdir()
    work = work_of(folder / "sources")
    prepare_work(folder / "whole", work, workers=1)
    for number in (1, 2, 3):
        prepare_shard(folder / f"part{number}", work, Share(number, 3), workers=1)
    return folder


def test_merged_shards_are_the_corpus_byte_for_byte(made, tmp_path):
    shutil.move(made / "sources" / "5.wav", made / "sources" / "away")  # sources need not be there
    merged = merge_shards([made / f"part{number}" for number in (3, 1, 2)], tmp_path / "merged")
    shutil.move(made / "sources" / "away", made / "sources" / "5.wav")
    assert contents(tmp_path / "merged") == contents(made / "whole")
    assert merged.fingerprint == Corpus.open(made / "whole").fingerprint
    assert [path.name for path in tmp_path.iterdir()] == ["merged"]


def test_a_shard_resumes(made, tmp_path):
    work = work_of(made / "sources")

    def stopped(number):
        if number == 5:
            raise KeyboardInterrupt
        return work.make(number)

    with pytest.raises(Interrupted):
        prepare_shard(tmp_path / "part", work._replace(make=stopped), Share(2, 3), workers=1)
    reports = []
    prepare_shard(tmp_path / "part", work, Share(2, 3), workers=1, report=reports.append)
    assert any("resuming after 2 of 3" in line for line in reports)
    assert contents(tmp_path / "part") == contents(made / "part2")


def change(folder, **values):
    about = json.loads((folder / SHARD).read_text())
    about.update(values, checksum=None)
    (folder / SHARD).write_text(json.dumps(about))


def refused(message, shards, out):
    with pytest.raises(InputError, match=message):
        merge_shards(shards, out)
    assert not out.exists()


def test_what_cannot_be_merged(made, tmp_path):
    parts, out = [made / f"part{number}" for number in (1, 2, 3)], tmp_path / "out"
    refused("shard 2 of 3 is missing", [parts[0], parts[2]], out)
    refused("shards 1, 2 of 3 are missing", parts[2:], out)
    again = shutil.copytree(parts[1], tmp_path / "again")
    refused("again: is shard 2, as .*part2 is; name each once", [*parts, again], out)
    refused("is no shard", [*parts, made / "whole"], out)
    prepare_shard(tmp_path / "other", work_of(made / "sources", limit=8), Share(3, 3), workers=1)
    refused(r"other: was prepared with other settings than .*part1 \(limit\)", [*parts[:2], tmp_path / "other"], out)
    prepare_shard(tmp_path / "half", work_of(made / "sources"), Share(2, 2), workers=1)
    refused("half: is one of 2 shards, .*part1 one of 3", [*parts, tmp_path / "half"], out)
    for name in ("pose.npy", "annotations/00000.json"):
        broken = shutil.copytree(parts[2], tmp_path / "broken")
        data = bytearray((broken / name).read_bytes())
        data[-3] ^= 1
        (broken / name).write_bytes(data)
        refused(f"broken/{name}: differs from its hash", [*parts[:2], broken], out)
        shutil.rmtree(broken)
    with pytest.raises(InputError, match="is one shard of a corpus; merge all"):
        Corpus.open(parts[0])


@pytest.mark.parametrize("text", ["0/3", "4/3", "3", "1/0", "a/b", "-1/2"])
def test_shares(text):
    assert Share.parse("2/4") == Share(2, 4)
    with pytest.raises(InputError, match="--shard: expected I/N"):
        Share.parse(text)


def test_every_recording_is_in_one_share():
    for total, count in ((9, 4), (4, 4), (100, 7)):
        found = [row for number in range(1, count + 1) for row in range(total)[Share(number, count).of(total)]]
        assert found == list(range(total))


def test_fewer_recordings_than_shards(made, tmp_path):
    with pytest.raises(InputError, match="there are 9 recordings"):
        prepare_shard(tmp_path / "part", work_of(made / "sources"), Share(1, 10))


def test_flags_that_exclude_each_other(made, tmp_path, capsys):
    assert main(["prepare", "talker", "--merge", str(made / "part1"), "--out", str(tmp_path / "c")]) == 2
    assert "--merge: takes the folders of the shards and --out alone" in capsys.readouterr().err


@pytest.mark.slow
def test_the_command(tmp_path, capsys):
    talker = ["prepare", "talker", "--minutes", "4", "--workers", "1"]
    assert main([*talker, "--out", str(tmp_path / "whole")]) == 0
    parts = [str(tmp_path / f"part{number}") for number in (1, 2)]
    for number, part in enumerate(parts, 1):
        assert main([*talker, "--shard", f"{number}/2", "--out", part]) == 0
    assert "shard 2/2, 2 recordings" in capsys.readouterr().out
    assert main(["prepare", "--merge", *parts, "--out", str(tmp_path / "merged")]) == 0
    assert contents(tmp_path / "merged") == contents(tmp_path / "whole")
