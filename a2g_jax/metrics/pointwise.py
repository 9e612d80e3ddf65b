"""Metrics that compare a motion with a target frame by frame and joint by joint.

Positions are (..., T, J, D) with D of 2 or 3, in any unit: results are in it. A NaN anywhere in a motion makes its
value NaN; nothing is left out silently. Cut off the seed frames of a model before scoring.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.geometry.body_joints import find_body_joints, path_up
from a2g_jax.geometry.rotation import geodesic_distance
from a2g_jax.geometry.skeleton import BODY_JOINTS, Skeleton

Positions = Float[Array | np.ndarray, "*batch T J D"]
Weights = Float[Array | np.ndarray, " J"]
Rotations = Float[Array | np.ndarray, "*batch T J 3 3"]

#: Distance of the wrists of Audio2Gestures' skeleton in T-pose, metres (extended paper, Eq. 23).
REFERENCE_WRIST_TO_WRIST = 1.2064
#: A rest pose is a T-pose if its wrists are at least this share of the stretched arms' reach apart.
_T_POSE = 0.97


def position_l1(predicted: Positions, target: Positions, weights: Weights | None = None) -> Float[Array, "*batch"]:
    """Mean over frames and joints of the L1 norm of a joint's error (Audio2Gestures, extended, Eq. 22).

    Args:
        weights: of the joints in the mean; their sum is 1. Without them all joints count alike.
    """
    return _mean(jnp.sum(jnp.abs(predicted - target), axis=-1), weights)


def _mean(values: Float[Array, "*batch T J"], weights: Weights | None) -> Float[Array, "*batch"]:
    """Mean over frames and, weighted, over joints."""
    return jnp.mean(values, axis=(-2, -1)) if weights is None else jnp.mean(values @ jnp.asarray(weights), axis=-1)


def position_l1_star(
    predicted: Positions, target: Positions, wrist_to_wrist: float, reference: float = REFERENCE_WRIST_TO_WRIST
) -> Float[Array, "*batch"]:
    """:func:`position_l1` scaled to a skeleton of the reference size (Eq. 23).

    Args:
        wrist_to_wrist: distance of the wrists in T-pose, in the unit of ``reference``.
        reference: the same of the reference skeleton.
    """
    return position_l1(predicted, target) * (reference / wrist_to_wrist)


def wrist_to_wrist(skeleton: Skeleton) -> float | None:
    """Distance of the wrists in T-pose, metres; None where wrists are not found.

    That of the rest pose if it is a T-pose. For other rest poses, the arms are stretched along the line through the
    shoulders, whose distance, and so the collars, stay as they are at rest.
    """
    body = find_body_joints(skeleton)
    if body is None:
        return None
    places = np.asarray(skeleton.offsets, np.float64).copy()
    lengths = np.linalg.norm(places, axis=-1)
    for joint, parent in enumerate(skeleton.parents):
        places[joint] = places[joint] + places[parent] if parent >= 0 else 0.0
    shoulders, wrists = ([body[BODY_JOINTS.index(f"{side}_{name}")] for side in "LR"] for name in ("Shoulder", "Wrist"))
    reach = float(np.linalg.norm(places[shoulders[0]] - places[shoulders[1]]))
    for shoulder, wrist in zip(shoulders, wrists, strict=True):
        reach += float(lengths[[wrist, *(path_up(skeleton.parents, wrist, shoulder) or ())]].sum())
    rest = float(np.linalg.norm(places[wrists[0]] - places[wrists[1]]))
    return rest if rest >= _T_POSE * reach else reach


def position_l2(predicted: Positions, target: Positions) -> Float[Array, "*batch"]:
    """Mean over frames and joints of a joint's distance from its target (EmotionGesture's L2)."""
    return jnp.mean(jnp.linalg.norm(predicted - target, axis=-1), axis=(-2, -1))


def speed_l1(
    predicted: Positions, target: Positions, fps: float = 1.0, weights: Weights | None = None
) -> Float[Array, "*batch"]:
    """:func:`position_l1` of velocities ``(p[t+1] - p[t]) fps``; with ``fps`` 1 in the paper's units per frame."""
    return fps * position_l1(jnp.diff(predicted, axis=-3), jnp.diff(target, axis=-3), weights)


def acceleration_l1(
    predicted: Positions, target: Positions, fps: float = 1.0, weights: Weights | None = None
) -> Float[Array, "*batch"]:
    """:func:`position_l1` of second differences times ``fps**2``."""
    return fps**2 * position_l1(jnp.diff(predicted, n=2, axis=-3), jnp.diff(target, n=2, axis=-3), weights)


def pck(
    predicted: Positions, target: Positions, threshold: float | Float[Array, ""], weights: Weights | None = None
) -> Float[Array, "*batch"]:
    """Percentage of correct keypoints, as a share: joints nearer than ``threshold`` to their targets (Eq. 24).

    Args:
        threshold: in the unit of the positions: 0.2 in Audio2Gestures, 0.1 of TED's units in the flow paper's code.
        weights: as in :func:`position_l1`.
    """
    distance = jnp.linalg.norm(predicted - target, axis=-1)
    share = _mean((distance < threshold).astype(predicted.dtype), weights)
    # A comparison with NaN is false, which would count a broken motion as merely wrong.
    return jnp.where(jnp.any(jnp.isnan(distance), axis=(-2, -1)), jnp.nan, share)


def correct_within(target: Float[np.ndarray, "T P _"], metres: bool) -> float:
    """Threshold of :func:`pck`: 0.2 m (Audio2Gestures), or without metres a fifth of the longer side of the box around
    the mean pose (after Speech2Gesture's alpha of 0.2)."""
    if metres:
        return 0.2
    mean = target.mean(axis=0)
    return float(0.2 * np.max(mean.max(axis=0) - mean.min(axis=0)))


def joint_rotation_error(predicted: Rotations, target: Rotations) -> Float[Array, "*batch"]:
    """MPJRE: mean over frames and joints of the geodesic angle between rotations, degrees (EmotionGesture)."""
    return jnp.rad2deg(jnp.mean(geodesic_distance(jnp.asarray(predicted), jnp.asarray(target)), axis=(-2, -1)))
