"""Preparation that is stopped, killed, damaged or started twice ends with the same bytes as one left alone."""

import shutil
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_layout import ARRAYS
from a2g_jax.data.corpus_writer import Item, Plan, prepare_corpus
from a2g_jax.data.featurise import Prepared
from a2g_jax.data.prepare import prepare_data_set
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError, Interrupted
from a2g_jax.features.mel import MelConfig
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.talker.recordings import talk

MEL = MelConfig()
COUNT = 8
ITEMS = [Item(f"r{number}", ()) for number in range(COUNT)]
PLAN = Plan(Features(), {"reader": "noise", "speed": 1.0})


def noise(number: int) -> Prepared:
    """A recording of random rows whose bones grow a little with its number."""
    rng = np.random.default_rng(number)
    frames = 5 + 3 * number
    offsets = np.array([[0, 0, 0], [0, 1 + 0.01 * number, 0]], np.float32)
    return Prepared(
        name=f"r{number}",
        audio=rng.normal(size=(frames, MEL.bands)).astype(np.float32),
        pose=rng.normal(size=(frames, 2, 6)).astype(np.float32),
        root=rng.normal(size=(frames, 3)).astype(np.float32),
        waveform=None,
        body=Skeleton(offsets, ("hip", "head"), (-1, 0)),
        split="",
        speaker="nobody",
        emotion="none",
        sources=(),
        annotations={"words": [], "number": number},
    )


def make(done, stop_before=None, calls=None):
    """Recordings from ``done`` on; Ctrl-C comes before one of them."""
    for number in range(done, COUNT):
        if number == stop_before:
            raise KeyboardInterrupt
        if calls is not None:
            calls.append(number)
        yield noise(number)


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def stop_after(path: Path, count: int) -> Path:
    """The unfinished work that Ctrl-C leaves."""
    message = f"stopped after {count} of {COUNT} recordings; run the same command to resume"
    with pytest.raises(Interrupted, match=message):
        prepare_corpus(path, ITEMS, lambda done: make(done, stop_before=count), PLAN)
    assert not path.exists()
    return path.parent / f".{path.name}.unfinished"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """What an uninterrupted preparation makes."""
    path = tmp_path_factory.mktemp("whole") / "corpus"
    prepare_corpus(path, ITEMS, make, PLAN)
    return contents(path)


@pytest.mark.parametrize("count", [1, 4, COUNT - 1])
def test_resumes_where_it_was_stopped(tmp_path, whole, count):
    stop_after(tmp_path / "corpus", count)
    reported, calls = [], []
    prepare_corpus(tmp_path / "corpus", ITEMS, lambda done: make(done, calls=calls), PLAN, reported.append)
    assert calls == list(range(count, COUNT))
    assert f"resuming after {count} of {COUNT} recordings" in reported[0]
    # The spread of bone lengths is over all recordings, not over those of the last start.
    assert "up to 7.0 cm" in reported[-1]
    assert contents(tmp_path / "corpus") == whole
    assert list(tmp_path.iterdir()) == [tmp_path / "corpus"]


def test_nothing_is_left_when_nothing_was_done(tmp_path):
    stop_after(tmp_path / "corpus", 0)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", [*ARRAYS, "annotations/00002.json"])
def test_rows_that_are_cut_or_changed_are_made_again(tmp_path, whole, name):
    rng = np.random.default_rng(len(name))
    for number in range(6):
        path = tmp_path / str(number) / "corpus"
        file = stop_after(path, 5) / "corpus" / name
        content = bytearray(file.read_bytes())
        place = int(rng.integers(len(content)))
        if number % 2:
            content[place] ^= 0x20
        else:
            del content[place:]
        file.write_bytes(content)
        prepare_corpus(path, ITEMS, make, PLAN)
        assert contents(path) == whole


def test_a_damaged_journal_costs_only_what_it_does_not_tell(tmp_path, whole):
    rng = np.random.default_rng(0)
    for number in range(12):
        path = tmp_path / str(number) / "corpus"
        journal = stop_after(path, 6) / "journal.txt"
        content = bytearray(journal.read_bytes())
        lines = [n for n, byte in enumerate(content) if byte == ord("\n")]
        place = int(rng.integers(len(content)))
        good = sum(line < place for line in lines)
        if number % 2:
            content[place] ^= 0x41
        else:
            del content[place:]
        journal.write_bytes(content)
        calls = []
        prepare_corpus(path, ITEMS, lambda done, calls=calls: make(done, calls=calls), PLAN)
        assert calls[0] == good
        assert contents(path) == whole
    for lost in ("journal.txt", "corpus/pose.npy", "corpus", "recipe.json"):
        path = tmp_path / lost.replace("/", "_") / "corpus"
        target = stop_after(path, 6) / lost
        shutil.rmtree(target) if target.is_dir() else target.unlink()
        prepare_corpus(path, ITEMS, make, PLAN)
        assert contents(path) == whole


def test_other_settings_discard_unfinished_work(tmp_path, whole):
    stop_after(tmp_path / "corpus", 3)
    reported = []
    other = Plan(Features(), {"reader": "noise", "speed": 2.0})
    corpus = prepare_corpus(tmp_path / "corpus", ITEMS, make, other, reported.append)
    assert "unfinished work with other settings (speed: 1.0, now 2.0) is discarded" in reported[0]
    assert corpus.recipe["speed"] == 2.0


def test_an_error_keeps_what_was_done(tmp_path, whole):
    def broken(done):
        yield from (noise(number) for number in range(done, 3))
        raise InputError("r3: is broken")

    reported = []
    with pytest.raises(InputError, match="r3"):
        prepare_corpus(tmp_path / "corpus", ITEMS, broken, PLAN, reported.append)
    assert f"3 of {COUNT} recordings are finished; run the same command to resume" in reported[-1]
    prepare_corpus(tmp_path / "corpus", ITEMS, make, PLAN)
    assert contents(tmp_path / "corpus") == whole


def test_only_one_process_at_a_time(tmp_path, whole):
    path = tmp_path / "corpus"

    def meanwhile(done):
        with pytest.raises(InputError, match=r"is being prepared by another process \(process [0-9]+ on "):
            prepare_corpus(path, ITEMS, make, PLAN)
        yield from make(done)

    prepare_corpus(path, ITEMS, meanwhile, PLAN)
    assert contents(path) == whole
    assert list(tmp_path.iterdir()) == [tmp_path / "corpus"]


def test_a_kill_right_after_the_end_leaves_only_rubbish(tmp_path, whole):
    """The corpus has its name already; what is left of the work goes with the next command, which refuses."""
    prepare_corpus(tmp_path / "corpus", ITEMS, make, PLAN)
    (tmp_path / ".corpus.unfinished").mkdir()
    (tmp_path / ".corpus.unfinished" / "recipe.json").write_text("{}")
    with pytest.raises(InputError, match="exists already"):
        prepare_corpus(tmp_path / "corpus", ITEMS, make, PLAN)
    assert list(tmp_path.iterdir()) == [tmp_path / "corpus"]


def test_files_that_changed_are_read_again(tmp_path, capsys):
    source = tmp_path / "mine"
    takes = [talk(2.5, seed) for seed in range(3)]
    for number, take in enumerate(takes):
        write_audio(source / f"{number}.wav", take.audio, 16000)
        write_bvh(source / f"{number}.bvh", take.motion)
    whole = source / "2.bvh"
    text = whole.read_text()
    whole.write_text("HIERARCHY\n")
    with pytest.raises(InputError, match=r"2\.bvh"):
        prepare_data_set("folder", source, tmp_path / "corpus", Features())
    assert "2 of 3 recordings are finished" in capsys.readouterr().err
    whole.write_text(text)
    write_audio(source / "1.wav", takes[1].audio * 0.5, 16000)
    corpus = prepare_data_set("folder", source, tmp_path / "corpus", Features())
    assert "resuming after 1 of 3 recordings (1 finished ones have changed" in capsys.readouterr().err
    again = prepare_data_set("folder", source, tmp_path / "again", Features())
    assert contents(corpus.path) == contents(again.path)


_SCRIPT = """
import sys
sys.path.insert(0, {tests!r})
import test_prepare_resume as here
def rows(done):
    for item in here.make(done):
        here.time.sleep({pause})
        yield item
here.prepare_corpus({path!r}, here.ITEMS, rows, here.PLAN)
"""

_TALKER = """
from a2g_jax.talker import recordings
recordings.RECORDING_SECONDS = 10.0
from a2g_jax.data.generated import TalkerOptions
from a2g_jax.data.prepare import prepare_talker
if __name__ == "__main__":
    prepare_talker({path!r}, TalkerOptions(minutes=4.0, jitter=0.5), workers={workers})
"""


def kill_until_done(start, path: Path, rng, kills: int, most: float) -> int:
    """Kill a preparation at random moments after it began to write, then let it end; how many kills hit it."""
    work = path.parent / f".{path.name}.unfinished"
    hit = 0
    for _ in range(kills):
        before = work.stat().st_mtime_ns if work.exists() else 0
        process = start()
        while process.poll() is None and not (work.exists() and work.stat().st_mtime_ns > before):
            time.sleep(0.002)
        time.sleep(rng.uniform(0.0, most))
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
            hit += 1
        process.wait()
        if path.exists():
            break
    if not path.exists():
        process = start()
        assert process.wait() == 0, process.stderr.read().decode()
    return hit


def start_script(text: str):
    return subprocess.Popen([sys.executable, "-c", text], stderr=subprocess.PIPE)


def test_resumes_after_a_kill(tmp_path, whole):
    path = tmp_path / "corpus"
    text = textwrap.dedent(_SCRIPT).format(tests=str(Path(__file__).parent), path=str(path), pause=0.05)
    assert kill_until_done(lambda: start_script(text), path, np.random.default_rng(1), 2, 0.4) > 0
    assert contents(path) == whole


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_resumes_after_many_kills(tmp_path, whole):
    """Every stage is hit, the last steps too: there the rows come without a pause."""
    rng = np.random.default_rng(2)
    for number in range(20):
        path = tmp_path / str(number) / "corpus"
        path.parent.mkdir()
        text = textwrap.dedent(_SCRIPT).format(tests=str(Path(__file__).parent), path=str(path), pause=0.0)
        kill_until_done(lambda text=text: start_script(text), path, rng, 3, 0.12)
        assert contents(path) == whole


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_generation_killed_many_times(tmp_path):
    """With worker processes, which end with their parent."""
    script = tmp_path / "prepare.py"
    start = lambda: subprocess.Popen([sys.executable, str(script)], stderr=subprocess.PIPE)  # noqa: E731
    script.write_text(_TALKER.format(path=str(tmp_path / "whole"), workers=1))
    assert start().wait() == 0
    script.write_text(_TALKER.format(path=str(tmp_path / "killed"), workers=2))
    assert kill_until_done(start, tmp_path / "killed", np.random.default_rng(3), 6, 5.0) > 0
    assert contents(tmp_path / "killed") == contents(tmp_path / "whole")
    assert Corpus.open(tmp_path / "killed").recipe["jitter"] == 0.5
