"""Speech2Gesture: generated trees of overlapping windows."""

from pathlib import Path

import numpy as np
import pytest
from datasets_s2g_tree import made_up_interval, write_interval, write_table

from a2g_jax.data.datasets.layouts import S2G_LAYOUT
from a2g_jax.data.datasets.s2g import DATASET
from a2g_jax.errors import InputError
from a2g_jax.talker.views.keypoints import write_s2g_windows


def relative(poses):
    """(T, 2, 49) pixels as (T, 49, 2) from point 0."""
    return np.swapaxes(poses - poses[:, :, :1], 1, 2)


def covered(frames):
    """Frames that windows of 64, 5 apart, reach: the code leaves the last ones out."""
    return range(0, frames - 64, 5)[-1] + 64


def test_what_was_written_is_read(tmp_path):
    rows, intervals = [], {}
    for seed, (speaker, interval, part, points) in enumerate(
        [("oliver", "101", "train", 49), ("oliver", "102", "dev", 52), ("seth", "101", "train", 49)]
    ):
        poses, audio = intervals[speaker, interval] = made_up_interval(200, points, seed=seed)
        rows += write_interval(tmp_path, speaker, interval, poses, audio, 61.2, part)
    write_table(tmp_path, rows[::-1])
    takes = DATASET.find(tmp_path)
    assert [(take.name, take.split) for take in takes] == [
        ("oliver/101", "train"), ("oliver/102", "validation"), ("seth/101", "train"),
    ]  # fmt: skip
    for take in takes:
        found = DATASET.read(take, 16000)
        poses, audio = intervals[tuple(take.name.split("/"))]
        kept = np.delete(poses, [7, 8, 9], axis=2) if poses.shape[2] == 52 else poses
        frames = covered(200)
        np.testing.assert_array_equal(found.motion.values, relative(kept)[:frames].astype(np.float32))
        np.testing.assert_array_equal(found.audio, audio[: len(found.audio)])
        assert len(found.audio) == pytest.approx((frames - 1) / 15 * 16000, abs=1)
        assert (found.motion.fps, found.motion.kind, found.motion.layout) == (15.0, "keypoints", S2G_LAYOUT)
        assert found.speaker == take.name.split("/")[0]
        assert len(take.sources) < 8  # of 28


def test_windows_alone(tmp_path):
    """Without the table, and with names that Windows can hold."""
    poses, audio = made_up_interval(150)
    write_interval(tmp_path, "oliver", "101", poses, audio, 3599.0)
    for path in tmp_path.rglob("*.npz"):
        path.rename(path.with_name(path.name.replace(":", "_")))
    (tmp_path / "oliver" / "train" / "npz" / ".x.npz").write_bytes(b"x")
    for folder in (tmp_path, tmp_path / "oliver" / "train" / "npz"):
        (take,) = DATASET.find(folder)
        assert (take.name, take.split) == ("oliver/101", "")
        found = DATASET.read(take, 16000)
        np.testing.assert_array_equal(found.motion.values, relative(poses)[: covered(150)].astype(np.float32))


def test_windows_of_the_talker(tmp_path):
    poses, audio = made_up_interval(150)
    points = np.swapaxes(poses, 1, 2)
    write_s2g_windows(tmp_path / "ada" / "train" / "npz", "take-1", points, np.pad(audio, (0, 16000)), 16000)
    (take,) = DATASET.find(tmp_path)
    assert take.name == "ada/take-1"
    found = DATASET.read(take, 16000)
    frames = range(0, 150 - 63, 5)[-1] + 64
    np.testing.assert_array_equal(found.motion.values, relative(poses)[:frames].astype(np.float32))
    np.testing.assert_array_equal(found.audio[: len(audio)], audio[: len(found.audio)])


def test_no_frame_is_in_two_recordings(tmp_path):
    """Windows are missing in the middle: two recordings, which share nothing."""
    poses, audio = made_up_interval(400)
    rows = write_interval(tmp_path, "oliver", "7", poses, audio, 5.0, without=range(100, 200, 5))
    write_table(tmp_path, rows)
    takes = DATASET.find(tmp_path)
    assert [take.name for take in takes] == ["oliver/7", "oliver/7-part2"]
    first, second = (DATASET.read(take, 16000).motion.values for take in takes)
    np.testing.assert_array_equal(first, relative(poses)[: 95 + 64].astype(np.float32))
    np.testing.assert_array_equal(second, relative(poses)[200 : covered(400)].astype(np.float32))


def test_times_that_jump_within_an_interval(tmp_path):
    """A second of frames is missing in the video: the windows across it are left out."""
    poses, audio = made_up_interval(400)
    write_table(tmp_path, write_interval(tmp_path, "oliver", "7", poses, audio, 5.0, jump=120))
    first, second = (DATASET.read(take, 16000).motion for take in DATASET.find(tmp_path))
    np.testing.assert_array_equal(first.values, relative(poses)[: 55 + 64].astype(np.float32))
    np.testing.assert_array_equal(second.values, relative(poses)[120 : covered(400)].astype(np.float32))
    assert first.fps == second.fps == 15.0


def test_other_rates_and_rounded_times(tmp_path):
    poses, audio = made_up_interval(160)
    rows = write_interval(tmp_path / "a", "oliver", "7", poses, audio, 5.0, rate=14.0)
    write_table(tmp_path / "a", rows)
    found = DATASET.read(DATASET.find(tmp_path / "a")[0], 16000)
    np.testing.assert_array_equal(found.motion.values, relative(poses)[: covered(160)].astype(np.float32))
    assert found.motion.fps == pytest.approx(14.0, rel=1e-3)
    rows = write_interval(tmp_path / "b", "oliver", "7", poses, audio, 5.07)
    # Tenths of a second: 00:00:05.3 for 00:00:05.333333.
    write_table(tmp_path / "b", [{**row, "start": row["start"][:-5], "end": row["end"][:-5]} for row in rows])
    found = DATASET.read(DATASET.find(tmp_path / "b")[0], 16000)
    np.testing.assert_array_equal(found.motion.values, relative(poses)[: covered(160)].astype(np.float32))


def test_gaps_are_bridged_and_long_ones_refused(tmp_path):
    poses, audio = made_up_interval(100)
    truth = np.array(poses)
    truth[31:34, :, 10] = poses[30, :, 10] + np.arange(1, 4)[:, None] / 4 * (poses[34, :, 10] - poses[30, :, 10])
    poses[31:34, :, 10] = np.nan
    write_interval(tmp_path / "a", "oliver", "7", poses, audio, 5.0)
    found = DATASET.read(DATASET.find(tmp_path / "a")[0], 16000)
    np.testing.assert_allclose(found.motion.values, relative(truth)[: covered(100)], atol=1e-3)
    poses[40:50, :, 20] = np.nan
    write_interval(tmp_path / "b", "oliver", "7", poses, audio, 5.0)
    with pytest.raises(InputError, match=r"frame 40: point or bone 20 has no value for 0.67 s"):
        DATASET.read(DATASET.find(tmp_path / "b")[0], 16000)


def test_wrong_folders_and_tables(tmp_path):
    with pytest.raises(InputError, match="is not a folder.*Speech2Gesture's"):
        DATASET.find(tmp_path / "none")
    with pytest.raises(InputError, match=r"has no windows \(.npz\); name a folder that is Speech2Gesture's"):
        DATASET.find(tmp_path)
    rows = write_interval(tmp_path, "oliver", "7", *made_up_interval(100), 5.0)
    for column, value, message in (
        ("dataset", "holdout", "line 2: expected train, dev or test; got 'holdout'"),
        ("start", "soon", "line 2: expected rising times"),
        ("end", "00:00:01", "line 2: expected rising times"),
        ("dataset", "dev", "line 3: interval '7' is in two parts"),
    ):
        write_table(tmp_path, [rows[0] | {column: value}, *rows[1:]])
        with pytest.raises(InputError, match=message):
            DATASET.find(tmp_path)
    (tmp_path / "train.csv").write_text("dataset,start\ntrain,x\n")
    with pytest.raises(InputError, match="line 1: has no column 'end'"):
        DATASET.find(tmp_path)
    (tmp_path / "train.csv").unlink()
    (tmp_path / "oliver" / "train" / "npz" / "stray.npz").write_bytes(b"x")
    with pytest.raises(InputError, match="stray.npz: its name has no interval"):
        DATASET.find(tmp_path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda pose, audio: {"pose": pose, "sound": audio}, "has no array 'audio'"),
        (lambda pose, audio: {"pose": pose[:, :, :40], "audio": audio}, r"pose: expected numbers of shape"),
        (lambda pose, audio: {"pose": pose, "audio": np.array(["a"])}, "audio <U1 of shape"),
        (lambda pose, audio: {"pose": pose + 1, "audio": audio}, "does not continue"),
        (lambda pose, audio: {"pose": pose, "audio": audio.reshape(2, -1)}, r"audio float32 of shape \(2, "),
        (lambda pose, audio: {"pose": pose, "audio": audio * np.nan}, "audio: holds NaN"),
        (None, "is not an .npz archive"),
    ],
)
def test_damaged_windows(tmp_path, change, message):
    write_interval(tmp_path, "oliver", "7", *made_up_interval(150), 5.0)
    (take,) = DATASET.find(tmp_path)
    path = take.sources[1]
    if change is None:
        Path(path).write_bytes(b"not an archive")
    else:
        with np.load(path) as window:
            arrays = change(window["pose"], window["audio"])
        np.savez(path, **arrays)
    with pytest.raises(InputError, match=message):
        DATASET.read(take, 16000)


def test_points_in_no_image(tmp_path):
    poses, audio = made_up_interval(100)
    poses[70, 0, 9] = 1e30
    write_interval(tmp_path, "oliver", "7", poses, audio, 5.0)
    with pytest.raises(InputError, match=r"pose, frame 70: a keypoint is 1e.30 from the neck; expected pixels"):
        DATASET.read(DATASET.find(tmp_path)[0], 16000)


def test_missing_window(tmp_path):
    rows = write_interval(tmp_path, "oliver", "7", *made_up_interval(150), 5.0)
    write_table(tmp_path, rows)
    (take,) = DATASET.find(tmp_path)
    (tmp_path / "oliver" / "train" / "npz" / take.sources[0].rsplit("/", 1)[1]).unlink()
    with pytest.raises(InputError, match=r"oliver.train.npz.7-00.*there is no such file"):
        DATASET.read(take, 16000)
