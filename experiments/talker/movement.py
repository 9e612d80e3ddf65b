"""Simple measures of motion, the same for generated and real takes."""

from typing import NamedTuple

import numpy as np
from scipy import interpolate, ndimage, signal

from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import BODY_JOINTS

#: Paths are brought to this rate by cubic splines and smoothed by a Gaussian of :data:`SMOOTHING` before they are
#: differentiated: percentiles of derivatives depend on both, so they must be the same for all.
RATE = 60.0
SMOOTHING = 0.05
#: Hands rest while the faster wrist is slower than this (m/s) for :data:`REST_SECONDS`.
REST_SPEED, REST_SECONDS = 0.10, 0.3
#: Prominence of the faster wrist's speed peak that counts as a gesture stroke (m/s).
STROKE_PROMINENCE = 0.2


class Paths(NamedTuple):
    """Smoothed paths at :data:`RATE`, metres."""

    wrists: np.ndarray
    """(T, 2, 3) left and right, relative to the root."""
    head: np.ndarray | None
    """(T, 3) relative to the root."""
    reach: np.ndarray
    """(T, 2, 3) relative to the middle of the shoulders; x to the left, y up, z forward of them."""
    arm: float
    """Shoulder to wrist along a straight arm."""


def joint(positions: np.ndarray, name: str) -> np.ndarray:
    """(T, 3) path of one of the 22 body joints."""
    return positions[:, BODY_JOINTS.index(name)]


def body_positions(motion: Motion) -> np.ndarray:
    """(T, 22, 3) positions of the body joints of any rig that has them."""
    body = find_body_joints(motion.skeleton)
    if body is None:
        raise ValueError("Expected a rig with the 22 body joints.")
    return motion.positions()[:, list(body)]


def paths(positions: np.ndarray, fps: float) -> Paths:
    """Paths of wrists and head from (T, 22, 3) body positions."""
    shoulders = np.stack([joint(positions, "L_Shoulder"), joint(positions, "R_Shoulder")], axis=1)
    hands = np.stack([joint(positions, "L_Wrist"), joint(positions, "R_Wrist")], axis=1)
    elbow, root = joint(positions, "L_Elbow"), joint(positions, "Pelvis")
    arm = np.linalg.norm(shoulders[:, 0] - elbow, axis=1) + np.linalg.norm(elbow - hands[:, 0], axis=1)
    return from_parts(
        hands - root[:, None], joint(positions, "Head") - root, shoulders - root[:, None], fps, arm.mean()
    )


def from_parts(hands: np.ndarray, head: np.ndarray | None, shoulders: np.ndarray, fps: float, arm: float) -> Paths:
    """Paths from (T, 2, 3) hands and shoulders and a (T, 3) head relative to a root, left before right, y up."""
    hands, shoulders = smooth(hands, fps), smooth(shoulders, fps)
    across = shoulders[:, 0] - shoulders[:, 1]
    across = across * np.array([1.0, 0.0, 1.0])
    x = across / np.linalg.norm(across, axis=1, keepdims=True)
    z = np.cross(x, np.array([0.0, 1.0, 0.0]))
    away = hands - shoulders.mean(axis=1, keepdims=True)
    reach = np.stack([(away * x[:, None]).sum(-1), away[..., 1], (away * z[:, None]).sum(-1)], axis=-1)
    return Paths(hands, None if head is None else smooth(head, fps), reach, float(arm))


def smooth(path: np.ndarray, fps: float) -> np.ndarray:
    """The same path at :data:`RATE`, smoothed."""
    times = np.arange(len(path)) / fps
    grid = np.arange(int(times[-1] * RATE) + 1) / RATE
    fine = interpolate.CubicSpline(times, np.asarray(path, np.float64))(grid)
    return ndimage.gaussian_filter1d(fine, SMOOTHING * RATE, axis=0, mode="nearest")


def derivative(path: np.ndarray, order: int) -> np.ndarray:
    """Norm of the derivative of a path: m/s, m/s^2, m/s^3."""
    for _ in range(order):
        path = np.gradient(path, axis=0) * RATE
    return np.linalg.norm(path, axis=-1)


def rest(moves: Paths) -> np.ndarray:
    """(T,) whether both hands rest."""
    slow = derivative(moves.wrists, 1).max(axis=1) < REST_SPEED
    return ndimage.binary_opening(slow, np.ones(round(REST_SECONDS * RATE)))


def stroke_peaks(speed: np.ndarray) -> np.ndarray:
    """Indices of strokes in a wrist's speed at :data:`RATE`."""
    return signal.find_peaks(speed, prominence=STROKE_PROMINENCE, distance=round(0.15 * RATE))[0]


def summary(moves: Paths) -> dict[str, float]:
    """Summary figures of one take, for a table."""
    figures: dict[str, float] = {}
    for order, name in ((1, "speed"), (2, "acceleration"), (3, "jerk")):
        for part, path in (("wrist", moves.wrists), ("head", moves.head)):
            if path is not None:
                values = np.percentile(derivative(path, order), (50, 90, 95))
                figures |= {f"{part}_{name}_p{p}": float(v) for p, v in zip((50, 90, 95), values, strict=True)}
    # Left and right mirrored onto each other: range of a hand, outward to the side, up, forward.
    places = (moves.reach * np.array([[[1.0, 1, 1]], [[-1.0, 1, 1]]]).transpose(1, 0, 2)).reshape(-1, 3)
    box = np.subtract(*np.percentile(places, (95, 5), axis=0))
    for axis, length in zip(("side", "up", "forward"), box, strict=True):
        figures[f"range_{axis}_m"] = float(length)
        figures[f"range_{axis}_arms"] = float(length / moves.arm)
    speed = derivative(moves.wrists, 1)
    figures["rest_share"] = float(rest(moves).mean())
    figures["strokes_per_minute"] = 60 * RATE * len(stroke_peaks(speed.max(axis=1))) / len(speed)
    return figures


def statistics(motion: Motion) -> np.ndarray:
    """Features of a take for classifiers: derivatives, places, rest, head and torso of the 22 body joints."""
    positions = body_positions(motion)
    moves = paths(positions, motion.fps)
    speed = derivative(moves.wrists, 1)
    quantiles = [np.percentile(derivative(moves.wrists, order), (50, 90), axis=0).ravel() for order in (1, 2, 3)]
    quantiles += [np.percentile(derivative(moves.head, order), (50, 90)) for order in (1, 2, 3)]
    height = joint(positions, "Neck") - joint(positions, "Pelvis")
    nose = motion.world_rotations()[:, find_body_joints(motion.skeleton)[BODY_JOINTS.index("Head")], :, 2]
    collars = joint(positions, "L_Shoulder") + joint(positions, "R_Shoulder") - 2 * joint(positions, "Neck")
    elbows = np.concatenate(
        [joint(positions, f"{side}_Elbow") - joint(positions, f"{side}_Shoulder") for side in "LR"], axis=1
    )
    figures = summary(moves)
    parts = [
        *quantiles,
        moves.reach.mean(axis=0).ravel(),
        moves.reach.std(axis=0).ravel(),
        *(statistic for path in (height, nose, collars, elbows) for statistic in (path.mean(axis=0), path.std(axis=0))),
        [figures["rest_share"], figures["strokes_per_minute"], np.corrcoef(speed.T)[0, 1]],
        speed.mean(axis=0) / speed.mean(),
    ]
    return np.concatenate([np.atleast_1d(part) for part in parts])
