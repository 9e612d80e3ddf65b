"""Nothing damaged in a corpus is used: not a changed bit, not a missing or cut file, not NaN."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.data import corpus_writer
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_integrity import damaged_files, verify_corpus
from a2g_jax.data.corpus_layout import ARRAYS
from a2g_jax.data.corpus_writer import Item, Plan, prepare_corpus, prepare_recording
from a2g_jax.data.prepared_checks import is_still
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError, OutputError
from a2g_jax.inspection.inspect import inspect
from a2g_jax.io.sealed import seal_file, write_sealed
from a2g_jax.talker.recordings import talk
from tests.disk_for_tests import small_files


@pytest.fixture
def copy(toy_corpus, tmp_path):
    return shutil.copytree(toy_corpus.path, tmp_path / "corpus")


@pytest.fixture(scope="module")
def prepared():
    return [prepare_recording(talk(3.0, seed, name=f"take{seed}"), Features()) for seed in range(3)]


def use(path):
    """Open a corpus and verify it, as training and evaluation do."""
    corpus = Corpus.open(path)
    verify_corpus(corpus)
    return corpus


def files_of(folder):
    return sorted(path for path in folder.rglob("*") if path.is_file())


def test_changed_bits_and_cuts_of_every_file_are_named(copy):
    use(copy)
    rng = np.random.default_rng(0)
    files = files_of(copy)
    assert len(files) == 11
    for path in files:
        data = path.read_bytes()
        places = {0, len(data) - 1, *rng.integers(0, len(data), 4).tolist()}
        changes = [data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :] for at in places]
        changes += [data[:-1], data[: len(data) // 2], b"", data + b"\n"]
        for changed in changes:
            path.write_bytes(changed)
            with pytest.raises(InputError, match=path.name) as caught:
                use(copy)
            assert "\n" not in str(caught.value)
        path.unlink()
        with pytest.raises(InputError, match=path.name):
            use(copy)
        path.write_bytes(data)
    use(copy)


def test_inspect_names_all_damaged_files(copy):
    assert not [finding for finding in inspect(copy).findings if finding.code == "damaged"]
    for name in ("pose.npy", "root.npy", "annotations/00003.json"):
        data = bytearray((copy / name).read_bytes())
        data[-9] ^= 1
        (copy / name).write_bytes(data)
    found = [finding for finding in inspect(copy).findings if finding.code == "damaged"]
    assert [finding.place.path for finding in found] == ["pose.npy", "root.npy", "annotations/00003.json"]
    assert {finding.severity for finding in found} == {"warning"}


def test_what_was_read_once_is_read_again_by_force_alone(copy, tmp_path, monkeypatch):
    """A disk that changes bits leaves size and times as they are."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr("a2g_jax.io.hashes._SETTLED", -1.0)
    corpus = use(copy)
    monkeypatch.setattr("a2g_jax.data.corpus_integrity._scan", lambda path: {"sha256": "other", "bad row": -1})
    assert list(damaged_files(corpus)) == []
    assert len(list(damaged_files(corpus, force=True))) == 3


def test_corpora_of_version_0_1_are_read_and_their_arrays_compared(copy):
    manifest = json.loads((copy / "manifest.json").read_text())
    for name in ("annotations", "checksum"):
        del manifest[name]
    (copy / "manifest.json").write_text(json.dumps(manifest))
    assert use(copy).annotations(0)
    data = bytearray((copy / "pose.npy").read_bytes())
    data[5000] ^= 1
    (copy / "pose.npy").write_bytes(data)
    with pytest.raises(InputError, match=r"pose\.npy: differs from its hash"):
        use(copy)
    manifest["fingerprint"] = "0" * 64
    (copy / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(InputError, match="fingerprint and hashes disagree"):
        Corpus.open(copy)


def test_nan_is_named_by_array_recording_and_frame(copy, toy_corpus):
    """Of a corpus whose hashes are right, as another program may write it."""
    for name, recording, frame, value in (("pose", 3, 17, np.nan), ("audio", 0, 0, np.inf), ("root", 5, 299, np.nan)):
        array = np.load(toy_corpus.path / f"{name}.npy")
        array[toy_corpus.recordings[recording].first + frame].flat[0] = value
        np.save(copy / f"{name}.npy", array)
        manifest = json.loads((toy_corpus.path / "manifest.json").read_text())
        manifest["arrays"][f"{name}.npy"] = corpus_writer.sha256_file(copy / f"{name}.npy")
        manifest["fingerprint"] = corpus_writer.fingerprint_of(manifest["arrays"])
        write_sealed(copy / "manifest.json", manifest)
        with pytest.raises(InputError, match=rf"{name}\.npy: has NaN .* recording 'take{recording}', frame {frame};"):
            use(copy)
        shutil.copy(toy_corpus.path / f"{name}.npy", copy / f"{name}.npy")


def broken(item, name, frame):
    array = np.array(getattr(item, name))
    array[frame].flat[1] = np.nan
    return replace(item, **{name: array})


def make_corpus(out, items, report=lambda line: None, skip=False):
    names = [Item(item.name, ()) for item in items]
    plan = Plan(Features(), {"reader": "folder"}, skip_broken=skip)
    return prepare_corpus(out, names, lambda done: iter_from(items, done), plan, report)


def iter_from(items, done):
    yield from items[done:]


@pytest.mark.parametrize(("name", "words"), [("audio", "audio features"), ("pose", "poses"), ("root", "root")])
def test_nan_is_refused_by_prepare(prepared, tmp_path, name, words):
    items = [prepared[0], broken(prepared[1], name, 40), prepared[2]]
    message = f"take1.*NaN or infinity in its {words}, 1 of 90 frames, the first is 40"
    with pytest.raises(InputError, match=message):
        make_corpus(tmp_path / "corpus", items)
    assert not (tmp_path / "corpus").exists()
    said = []
    corpus = make_corpus(tmp_path / "corpus", items, said.append, skip=True)
    assert [entry.name for entry in corpus.recordings] == ["take0", "take2"]
    assert any("NaN" in line for line in said)


def test_a_motion_that_never_moves_is_mentioned(prepared, tmp_path, capsys):
    still = [
        replace(
            item,
            pose=np.broadcast_to(prepared[0].pose[:1], item.pose.shape),
            root=np.broadcast_to(prepared[0].root[:1], item.root.shape),
        )
        for item in prepared
    ]
    assert [is_still(item) for item in (*prepared, *still)] == [False] * 3 + [True] * 3
    said = []
    make_corpus(tmp_path / "one", [prepared[0], still[1], prepared[2]], said.append)
    assert [line for line in said if "nothing moves" in line] == ["take1: nothing moves in 'take1'; check the export."]
    capsys.readouterr()
    verify_corpus(make_corpus(tmp_path / "all", still))
    assert "no pose of its training recordings ever changes" in capsys.readouterr().err


@pytest.mark.parametrize("size", [2_000, 60_000, 100_000, 130_000])
def test_a_full_disk_while_preparing(prepared, tmp_path, size):
    """At any file: one line that names the corpus; what is finished is resumed, and the corpus is the same."""
    whole, out = make_corpus(tmp_path / "whole", prepared), tmp_path / "corpus"
    message = r"/corpus: cannot be written \(File too large\); free some space"
    with pytest.raises(OutputError, match=message), small_files(size):
        make_corpus(out, prepared)
    assert not out.exists()
    said = []
    make_corpus(out, prepared, said.append)
    if size >= 100_000:
        assert any("resuming after" in line for line in said)
    for path in files_of(whole.path):
        assert (out / path.relative_to(whole.path)).read_bytes() == path.read_bytes()
    assert {path.name for path in tmp_path.iterdir()} == {"whole", "corpus"}


def test_a_full_disk_is_no_broken_recording(prepared, tmp_path):
    with pytest.raises(OutputError), small_files(60_000):
        make_corpus(tmp_path / "corpus", prepared, skip=True)


def test_a_corpus_that_is_edited_and_sealed_again(copy):
    manifest = json.loads((copy / "manifest.json").read_text())
    manifest["recipe"]["note"] = "cut by hand"
    (copy / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(InputError, match=r'manifest\.json: differs from its checksum.*"checksum": null'):
        Corpus.open(copy)
    seal_file(copy / "manifest.json")
    assert use(copy).recipe["note"] == "cut by hand"
    assert set(Corpus.open(copy).hashes) == {*ARRAYS, "statistics.npz"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda m: m["recordings"][0].update(frames=[1]), "is damaged"),
        (lambda m: m["recordings"][0].update(name=None), "is damaged"),
        (lambda m: m["recordings"][1].update(first="a"), "is damaged"),
        (lambda m: m["recordings"][1].update(waveform_gain="a"), "is damaged"),
        (lambda m: m["splits"].update(train=[[0, [], 5]]), "is damaged"),
        (lambda m: m["annotations"].__setitem__(0, True), "is damaged"),
        (lambda m: m.update(recipe=[]), "is damaged"),
        (lambda m: m.update(version="a" * 100_000), "has version aaaa"),
        (lambda m: m.update(pose=[0] * 10_000), "has poses of the unknown kind"),
    ],
)
def test_values_of_other_types_are_one_short_line(copy, change, words):
    """Of a manifest that was edited, and whose checksum accepts it."""
    manifest = json.loads((copy / "manifest.json").read_text())
    change(manifest)
    (copy / "manifest.json").write_text(json.dumps({**manifest, "checksum": None}))
    with pytest.raises(InputError, match=rf"manifest\.json: {words}") as error:
        use(copy)
    assert len(str(error.value)) < 400 + len(str(copy))
    assert "\n" not in str(error.value)


def test_headers_of_arrays_that_no_parser_finishes_are_damage(copy):
    data = (copy / "pose.npy").read_bytes()
    for header in (b"{'descr': '<f4', 'shape': (((", b"{'descr': '<f4' \\", b'"""', b"(" * 100, b"\x00" * 60):
        (copy / "pose.npy").write_bytes(data[:10] + header.ljust(118)[:117] + b"\n" + data[128:])
        with pytest.raises(InputError, match=r"pose\.npy: cannot be read \("):
            Corpus.open(copy)
