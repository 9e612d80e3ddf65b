"""Style controls: conditioning on the height, speed and radius of the hands.

As in StyleGestures (Alexanderson et al. 2020), averages of these join the audio in the conditioning of a frame. In
training they are those of the clip itself. In generation they are requested as quantiles of the training clips:
:mod:`a2g_jax.models.control_curves`; ``speed`` is requested as ``energy``, the name that it has for every model.
"""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from a2g_jax.errors import InputError
from a2g_jax.features.style_controls import hand_height, hand_radius, hand_speed
from a2g_jax.geometry.joint_names import named_joints
from a2g_jax.models.base import Data
from a2g_jax.models.control_curves import DEFAULT
from a2g_jax.models.control_requests import requested_values

#: The controls, and the value that networks take as 1 (m, m/s): about the standard deviation over clips of speech.
SCALES = {"height": 0.1, "left_height": 0.1, "right_height": 0.1, "speed": 0.1, "radius": 0.05}


def check_controls(names: Sequence[str], data: Data) -> None:
    """Refuse poses on which the controls cannot be measured.

    Raises:
        InputError: poses without a skeleton, or one whose wrists are not found.
    """
    if not names:
        return
    if not data.space.has_rotations:
        raise InputError(
            f"--style-controls: hands are measured on a skeleton, and the corpus holds {data.space.noun};"
            " prepare it with --pose 6d, exponential or euler, or leave the controls out."
        )
    lacking = {"L_Wrist", "R_Wrist"} - set(named_joints(data.space.body.names))
    if lacking:
        raise InputError(
            f"--style-controls: the skeleton has no joint named {', '.join(sorted(lacking))};"
            " prepare the corpus with --joints body, or leave the controls out."
        )


def measure(names: Sequence[str], data: Data, pose: Float[Array, "B T R D"]) -> Float[Array, "B T K"]:
    """The controls of every frame of clips, metres and m/s.

    Windows are cut at the ends of a clip. The root joint is at the origin, so walking does not count as hand speed.

    Args:
        pose: rotations of a skeleton.
    """
    if not names:
        return jnp.zeros((*pose.shape[:2], 0), pose.dtype)
    joints = named_joints(data.space.skeleton.names)
    rotations: Any = data.space.rotations(pose)
    places = data.space.joint_positions(rotations)
    left, right = joints["L_Wrist"], joints["R_Wrist"]

    def clip(places: Float[Array, "T J 3"]) -> Float[Array, "T K"]:
        root, hands = places[:, 0], places[:, np.array([left, right])]
        of = {
            "height": lambda: hand_height(hands, root, data.fps),
            "left_height": lambda: hand_height(hands[:, :1], root, data.fps),
            "right_height": lambda: hand_height(hands[:, 1:], root, data.fps),
            "speed": lambda: hand_speed(hands, data.fps),
            "radius": lambda: hand_radius(hands, root, data.fps),
        }
        return jnp.stack([of[name]() for name in names], axis=-1)

    return jax.vmap(clip)(places)


def scaled(names: Sequence[str], controls: Float[Array, "*S K"]) -> Float[Array, "*S K"]:
    """Controls divided by their scales, as networks take them."""
    scales = jnp.asarray([SCALES[name] for name in names], controls.dtype)
    return controls / scales.reshape((1,) * (controls.ndim - 1) + (len(names),))


def requested(
    quantiles: Float[Array, "T K"], training: Float[Array, "N K"], gains: Sequence[float] | None = None
) -> Float[Array, "T K"]:
    """Control values of requested quantiles, metres and m/s; the median of those that are not a number.

    Args:
        training: mean controls of every training clip.
        gains: factors on the distance from the median; 1 if None.
    """
    given = jnp.where(jnp.isnan(quantiles), DEFAULT, quantiles)
    return requested_values(given, training, gains or (1.0,) * given.shape[1])
