"""Corpora: made whole or not at all, read back as written, and refused when damaged."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_writer import prepare_recording, write_corpus
from a2g_jax.data.folder import find_pairs, read_pair
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError
from a2g_jax.features.mel import log_mel
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.recording import Recording
from a2g_jax.talker.recordings import talk

FEATURES = Features(joints="all")


@pytest.fixture(scope="module")
def take():
    return talk(4.0, 3, fps=30.0)


@pytest.fixture
def copy(toy_corpus, tmp_path):
    """A corpus folder to break."""
    return shutil.copytree(toy_corpus.path, tmp_path / "copy")


def test_rows_are_the_recordings(toy_corpus):
    take = talk(10.0, 2, name="take2")
    entry = toy_corpus.recordings[2]
    assert (entry.name, entry.frames, entry.speaker) == ("take2", 300, take.speaker)
    rows = slice(entry.first, entry.first + entry.frames)
    np.testing.assert_array_equal(toy_corpus.audio[rows], log_mel(take.audio, FEATURES.mel, 30.0, 300))
    again = toy_corpus.motion(rows.start, rows.stop)
    np.testing.assert_allclose(again.positions(), take.motion.positions(), atol=1e-5)
    assert toy_corpus.annotations(2)["words"][0]["text"] == take.words[0].text


def test_statistics_are_of_the_training_split_only(toy_corpus):
    rows = np.concatenate([toy_corpus.audio[start:stop] for _, start, stop in toy_corpus.segments("train")])
    np.testing.assert_allclose(toy_corpus.statistics["audio"].mean, rows.mean(axis=0), rtol=1e-4)
    everything = np.asarray(toy_corpus.audio).mean(axis=0)
    assert np.abs(toy_corpus.statistics["audio"].mean - everything).max() > 1e-3
    assert toy_corpus.statistics["pose"].std.min() >= 0.01


def test_splits_do_not_share_recordings(toy_corpus):
    members = {name: {segment.recording for segment in parts} for name, parts in toy_corpus.splits.items()}
    assert not members["train"] & members["test"]
    assert not members["train"] & members["validation"]
    assert set().union(*members.values()) == set(range(6))
    with pytest.raises(InputError, match="no split 'exam'; there are: train, validation, test"):
        toy_corpus.segments("exam")


def test_an_error_leaves_nothing_behind(tmp_path, take):
    def rows():
        yield prepare_recording(take, FEATURES)
        raise InputError("take7.bvh: is broken")

    with pytest.raises(InputError, match="take7"):
        write_corpus(tmp_path / "corpus", rows(), features=FEATURES, recipe={})
    assert list(tmp_path.iterdir()) == []


def test_existing_folders_and_empty_sources_are_refused(tmp_path):
    with pytest.raises(InputError, match="exists already"):
        write_corpus(tmp_path, iter(()), features=FEATURES, recipe={})
    with pytest.raises(InputError, match="no recordings"):
        write_corpus(tmp_path / "corpus", iter(()), features=FEATURES, recipe={})


def test_audio_and_motion_of_different_takes_are_refused(take):
    longer = Recording(
        name=take.name, audio=np.tile(take.audio, 2), sample_rate=16000, motion=take.motion, sources=("a.wav", "a.bvh")
    )
    with pytest.raises(InputError, match=r"a\.wav and a\.bvh: audio lasts 8\.00 s and motion 4\.00 s"):
        prepare_recording(longer, FEATURES)


def test_recordings_of_another_rig_are_refused(tmp_path, take):
    whole = take.motion.skeleton
    small = Skeleton(whole.offsets[:4], whole.names[:4], whole.parents[:4])
    motion = replace(take.motion, rotations=take.motion.rotations[:, :4], skeleton=small)
    arms = replace(take, name="arms", motion=motion)
    with pytest.raises(InputError, match=r"arms: has other joints \(4 of them\) than the recordings before it \(22\)"):
        write_corpus(
            tmp_path / "corpus",
            [prepare_recording(take, FEATURES), prepare_recording(arms, FEATURES)],
            features=FEATURES,
            recipe={},
        )


@pytest.mark.parametrize("fps", [15.0, 25.0, 60.0])
def test_other_frame_rates(take, fps):
    prepared = prepare_recording(take, Features(fps=fps))
    assert len(prepared.audio) == len(prepared.pose) == round(4.0 * fps)


def test_damaged_corpora(copy, tmp_path):
    with pytest.raises(InputError, match="is not a corpus"):
        Corpus.open(tmp_path)
    manifest = {**json.loads((copy / "manifest.json").read_text()), "checksum": None}
    for change, message in (
        ({"format": "something"}, "is not the manifest"),
        ({"version": 99}, "has version 99"),
        ({"recordings": [{"name": "x"}]}, "is damaged"),
        ({"skeleton": {"names": ["a"], "parents": [3], "offsets": [[0, 0, 0]]}}, "is damaged"),
    ):
        (copy / "manifest.json").write_text(json.dumps({**manifest, **change}))
        with pytest.raises(InputError, match=message):
            Corpus.open(copy)
    for change in ({"splits": [1]}, {"splits": {"train": [[9, 0, 5]]}}, {"fps": 0}):
        (copy / "manifest.json").write_text(json.dumps({**manifest, **change}))
        with pytest.raises(InputError, match="is damaged"):
            Corpus.open(copy)
    (copy / "manifest.json").write_text("{")
    with pytest.raises(InputError, match="is not JSON"):
        Corpus.open(copy)
    (copy / "manifest.json").write_text(json.dumps(manifest))
    statistics = (copy / "statistics.npz").read_bytes()
    (copy / "statistics.npz").write_bytes(statistics[: len(statistics) // 2])
    with pytest.raises(InputError, match=r"statistics\.npz: differs from its hash"):
        Corpus.open(copy)
    (copy / "statistics.npz").write_bytes(statistics)
    pose = (copy / "pose.npy").read_bytes()
    (copy / "pose.npy").write_bytes(pose[: len(pose) // 2])
    with pytest.raises(InputError, match=r"pose\.npy: has [0-9]+ bytes, its header says [0-9]+"):
        Corpus.open(copy)
    np.save(copy / "pose.npy", np.zeros((3, 22, 6), np.float32))
    with pytest.raises(InputError, match=r"pose\.npy: expected float32"):
        Corpus.open(copy)
    np.save(copy / "pose.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(InputError, match=r"pose\.npy: cannot be read"):
        Corpus.open(copy)


def test_a_folder_of_pairs(tmp_path, take):
    source = tmp_path / "mine"
    for name in ("b", "a"):
        write_audio(source / f"{name}.wav", take.audio, 16000)
        write_bvh(source / f"{name}.bvh", take.motion)
    pairs = find_pairs(source)
    assert [audio.name for audio, _ in pairs] == ["a.wav", "b.wav"]
    recording = read_pair(*pairs[0], 16000)
    assert recording.motion.skeleton.joints == 22
    prepared = prepare_recording(recording, Features())
    # BVH lists joints depth first; the body is found by name and comes in the standard order.
    assert prepared.body.names == take.motion.skeleton.names
    (source / "b.bvh").unlink()
    with pytest.raises(InputError, match=r"b\.wav: has no BVH file of the same name"):
        find_pairs(source)
    with pytest.raises(InputError, match="is not a folder"):
        find_pairs(tmp_path / "nowhere")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="holds no WAV and no BVH"):
        find_pairs(tmp_path / "empty")


def test_audio_and_motion_in_separate_folders(tmp_path, take):
    write_audio(tmp_path / "wav" / "a.wav", take.audio, 16000)
    write_bvh(tmp_path / "bvh" / "a.bvh", take.motion)
    assert len(find_pairs(tmp_path)) == 1


def test_parallel_trees_pair_by_path(tmp_path, take):
    for speaker in ("s1", "s2"):
        write_audio(tmp_path / "wav" / speaker / "001.wav", take.audio, 16000)
        write_bvh(tmp_path / "bvh" / speaker / "001.bvh", take.motion)
    pairs = find_pairs(tmp_path)
    assert [(audio.parent.name, bvh.parent.name) for audio, bvh in pairs] == [("s1", "s1"), ("s2", "s2")]
    write_audio(tmp_path / "wav" / "s1" / "001.flac", take.audio, 16000)
    with pytest.raises(InputError, match="have the same name"):
        find_pairs(tmp_path)


@pytest.mark.parametrize(("name", "frames"), [("zeggs", 2065), ("beat", 1912)])
def test_real_takes(shared, name, frames):
    ((audio, bvh),) = find_pairs(shared / name)
    recording = read_pair(audio, bvh, 16000)
    prepared = prepare_recording(recording, Features())
    assert prepared.pose.shape == (frames, 22, 6)
    assert prepared.audio.shape == (frames, 64)
    everything = prepare_recording(recording, Features(joints="all"))
    assert everything.pose.shape == (frames, 75, 6)
    if name == "beat":
        assert len(recording.words) == 199
        assert recording.speaker == "scott"
