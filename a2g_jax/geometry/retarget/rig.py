"""Rigs analysed for retargeting: body parts, reference pose, axes and unit."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.anthropometry import stature
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.human import check_human
from a2g_jax.geometry.retarget.parts import assign_sides, find_parts, trunk_chains
from a2g_jax.geometry.retarget.poses import angle_between, frame_of, joint_places, world_rotations
from a2g_jax.geometry.retarget.rest import anatomy, body_frame, oddness, snapped, trunk_axis
from a2g_jax.geometry.skeleton import Skeleton

#: Largest oddness (degrees) of a T-, A- or I-pose, of a zero pose, and of any other reference pose.
_GOOD_POSE, _ZERO_POSE, _WORST_POSE = 15.0, 40.0, 75.0
_AXES = {"X": 0, "Y": 1, "Z": 2}
#: Units, and the factor that corrects lengths that were read as metres or centimetres.
_UNITS = (
    ("metres", 1.0), ("inches", 2.54), ("units of 5.644 cm", 2.54 / 0.45), ("millimetres", 0.1), ("feet", 0.3048),
    ("decimetres", 10.0),
)  # fmt: skip
_ADULT = (1.2, 2.3)
#: An adult's height over the length of the arm without the hand (Drillis and Contini 1966: 0.186 + 0.146 of height).
_ARMS_IN_HEIGHT = 3.0


@dataclass(frozen=True, eq=False)
class Rig:
    """A skeleton with the parts of a body; :mod:`a2g_jax.geometry.retarget.rest` defines the frames."""

    skeleton: Skeleton
    roles: dict[str, int]
    """Joint of each part: ``Pelvis``, ``L_Hip`` ... ``R_Wrist``, ``Neck``, ``Head``, ``Chest``, ``L_Index1`` ..."""
    spine: tuple[int, ...]
    """Joints above the pelvis up to the chest, the parent of the collars."""
    neck: tuple[int, ...]
    """Joints between chest and head."""
    by_shape: bool
    """Whether parts were found by topology instead of names."""
    rest: Float[np.ndarray, "J 3 3"]
    """Local rotations of the reference pose."""
    align: Float[np.ndarray, "J 3 3"]
    """``R_joint_anatomy`` of every joint."""
    world: Float[np.ndarray, "3 3"]
    """``R_world_body`` of a person facing forward in the world of the rig's motions: columns left, up, forward."""
    height: float
    """Height of the reference pose along the body, in the unit as read (metres if read correctly); of a rig without
    legs, that of an adult with such arms."""
    notes: tuple[str, ...]
    """How the reference pose, the axes and the unit were found."""

    @property
    def up(self) -> str:
        """The axis that points up, such as ``"+Y"``."""
        return _axis_name(self.world[:, 1])

    @property
    def unit_factor(self) -> float:
        """Factor from the unit as read to metres: 1 unless lengths were read in another unit."""
        return _guess_unit(self.height, stature(self.skeleton, self.roles))[1]

    @property
    def rest_world(self) -> Float[np.ndarray, "J 3 3"]:
        """Orientations of the reference pose, ``R_rest_joint``."""
        return world_rotations(self.rest, self.skeleton.parents)


def find_rig(
    source: Motion | Skeleton,
    *,
    name: str = "the rig",
    rest: str | int = "auto",
    up: str | None = None,
    joints: Mapping[str, str] | None = None,
) -> Rig:
    """Find the body in a rig.

    Parts are found by names; where these do not give both arms, by topology and bone lengths. The reference pose is
    the zero pose of the file if that is a standing person, or else the frame of the motion nearest to one.

    Args:
        source: a motion, or only its skeleton; a motion also gives the vertical axis and candidates for the reference
            pose.
        name: what errors call the rig, such as its file name.
        rest: ``"auto"``, ``"zero"`` for the zero pose, or the number of a frame.
        up: the vertical axis of the rig's motions, such as ``"Z"`` or ``"-Y"``; None finds it.
        joints: parts given by hand, such as ``{"L_Elbow": "joint17"}``; they come before what is found.

    Raises:
        InputError: no two arms are found, or no pose is that of a standing person.
    """
    skeleton = source if isinstance(source, Skeleton) else source.skeleton
    motion = None if isinstance(source, Skeleton) else source
    roles, unsided = find_parts(skeleton, name, joints or {})
    by_shape = unsided is not None
    some = _some_places(motion)
    if some is not None:
        check_human(skeleton, roles, some, name)
    local, notes = _reference_pose(skeleton, motion, roles, rest, name)
    world = world_rotations(local, skeleton.parents)
    places = joint_places(world, np.asarray(skeleton.offsets, np.float64), skeleton.parents)
    if unsided:
        roles = assign_sides(roles, unsided, places, name)
    body = body_frame(places, roles)
    body = _upright(body, drawn="zero pose" in notes[0])
    axes = _world_axes(some, roles, body, up, name)
    spine, neck = trunk_chains(skeleton, roles)
    heights = places @ body[:, 1]
    height = float(heights.max() - heights.min())
    if "L_Ankle" not in roles or "R_Ankle" not in roles:
        height = _ARMS_IN_HEIGHT * _arm_length(places, roles)
    notes += (f"up is {_axis_name(axes[:, 1])}, forward {_axis_name(axes[:, 2])}",)
    unit, factor = _guess_unit(height, stature(skeleton, roles))
    notes += (f"{height:.2f} tall: lengths are {'right in metres' if factor == 1 else f'{unit}, times {factor}'}",)
    align = anatomy(skeleton, places, world, body, roles)
    return Rig(skeleton, roles, spine, neck, by_shape, local, align, axes, height, notes)


def _reference_pose(
    skeleton: Skeleton, motion: Motion | None, roles: dict[str, int], rest: str | int, name: str
) -> tuple[Float[np.ndarray, "J 3 3"], tuple[str, ...]]:
    zero = np.tile(np.eye(3), (skeleton.joints, 1, 1))
    odd = float(oddness(_places(skeleton, zero), roles))
    if isinstance(rest, int):
        if motion is None or not 0 <= rest < motion.frames:
            raise InputError(f"{name}: frame {rest} cannot be the reference pose; there is no such frame.")
        return np.asarray(motion.rotations[rest], np.float64), (f"reference: frame {rest}",)
    if rest not in ("auto", "zero"):
        raise InputError(f"{name}: expected the reference pose as auto, zero or a frame's number; got {rest!r}.")
    if rest == "zero" or odd <= _ZERO_POSE:
        return zero, (f"reference: zero pose ({odd:.0f} degrees from upright with straight limbs)",)
    if motion is None or motion.frames == 0:
        raise InputError(
            f"{name}: the zero pose of the skeleton is no standing person ({odd:.0f} degrees off); "
            "give a motion with such a pose, or the number of its frame."
        )
    rows = np.unique(np.linspace(0, motion.frames - 1, 2000).astype(int))
    rotations = np.asarray(motion.rotations)[rows].astype(np.float64)
    scores = oddness(_places(skeleton, rotations), roles)
    # A T-pose, where there is one, is the first frame.
    best = 0 if scores[0] <= _GOOD_POSE else int(np.argmin(scores))
    if scores[best] > min(odd, _WORST_POSE):
        raise InputError(
            f"{name}: neither the zero pose nor a frame is a person standing with straight limbs (best: frame "
            f"{rows[best]}, {scores[best]:.0f} degrees off); add a T-pose as first frame or name a frame."
        )
    note = f"reference: frame {rows[best]} ({scores[best]:.0f} degrees from upright with straight limbs)"
    return rotations[best], (note,)


def _places(skeleton: Skeleton, rotations: Float[np.ndarray, "*t J 3 3"]) -> Float[np.ndarray, "*t J 3"]:
    world = world_rotations(rotations, skeleton.parents)
    return joint_places(world, np.asarray(skeleton.offsets, np.float64), skeleton.parents)


def _upright(body: Float[np.ndarray, "3 3"], drawn: bool) -> Float[np.ndarray, "3 3"]:
    """The body frame, aligned with the world's axes where it nearly is, since a posing person stands upright.

    A modelled pose (``drawn``) also faces along an axis; a captured person may face anywhere.
    """
    axes = snapped(body, 15.0)
    if axes is None or drawn:
        return body if axes is None else axes
    if snapped(body, 4.0) is not None:
        return axes
    frame = frame_of(axes[:, 1], body[:, 0])
    return np.stack([frame[:, 1], frame[:, 0], np.cross(frame[:, 1], frame[:, 0])], axis=1)


def _some_places(motion: Motion | None) -> Float[np.ndarray, "N J 3"] | None:
    """Joint positions in up to 200 frames, the root at the origin; None without a motion."""
    if motion is None or motion.frames == 0:
        return None
    rows = np.unique(np.linspace(0, motion.frames - 1, 200).astype(int))
    return _places(motion.skeleton, np.asarray(motion.rotations)[rows].astype(np.float64))


def _world_axes(
    some: Float[np.ndarray, "N J 3"] | None,
    roles: dict[str, int],
    body: Float[np.ndarray, "3 3"],
    up: str | None,
    name: str,
) -> Float[np.ndarray, "3 3"]:
    """Left, up and forward in the world of the motion; forward as in the reference pose where that is upright in it."""
    vertical = body[:, 1]
    if some is not None and up is None:
        vertical = trunk_axis(some, roles).mean(axis=0)
    axis = int(np.argmax(np.abs(vertical)))
    upward = np.eye(3)[axis] * (1.0 if vertical[axis] > 0 else -1.0)
    if up is not None:
        letter, sign = up[-1:].upper(), -1.0 if up.startswith("-") else 1.0
        if letter not in _AXES or up[:-1] not in ("", "+", "-"):
            raise InputError(f"{name}: expected the vertical axis as X, Y or Z with or without a sign; got {up!r}.")
        upward = np.eye(3)[_AXES[letter]] * sign
    forward = np.eye(3)[int(np.argmax(np.abs(body[:, 2])))] * np.sign(body[:, 2][np.argmax(np.abs(body[:, 2]))])
    if abs(forward @ upward) > 0.5 or angle_between(body[:, 1], upward) > 30:
        # By custom: forward is +Z where Y is up, -Y where Z is up.
        forward = {0: np.eye(3)[2], 1: np.eye(3)[2], 2: -np.eye(3)[1]}[int(np.argmax(np.abs(upward)))]
    return np.stack([np.cross(upward, forward), upward, forward], axis=1)


def _arm_length(places: Float[np.ndarray, "J 3"], roles: dict[str, int]) -> float:
    """Length from shoulder over elbow to wrist, the mean of both sides."""
    chain = ("Shoulder", "Elbow", "Wrist")
    bones = [
        places[roles[f"{side}_{end}"]] - places[roles[f"{side}_{start}"]]
        for side in "LR"
        for start, end in zip(chain, chain[1:], strict=False)
    ]
    return float(np.linalg.norm(bones, axis=-1).sum() / 2)


def _guess_unit(height: float, limbs: float | None) -> tuple[str, float]:
    # Lengths of files are in metres by now; those given otherwise may not be. A person of unusual proportions or in a
    # bent reference pose has either the height or the limbs of a person.
    if height <= 0 or any(_ADULT[0] <= tall <= _ADULT[1] for tall in (height, limbs or height)):
        return _UNITS[0]
    return min(_UNITS, key=lambda unit: abs(np.log(height * unit[1] / 1.7)))


def _axis_name(vector: Float[np.ndarray, "3"]) -> str:
    axis = int(np.argmax(np.abs(vector)))
    return f"{'+' if vector[axis] > 0 else '-'}{'XYZ'[axis]}"
