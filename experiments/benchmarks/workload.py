"""Workload of the benchmarks: a skeleton, a corpus of random smooth motion, and settings; nothing is downloaded."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_layout import Entry
from a2g_jax.data.splits import Segment
from a2g_jax.features.mel import MelConfig
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import BODY_JOINTS, BODY_PARENTS, Skeleton
from a2g_jax.models.audio2gestures.config import PRESETS
from a2g_jax.models.train_config import TRAIN_PRESETS
from a2g_jax.training.run import RunConfig

FPS = 30.0


def make_skeleton(joints: int, seed: int) -> Skeleton:
    """The 22 joints of the SMPL-X body, or all 55 with jaw, eyes and five chains of three joints in each hand."""
    names, parents = list(BODY_JOINTS), list(BODY_PARENTS)
    if joints == 55:
        head = names.index("Head")
        names += ["Jaw", "L_Eye", "R_Eye"]
        parents += [head] * 3
        for side in "LR":
            for finger in range(5):
                for part in range(3):
                    parents.append(names.index(f"{side}_Wrist") if part == 0 else len(names) - 1)
                    names.append(f"{side}_Finger{finger}_{part}")
    elif joints != 22:
        raise ValueError(f"Expected 22 or 55 joints; got {joints}.")
    offsets = np.random.default_rng(seed).normal(0, 0.1, (joints, 3)).astype(np.float32)
    return Skeleton(offsets, tuple(names), tuple(parents))


def make_corpus(folder: Path, frames: int, joints: int, seed: int) -> Corpus:
    """One recording of random walks through rotations and of random audio features, as arrays on disk."""
    rng = np.random.default_rng(seed)
    skeleton, mel = make_skeleton(joints, seed), MelConfig()
    walk = np.cumsum(rng.normal(0, 0.02, (frames, joints, 6)), axis=0)
    pose = np.sin(walk).astype(np.float32) * 0.5 + np.eye(3, dtype=np.float32)[:2].reshape(6)
    audio = rng.normal(-40, 10, (frames, mel.width)).astype(np.float32)
    root = np.zeros((frames, 3), np.float32)
    arrays = {"audio": audio, "pose": pose, "root": root}
    statistics = {}
    for name, array in arrays.items():
        np.save(folder / f"{name}.npy", array)
        statistics[f"{name}_mean"] = array.mean(axis=0)
        statistics[f"{name}_std"] = np.maximum(array.std(axis=0), 1e-3)
    np.savez(folder / "statistics.npz", **statistics)
    return Corpus(
        path=folder,
        fps=FPS,
        mel=mel,
        space=PoseSpace(skeleton),
        recordings=(Entry("noise", 0, frames, "none", "", {}),),
        splits={"train": [Segment(0, 0, frames)]},
        recipe={"seed": seed},
        fingerprint="",
    )


def run_config(corpus: Corpus, preset: str, batch: int, frames: int, seed: int) -> RunConfig:
    """A run of a preset with the given batch size."""
    model = replace(PRESETS[preset], clip_frames=frames)
    training = replace(TRAIN_PRESETS[preset], batch_size=batch, seed=seed)
    return RunConfig.of("audio2gestures", preset, model, training, corpus)
