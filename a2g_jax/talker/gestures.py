"""Full-body motion for a speech plan: one draw of everything that the audio does not determine."""

import numpy as np

from a2g_jax.geometry.motion import Motion
from a2g_jax.talker.arms import plan_arms
from a2g_jax.talker.fingers import finger_rotations, plan_fingers
from a2g_jax.talker.gesture_plan import draw_gestures
from a2g_jax.talker.paths import draw_waves
from a2g_jax.talker.pose import joint_rotations
from a2g_jax.talker.posture import plan_posture
from a2g_jax.talker.skeleton import TALKER_HANDS_SKELETON, TALKER_SKELETON
from a2g_jax.talker.speech import SpeechPlan
from a2g_jax.talker.styles import gesture_style
from a2g_jax.talker.truth import GestureTruth

_IDLE = np.array([0.028, 0.030, 0.026, 0.11, 0.08, 0.05, 0.06])
"""Standard deviation of an arm's idle movement, by control channel (metres, radians), where its ``life`` is 1."""
_HAND_LAG = 0.035
"""Relaxed hands follow their wrists by this much, seconds."""


def gesticulate(
    plan: SpeechPlan, rng: np.random.Generator, fps: float = 30.0, fingers: bool = False
) -> tuple[Motion, GestureTruth]:
    """Draw a motion for a speech plan.

    When strokes and nods happen and how large they are follows from the plan; hands, families, places, holds, rest
    pose and posture are drawn from ``rng``, and so is everything continuous. The same generator state gives the same
    motion at any frame rate: paths are functions of time, sampled at ``k / fps``.

    Args:
        plan: the speech.
        rng: source of every hidden choice; advanced.
        fps: frames per second.
        fingers: with finger joints; the other joints and the hidden choices are the same with and without.

    Returns:
        Motion of ``round(plan.seconds * fps)`` frames (float32) on :data:`TALKER_SKELETON`, or
        :data:`TALKER_HANDS_SKELETON` with ``fingers``, and the hidden choices.

    Raises:
        InputError: for a speaker or emotion without a gesture style.
    """
    style = gesture_style(plan.speaker, plan.emotion)
    draws = draw_gestures(plan, style, rng)
    tracks, phases = plan_arms(plan, draws, style, rng)
    posture = plan_posture(plan, draws, style, rng)
    idle = {hand: draw_waves(rng, _IDLE, 0.18, 1.3) for hand in ("left", "right")}
    # Fingers have a stream of their own, seeded even without them: the other joints do not depend on them.
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
    over = -1.0 if style.right_handed >= 0.5 else 1.0
    rotations, root = joint_rotations(channels, breath, controls, posture.stance, over)
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
