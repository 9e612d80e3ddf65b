"""Figures of each frame of a motion that bounds of a body are about: turns, ranges, hinges, wrists, root and feet.

Every figure is larger the worse it is, so that one comparison with an upper bound serves all. Degrees, metres, seconds.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.joint_names import named_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import angle_between, joint_places, rotation_angle, unit, world_rotations
from a2g_jax.geometry.skeleton import BODY_JOINTS, Skeleton
from a2g_jax.metrics.physical import FOOT_HEIGHT, FOOT_LIFT

#: Figures of a motion by name: a row for each frame, a column for each part of :attr:`Reference.parts`.
Figures = Mapping[str, Float[np.ndarray, "T _"]]

HINGES = ("L_Elbow", "R_Elbow", "L_Knee", "R_Knee")
WRISTS = ("L_Wrist", "R_Wrist")
FEET = ("L_Ankle", "R_Ankle", "L_Foot", "R_Foot")
#: Joint above and joint below each hinge.
_AROUND = {
    f"{side}_{hinge}": (f"{side}_{above}", f"{side}_{below}")
    for hinge, above, below in (("Elbow", "Shoulder", "Wrist"), ("Knee", "Hip", "Ankle"))
    for side in "LR"
}

#: Seconds over which the slide of a standing foot is measured.
SLIDE_SECONDS = 0.5
#: Degrees of flexion in the mean pose from which it determines the axis of an elbow, and of a knee.
_BENT = {"Elbow": 10.0, "Knee": 15.0}


@dataclass(frozen=True, eq=False)
class Reference:
    """The mean pose of a body, against which its motion is measured."""

    skeleton: Skeleton
    pose: Float[np.ndarray, "J 3 3"]
    """Mean local rotations."""
    height: float
    """Mean height of the root, metres."""

    @cached_property
    def joints(self) -> dict[str, int]:
        """Index of each of the 22 body joints; of those that are recognised by their names on a skeleton that lacks
        some, such as an upper body."""
        found = find_body_joints(self.skeleton)
        if found is not None:
            return dict(zip(BODY_JOINTS, found, strict=True))
        named = named_joints(self.skeleton.names)
        return {role: named[role] for role in BODY_JOINTS if role in named}

    @cached_property
    def hinges(self) -> tuple[str, ...]:
        """Those of :data:`HINGES` that the skeleton has, with the joints above and below them."""
        return tuple(role for role in HINGES if {role, *_AROUND[role]} <= self.joints.keys())

    @cached_property
    def wrists(self) -> tuple[str, ...]:
        """Those of :data:`WRISTS` that the skeleton has."""
        return tuple(role for role in WRISTS if role in self.joints)

    @cached_property
    def parts(self) -> dict[str, tuple[str, ...]]:
        """Names of the columns of each figure: joints of the skeleton."""
        names = self.skeleton.names
        own = lambda roles: tuple(names[self.joints[role]] for role in roles)  # noqa: E731
        parts = {"turn": names, "range": names, "tilt": names[:1], "root_speed": names[:1]}
        if self.hinges:
            parts |= dict.fromkeys(("bend", "backwards", "sideways"), own(self.hinges))
        if self.wrists:
            parts |= dict.fromkeys(("wrist_speed", "wrist_jerk"), own(self.wrists))
        if self.feet:
            parts |= dict.fromkeys(("sink", "slide"), own(FEET)) | {"lift": own(("Pelvis",))}
        return parts

    @cached_property
    def feet(self) -> list[int]:
        """Ankles and toes, in the order of :data:`FEET`; none where one of them or the pelvis is missing."""
        return [self.joints[role] for role in FEET] if {*FEET, "Pelvis"} <= self.joints.keys() else []

    @cached_property
    def soles(self) -> Float[np.ndarray, " feet"]:
        """Height of ankles and toes in the mean pose, metres: where the feet stand."""
        world = world_rotations(self.pose.astype(np.float64), self.skeleton.parents)
        places = joint_places(world, np.asarray(self.skeleton.offsets, np.float64), self.skeleton.parents)
        return self.height + places[self.feet, 1]

    @cached_property
    def axes(self) -> Float[np.ndarray, "hinges 3"]:
        """Axis about which each hinge bends, a unit vector in the frame of the joint above; NaN if undetermined."""
        axes = np.full((len(self.hinges), 3), np.nan)
        pose = self.pose.astype(np.float64)
        world = world_rotations(pose, self.skeleton.parents)
        offsets = np.asarray(self.skeleton.offsets, np.float64)
        for number, hinge in enumerate(self.hinges):
            above, below = _AROUND[hinge]
            bones = self._bones(number)
            if bones is None:
                continue
            upper, lower = bones[0], pose[self.joints[hinge]] @ bones[1]
            if _BENT[hinge[2:]] < angle_between(upper, lower) < 170.0:
                axes[number] = unit(np.cross(upper, lower))
            elif below.endswith("Ankle") and below.replace("Ankle", "Foot") in self.joints:
                # A stretched knee bends across the foot.
                toe = world[self.joints[below]] @ offsets[self.joints[below.replace("Ankle", "Foot")]]
                axes[number] = unit(np.cross(world[self.joints[above]].T @ toe, upper))
        return axes

    def _bones(self, number: int) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]] | None:
        """Directions of the bones above and below a hinge in the frames of their joints; None where joints lie between
        them, as twist joints do."""
        hinge = self.joints[self.hinges[number]]
        above, below = (self.joints[role] for role in _AROUND[self.hinges[number]])
        offsets = np.asarray(self.skeleton.offsets, np.float64)
        upper, lower = unit(offsets[hinge]), unit(offsets[below])
        chained = self.skeleton.parents[hinge] == above and self.skeleton.parents[below] == hinge
        return (upper, lower) if chained and upper.any() and lower.any() else None

    def figures(self, motion: Motion) -> dict[str, Float[np.ndarray, "T _"]]:
        """Figures of a motion of this skeleton; those of speeds belong to the later of two frames.

        ``turn``: speed of each local rotation, degrees/s. ``range``: its angle from the mean pose, degrees; 0 for the
        root. ``tilt``: angle between the root's vertical and that of the mean pose, degrees. ``bend``, ``backwards``:
        flexion of elbows and knees about their axis and the opposite, degrees; ``sideways``: angle of the lower bone
        with the plane of that flexion. ``wrist_speed`` (m/s) and ``wrist_jerk`` (m/s3): relative to the root.
        ``root_speed``: m/s. ``sink``: metres of ankles and toes below their height in the mean pose. ``lift``: height
        of the lowest of them above it, metres. ``slide``: metres that a foot moved along the floor in the half second
        before, if it stood throughout. Those of hinges, wrists or feet are missing where their joints are not
        recognised.
        """
        rotations, root = np.asarray(motion.rotations), np.asarray(motion.root)
        mean = self.pose.astype(rotations.dtype)
        found = {
            "turn": _later(rotation_angle(rotations[1:], rotations[:-1]) * motion.fps, 1, motion.frames),
            "range": rotation_angle(rotations, np.broadcast_to(mean, rotations.shape)),
            "tilt": angle_between(rotations[:, 0, 1], np.broadcast_to(mean[0, 1], root.shape))[:, None],
            "root_speed": _speed(root[:, None], motion.fps),
        }
        found["range"][:, 0] = 0.0
        if self.hinges:
            found |= self.hinge_figures(rotations)
        places = motion.positions() if self.wrists or self.feet else None
        if places is not None and self.wrists:
            wrists = places[:, [self.joints[role] for role in self.wrists]] - root[:, None]
            found["wrist_speed"] = _speed(wrists, motion.fps)
            jerk = np.linalg.norm(np.diff(wrists, n=3, axis=0), axis=-1) * motion.fps**3
            # The third difference of a jump is largest in the frame after it if it counts for the third of its four.
            found["wrist_jerk"] = _later(jerk, 2, motion.frames)
        if places is not None and self.feet:
            found |= self._feet(places[:, self.feet], motion.fps)
        return found

    def hinge_figures(self, rotations: Float[np.ndarray, "T J 3 3"]) -> dict[str, Float[np.ndarray, "T hinges"]]:
        """``bend``, ``backwards`` and ``sideways`` of :meth:`figures`, of local rotations."""
        flexion, sideways = np.zeros((2, len(rotations), len(self.hinges)), rotations.dtype)
        for number, (hinge, axis) in enumerate(zip(self.hinges, self.axes, strict=True)):
            bones = self._bones(number)
            if bones is None or np.isnan(axis).any():
                continue
            upper, lower, axis = (vector.astype(rotations.dtype) for vector in (*bones, axis))
            bent = rotations[:, self.joints[hinge]] @ lower
            flexion[:, number] = np.degrees(np.arctan2(np.cross(upper, bent) @ axis, bent @ upper))
            sideways[:, number] = np.degrees(np.abs(np.arcsin(np.clip(bent @ axis, -1.0, 1.0))))
        return {"bend": flexion, "backwards": -flexion, "sideways": sideways}

    def _feet(self, places: Float[np.ndarray, "T 4 3"], fps: float) -> dict[str, Float[np.ndarray, "T _"]]:
        height = places[..., 1] - self.soles.astype(places.dtype)
        span = max(1, round(SLIDE_SECONDS * fps))
        slide = np.zeros_like(height)
        if len(places) > span:
            moved = np.linalg.norm((places[span:] - places[:-span])[..., [0, 2]], axis=-1)
            slide[span:] = np.where(_throughout(_stands(places, fps), span), moved, 0.0)
        return {"sink": -height, "lift": height.min(axis=1, keepdims=True), "slide": slide}


def _stands(places: Float[np.ndarray, "T F 3"], fps: float) -> Bool[np.ndarray, "T F"]:
    """Frames in which a foot is low and does not rise; as in :func:`~a2g_jax.metrics.physical.foot_skate`, but lowest
    is the 5th percentile of its heights, as one frame below the floor would end all standing."""
    low = places[..., 1] < np.percentile(places[..., 1], 5.0, axis=0) + FOOT_HEIGHT
    rise = np.abs(np.gradient(places[..., 1], axis=0)) * fps
    return low & (rise < FOOT_LIFT)


def _throughout(flags: Bool[np.ndarray, "T F"], span: int) -> Bool[np.ndarray, "t F"]:
    """Whether a flag is set in each of ``span + 1`` frames; ``span`` values fewer."""
    count = np.concatenate([np.zeros((1, flags.shape[1]), int), np.cumsum(flags, axis=0)])
    return np.asarray(count[span + 1 :] - count[: -span - 1] == span + 1)


def _speed(places: Float[np.ndarray, "T N 3"], fps: float) -> Float[np.ndarray, "T N"]:
    return _later(np.linalg.norm(np.diff(places, axis=0), axis=-1) * fps, 1, len(places))


def _later(values: Float[np.ndarray, "t N"], first: int, frames: int) -> Float[np.ndarray, "T N"]:
    """Values of differences as those of the frames from ``first`` on; 0 elsewhere."""
    rows = np.zeros((frames, values.shape[1]), values.dtype)
    rows[first : first + len(values)] = values[: max(frames - first, 0)]
    return rows
