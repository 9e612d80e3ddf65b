"""Full-body motion for a speech plan: one draw of all that the audio leaves open."""

import numpy as np
from jaxtyping import Float

from a2g_jax.data.talker import body
from a2g_jax.data.talker.arms import plan_arms
from a2g_jax.data.talker.body import TALKER_HANDS_SKELETON, TALKER_SKELETON
from a2g_jax.data.talker.fingers import finger_rotations, plan_fingers
from a2g_jax.data.talker.gesture_plan import draw_gestures
from a2g_jax.data.talker.ik import Rotations, Vectors, arm_rotations, leg_rotations, rotate, turn, yaw_roll_pitch
from a2g_jax.data.talker.paths import draw_waves, softplus
from a2g_jax.data.talker.posture import Stance, plan_posture
from a2g_jax.data.talker.reach import wrist_targets
from a2g_jax.data.talker.speech import SpeechPlan
from a2g_jax.data.talker.styles import gesture_style
from a2g_jax.data.talker.truth import GestureTruth
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import BODY_JOINTS

_JOINT = {name: index for index, name in enumerate(BODY_JOINTS)}
_OFFSETS = np.asarray(TALKER_SKELETON.offsets, dtype=np.float64)
_SPINE_SHARES = {"Spine1": 0.30, "Spine2": 0.35, "Spine3": 0.35}
_HEAD_SHARES = {"Neck": 0.45, "Head": 0.55}
_IDLE = np.array([0.015, 0.015, 0.012, 0.09, 0.07, 0.05, 0.06])
"""Standard deviation of an arm's own wandering, by control channel (metres, radians), where its ``life`` is 1."""
_HAND_LAG = 0.035
"""Relaxed hands follow their wrists by this much, seconds."""


def gesticulate(
    plan: SpeechPlan, rng: np.random.Generator, fps: float = 30.0, fingers: bool = False
) -> tuple[Motion, GestureTruth]:
    """Draw a motion for a speech plan.

    When strokes and nods happen and how large they are follows from the plan; hands, families, places, holds, rest
    pose and posture are drawn from ``rng``, and so is all that is continuous. The same generator state gives the same
    motion at any frame rate: paths are functions of time, sampled at ``k / fps``.

    Args:
        plan: what is said.
        rng: source of every hidden choice; advanced.
        fps: frames per second.
        fingers: with finger joints; the body's joints and what was drawn are the same with and without.

    Returns:
        Motion of ``round(plan.seconds * fps)`` frames (float32) on :data:`TALKER_SKELETON`, or
        :data:`TALKER_HANDS_SKELETON` with ``fingers``, and what was drawn.

    Raises:
        InputError: for a speaker or emotion without a gesture style.
    """
    style = gesture_style(plan.speaker, plan.emotion)
    draws = draw_gestures(plan, style, rng)
    tracks, phases = plan_arms(plan, draws, style, rng)
    posture = plan_posture(plan, draws, style, rng)
    idle = {hand: draw_waves(rng, _IDLE, 0.18, 1.3) for hand in ("left", "right")}
    # A stream of their own, seeded whether they are wanted or not: the body is the same with and without them.
    finger_rng = np.random.default_rng(rng.integers(2**63))

    times = np.arange(round(plan.seconds * fps)) / fps
    lag = _HAND_LAG * (1.0 - 0.8 * min(style.tension, 1.0))
    controls = {}
    for hand, track in tracks.items():
        values = track.sample(times)
        values[:, 3:6] = track.sample(times - lag)[:, 3:6]
        values[:, :7] += values[:, 8:] * idle[hand].sample(times)
        controls[hand] = values
    channels, breath = posture.sample(times)
    rotations, root = _pose(channels, breath, controls, posture.stance)
    truth = GestureTruth(
        strokes=draws.strokes,
        phases=phases,
        rest_pose=draws.rest_pose,
        log_probability=draws.log_probability(style),
        posture=draws.posture,
        units=draws.units,
    )
    skeleton = TALKER_SKELETON
    if fingers:
        skeleton = TALKER_HANDS_SKELETON
        hands = []
        for hand, side in (("left", 1.0), ("right", -1.0)):
            shapes = plan_fingers(hand, draws, phases, style, finger_rng)
            hands.append(finger_rotations(shapes, times, side, style, finger_rng))
        rotations = np.concatenate([rotations, *hands], axis=1)
    motion = Motion(rotations.astype(np.float32), root.astype(np.float32), skeleton, float(fps))
    return motion, truth


def _pose(
    channels: Float[np.ndarray, "T 12"],
    breath: Float[np.ndarray, " T"],
    controls: dict[str, Float[np.ndarray, "T 9"]],
    stance: Stance,
) -> tuple[Float[np.ndarray, "T J 3 3"], Vectors]:
    """Local rotations and root path from posture channels and arm controls."""
    count = len(channels)
    local = np.tile(np.eye(3), (count, len(BODY_JOINTS), 1, 1))
    pelvis_turn = yaw_roll_pitch(*channels[:, 3:6].T)
    local[:, 0] = pelvis_turn
    root = np.array([0.0, body.PELVIS_HEIGHT, 0.0]) + channels[:, :3]
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

    yaw = channels[:, 3] + channels[:, 6]
    targets = wrist_targets(controls, chest, root, neck, yaw)
    for hand, side in (("left", 1.0), ("right", -1.0)):
        _pose_arm(local, chest, chest_turn, turn(1, yaw), controls[hand], targets[hand], breath, side)
    return local, root


def _ankle(stance: Stance, side: float) -> Float[np.ndarray, " 3"]:
    return np.array([side * stance.lateral, body.ANKLE_HEIGHT, 0.5 * side * stance.stagger])


def _stand(root: Vectors, pelvis_turn: Rotations, stance: Stance) -> Float[np.ndarray, " T"]:
    """Pelvis height: as asked, but never higher than the straighter leg allows."""
    height = root[:, 1]
    for side, name in ((1.0, "L_Hip"), (-1.0, "R_Hip")):
        hip = rotate(pelvis_turn, _OFFSETS[_JOINT[name]])
        away = _ankle(stance, side) - root - hip
        limit = np.sqrt((0.995 * (body.THIGH + body.SHIN)) ** 2 - away[:, 0] ** 2 - away[:, 2] ** 2)
        limit = limit + body.ANKLE_HEIGHT - hip[:, 1]
        height = limit - softplus(limit - height, 0.003)
    return height


def _pose_legs(local: Float[np.ndarray, "T J 3 3"], root: Vectors, pelvis_turn: Rotations, stance: Stance) -> None:
    for side, letter in ((1.0, "L"), (-1.0, "R")):
        hip = root + rotate(pelvis_turn, _OFFSETS[_JOINT[f"{letter}_Hip"]])
        foot = turn(1, np.array([side * stance.toe_out[0 if side > 0 else 1]]))
        forward = np.broadcast_to(foot[0, :, 2], hip.shape)
        ankle = np.broadcast_to(_ankle(stance, side), hip.shape)
        thigh, knee = leg_rotations(hip, ankle, forward, (body.THIGH, body.SHIN))
        local[:, _JOINT[f"{letter}_Hip"]] = np.swapaxes(pelvis_turn, 1, 2) @ thigh
        local[:, _JOINT[f"{letter}_Knee"]] = knee
        local[:, _JOINT[f"{letter}_Ankle"]] = np.swapaxes(thigh @ knee, 1, 2) @ foot


def _pose_arm(
    local: Float[np.ndarray, "T J 3 3"],
    chest: Vectors,
    chest_turn: Rotations,
    facing: Rotations,
    control: Float[np.ndarray, "T 9"],
    target: Vectors,
    breath: Float[np.ndarray, " T"],
    side: float,
) -> None:
    letter = "L" if side > 0 else "R"
    collar, joint = _JOINT[f"{letter}_Collar"], _JOINT[f"{letter}_Shoulder"]
    # Collarbones rise with a raised hand and come forward with a reaching one.
    lift = 0.9 * softplus(control[:, 1] + 0.02, 0.06) + control[:, 7] + breath - 0.02
    forward = 0.8 * softplus(control[:, 2] - 0.30, 0.05)
    local[:, collar] = turn(2, side * lift) @ turn(1, -side * forward)
    collar_turn = chest_turn @ local[:, collar]
    shoulder = chest + rotate(chest_turn, _OFFSETS[collar]) + rotate(collar_turn, _OFFSETS[joint])
    # Elbows point down and slightly out; behind the body only where the arm hangs.
    reach = rotate(np.swapaxes(facing, 1, 2), target - shoulder)
    hang = 0.5 * (1.0 + np.tanh((-reach[:, 1] / (np.linalg.norm(reach, axis=1)) - 0.78) / 0.16))
    pole = np.stack([side * control[:, 6], np.full(len(hang), -0.9), -0.12 - 0.55 * hang], axis=1)
    upper, elbow, wrist = arm_rotations(
        shoulder, target, rotate(facing, pole), (body.UPPER_ARM, body.FOREARM), side, control[:, 3:6]
    )
    local[:, joint] = np.swapaxes(collar_turn, 1, 2) @ upper
    local[:, _JOINT[f"{letter}_Elbow"]] = elbow
    local[:, _JOINT[f"{letter}_Wrist"]] = wrist
