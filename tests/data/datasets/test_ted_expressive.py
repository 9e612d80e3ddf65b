"""TED-Expressive: clips as npz, generated and real."""

import numpy as np
import pytest

from a2g_jax.data.datasets.layouts import TED_EXPRESSIVE_LAYOUT
from a2g_jax.data.datasets.ted_expressive import DATASET
from a2g_jax.errors import InputError


def unit_vectors(frames, bones=42, seed=0):
    vectors = np.random.default_rng(seed).normal(size=(frames, bones, 3))
    return (vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)).astype(np.float32)


def clip(frames=30, **changes):
    arrays = {
        "dir_vec": unit_vectors(frames).reshape(frames, 126),
        "audio": np.random.default_rng(1).integers(-30000, 30000, frames * 16000 // 15).astype(np.int16),
        "sr": np.int32(16000),
        "fps": np.int32(15),
        "sentence": np.array(" bonjour  à   tous "),
    }
    return arrays | changes


def test_clips_as_npz(tmp_path):
    written = clip()
    for path in (tmp_path / "o1rERZRFyqE_112_4_0.npz", tmp_path / "more" / "b.npz"):
        path.parent.mkdir(exist_ok=True)
        np.savez(path, **written)
    (tmp_path / ".c.npz").write_bytes(b"x")
    takes = DATASET.find(tmp_path)
    assert [(take.name, take.split) for take in takes] == [("more/b", ""), ("o1rERZRFyqE_112_4_0", "")]
    found = DATASET.read(takes[1], 16000)
    np.testing.assert_allclose(found.motion.values, written["dir_vec"].reshape(30, 42, 3), atol=1e-6)
    np.testing.assert_array_equal(found.audio, written["audio"] / np.float32(32768))
    assert (found.motion.kind, found.motion.fps, found.motion.layout) == ("directions", 15.0, TED_EXPRESSIVE_LAYOUT)
    assert (found.speaker, found.annotations) == ("o1rERZRFyqE", {"sentence": "bonjour à tous"})
    assert DATASET.read(takes[0], 8000).speaker == ""
    assert len(DATASET.read(takes[0], 8000).audio) == 16000


def test_gaps_are_bridged_and_long_ones_refused(tmp_path):
    vectors = unit_vectors(30)
    vectors[10], vectors[14] = vectors[10, 0], vectors[14, 0]
    vectors[11:14] = 0.0
    vectors[20, 5] = np.nan
    vectors[:3, 7] = 0.0
    np.savez(tmp_path / "a.npz", **clip(dir_vec=vectors))
    found = DATASET.read(DATASET.find(tmp_path)[0], 16000).motion.values
    np.testing.assert_allclose(np.linalg.norm(found, axis=-1), 1.0, atol=1e-6)
    middle = vectors[10, 0] + vectors[14, 0]
    np.testing.assert_allclose(found[12, 3], middle / np.linalg.norm(middle), atol=1e-6)
    np.testing.assert_allclose(found[:3, 7], np.tile(vectors[3, 7], (3, 1)), atol=1e-6)
    vectors[11:19] = 0.0
    np.savez(tmp_path / "a.npz", **clip(dir_vec=vectors))
    with pytest.raises(InputError, match=r"a.npz, dir_vec, frame 11: point or bone 0 has no value for 0.53 s"):
        DATASET.read(DATASET.find(tmp_path)[0], 16000)
    np.savez(tmp_path / "a.npz", **clip(dir_vec=np.zeros((30, 126))))
    with pytest.raises(InputError, match="frame 0: point or bone 0 has no value for 2.00 s"):
        DATASET.read(DATASET.find(tmp_path)[0], 16000)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"dir_vec": unit_vectors(30, 9).reshape(30, 27)}, r"dir_vec: expected numbers of shape \(T, 42, 3\) or"),
        ({"dir_vec": unit_vectors(30) * 1.02}, "dir_vec, frame 0: bone 0 has length 1.020; expected unit vectors"),
        ({"dir_vec": unit_vectors(1)}, "has 1 frames"),
        ({"audio": np.zeros(100, np.int16)}, "audio: is silent"),
        ({"audio": np.zeros(0, np.int16)}, "audio: holds no samples"),
        ({"audio": np.full(100, np.nan)}, "audio: holds NaN"),
        ({"audio": np.full(100, 3000.0)}, "audio: has samples as large as 3000"),
        ({"audio": np.ones((100, 2))}, "audio: expected one channel"),
        ({"audio": np.array(["a"])}, "audio: expected one channel"),
        ({"sr": np.array([])}, "sr: expected a number"),
        ({"sr": np.int32(7)}, "sr: expected a number"),
        ({"fps": np.float32(np.nan)}, "fps: expected a number"),
        ({"audio": None}, "array of Python objects"),
    ],
)
def test_wrong_clips(tmp_path, changes, message):
    np.savez(tmp_path / "a.npz", **clip(**changes))
    with pytest.raises(InputError, match=message) as caught:
        DATASET.read(DATASET.find(tmp_path)[0], 16000)
    assert "a.npz" in str(caught.value)


def test_wrong_folders_and_files(tmp_path):
    with pytest.raises(InputError, match="is not a folder.*TED-Expressive's"):
        DATASET.find(tmp_path / "none")
    with pytest.raises(InputError, match="has no clips; name a folder that is TED-Expressive's, with lmdb_train"):
        DATASET.find(tmp_path)
    (tmp_path / "a.npz").write_bytes(b"not an archive")
    with pytest.raises(InputError, match="a.npz: is not an .npz archive"):
        DATASET.read(DATASET.find(tmp_path)[0], 16000)
    np.savez(tmp_path / "a.npz", dir_vec=unit_vectors(4))
    with pytest.raises(InputError, match="a.npz: has no array 'audio'"):
        DATASET.read(DATASET.find(tmp_path)[0], 16000)


def test_real_clips(shared):
    takes = DATASET.find(shared / "ted")
    assert len(takes) == 10
    seconds = 0.0
    for take in takes:
        found = DATASET.read(take, 16000)
        with np.load(take.sources[0]) as arrays:
            np.testing.assert_allclose(found.motion.values.reshape(-1, 126), arrays["dir_vec"], atol=1e-6)
            np.testing.assert_array_equal(found.audio, arrays["audio"] / np.float32(32768))
        assert abs(found.motion.seconds - len(found.audio) / 16000) < 0.1
        assert take.name.startswith(found.speaker)
        assert len(found.speaker) == 11
        assert found.annotations["sentence"]
        seconds += found.motion.seconds
    assert 90 < seconds < 110
