"""Style controls: what a frame is told of how the hands shall move, and what an animator asks for.

As in StyleGestures (Alexanderson et al. 2020), average height, speed and radius of the hands join the audio in what is
known of a frame. In training they are those of the clip itself. In generation they are asked for as percentiles of the
training clips, which every corpus and rig has, and may change over the speech: ``height=90``, or
``speed=20@0 80@10`` for 20 at the start and 80 from second 10 on, linearly in between.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from a2g_jax.errors import InputError
from a2g_jax.features.style_controls import hand_height, hand_radius, hand_speed
from a2g_jax.geometry.joint_names import named_joints
from a2g_jax.geometry.kinematics import joint_positions
from a2g_jax.geometry.rotation import matrix_from_6d, matrix_from_axis_angle
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models.base import Data

#: The controls, and what networks see as 1 (m, m/s): about the standard deviation over clips of talk.
SCALES = {"height": 0.1, "left_height": 0.1, "right_height": 0.1, "speed": 0.1, "radius": 0.05}
#: What is asked for where nothing is said: the median of the training clips.
DEFAULT = 50.0


class Curve(NamedTuple):
    """What is asked of one control: percentiles at seconds, linear between them and held beyond."""

    name: str
    seconds: tuple[float, ...]
    percentiles: tuple[float, ...]


def parse_curve(text: str) -> Curve:
    """A curve from its line: ``NAME=PERCENTILE``, or ``NAME=PERCENTILE@SECOND PERCENTILE@SECOND ...``.

    Raises:
        InputError: anything else, percentiles outside of 0 to 100, or seconds that do not rise.
    """
    name, equals, points = text.partition("=")
    parts = [part.partition("@") for part in points.split()]
    if not equals or not parts or (len(parts) > 1 and not all(at for _, at, _ in parts)):
        raise _refused(text, "expected NAME=PERCENTILE such as height=90, or 'height=10@0 90@5' over seconds")
    percentiles = tuple(_number(value, text) for value, _, _ in parts)
    seconds = tuple(_number(second, text) if at else 0.0 for _, at, second in parts)
    if not all(0 <= percentile <= 100 for percentile in percentiles):
        raise _refused(text, "expected percentiles of the training clips, from 0 to 100")
    if any(after <= before for before, after in zip(seconds, seconds[1:], strict=False)):
        raise _refused(text, "expected seconds that rise")
    return Curve(name.strip(), seconds, percentiles)


def parse_curves(texts: Sequence[str], names: Sequence[str]) -> tuple[Curve, ...]:
    """One curve for each of ``names``, in their order.

    Raises:
        InputError: a line that is no curve, of a control that the model does not have, or of one twice.
    """
    curves: dict[str, Curve] = {}
    for text in texts:
        curve = parse_curve(text)
        if curve.name not in names:
            raise _refused(text, f"the run's style controls are: {', '.join(names) or 'none'}")
        if curve.name in curves:
            raise _refused(text, f"{curve.name} is asked for twice; give its changes as 'VALUE@SECOND VALUE@SECOND'")
        curves[curve.name] = curve
    return tuple(curves.get(name, Curve(name, (0.0,), (DEFAULT,))) for name in names)


def check_controls(names: Sequence[str], data: Data) -> None:
    """Refuse poses that tell no such controls.

    Raises:
        InputError: poses without a skeleton, or one whose wrists are not found.
    """
    if not names:
        return
    if not isinstance(data.body, Skeleton):
        raise InputError(
            f"--style-controls: hands are measured on a skeleton, and the corpus holds {data.representation};"
            " prepare it with --pose 6d or --pose exponential, or leave the controls out."
        )
    lacking = {"L_Wrist", "R_Wrist"} - set(named_joints(data.body.names))
    if lacking:
        raise InputError(
            f"--style-controls: the skeleton has no joint that is named as {', '.join(sorted(lacking))};"
            " prepare the corpus with --joints body, or leave the controls out."
        )


def measure(names: Sequence[str], data: Data, pose: Float[Array, "B T R D"]) -> Float[Array, "B T K"]:
    """The controls of every frame of clips, metres and m/s.

    Windows are cut at the ends of a clip. The root joint lies at the origin, so that walking is no speed of the hands.

    Args:
        pose: as the corpus writes them down, on a skeleton.
    """
    if not names:
        return jnp.zeros((*pose.shape[:2], 0), pose.dtype)
    skeleton, joints = data.skeleton, named_joints(data.skeleton.names)
    rotations = matrix_from_6d(pose) if data.representation == "6d" else matrix_from_axis_angle(pose)
    places = joint_positions(rotations, np.asarray(skeleton.offsets, np.float32), skeleton.parents)
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
    """Controls as networks see them."""
    scales = jnp.asarray([SCALES[name] for name in names], controls.dtype)
    return controls / scales.reshape((1,) * (controls.ndim - 1) + (len(names),))


def asked(
    curves: Sequence[Curve], training: Float[Array, "N K"], start: Int[Array, ""], frames: int, fps: float
) -> Float[Array, "T K"]:
    """Controls of the frames from ``start``, metres and m/s: the same at a frame for any cutting into windows.

    Args:
        curves: one for each control.
        training: mean controls of every training clip.
    """
    seconds = (start + jnp.arange(frames)) / fps
    columns = []
    for number, curve in enumerate(curves):
        percentile = jnp.interp(seconds, jnp.asarray(curve.seconds), jnp.asarray(curve.percentiles))
        columns.append(jnp.percentile(training[:, number], percentile))
    return jnp.stack(columns, axis=-1)


def _number(text: str, line: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise _refused(line, f"{text!r} is no number")
    return value


def _refused(text: str, why: str) -> InputError:
    return InputError(f"--control {text!r}: {why}.")
