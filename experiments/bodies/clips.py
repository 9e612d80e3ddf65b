"""Clips for pins and styles: of generated speakers, and made absurd on purpose."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.motion import Motion
from a2g_jax.io.bvh_writer import write_bvh
from a2g_jax.talker.recordings import talk

SEED = 2100


def _turned(motion: Motion, joint: str, frames: slice, degrees: np.ndarray, axis: str) -> Motion:
    rotations = np.array(motion.rotations, np.float64)
    at = motion.skeleton.names.index(joint)
    turn = Rotation.from_euler(axis, degrees[:, None], degrees=True)
    rotations[frames, at] = (turn * Rotation.from_matrix(rotations[frames, at])).as_matrix()
    return replace(motion, rotations=rotations.astype(np.float32))


def flips(motion: Motion) -> Motion:
    """An elbow that flips by 150 degrees in single frames."""
    degrees = np.where(np.arange(motion.frames) % 20 == 10, 150.0, 0.0)
    return _turned(motion, "R_Elbow", slice(None), degrees, "y")


def teleport(motion: Motion) -> Motion:
    """A root that jumps by a metre and back every second."""
    root = np.array(motion.root)
    root[:, 0] += np.where(np.arange(motion.frames) // 30 % 2, 1.0, 0.0)
    return replace(motion, root=root.astype(np.float32))


def cartwheel(motion: Motion) -> Motion:
    """A body that turns head over heels once a second and a half."""
    return _turned(motion, "Pelvis", slice(None), 8.0 * np.arange(motion.frames), "z")


def t_pose(motion: Motion) -> Motion:
    """The identity rotation of every joint."""
    return replace(motion, rotations=np.broadcast_to(np.eye(3, dtype=np.float32), motion.rotations.shape).copy())


def backwards(motion: Motion) -> Motion:
    """Both elbows bent the wrong way."""
    motion = _turned(motion, "L_Elbow", slice(None), np.full(motion.frames, 120.0), "y")
    return _turned(motion, "R_Elbow", slice(None), np.full(motion.frames, -120.0), "y")


ABSURD: dict[str, Callable[[Motion], Motion]] = {
    "flips": flips,
    "teleport": teleport,
    "cartwheel": cartwheel,
    "T-pose": t_pose,
    "backwards": backwards,
    "half a second": lambda motion: motion.clip(0, 15),
}


def write_clips(folder: Path) -> dict[str, Path]:
    """BVH files of clips by name, written once: of three speakers, and the absurd ones."""
    folder.mkdir(parents=True, exist_ok=True)
    makers: dict[str, Callable[[], Motion]] = {
        f"talk of {speaker}": lambda speaker=speaker, seed=seed: talk(4.0, SEED + seed, speaker=speaker).motion
        for seed, speaker in enumerate(("ada", "chiara", "felix"))
    }
    makers |= {name: lambda make=make: make(talk(4.0, SEED).motion) for name, make in ABSURD.items()}
    paths = {name: folder / f"{name.replace(' ', '_')}.bvh" for name in makers}
    for name, path in paths.items():
        if not path.exists():
            write_bvh(path, makers[name]())
    return paths
