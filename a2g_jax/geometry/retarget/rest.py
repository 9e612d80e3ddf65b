"""The reference pose of a rig and the anatomical frame of every joint in it.

Notation: ``R_world_joint`` turns a joint's coordinates into the world's; ``body`` is a frame whose axes are the
person's left (x), up (y) and forward (z). In the reference pose, written with ``rest``,

    R_rest_anatomy = turn @ R_rest_body,        R_joint_anatomy = R_rest_joint^T @ R_rest_anatomy,

where ``turn`` (identity for the trunk) rotates the bone from its direction in a T-pose, palms down and feet flat, to
its direction in the reference pose, by the smallest rotation from the turn of its parent. So the arm of an A-pose is
recognised as a lowered arm, with its twist. ``R_joint_anatomy`` is constant, and

    R_world_anatomy(t) = R_world_joint(t) @ R_joint_anatomy

is the pose without the rig's conventions: equal for all rigs in the same pose, whatever their local axes and reference
pose. Retargeting copies it; mirroring reflects it.
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.joint_names import FINGERS
from a2g_jax.geometry.retarget.poses import Vector, angle_between, frame_of, shortest_turn, unit
from a2g_jax.geometry.skeleton import Skeleton

#: An elbow or a knee bent by more degrees than this in the reference pose defines its hinge axis, and so the twist.
_SHOWS_HINGE = 15.0
#: A foot bone flatter than the first angle, in degrees, does not follow the sole; the second is the usual slope from
#: ankle to ball of a flat foot (25 in the generated body, 27 in standing ZeroEGGS takes).
_FLAT_FOOT, _USUAL_SLOPE = 5.0, 25.0
#: An end site of a hand without fingers that deviates by more degrees from the forearm is no hand direction.
_BENT_HAND = 60.0
#: Directions of bones in a T-pose, in the body frame, left side.
_LEFT, _DOWN, _FORWARD = np.eye(3)[0], -np.eye(3)[1], np.eye(3)[2]
_THUMB = unit(np.array([0.65, -0.3, 0.7]))

Roles = Mapping[str, int]
Places = Float[np.ndarray, "*t J 3"]


def trunk_axis(places: Places, roles: Roles) -> Vector:
    """Direction from the feet or the pelvis to the neck."""
    neck = _neck(places, roles)
    if "L_Hip" not in roles or "R_Hip" not in roles:
        low = places[..., roles.get("Pelvis", roles.get("Chest", 0)), :]
        return unit(neck - low) if np.any(np.abs(neck - low) > 1e-6) else unit(np.zeros_like(neck) + _FORWARD)
    hips = (places[..., roles["L_Hip"], :] + places[..., roles["R_Hip"], :]) / 2
    axis = unit(neck - hips)
    if "L_Knee" in roles and "R_Knee" in roles:
        knees = (places[..., roles["L_Knee"], :] + places[..., roles["R_Knee"], :]) / 2
        axis = unit(axis + 0.5 * unit(hips - knees))
    return axis


def body_frame(places: Float[np.ndarray, "J 3"], roles: Roles) -> Float[np.ndarray, "3 3"]:
    """``R_rest_body`` from joint positions: columns left, up, forward."""
    frame = frame_of(trunk_axis(places, roles), _across(places, roles))
    up, left = frame[:, 0], frame[:, 1]
    return np.stack([left, up, np.cross(left, up)], axis=1)


def snapped(frame: Float[np.ndarray, "3 3"], within: float) -> Float[np.ndarray, "3 3"] | None:
    """The axis-aligned rotation nearest to a frame, if no axis is farther than ``within`` degrees; otherwise None."""
    near = np.zeros((3, 3))
    rows = np.argmax(np.abs(frame), axis=0)
    near[rows, range(3)] = np.sign(frame[rows, range(3)])
    if abs(np.linalg.det(near) - 1) > 1e-6 or np.max(angle_between(frame.T, near.T)) > within:
        return None
    return near


def oddness(places: Places, roles: Roles) -> Float[np.ndarray, "*t"]:
    """Deviation of poses, in degrees, from a person standing upright and symmetric with straight limbs.

    The largest of: legs out of line with the trunk, hips twisted against the shoulders, arms to the front or the back
    or above the head, asymmetric arms, bent elbows and knees. It is near 0 for T-, A- and I-poses.
    """
    up, across = trunk_axis(places, roles), unit(_across(places, roles))
    forward = unit(np.cross(across, up))
    scores, arms = [90 - np.minimum(angle_between(across, up), angle_between(-across, up))], []
    for side, sign in (("L", 1.0), ("R", -1.0)):
        upper = _bone(places, roles, f"{side}_Shoulder", f"{side}_Elbow")
        lower = _bone(places, roles, f"{side}_Elbow", f"{side}_Wrist")
        out, high, front = (np.sum(upper * axis, axis=-1) for axis in (across * sign, up, forward))
        arms.append(np.stack([out, high, front], axis=-1))
        scores += [np.degrees(np.arcsin(np.clip(np.abs(front), 0, 1))), angle_between(upper, lower)]
        scores += [np.maximum(np.degrees(np.arcsin(np.clip(high, -1, 1))) - 20, 0), np.where(out < -0.3, 90.0, 0.0)]
        if f"{side}_Knee" in roles and f"{side}_Hip" in roles and f"{side}_Ankle" in roles:
            thigh = _bone(places, roles, f"{side}_Hip", f"{side}_Knee")
            shin = _bone(places, roles, f"{side}_Knee", f"{side}_Ankle")
            scores += [angle_between(thigh, -up), angle_between(thigh, shin)]
    scores.append(angle_between(arms[0], arms[1]))
    if "L_Hip" in roles and "R_Hip" in roles:
        scores.append(angle_between(across, places[..., roles["L_Hip"], :] - places[..., roles["R_Hip"], :]))
    return np.asarray(np.max(np.stack(scores), axis=0))


def anatomy(
    skeleton: Skeleton,
    places: Float[np.ndarray, "J 3"],
    world: Float[np.ndarray, "J 3 3"],
    body: Float[np.ndarray, "3 3"],
    roles: Roles,
) -> Float[np.ndarray, "J 3 3"]:
    """``R_joint_anatomy`` of every joint; a joint without a role follows its parent.

    Args:
        places: positions in the reference pose.
        world: orientations in the reference pose, ``R_rest_joint``.
        body: ``R_rest_body``.
        roles: joints by role; ``L_`` and ``R_`` as in :func:`~a2g_jax.geometry.joint_names.named_joints`.
    """
    part_of = {joint: role for role, joint in roles.items()}
    pose = _Pose(skeleton, places, world, body, roles)
    turns = np.tile(np.eye(3), (skeleton.joints, 1, 1))
    for joint, parent in enumerate(skeleton.parents):
        above = turns[parent] if parent >= 0 else np.eye(3)
        role = part_of.get(joint, "")
        turns[joint] = _turn(role, above, pose)
    return np.swapaxes(world, -1, -2) @ turns @ body


class _Pose:
    def __init__(self, skeleton: Skeleton, places, world, body, roles: Roles) -> None:
        self.skeleton, self.places, self.world, self.body, self.roles = skeleton, places, world, body, roles

    def bone(self, start: str, end: str) -> Float[np.ndarray, "3"] | None:
        """Vector from one part to another; None if one is missing or they coincide."""
        if start not in self.roles or end not in self.roles:
            return None
        vector = self.places[self.roles[end]] - self.places[self.roles[start]]
        return vector if np.linalg.norm(vector) > 1e-5 else None

    def tip(self, role: str) -> Float[np.ndarray, "3"] | None:
        """Vector from a part to its end site, or to the child with the longest branch (the middle finger of a hand)."""
        joint, skeleton = self.roles[role], self.skeleton
        points = [(self.world[joint] @ np.asarray(end),) * 2 for owner, end in skeleton.ends if owner == joint]
        branch = {joint: joint}
        for below, parent in enumerate(skeleton.parents):
            if parent in branch:
                branch[below] = below if parent == joint else branch[parent]
                points.append(
                    (self.places[branch[below]] - self.places[joint], self.places[below] - self.places[joint])
                )
        points = [point for point in points if np.linalg.norm(point[0]) > 1e-4 * np.linalg.norm(point[1])]
        return max(points, key=lambda point: float(np.linalg.norm(point[1])), default=(None,))[0]


def _turn(role: str, above: Float[np.ndarray, "3 3"], pose: _Pose) -> Float[np.ndarray, "3 3"]:
    """``turn`` of one joint from that of its parent."""
    side, _, part = role.partition("_")
    if side not in ("L", "R"):
        return above if not role else np.eye(3)
    out = _LEFT if side == "L" else -_LEFT

    def along(canonical, bone):
        return above if bone is None else shortest_turn(above @ pose.body @ canonical, bone) @ above

    match part:
        case "Collar":
            return np.eye(3)
        case "Shoulder":
            above = np.eye(3)
            upper, lower = pose.bone(role, f"{side}_Elbow"), pose.bone(f"{side}_Elbow", f"{side}_Wrist")
            # An elbow bends forward in a T-pose with palms down.
            return _hinge(pose.body, out, _FORWARD, upper, lower, along(out, upper))
        case "Elbow":
            return along(out, pose.bone(role, f"{side}_Wrist"))
        case "Wrist":
            return _hand(side, out, above, pose)
        case "Hip":
            above = np.eye(3)
            upper, lower = pose.bone(role, f"{side}_Knee"), pose.bone(f"{side}_Knee", f"{side}_Ankle")
            return _hinge(pose.body, _DOWN, -_FORWARD, upper, lower, along(_DOWN, upper))
        case "Knee":
            return along(_DOWN, pose.bone(role, f"{side}_Ankle"))
        case "Ankle":
            return _foot(pose.bone(role, f"{side}_Foot"), pose.body, sloped=True)
        case "Foot":
            return _foot(pose.bone(f"{side}_Ankle", role), pose.body, sloped=False)
        case _:
            finger, number = part[:-1], int(part[-1])
            if number == 0:
                return above
            bone = pose.bone(role, f"{role[:-1]}{number + 1}")
            canonical = out if finger != "Thumb" else _THUMB * np.array([out[0], 1.0, 1.0])
            return along(canonical, pose.tip(role) if bone is None else bone)


def _hinge(body, canonical, bends_to, upper, lower, straight):
    """The turn of a limb's upper bone, with the twist of the hinge below where that is bent enough to define it."""
    if upper is None or lower is None or not _SHOWS_HINGE < angle_between(upper, lower) < 180 - _SHOWS_HINGE:
        return straight
    return frame_of(upper, lower) @ frame_of(body @ canonical, body @ bends_to).T


def _hand(side: str, out: Float[np.ndarray, "3"], above: Float[np.ndarray, "3 3"], pose: _Pose):
    """The turn of a hand: direction from the middle finger, roll from the knuckles."""
    wrist = f"{side}_Wrist"
    bases = {
        finger: bone
        for finger in FINGERS
        if finger != "Thumb" and (bone := pose.bone(wrist, f"{side}_{finger}1")) is not None
    }
    if not bases:
        ends = pose.tip(wrist)
        forearm = above @ pose.body @ out
        # Some writers add end sites of arbitrary direction.
        if ends is None or angle_between(forearm, ends) > _BENT_HAND:
            return above
        return shortest_turn(forearm, ends) @ above
    points = bases.get("Middle", sum(bases.values(), np.zeros(3)) / len(bases))
    last = next((bases[finger] for finger in ("Pinky", "Ring") if finger in bases), None)
    if "Index" in bases and last is not None and angle_between(points, bases["Index"] - last) > 20:
        frame = frame_of(points, bases["Index"] - last)
        return frame @ frame_of(pose.body @ out, pose.body @ _FORWARD).T
    return shortest_turn(above @ pose.body @ out, points) @ above


def _foot(bone: Float[np.ndarray, "3"] | None, body: Float[np.ndarray, "3 3"], sloped: bool):
    """The turn of a foot: flat on the ground in the reference pose, heading and slope of its bone.

    A bone that does not follow the sole has the usual slope.
    """
    up = body[:, 1]
    if bone is None or angle_between(bone, up) < 10 or angle_between(bone, -up) < 10:
        return np.eye(3)
    heading = frame_of(up, bone)[:, 1]
    slope = 90 - float(angle_between(bone, -up))
    raised = np.radians(_USUAL_SLOPE - slope) if sloped and slope < _FLAT_FOOT else 0.0
    sole, across = heading * np.cos(raised) + up * np.sin(raised), np.cross(up, heading)
    return np.stack([across, np.cross(sole, across), sole], axis=1) @ body.T


def _bone(places: Places, roles: Roles, start: str, end: str) -> Vector:
    return unit(places[..., roles[end], :] - places[..., roles[start], :])


def _neck(places: Places, roles: Roles) -> Vector:
    for role in ("Neck", "Head"):
        if role in roles:
            return places[..., roles[role], :]
    return (places[..., roles["L_Shoulder"], :] + places[..., roles["R_Shoulder"], :]) / 2


def _across(places: Places, roles: Roles) -> Vector:
    across = unit(places[..., roles["L_Shoulder"], :] - places[..., roles["R_Shoulder"], :])
    if "L_Hip" in roles and "R_Hip" in roles:
        across = across + unit(places[..., roles["L_Hip"], :] - places[..., roles["R_Hip"], :])
    return across


def ankle_height(
    skeleton: Skeleton, places: Float[np.ndarray, "J 3"], world: Float[np.ndarray, "J 3 3"], roles: Roles
) -> float:
    """Height of the ankles above the lowest joint or end site of flat feet.

    Where the foot bone does not follow the sole, from the usual slope of a foot.

    Args:
        places: positions in the reference pose, in the body frame.
        world: orientations in the reference pose, in the body frame.
    """
    heights = []
    for side in "LR":
        ankle = roles[f"{side}_Ankle"]
        below = {ankle}
        for joint, parent in enumerate(skeleton.parents):
            if parent in below:
                below.add(joint)
        points = [places[joint] for joint in below]
        points += [places[joint] + world[joint] @ np.asarray(end) for joint, end in skeleton.ends if joint in below]
        drop = max(float(places[ankle, 1] - point[1]) for point in points)
        toe = places[roles[f"{side}_Foot"]] - places[ankle] if f"{side}_Foot" in roles else np.zeros(3)
        length = float(np.linalg.norm(toe))
        if length > 1e-6 and -toe[1] < length * np.sin(np.radians(_FLAT_FOOT)):
            drop = length * float(np.sin(np.radians(_USUAL_SLOPE)))
        heights.append(drop)
    return sum(heights) / 2
