"""Curves of named controls over a speech, as an animator writes them; importable without JAX.

``height=90`` is 90 throughout; ``speed=20@0 80@10`` is 20 at the start and 80 from second 10 on, linearly in between.
Values are percentiles of the training clips, so that they apply to any corpus and rig.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from a2g_jax.errors import InputError

#: Percentile of a control that is not requested, in models that always have one: the median of the training clips.
DEFAULT = 50.0


class Curve(NamedTuple):
    """Requested percentiles of one control at given seconds, linear between them and constant beyond."""

    name: str
    seconds: tuple[float, ...]
    percentiles: tuple[float, ...]


def parse_curve(text: str) -> Curve:
    """Parse the line of a curve: ``NAME=PERCENTILE``, or ``NAME=PERCENTILE@SECOND PERCENTILE@SECOND ...``.

    Raises:
        InputError: another form, percentiles outside of 0 to 100, or seconds not in ascending order.
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
        raise _refused(text, "expected seconds in ascending order")
    return Curve(name.strip(), seconds, percentiles)


def parse_curves(texts: Sequence[str], names: Sequence[str]) -> tuple[Curve, ...]:
    """One curve for each of ``names``, in their order; of NaN for one that is not requested.

    Raises:
        InputError: an invalid line, an unknown control, or a control requested twice.
    """
    curves: dict[str, Curve] = {}
    for text in texts:
        curve = parse_curve(text)
        if curve.name not in names:
            raise _refused(text, f"the run's controls are: {', '.join(names) or 'none'}")
        if curve.name in curves:
            raise _refused(text, f"{curve.name} is requested twice; give its changes as 'VALUE@SECOND VALUE@SECOND'")
        curves[curve.name] = curve
    return tuple(curves.get(name, Curve(name, (0.0,), (math.nan,))) for name in names)


def _number(text: str, line: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise _refused(line, f"{text!r} is not a number")
    return value


def _refused(text: str, why: str) -> InputError:
    return InputError(f"--control {text!r}: {why}.")
