"""Clips for pins: cut from real takes and from generated recordings, and made absurd on purpose."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from a2g_jax.generation.clips import read_motion
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.bvh import read_bvh
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS

#: Generated recordings that clips are cut from, and their seconds.
RECORDINGS, SECONDS = 10, 20.0


@dataclass(frozen=True, eq=False)
class Take:
    """A recorded motion that clips are cut from."""

    source: str
    """``BEAT``, ``ZeroEGGS`` or ``generated talk``."""
    motion: Motion

    def cut(self, start: float, seconds: float) -> Motion:
        """A stretch of it."""
        first = round(start * self.motion.fps)
        return self.motion.clip(first, first + round(seconds * self.motion.fps))


def generated_takes(seed: int) -> list[Take]:
    """Ten recordings; the six speakers take turns."""
    names = tuple(SPEAKERS)
    return [
        Take("generated talk", talk(SECONDS, seed + 300_000 + k, speaker=names[k % len(names)]).motion)
        for k in range(RECORDINGS)
    ]


def real_takes(folder: Path) -> list[Take]:
    """The BEAT and the ZeroEGGS take, as far as they are there."""
    found = []
    for source, room in (("BEAT", "beat"), ("ZeroEGGS", "zeggs")):
        found += [Take(source, read_motion(path)) for path in sorted((folder / room).glob("*.bvh"))]
    return found


def absurd(clip: Motion, folder: Path) -> dict[str, Callable[[], Motion]]:
    """A sound clip of the talker's skeleton made absurd in many ways, and a dog if its file is there."""

    def turned(joint: int, angles: np.ndarray, axis: str) -> Motion:
        rotations = np.array(clip.rotations)
        rotations[:, joint] = Rotation.from_euler(axis, angles[:, None], degrees=True).as_matrix() @ rotations[:, joint]
        return replace(clip, rotations=rotations)

    frames, names = clip.frames, clip.skeleton.names
    once, often, late = (np.zeros(frames) for _ in range(3))
    once[frames // 2], often[::3], late[frames // 2 :] = 170.0, 170.0, 170.0
    shoulder = names.index("R_Shoulder")
    away = np.array(clip.root)
    away[frames // 2 :] += np.array([3.0, 0.0, 1.0])
    still = np.tile(np.eye(3, dtype=np.float32), (frames, len(names), 1, 1))
    calibrated = np.concatenate([still[:5], clip.rotations])
    cases: dict[str, Callable[[], Motion]] = {
        "a shoulder flipped in one frame": lambda: turned(shoulder, once, "x"),
        "a shoulder flipped from one frame on": lambda: turned(shoulder, late, "x"),
        "a shoulder flipped in every third frame": lambda: turned(shoulder, often, "x"),
        "a root that jumps by 3 m": lambda: replace(clip, root=away),
        "a cartwheel": lambda: turned(0, np.linspace(0.0, 360.0, frames), "z"),
        "a T-pose throughout": lambda: replace(clip, rotations=still),
        "a T-pose before the clip": lambda: replace(
            clip, rotations=calibrated, root=np.concatenate([clip.root[:5], clip.root])
        ),
        "eight times too fast": lambda: replace(clip, rotations=clip.rotations[::8], root=clip.root[::8]),
        "half a second": lambda: clip.clip(0, 15),
        "three frames": lambda: clip.clip(0, 3),
        "one frame": lambda: clip.clip(0, 1),
    }
    dog = folder.parent / "cases" / "bvh" / "dog_walk.bvh"
    if dog.is_file():
        cases["a dog"] = lambda: read_bvh(dog)
    return cases
