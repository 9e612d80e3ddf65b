"""Small motions to put on test pages."""

import numpy as np

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import BODY_JOINTS, BODY_PARENTS, Skeleton

_LEFT = {
    "Hip": (0.06, -0.09, 0.0), "Knee": (0.04, -0.39, 0.0), "Ankle": (-0.01, -0.41, -0.03), "Foot": (0.03, -0.05, 0.12),
    "Collar": (0.07, 0.09, 0.0), "Shoulder": (0.11, 0.03, 0.0), "Elbow": (0.26, 0.0, 0.0), "Wrist": (0.25, 0.0, 0.0),
}  # fmt: skip
_SPINE = {
    "Pelvis": (0.0, 0.95, 0.0), "Spine1": (0.0, 0.11, 0.0), "Spine2": (0.0, 0.13, 0.0), "Spine3": (0.0, 0.06, 0.0),
    "Neck": (0.0, 0.17, 0.0), "Head": (0.0, 0.09, 0.0),
}  # fmt: skip


def body_skeleton() -> Skeleton:
    """The 22 body joints of an adult in a T-pose."""
    offsets = []
    for name in BODY_JOINTS:
        x, y, z = _SPINE.get(name) or _LEFT[name[2:]]
        offsets.append((-x if name.startswith("R_") else x, y, z))
    return Skeleton(np.array(offsets, np.float32), BODY_JOINTS, BODY_PARENTS)


def waving(frames: int = 60, fps: float = 30.0, pace: float = 1.0) -> Motion:
    """Arms that swing around the front axis, head that turns."""
    skeleton, time = body_skeleton(), np.arange(frames) / fps
    rotations = np.tile(np.eye(3, dtype=np.float32), (frames, 22, 1, 1))
    for name, sign in (("L_Shoulder", -1.0), ("R_Shoulder", 1.0)):
        angle = sign * (0.9 + 0.5 * np.sin(2 * np.pi * pace * time))
        rotations[:, skeleton.index(name)] = _turn(angle, 0, 1)
    rotations[:, skeleton.index("Head")] = _turn(0.4 * np.sin(2 * np.pi * pace * time), 2, 0)
    root = np.tile(np.float32([0.0, 0.95, 0.0]), (frames, 1))
    root[:, 0] += 0.02 * np.sin(time)
    return Motion(rotations, root.astype(np.float32), skeleton, fps)


def _turn(angle: np.ndarray, first: int, second: int) -> np.ndarray:
    out = np.tile(np.eye(3, dtype=np.float32), (len(angle), 1, 1))
    out[:, first, first] = out[:, second, second] = np.cos(angle)
    out[:, second, first], out[:, first, second] = np.sin(angle), -np.sin(angle)
    return out


def tone(seconds: float, sample_rate: int = 16000) -> np.ndarray:
    """A hum that swells twice a second."""
    time = np.arange(round(seconds * sample_rate)) / sample_rate
    return (0.4 * np.sin(2 * np.pi * 220 * time) * np.sin(2 * np.pi * time) ** 2).astype(np.float32)
