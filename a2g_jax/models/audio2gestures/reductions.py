"""How distances become scalars: as the papers write it, or as the authors' code does.

The authors' code averages over x, y, z where the papers sum, over the 55 joints of SMPL-X where the papers speak of the
body's 22, and sums the KL divergence over time where the paper names no sum; so equal weights mean different
objectives. Both take positions in metres and rotations as matrices.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.geometry.joint_names import named_joints
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.models.audio2gestures import losses
from a2g_jax.models.audio2gestures.networks import Gaussian

Loss = Callable[[Array, Array], Float[Array, ""]]

#: Joints of SMPL-X, and those of them that the body's joints move rigidly: 15 of a hand, and both eyes and the jaw.
_SMPLX_JOINTS, _HAND_JOINTS, _FACE_JOINTS = 55, 15, 3


class Reductions(NamedTuple):
    """The losses of two motions, ``(predicted, target) -> scalar``, and the KL divergence of a code."""

    rotation: Loss
    position: Loss
    speed: Loss
    relaxed: Loss
    kl: Callable[[Gaussian], Float[Array, ""]]


def make_reductions(name: str, space: PoseSpace, threshold: float, free_nats: float) -> Reductions:
    """The reductions of a name in :class:`~a2g_jax.models.audio2gestures.config.Audio2GesturesConfig`.

    Args:
        threshold: rho of the relaxed loss, metres.
        free_nats: KL divergence of a channel without a gradient.
    """
    if name == "paper":
        return Reductions(
            losses.rotation_loss,
            losses.position_loss,
            losses.speed_loss,
            lambda predicted, target: losses.relaxed_loss(predicted, target, threshold),
            lambda code: losses.kl_loss(code, free_nats),
        )
    places = jnp.asarray(smplx_weights(space))
    axes = 3.0

    def position(predicted, target):
        return losses.position_loss(predicted, target, places) / axes

    def relaxed(predicted, target):
        distance = jnp.abs(predicted - target)
        weights = jnp.where(distance > threshold, places[None, None, :, None], 0.0)
        # Over no entry at all the authors' average is NaN.
        return jnp.sum(distance * weights) / jnp.maximum(jnp.sum(weights), 1e-9)

    def kl(code):
        terms = jnp.mean(jnp.sum(losses.kl_terms(code), axis=1), axis=0)
        return jnp.mean(jnp.maximum(terms, free_nats * code.mean.shape[1]))

    return Reductions(
        # Joints that never turn count as right.
        lambda predicted, target: losses.rotation_loss(predicted, target) * predicted.shape[2] / _SMPLX_JOINTS,
        position,
        lambda predicted, target: position(jnp.diff(predicted, axis=1), jnp.diff(target, axis=1)),
        relaxed,
        kl,
    )


def smplx_weights(space: PoseSpace) -> Float[np.ndarray, " J"]:
    """Weight of each joint in an average over the 55 joints of SMPL-X.

    Wrists also count for their fingers, the head for eyes and jaw; uniform for a body without these joints.
    """
    if not space.has_rotations:
        return np.ones(space.rows, np.float32)
    weights = np.ones(space.rows, np.float32)
    joints = named_joints(space.body.names)
    for name, riders in (("L_Wrist", _HAND_JOINTS), ("R_Wrist", _HAND_JOINTS), ("Head", _FACE_JOINTS)):
        if name in joints:
            weights[joints[name]] += riders
    return weights
