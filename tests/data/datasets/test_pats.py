"""PATS: a generated tree."""

import numpy as np
import pytest

from a2g_jax.data.datasets.layouts import S2G_LAYOUT
from a2g_jax.data.datasets.pats import DATASET
from a2g_jax.errors import InputError
from a2g_jax.io.audio import write_audio

h5py = pytest.importorskip("h5py", reason="PATS is read with h5py")

TABLE = [
    ("train", "oliver", "cmu0000006502"),
    ("dev", "oliver", "102"),
    ("test", "bee", "102"),
    ("train", "noah", "not_downloaded"),
]


def write_table(root, rows):
    head = "dataset,delta_time,end_time,interval_id,speaker,start_time,video_fn,video_link\n"
    lines = [f'{part},4.0,00:00:08,{interval},{speaker},00:00:04,"a, b.mp4",https://x/{speaker}\n'
             for part, speaker, interval in rows]  # fmt: skip
    root.mkdir(parents=True, exist_ok=True)
    (root / "cmu_intervals_df.csv").write_text(head + "".join(lines))


def write_interval(root, speaker, interval, pose):
    """As ``skeleton.py`` and ``audio.py`` write an h5, with a WAV in place of the mp3; returns its samples."""
    path = root / "processed" / speaker / f"{interval}.h5"
    path.parent.mkdir(parents=True, exist_ok=True)
    with h5py.File(path, "w") as file:
        for name in ("pose/data", "pose/normalize", "pose/confidence"):
            file.create_dataset(name, data=pose)
        file.create_dataset("audio/log_mel_512", data=np.zeros((300, 128)))
    samples = np.random.default_rng(len(speaker)).integers(-9000, 9000, len(pose) * 16000 // 15) / 32768
    write_audio(root / "raw" / f"{speaker}_cropped" / f"{interval}.wav", samples.astype(np.float32), 16000)
    return samples.astype(np.float32)


def made_up_pose(frames=30, seed=0):
    """52 x, then 52 y: the neck in pixels, the rest relative to it."""
    return np.random.default_rng(seed).integers(-3000, 3000, (frames, 104)) / 8


@pytest.fixture
def tree(tmp_path):
    root = tmp_path / "pats" / "data"
    write_table(root, TABLE)
    written = {}
    for seed, (_, speaker, interval) in enumerate(TABLE[:3]):
        pose = made_up_pose(seed=seed)
        written[f"{speaker}/{interval}"] = pose, write_interval(root, speaker, interval, pose)
    return root, written


def test_what_was_written_is_read(tree):
    root, written = tree
    for folder in (root, root.parent):
        takes = DATASET.find(folder)
        assert [(take.name, take.split) for take in takes] == [
            ("bee/102", "test"), ("oliver/102", "validation"), ("oliver/cmu0000006502", "train"),
        ]  # fmt: skip
    for take in takes:
        pose, samples = written[take.name]
        found = DATASET.read(take, 16000)
        kept = [0, 1, 2, 3, 4, 5, 6, *range(10, 52)]
        points = np.stack([pose[:, kept], pose[:, [52 + point for point in kept]]], axis=-1)
        points[:, 0] = 0
        np.testing.assert_array_equal(found.motion.values, points.astype(np.float32))
        np.testing.assert_array_equal(found.audio, samples)
        assert (found.motion.fps, found.motion.kind, found.motion.layout) == (15.0, "keypoints", S2G_LAYOUT)
        assert found.speaker == take.name.split("/")[0]
        assert found.annotations == {"interval": take.name.split("/")[1], "video": f"https://x/{found.speaker}"}


def test_an_interval_that_is_not_in_the_table(tree):
    root, _ = tree
    write_interval(root, "bee", "7", made_up_pose())
    assert next(take for take in DATASET.find(root) if take.name == "bee/7").split == ""


def test_without_speech(tree):
    root, _ = tree
    (root / "raw" / "bee_cropped" / "102.wav").unlink()
    take = DATASET.find(root)[0]
    with pytest.raises(InputError, match=r"102.h5: has no speech, and .*102.mp3 is not there; make it .*youtube2audio"):
        DATASET.read(take, 16000)
    for path in (root / "raw").rglob("*.wav"):
        path.unlink()
    with pytest.raises(InputError, match=r"has no speech for any interval.*bee_cropped.102.mp3 .*youtube2audio"):
        DATASET.find(root)


def test_gaps_are_bridged_and_long_ones_refused(tmp_path):
    write_table(tmp_path, TABLE)
    pose = made_up_pose()
    pose[5:12, 3] = np.nan
    write_interval(tmp_path, "bee", "102", pose)
    found = DATASET.read(DATASET.find(tmp_path)[0], 16000).motion.values
    middle = 0.5 * (pose[4, [3, 55]] + pose[12, [3, 55]])
    np.testing.assert_allclose(found[8, 3], middle, rtol=1e-6)
    pose[5:13, 3] = np.nan
    write_interval(tmp_path, "bee", "102", pose)
    with pytest.raises(InputError, match=r"102.h5, pose/data, frame 5: point or bone 3 has no value for 0.53 s"):
        DATASET.read(DATASET.find(tmp_path)[0], 16000)


@pytest.mark.parametrize(
    "pose", [np.zeros((30, 98)), np.zeros(104), np.zeros((1, 104)), np.array([b"a"] * 104).reshape(1, 104)]
)
def test_wrong_poses(tree, pose):
    root, _ = tree
    with h5py.File(root / "processed" / "bee" / "102.h5", "w") as file:
        file.create_dataset("pose/data", data=pose)
    with pytest.raises(InputError, match=r"102.h5.*pose/data"):
        DATASET.read(DATASET.find(root)[0], 16000)


def test_wrong_folders_and_files(tree, tmp_path):
    root, _ = tree
    with pytest.raises(InputError, match="has no processed/<speaker>.*PATS', with cmu_intervals_df.csv"):
        DATASET.find(tmp_path / "none")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="empty: has no processed/<speaker>"):
        DATASET.find(tmp_path / "empty")
    take = DATASET.find(root)[0]
    with h5py.File(root / "processed" / "bee" / "102.h5", "w") as file:
        file.create_dataset("pose/normalize", data=made_up_pose())
    with pytest.raises(InputError, match=r"102.h5.*pose/data"):
        DATASET.read(take, 16000)
    (root / "processed" / "bee" / "102.h5").write_bytes(b"not an h5 file" * 100)
    with pytest.raises(InputError, match="102.h5"):
        DATASET.read(take, 16000)
    write_table(root, [*TABLE, ("rehearsal", "bee", "103")])
    with pytest.raises(InputError, match="line 6: expected train, dev or test; got 'rehearsal'"):
        DATASET.find(root)
    write_table(root, [*TABLE, ("train", "bee", "102")])
    with pytest.raises(InputError, match="line 6: interval '102' is in two parts"):
        DATASET.find(root)
    (root / "cmu_intervals_df.csv").unlink()
    with pytest.raises(InputError, match="cmu_intervals_df.csv: there is no such file"):
        DATASET.find(root)
