"""SHOW: a generated tree of pickles."""

import pickle
import shutil

import numpy as np
import pytest
from datasets_show_tree import made_up_fit, write_take
from scipy.spatial.transform import Rotation

from a2g_jax.data.datasets.show import DATASET
from a2g_jax.errors import InputError
from a2g_jax.talker.skeleton import PELVIS_HEIGHT, TALKER_SKELETON

#: Half a turn about x: the camera's y down and z away to y up and z toward it.
OVER = np.diag([1.0, -1.0, -1.0])


@pytest.mark.parametrize("protocol", [2, 4])
def test_what_was_written_is_read(tmp_path, protocol):
    fits = {}
    for seed, place in enumerate(("oliver/v1/train/s1", "oliver/v1/val/s2", "seth/v2/test/s1")):
        fits[place] = made_up_fit(20, seed), write_take(tmp_path / place, made_up_fit(20, seed), protocol)
    takes = DATASET.find(tmp_path)
    assert [(take.name, take.split) for take in takes] == [
        ("oliver/v1/s1", "train"), ("oliver/v1/s2", "validation"), ("seth/v2/s1", "test"),
    ]  # fmt: skip
    for take, (place, (fit, samples)) in zip(takes, fits.items(), strict=True):
        found = DATASET.read(take, 22050)
        assert found.speaker == place.split("/")[0]
        assert found.motion.fps == 30.0
        assert found.motion.skeleton is TALKER_SKELETON
        np.testing.assert_array_equal(found.audio, samples)
        vectors = np.concatenate([fit["global_orient"], fit["body_pose_axis"].reshape(20, 21, 3)], axis=1)
        wanted = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(20, 22, 3, 3)
        wanted[:, 0] = OVER @ wanted[:, 0]
        np.testing.assert_allclose(found.motion.rotations, wanted, atol=1e-6)
        path = (fit["transl"] - fit["transl"][0]) @ OVER.T
        np.testing.assert_allclose(found.motion.root, path + np.array([0, PELVIS_HEIGHT, 0]), atol=1e-5)


def test_people_stand_on_their_feet_and_face_the_viewer(tmp_path):
    fit = made_up_fit(10)
    fit["body_pose_axis"] = np.zeros((10, 21, 3))
    write_take(tmp_path / "oliver/v/train/turned", fit)
    write_take(tmp_path / "oliver/v/train/upright", fit | {"global_orient": np.zeros((10, 3))})
    for take in DATASET.find(tmp_path):
        motion = DATASET.read(take, 16000).motion
        positions, names = motion.positions(), motion.skeleton.names
        assert np.all(positions[:, names.index("Head"), 1] > positions[:, 0, 1] + 0.4)
        assert np.all(positions[:, names.index("L_Foot"), 2] > positions[:, names.index("L_Ankle"), 2] + 0.05)
        assert np.all(positions[:, names.index("L_Wrist"), 0] > positions[:, 0, 0] + 0.3)


@pytest.mark.parametrize("place", ["conan/v/s1", "conan/v/train/s1"])
def test_other_places_of_the_same_files(tmp_path, place):
    write_take(tmp_path / place, [made_up_fit(5)])
    (tmp_path / "conan" / ".cache").mkdir()
    (tmp_path / "conan" / ".cache" / "x.pkl").write_bytes(b"x")
    for folder in (tmp_path, tmp_path / "conan"):
        (take,) = DATASET.find(folder)
        assert take.name == "conan/v/s1"
        assert take.split == ("train" if "train" in place else "")
        assert DATASET.read(take, 16000).motion.frames == 5
    flat = tmp_path / "conan" / "v" / "s2"
    for end in (".pkl", ".wav"):
        shutil.copy(tmp_path / place / f"s1{end}", flat.with_suffix(end))
    assert sorted(take.name for take in DATASET.find(tmp_path)) == ["conan/v/s1", "conan/v/s2"]


class Hostile:
    def __reduce__(self):
        return print, ("run by a pickle",)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"transl": None}, "transl: expected numbers of shape"),
        ({"body_pose_axis": np.zeros((9, 60))}, r"body_pose_axis: expected numbers of shape \(T, 21, 3\) or \(T, 63\)"),
        ({"global_orient": np.zeros((8, 1, 3))}, "global_orient: has 8 frames; 'body_pose_axis' has 9"),
        ({"transl": np.full((9, 3), np.nan)}, "frame 0: NaN or infinity in the translation"),
        (
            {"body_pose_axis": np.zeros((0, 63)), "global_orient": np.zeros((0, 3)), "transl": np.zeros((0, 3))},
            "no fra",
        ),
        ({"transl": Hostile()}, "print"),
    ],
)
def test_wrong_fits(tmp_path, change, message, capsys):
    fit = made_up_fit(9)
    write_take(tmp_path / "oliver/v/train/s", fit)
    path = tmp_path / "oliver/v/train/s/s.pkl"
    path.write_bytes(pickle.dumps(fit | change))
    with pytest.raises(InputError, match=message) as caught:
        DATASET.read(DATASET.find(tmp_path)[0], 16000)
    assert str(path) in str(caught.value)
    assert "run by" not in capsys.readouterr().out


def test_missing_and_damaged_files(tmp_path):
    with pytest.raises(InputError, match="is not a folder.*SHOW's"):
        DATASET.find(tmp_path / "none")
    with pytest.raises(InputError, match=r"has no .pkl with a .wav.*<speaker>/<video>"):
        DATASET.find(tmp_path)
    write_take(tmp_path / "oliver/v/train/s", made_up_fit(9))
    write_take(tmp_path / "oliver/v/train/t", made_up_fit(9))
    path = tmp_path / "oliver/v/train/s/s.pkl"
    path.write_bytes(path.read_bytes()[:-400])
    (tmp_path / "oliver/v/train/t/t.wav").unlink()
    first, second = DATASET.find(tmp_path)
    with pytest.raises(InputError, match="s.pkl, byte"):
        DATASET.read(first, 16000)
    with pytest.raises(InputError, match="t.wav: there is no such file"):
        DATASET.read(second, 16000)
    path.write_bytes(pickle.dumps({"poses": [1]}))
    with pytest.raises(InputError, match="s.pkl: has no 'body_pose_axis'"):
        DATASET.read(first, 16000)
    path.write_bytes(pickle.dumps(3))
    with pytest.raises(InputError, match="s.pkl: holds a int"):
        DATASET.read(first, 16000)


def rebuild(*_arguments):
    raise AssertionError("this ran")


class Tensor:
    """Pickles as PyTorch's tensors do."""

    def __reduce__(self):
        return rebuild, (b"storage", 0, (), (), False, {})


def test_a_fit_with_tensors_that_are_not_needed(tmp_path):
    """SHOW's own files hold a tensor among their losses."""
    fit = made_up_fit(9)
    write_take(tmp_path / "oliver/v/train/s", fit)
    (plain,) = (DATASET.read(take, 16000) for take in DATASET.find(tmp_path))
    path = tmp_path / "oliver/v/train/s/s.pkl"
    path.write_bytes(pickle.dumps(fit | {"losses_to_log": {"sil_loss": Tensor()}, "betas": Tensor()}))
    (found,) = (DATASET.read(take, 16000) for take in DATASET.find(tmp_path))
    np.testing.assert_array_equal(found.motion.rotations, plain.motion.rotations)
    path.write_bytes(pickle.dumps(fit | {"body_pose_axis": Tensor()}))
    with pytest.raises(InputError, match=r"s\.pkl, byte .*rebuild', which is refused"):
        DATASET.read(DATASET.find(tmp_path)[0], 16000)
