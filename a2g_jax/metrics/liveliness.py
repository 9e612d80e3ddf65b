"""How lively a body moves: speed, jerk and rest of the hands, turns of head and hips, sway of the pelvis, sliding feet.

All are statistics of one motion, to be compared with those of recorded motion: neither more nor less is better. They
need the 22 body joints, under any names that :func:`~a2g_jax.geometry.body_joints.find_body_joints` recognises.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage

from a2g_jax.errors import InputError
from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import BODY_JOINTS
from a2g_jax.metrics.physical import foot_skate, jerk, speeds

#: A hand rests below this speed, m/s, smoothed by a Gaussian of this standard deviation, seconds.
REST_SPEED, REST_SMOOTHING = 0.05, 0.05
#: A frame is in a pause if no speech is within this time before and after it, seconds: hands come down slowly.
PAUSE_MARGIN = 0.4

_PELVIS, _HEAD = BODY_JOINTS.index("Pelvis"), BODY_JOINTS.index("Head")
_WRISTS, _ANKLES, _TOES = (
    [BODY_JOINTS.index(f"{side}_{joint}") for side in "LR"] for joint in ("Wrist", "Ankle", "Foot")
)


class Body(NamedTuple):
    """What the statistics look at: body joints of a motion in the world."""

    joints: Float[np.ndarray, "T 22 3"]
    """Positions, metres, y up."""
    pelvis: Float[np.ndarray, "T 3 3"]
    """Orientation in the world."""
    head: Float[np.ndarray, "T 3 3"]
    """Orientation relative to the pelvis."""
    fps: float

    @property
    def local(self) -> Float[np.ndarray, "T 22 3"]:
        """Positions relative to the pelvis, in the axes of the world."""
        return self.joints - self.joints[:, [_PELVIS]]

    @property
    def wrists(self) -> Float[np.ndarray, "T 2 3"]:
        """Left and right wrist relative to the pelvis."""
        return self.local[:, _WRISTS]


def body_of(motion: Motion) -> Body:
    """The body joints of a motion.

    Raises:
        InputError: joints of the body are missing.
    """
    found = find_body_joints(motion.skeleton)
    if found is None:
        raise InputError("the motion lacks joints of the body; retarget it first (a2g retarget).")
    turns = motion.world_rotations()
    pelvis, head = turns[:, found[_PELVIS]], turns[:, found[_HEAD]]
    return Body(motion.positions()[:, list(found)], pelvis, np.swapaxes(pelvis, -1, -2) @ head, motion.fps)


def wrist_speeds(body: Body) -> Float[np.ndarray, "t 2"]:
    """Speed of each wrist relative to the pelvis between frames, m/s, not smoothed; one frame fewer."""
    return np.asarray(speeds(body.wrists, body.fps))


def wrist_jerk(body: Body) -> Float[np.ndarray, "t 2"]:
    """Jerk of each wrist relative to the pelvis, m/s3 (third differences, not smoothed); three frames fewer."""
    return np.asarray(jerk(body.wrists, body.fps))


def hands_at_rest(body: Body) -> Bool[np.ndarray, " T"]:
    """Frames in which the smoothed speed of both wrists is below 5 cm/s."""
    smooth = ndimage.gaussian_filter1d(body.wrists, REST_SMOOTHING * body.fps, axis=0, mode="nearest")
    speed = np.linalg.norm(np.gradient(smooth, axis=0), axis=-1) * body.fps
    return np.all(speed < REST_SPEED, axis=-1)


def speech_pauses(
    envelope: Float[np.ndarray, " T"], fps: float
) -> tuple[Bool[np.ndarray, " T"], Bool[np.ndarray, " T"]]:
    """Frames in the middle of pauses, and frames with speech.

    There is speech where the level is above the middle between the 5th and the 95th percentile of the recording, which
    adapts to the noise of a room. In a pause there is none from 0.4 s before to 0.4 s after the frame.

    Args:
        envelope: level in dB (:func:`~a2g_jax.metrics.rhythm.speech_envelope`).
    """
    low, high = np.percentile(envelope, [5.0, 95.0])
    loud = envelope > (low + high) / 2.0
    margin = 2 * round(PAUSE_MARGIN * fps) + 1
    return ~ndimage.binary_dilation(loud, np.ones(margin, bool)), loud


def yaw_deviation(rotations: Float[np.ndarray, "T 3 3"]) -> float:
    """Standard deviation of the heading over time, degrees.

    The heading is the direction of the rotated z axis seen from above, ``atan2(x, z)``, relative to the mean direction.
    """
    forward = rotations[:, [0, 2], 2]
    mean = forward.sum(axis=0)
    turned = np.arctan2(
        forward[:, 0] * mean[1] - forward[:, 1] * mean[0], forward[:, 0] * mean[0] + forward[:, 1] * mean[1]
    )
    return float(np.degrees(turned.std()))


def pelvis_sway(body: Body) -> float:
    """Standard deviation of the pelvis's horizontal place above the middle between the ankles, cm.

    ``sqrt(var x + var z)``: the sway of a standing body; a body that walks has more.
    """
    place = (body.joints[:, _PELVIS] - body.joints[:, _ANKLES].mean(axis=1))[:, [0, 2]]
    return float(100.0 * np.sqrt(place.var(axis=0).sum()))


def feet_slide(body: Body) -> float:
    """Speed along the floor of standing ankles and toes, mm/s (:func:`~a2g_jax.metrics.physical.foot_skate`)."""
    return float(1000.0 * foot_skate(body.joints[:, _ANKLES + _TOES], body.fps)[1])


def hand_dominance(body: Body) -> float:
    """``|r - l| / (r + l)`` of the mean speeds of right and left wrist: 0 for equal hands, 1 for one that is still."""
    left, right = wrist_speeds(body).mean(axis=0)
    return float(abs(right - left) / max(right + left, 1e-9))


def hands_together(body: Body) -> float:
    """Correlation over time of the smoothed speeds of both wrists; 0 where one does not move."""
    smooth = ndimage.gaussian_filter1d(wrist_speeds(body), REST_SMOOTHING * body.fps, axis=0, mode="nearest")
    centred = smooth - smooth.mean(axis=0)
    scale = np.sqrt(np.square(centred).sum(axis=0).prod())
    return float((centred[:, 0] * centred[:, 1]).sum() / scale) if scale > 1e-9 else 0.0


def distance_between(bodies: list[Body]) -> tuple[float, float]:
    """Mean distance of joints, and of wrists, over pairs of motions for one speech, cm; relative to the pelvis.

    Raises:
        ValueError: fewer than two motions.
    """
    if len(bodies) < 2:
        raise ValueError(f"expected two motions or more; got {len(bodies)}")
    places = [body.local for body in bodies]
    pairs = [
        100.0 * np.linalg.norm(places[first] - places[second], axis=-1).mean(axis=0)
        for first in range(len(places))
        for second in range(first)
    ]
    by_joint = np.mean(pairs, axis=0)
    return float(by_joint.mean()), float(by_joint[_WRISTS].mean())
