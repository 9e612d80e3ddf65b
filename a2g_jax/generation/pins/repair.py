"""Flips of a recorded joint, replaced by a passage from the frames before to those after."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from a2g_jax.generation.clip_fit import FLIP
from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.geometry.skeleton import BODY_JOINTS, Skeleton

#: Seconds that a passage begins before and ends after its flips, that flips of one passage lie apart, and that it lasts
#: at most.
_AROUND, _APART, _LONGEST = 0.1, 0.15, 0.5
#: Joints whose rotations make up for one another in recordings with flips: they are replaced together.
_LIMBS = (
    *(tuple(f"{side}_{part}" for part in ("Collar", "Shoulder", "Elbow", "Wrist")) for side in "LR"),
    *(tuple(f"{side}_{part}" for part in ("Hip", "Knee", "Ankle", "Foot")) for side in "LR"),
    ("Pelvis", "Spine1", "Spine2", "Spine3", "Neck", "Head"),
)


def repair_flips(motion: Motion) -> tuple[Motion, list[str]]:
    """The motion without short flips, and a note on each.

    Where a joint turns faster than :data:`~a2g_jax.generation.clip_fit.FLIP`, its whole limb passes from the pose a
    tenth of a second before to that a tenth after. Passages of more than half a second are left as they are.
    """
    if motion.frames < 3:
        return motion, []
    rotations, notes = np.array(motion.rotations), []
    turns = rotation_angle(rotations[1:], rotations[:-1]) * motion.fps
    around, names = max(1, round(_AROUND * motion.fps)), motion.skeleton.names
    for limb in _limbs(motion.skeleton):
        for first, last in _clusters(np.flatnonzero(turns[:, limb].max(axis=1) > FLIP), _APART * motion.fps):
            start, end = first - around, last + 1 + around
            if (end - start) / motion.fps > _LONGEST:
                continue
            _pass(rotations, limb, start, end)
            within = turns[first : last + 1, limb]
            frame, joint = np.unravel_index(int(np.argmax(within)), within.shape)
            notes.append(
                f"{names[limb[joint]]} turns by {within[frame, joint] / motion.fps:.0f} degrees from frame"
                f" {first + frame} to the next: its limb is interpolated over {(end - start) / motion.fps:.2f} s"
            )
    return replace(motion, rotations=rotations), notes


def _limbs(skeleton: Skeleton) -> list[list[int]]:
    body = find_body_joints(skeleton)
    if body is None:
        return [[joint] for joint in range(skeleton.joints)]
    limbs = [[body[BODY_JOINTS.index(name)] for name in limb] for limb in _LIMBS]
    return limbs + [[joint] for joint in range(skeleton.joints) if joint not in body]


def _clusters(steps: np.ndarray, apart: float) -> list[tuple[int, int]]:
    """First and last of steps that lie close together."""
    if len(steps) == 0:
        return []
    parts = np.split(steps, np.flatnonzero(np.diff(steps) > apart) + 1)
    return [(int(part[0]), int(part[-1])) for part in parts]


def _pass(rotations: Float[np.ndarray, "T J 3 3"], limb: list[int], start: int, end: int) -> None:
    """Write the passage of a limb between two frames; at an end of the motion it holds the pose of the other."""
    frames = len(rotations)
    if start < 0 or end >= frames:
        inside = slice(0, end) if start < 0 else slice(start + 1, frames)
        kept = min(end, frames - 1) if start < 0 else max(start, 0)
        rotations[inside, limb] = rotations[kept, limb]
        return
    share = np.arange(1, end - start) / (end - start)
    share = share * share * (3.0 - 2.0 * share)
    for joint in limb:
        before, after = (Rotation.from_matrix(rotations[frame, joint]) for frame in (start, end))
        turn = (after * before.inv()).as_rotvec()
        rotations[start + 1 : end, joint] = (Rotation.from_rotvec(share[:, None] * turn) * before).as_matrix()
