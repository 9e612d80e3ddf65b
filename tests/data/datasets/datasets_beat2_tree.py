"""A tree as BEAT2 lies on disk, of made-up numbers."""

import numpy as np

from a2g_jax.io.audio import write_audio
from a2g_jax.io.textgrid import write_words
from a2g_jax.io.words import Word

WORDS = (Word("hello", 0.2, 0.5), Word("there", 0.5, 0.9))


def made_up_poses(frames, joints=55, seed=0):
    """Rotation vectors up to two radians."""
    return np.random.default_rng(seed).uniform(-1, 1, (frames, joints, 3)) * 1.1


def made_up_speech(seconds, rate=16000, seed=0):
    """Samples that 16 bits hold exactly."""
    return np.random.default_rng(seed).integers(-20000, 20000, round(seconds * rate)).astype(np.float32) / 32768


def write_beat2(root, recordings, table=None):
    """``recordings``: name -> changes to the arrays of its npz; returns the arrays of each."""
    written = {}
    for seed, (name, changes) in enumerate(recordings.items()):
        rng = np.random.default_rng(seed)
        arrays = {
            "betas": rng.normal(size=300).astype(np.float32),
            "poses": made_up_poses(45, seed=seed).reshape(45, 165).astype(np.float32),
            "expressions": rng.normal(size=(45, 100)),
            "trans": rng.normal(size=(45, 3)),
            "model": np.array("smplx2020"),
            "gender": np.array("neutral"),
            "mocap_frame_rate": np.array(30, np.int32),
        }
        arrays |= changes
        for folder in ("smplxflame_30", "wave16k", "textgrid", "sem"):
            (root / folder).mkdir(parents=True, exist_ok=True)
        np.savez(root / "smplxflame_30" / f"{name}.npz", **arrays)
        write_audio(root / "wave16k" / f"{name}.wav", made_up_speech(1.5, seed=seed), 16000)
        write_words(root / "textgrid" / f"{name}.TextGrid", WORDS, 1.5)
        lines = "01_beat_align\t0.1\t0.4\t0.3\t0.1\thello\n05_iconic_h\t0.5\t1.25\t0.75\t0.8\tthere\n"
        (root / "sem" / f"{name}.txt").write_text(lines)
        written[name] = arrays
    if table is not None:
        (root / "train_test_split.csv").write_text("id,type\n" + "".join(f"{name},{kind}\n" for name, kind in table))
    return written
