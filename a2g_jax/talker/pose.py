"""Joint rotations from the channels of posture and arms: inverse kinematics within the limits of the joints."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.skeleton import BODY_JOINTS
from a2g_jax.talker.ik import Rotations, Vectors, arm_rotations, leg_rotations, rotate, turn, yaw_roll_pitch
from a2g_jax.talker.paths import soft_clip, softplus
from a2g_jax.talker.posture import Stance
from a2g_jax.talker.reach import clear_hands, wrist_targets
from a2g_jax.talker.skeleton import ANKLE_HEIGHT, FOREARM, PELVIS_HEIGHT, SHIN, TALKER_SKELETON, THIGH, UPPER_ARM

_JOINT = {name: index for index, name in enumerate(BODY_JOINTS)}
_OFFSETS = np.asarray(TALKER_SKELETON.offsets, dtype=np.float64)
_SPINE_SHARES = {"Spine1": 0.30, "Spine2": 0.35, "Spine3": 0.35}
_HEAD_SHARES = {"Neck": 0.45, "Head": 0.55}
_TURN_LIMITS = np.deg2rad(
    [
        [-25.0, 25.0],
        [-7.0, 7.0],
        [-6.0, 12.0],
        [-34.0, 34.0],
        [-20.0, 20.0],
        [-15.0, 32.0],
        [-50.0, 50.0],
        [-28.0, 28.0],
        [-30.0, 34.0],
    ]
)
"""Least and most yaw, roll and pitch of pelvis, chest over pelvis and head over chest."""
_SHIFT_LIMITS = np.array([[-0.085, 0.085], [-0.06, 0.02], [-0.06, 0.06]])
"""Least and most shift of the pelvis, metres."""
_COLLAR_LIMITS = np.deg2rad([[-7.0, 26.0], [-6.0, 17.0]])
"""Least and most lift and forward turn of the collarbones."""
_WRIST_LIMITS = np.deg2rad([[-58.0, 66.0], [-26.0, 17.0]])
"""Least and most palmar flexion and radial deviation."""


def joint_rotations(
    channels: Float[np.ndarray, "T 12"],
    breath: Float[np.ndarray, " T"],
    controls: dict[str, Float[np.ndarray, "T 9"]],
    stance: Stance,
    over: float,
) -> tuple[Float[np.ndarray, "T J 3 3"], Vectors]:
    """Local rotations of the 22 joints, and the path of the root in metres.

    Args:
        channels, breath, stance: of :class:`~a2g_jax.talker.posture.PosturePlan`.
        controls: of both arms, see :mod:`a2g_jax.talker.hand_shapes`.
        over: which hand lies over the other where they meet: +1 the left one, -1 the right one.
    """
    count = len(channels)
    channels = np.concatenate(
        [soft_clip(channels[:, :3], _SHIFT_LIMITS, 0.02), soft_clip(channels[:, 3:], _TURN_LIMITS, 0.04)], axis=1
    )
    local = np.tile(np.eye(3), (count, len(BODY_JOINTS), 1, 1))
    pelvis_turn = yaw_roll_pitch(*channels[:, 3:6].T)
    local[:, 0] = pelvis_turn
    root = np.array([0.0, PELVIS_HEIGHT, 0.0]) + channels[:, :3]
    root[:, 1] = _stand(root, pelvis_turn, stance)
    _pose_legs(local, root, pelvis_turn, stance)

    place, world = root, pelvis_turn
    for name, share in _SPINE_SHARES.items():
        place = place + rotate(world, _OFFSETS[_JOINT[name]])
        local[:, _JOINT[name]] = yaw_roll_pitch(*(share * channels[:, 6:9]).T)
        world = world @ local[:, _JOINT[name]]
    chest, chest_turn = place, world
    for name, share in _HEAD_SHARES.items():
        local[:, _JOINT[name]] = yaw_roll_pitch(*(share * channels[:, 9:12]).T)
    neck = chest + rotate(chest_turn, _OFFSETS[_JOINT["Neck"]])

    trunk = _Trunk(chest, chest_turn, root, neck, turn(1, channels[:, 3] + channels[:, 6]))
    targets = wrist_targets(controls, chest, root, neck, trunk.facing)
    # Palms and fingers have no channels of their own: where they touch something, the whole hand moves away.
    arms = {hand: _solve_arm(trunk, controls[hand], targets[hand], breath, hand) for hand in targets}
    moved = clear_hands({hand: (arm.wrist, arm.palm) for hand, arm in arms.items()}, root, neck, trunk.facing, over)
    for hand, change in moved.items():
        arm = _solve_arm(trunk, controls[hand], targets[hand] + change, breath, hand)
        for name, rotation in arm.local.items():
            local[:, _JOINT[name]] = rotation
    return local, root


def _ankle(stance: Stance, side: float) -> Float[np.ndarray, " 3"]:
    return np.array([side * stance.lateral, ANKLE_HEIGHT, 0.5 * side * stance.stagger])


def _stand(root: Vectors, pelvis_turn: Rotations, stance: Stance) -> Float[np.ndarray, " T"]:
    """Pelvis height: as planned, but never higher than the straighter leg allows."""
    height = root[:, 1]
    for side, name in ((1.0, "L_Hip"), (-1.0, "R_Hip")):
        hip = rotate(pelvis_turn, _OFFSETS[_JOINT[name]])
        away = _ankle(stance, side) - root - hip
        limit = np.sqrt((0.995 * (THIGH + SHIN)) ** 2 - away[:, 0] ** 2 - away[:, 2] ** 2)
        limit = limit + ANKLE_HEIGHT - hip[:, 1]
        height = limit - softplus(limit - height, 0.006)
    return height


def _pose_legs(local: Float[np.ndarray, "T J 3 3"], root: Vectors, pelvis_turn: Rotations, stance: Stance) -> None:
    for side, letter in ((1.0, "L"), (-1.0, "R")):
        hip = root + rotate(pelvis_turn, _OFFSETS[_JOINT[f"{letter}_Hip"]])
        foot = turn(1, np.array([side * stance.toe_out[0 if side > 0 else 1]]))
        forward = np.broadcast_to(foot[0, :, 2], hip.shape)
        ankle = np.broadcast_to(_ankle(stance, side), hip.shape)
        thigh, knee = leg_rotations(hip, ankle, forward, (THIGH, SHIN))
        local[:, _JOINT[f"{letter}_Hip"]] = np.swapaxes(pelvis_turn, 1, 2) @ thigh
        local[:, _JOINT[f"{letter}_Knee"]] = knee
        local[:, _JOINT[f"{letter}_Ankle"]] = np.swapaxes(thigh @ knee, 1, 2) @ foot


@dataclass(frozen=True, eq=False)
class _Trunk:
    chest: Vectors
    chest_turn: Rotations
    pelvis: Vectors
    neck: Vectors
    facing: Rotations
    """Upright axes that turn with the chest."""


@dataclass(frozen=True, eq=False)
class _ArmPose:
    local: dict[str, Rotations]
    wrist: Vectors
    palm: Rotations
    """The hand's axes in the world."""


def _solve_arm(
    trunk: _Trunk, control: Float[np.ndarray, "T 9"], target: Vectors, breath: Float[np.ndarray, " T"], hand: str
) -> _ArmPose:
    side, letter = (1.0, "L") if hand == "left" else (-1.0, "R")
    # Collarbones rise with a raised hand and come forward with a reaching one.
    lift = 0.9 * softplus(control[:, 1] + 0.02, 0.06) + control[:, 7] + breath - 0.02
    forward = 0.8 * softplus(control[:, 2] - 0.30, 0.05)
    lift, forward = soft_clip(np.stack([lift, forward], axis=1), _COLLAR_LIMITS, 0.03).T
    collar = turn(2, side * lift) @ turn(1, -side * forward)
    collar_turn = trunk.chest_turn @ collar
    shoulder = trunk.chest + rotate(trunk.chest_turn, _OFFSETS[_JOINT[f"{letter}_Collar"]])
    shoulder = shoulder + rotate(collar_turn, _OFFSETS[_JOINT[f"{letter}_Shoulder"]])
    # Elbows point down and slightly out; backward where the arm itself leads that way.
    reach = rotate(np.swapaxes(trunk.facing, 1, 2), target - shoulder)
    # They follow a hand that goes far to the side: the upper arm turns outward only so far.
    elbow_out = control[:, 6] + 1.6 * softplus(control[:, 0] - 0.30, 0.04)
    pole = np.stack([side * elbow_out, np.full(len(reach), -0.9), np.zeros(len(reach))], axis=1)
    same_way = np.sum(pole * reach, axis=1) / np.sqrt(np.sum(pole**2, axis=1) * np.sum(reach**2, axis=1))
    pole[:, 2] = -0.15 - 0.35 * (1.0 + np.tanh((same_way - 0.74) / 0.2))
    angles = np.concatenate([control[:, 3:4], soft_clip(control[:, 4:6], _WRIST_LIMITS, 0.08)], axis=1)
    upper, elbow, wrist = arm_rotations(
        shoulder, target, rotate(trunk.facing, pole), (UPPER_ARM, FOREARM), side, angles
    )
    forearm = upper @ elbow
    along = np.array([side, 0.0, 0.0])
    place = shoulder + rotate(upper, UPPER_ARM * along) + rotate(forearm, FOREARM * along)
    names = [f"{letter}_{part}" for part in ("Collar", "Shoulder", "Elbow", "Wrist")]
    rotations = [collar, np.swapaxes(collar_turn, 1, 2) @ upper, elbow, wrist]
    return _ArmPose(dict(zip(names, rotations, strict=True)), place, forearm @ wrist)
