"""BEAT2: a generated tree, the real recording, and the same performance in BEAT's BVH."""

import numpy as np
import pytest
from datasets_beat2_tree import WORDS, made_up_speech, write_beat2
from scipy.spatial.transform import Rotation

from a2g_jax.data.datasets.beat2 import DATASET
from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import resample
from a2g_jax.geometry.retarget import find_rig, match_rigs, retarget
from a2g_jax.io.bvh import read_bvh
from a2g_jax.talker.skeleton import TALKER_HANDS_SKELETON, TALKER_SKELETON

SPLIT = [
    ("2_scott_0_1_1", "train"),
    ("1_wayne_0_73_73", "test"),
    ("5_stewart_1_2_2", "val"),
    ("2_scott_0_9_9", "additional"),
]


@pytest.fixture
def tree(tmp_path):
    root = tmp_path / "beat_english_v2.0.0"
    return root, write_beat2(root, {name: {} for name, _ in SPLIT}, SPLIT)


def test_what_was_written_is_read(tree):
    root, written = tree
    takes = DATASET.find(root)
    assert [take.name for take in takes] == sorted(written)
    assert {take.name: take.split for take in takes} == {
        "2_scott_0_1_1": "train", "1_wayne_0_73_73": "test", "5_stewart_1_2_2": "validation", "2_scott_0_9_9": "train",
    }  # fmt: skip
    for seed, name in enumerate(written):
        take = next(take for take in takes if take.name == name)
        found, arrays = DATASET.read(take, 16000), written[name]
        assert found.motion.fps == 30.0
        assert found.motion.skeleton is TALKER_HANDS_SKELETON
        vectors = arrays["poses"].reshape(45, 55, 3)[:, [*range(22), *range(25, 55)]]
        turns = Rotation.from_matrix(np.asarray(found.motion.rotations, np.float64).reshape(-1, 3, 3))
        wrong = (turns * Rotation.from_rotvec(vectors.reshape(-1, 3)).inv()).magnitude()
        assert wrong.max() < 1e-5
        np.testing.assert_allclose(found.motion.root - arrays["trans"], np.tile([0, -0.35, 0], (45, 1)), atol=1e-5)
        np.testing.assert_array_equal(found.audio, made_up_speech(1.5, seed=seed))
        assert found.words == WORDS
        assert found.speaker == name.split("_")[1]
        assert found.annotations["face"] == {"expressions": 100, "jaw": True}
        assert found.annotations["semantic"][1] == {
            "label": "05_iconic_h", "start": 0.5, "end": 1.25, "score": 0.8, "keywords": "there",
        }  # fmt: skip
        assert set(found.sources) == set(map(str, root.rglob(f"{name}.*")))
    emotions = {take.name: DATASET.read(take, 8000).emotion for take in takes}
    assert emotions == {
        "2_scott_0_1_1": "neutral", "1_wayne_0_73_73": "anger", "5_stewart_1_2_2": "", "2_scott_0_9_9": "neutral",
    }  # fmt: skip


def test_folder_above_hidden_files_and_missing_extras(tree):
    root, _ = tree
    (root / "smplxflame_30" / "._2_scott_0_1_1.npz").write_bytes(b"x")
    (root / "textgrid" / "2_scott_0_1_1.TextGrid").unlink()
    (root / "sem" / "2_scott_0_1_1.txt").unlink()
    takes = DATASET.find(root.parent)
    assert len(takes) == len(SPLIT)
    found = DATASET.read(next(take for take in takes if take.name == "2_scott_0_1_1"), 16000)
    assert found.words == ()
    assert "semantic" not in found.annotations


def test_without_a_table_there_is_no_split(tree):
    root, _ = tree
    (root / "train_test_split.csv").unlink()
    assert {take.split for take in DATASET.find(root)} == {""}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"poses": np.zeros((45, 156))}, r"poses: expected numbers of shape \(T, 55, 3\) or \(T, 165\); got"),
        ({"poses": np.zeros((45, 165)) + [np.nan] * 165}, "frame 0: NaN"),
        ({"poses": np.full((45, 165), 90.0)}, "radians"),
        ({"trans": np.full((45, 3), 1e4)}, "frame 0: the translation is 1e.04; expected metres"),
        ({"poses": np.zeros((0, 165)), "trans": np.zeros((0, 3))}, "no frames"),
        ({"trans": np.zeros((44, 3))}, "trans: has 44 frames"),
        ({"mocap_frame_rate": np.array(0)}, "mocap_frame_rate"),
        ({"poses": np.array([{}])}, "poses"),
    ],
)
def test_wrong_arrays(tmp_path, changes, message):
    write_beat2(tmp_path, {"2_scott_0_1_1": changes})
    with pytest.raises(InputError, match=message) as caught:
        DATASET.read(DATASET.find(tmp_path)[0], 16000)
    assert "2_scott_0_1_1.npz" in str(caught.value)


def test_wrong_folders_and_files(tree, tmp_path):
    root, _ = tree
    with pytest.raises(InputError, match="is not a folder.*BEAT2's"):
        DATASET.find(tmp_path / "nowhere")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"empty: has no smplxflame_30/.*BEAT2's, with"):
        DATASET.find(tmp_path / "empty")
    table = root / "train_test_split.csv"
    table.write_text("id,type\n2_scott_0_1_1,rehearsal\n")
    with pytest.raises(InputError, match=r"split.csv, line 2: expected train.*'rehearsal'"):
        DATASET.find(root)
    table.write_text("name,type\n")
    with pytest.raises(InputError, match="line 1: has no column 'id'"):
        DATASET.find(root)
    table.unlink()
    take = next(take for take in DATASET.find(root) if take.name == "2_scott_0_1_1")
    (root / "sem" / "2_scott_0_1_1.txt").write_text("01_beat\t0.1\tx\t0.3\t0.1\n")
    with pytest.raises(InputError, match=r"sem.2_scott_0_1_1.txt, line 1: expected a number; got 'x'"):
        DATASET.read(take, 16000)
    (root / "sem" / "2_scott_0_1_1.txt").write_text("\n")
    (root / "wave16k" / "2_scott_0_1_1.wav").unlink()
    with pytest.raises(InputError, match=r"wave16k.2_scott_0_1_1.wav: there is no such file"):
        DATASET.read(take, 16000)
    for path in (root / "wave16k").glob("*.wav"):
        path.unlink()
    with pytest.raises(InputError, match="no wave16k/ with"):
        DATASET.find(root)


# --- The real recording


@pytest.fixture(scope="module")
def same_take(shared, tmp_path_factory):
    """Wrist paths from the pelvis (T, 2 wrists, 3), 15 fps, of BEAT2's SMPL-X and of BEAT's BVH, on one body."""
    root = tmp_path_factory.mktemp("beat2")
    write_beat2(root, {"2_scott_0_1_1": dict(np.load(shared / "beat2" / "2_scott_0_1_1.npz"))})
    smplx = DATASET.read(DATASET.find(root)[0], 16000).motion
    bvh = read_bvh(shared / "beat" / "2_scott_0_1_1.bvh")
    body = find_rig(TALKER_SKELETON)
    paths = []
    for motion in (smplx, bvh):
        on_body = resample(retarget(motion, match_rigs(find_rig(motion), body)), 15.0, 950)
        positions = on_body.positions()
        paths.append(positions[:, 20:22] - positions[:, :1])
    return smplx, *paths


def correlations(first, second):
    """Over time, for each wrist and axis."""
    first, second = (paths - paths.mean(axis=0) for paths in (first, second))
    return np.sum(first * second, axis=0) / np.sqrt(np.sum(first**2, axis=0) * np.sum(second**2, axis=0))


def test_real_take_stands_upright(same_take):
    smplx, *_ = same_take
    positions, names = smplx.positions(), smplx.skeleton.names
    ankles = positions[:, [names.index("L_Ankle"), names.index("R_Ankle")], 1]
    assert smplx.frames == 1906
    assert np.all(positions[:, names.index("Head"), 1] > positions[:, 0, 1] + 0.4)
    assert abs(ankles.mean() - 0.12) < 0.08
    # Looks along z: toes are before ankles, the left hip is at +x.
    assert np.all(positions[:, names.index("L_Foot"), 2] > positions[:, names.index("L_Ankle"), 2])
    assert np.all(positions[:, names.index("L_Hip"), 0] > positions[:, names.index("R_Hip"), 0])


def test_same_performance_in_beat_and_beat2(same_take):
    """Measured: left wrist 0.89, 0.98, 0.90 (x, y, z), right wrist 0.83, 0.98, 0.91."""
    _, smplx, bvh = same_take
    agreement = correlations(smplx, bvh)
    assert agreement.min() > 0.8
    assert agreement.mean() > 0.88
    # Sides swapped, mirrored, or another stretch of the same speaker: none would pass.
    mirrored = bvh[:, ::-1] * [-1, 1, 1]
    for other in (bvh[:, ::-1], mirrored, np.roll(bvh, 150, axis=0), np.roll(bvh, 15, axis=0)):
        assert correlations(smplx, other).mean() < 0.6
    assert np.abs(smplx - bvh).mean() < 0.08
