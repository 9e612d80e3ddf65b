"""A tree as Speech2Gesture's code extracts it, of made-up numbers."""

import csv

import numpy as np

SPEECH_RATE = 16000


def stamp(seconds):
    """As ``frames_df`` writes times."""
    return f"{int(seconds // 3600):02}:{int(seconds % 3600 // 60):02}:{seconds % 60:09.6f}"


def made_up_interval(frames, points=49, rate=15.0, seed=0):
    """Pixels (T, 2, points) and samples up to the last frame."""
    rng = np.random.default_rng(seed)
    poses = rng.integers(0, 1000, (frames, 2, points)) + rng.integers(0, 8, (frames, 2, points)) / 8
    return poses, rng.uniform(-0.5, 0.5, int((frames - 1) / rate * SPEECH_RATE)).astype(np.float32)


def write_interval(root, speaker, interval, poses, audio, begin, part="train", rate=15.0, without=(), jump=None):
    """Windows of 64 frames, 5 apart; returns the rows of ``train.csv``. From frame ``jump`` on, times are 1 s later."""
    folder = root / speaker / "train" / "npz"
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for first in range(0, len(poses) - 64, 5):
        if first in without:
            continue
        late = [0.0 if jump is None or frame < jump else 1.0 for frame in (first, first + 63)]
        start, end = begin + first / rate + late[0], begin + (first + 63) / rate + late[1]
        name = f"{interval}-{stamp(start)}-{stamp(end)}.npz"
        sound = audio[int(round(first / rate * SPEECH_RATE, 3)) : int(round((first + 63) / rate * SPEECH_RATE, 3))]
        np.savez(folder / name, pose=poses[first : first + 64], imgs=np.array(["a.jpg"] * 64), audio=sound)
        rows.append(
            {
                "dataset": part, "start": stamp(start), "end": stamp(end), "interval_id": interval,
                "pose_fn": f"/home/somebody/Gestures/{speaker}/train/npz/{name}",
                "audio_fn": f"/home/somebody/Gestures/{speaker}/train/audio/{interval}.wav", "video_fn": "v, w.mp4",
                "speaker": speaker,
            }
        )  # fmt: skip
    return rows


def write_table(root, rows):
    with (root / "train.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
