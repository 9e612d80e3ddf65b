"""Curves of named controls over a speech, as an animator writes them; importable without JAX.

``height=0.9`` is 0.9 throughout; ``energy=0.2@0,0.8@10`` is 0.2 at the start and 0.8 from second 10 on, linearly in
between. Values are quantiles of the training clips, from 0 to 1, so that they apply to any corpus and rig. A control
with names for values changes at once: ``emotion=neutral@0,anger@12.5``.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from a2g_jax.errors import InputError

#: Quantile of a control that is not requested, in models that always have one: the median of the training clips.
DEFAULT = 0.5
#: Included runs by the names of their controls, for messages.
INCLUDED = {
    "demo": ("energy", "height", "radius", "rate", "handedness", "emotion"),
    "demo-flow": ("energy", "height", "radius"),
    "demo-emotion": ("emotion",),
}
#: Names of controls that runs store among their settings, by the names that requests have.
_ALIASES = {"speed": "energy"}


class Curve(NamedTuple):
    """Requested values of one control at given seconds, constant before the first and after the last."""

    name: str
    seconds: tuple[float, ...]
    values: tuple[float, ...]
    """Quantiles, or numbers of categories."""
    jumps: bool = False
    """Whether values hold until the next second instead of being linear in between."""


class Line(NamedTuple):
    """A request as it is written, with its values still text."""

    name: str
    seconds: tuple[float, ...]
    values: tuple[str, ...]


def public_name(name: str) -> str:
    """The name that requests use for a control: ``energy`` for what older runs call ``speed``."""
    return _ALIASES.get(name, name)


def parse_line(text: str) -> Line:
    """Split ``NAME=VALUE``, or ``NAME=VALUE@SECOND,VALUE@SECOND...`` with commas or spaces.

    Raises:
        InputError: another form, seconds below 0 or not in ascending order, or a number that is no quantile.
    """
    name, equals, points = text.partition("=")
    parts = [part.partition("@") for part in points.replace(",", " ").split()]
    if not equals or not parts or (len(parts) > 1 and not all(at for _, at, _ in parts)):
        raise _refused(text, "expected NAME=VALUE such as height=0.9, or height=0.1@0,0.9@5 over seconds")
    seconds = tuple(_number(second, text) if at else 0.0 for _, at, second in parts)
    if any(after <= before for before, after in zip(seconds, seconds[1:], strict=False)):
        raise _refused(text, "expected seconds in ascending order")
    if seconds[0] < 0:
        raise _refused(text, f"expected seconds from 0 on; got {seconds[0]:g}")
    values = tuple(value for value, _, _ in parts)
    for value in values:
        if _is_number(value):
            _quantile(value, text)
    return Line(public_name(name.strip()), seconds, values)


def check_ends(texts: Sequence[str], frames: int, fps: float) -> None:
    """Refuse requests that begin after the end of a speech, whose values would hold from its start.

    Raises:
        InputError: one of them.
    """
    for text in texts:
        second = parse_line(text).seconds[-1]
        if second > 0 and second >= frames / fps:
            why = f"second {second:g} is past the end of the speech, which lasts {frames / fps:.2f} s"
            raise _refused(text, why)


def parse_curves(
    texts: Sequence[str], names: Sequence[str], categories: Mapping[str, Sequence[str]] | None = None
) -> tuple[Curve, ...]:
    """One curve for each of ``names``, in their order; of NaN for one that is not requested.

    Args:
        categories: names of the values of controls that are not quantiles.

    Raises:
        InputError: an invalid line, an unknown control or value, or a control requested twice.
    """
    known = [public_name(name) for name in names]
    curves: dict[str, Curve] = {}
    for text in texts:
        line = parse_line(text)
        if line.name not in known:
            raise _refused(text, f"the run's controls are: {', '.join(known) or 'none'}{_elsewhere(line.name)}")
        if line.name in curves:
            raise _refused(text, f"{line.name} is requested twice; give its changes as VALUE@SECOND,VALUE@SECOND")
        words = (categories or {}).get(line.name)
        read = _quantile if words is None else lambda value, text, words=words: _category(value, text, words)
        values = tuple(read(value, text) for value in line.values)
        curves[line.name] = Curve(line.name, line.seconds, values, words is not None)
    return tuple(curves.get(name, Curve(name, (0.0,), (math.nan,))) for name in known)


def parse_gains(texts: Sequence[str], names: Sequence[str]) -> tuple[float, ...]:
    """The factor of each of ``names`` from lines such as ``energy=1.5``; 1 for one that has none.

    Raises:
        InputError: another form, an unknown control, one named twice, or a factor that is not above 0.
    """
    known = [public_name(name) for name in names]
    gains: dict[str, float] = {}
    for text in texts:
        name, factor = parse_gain(text)
        if name not in known:
            raise InputError(f"--control-gain {text!r}: the run's controls are: {', '.join(known) or 'none'}.")
        if name in gains:
            raise InputError(f"--control-gain {text!r}: {name} has another one already; give each once.")
        gains[name] = factor
    return tuple(gains.get(name, 1.0) for name in known)


def parse_gain(text: str) -> tuple[str, float]:
    """Name and factor of a line such as ``energy=1.5``.

    Raises:
        InputError: another form, or a factor that is not above 0.
    """
    name, _, value = text.partition("=")
    factor = float(value) if _is_number(value) else math.nan
    if not 0 < factor < math.inf:
        raise InputError(f"--control-gain {text!r}: expected NAME=FACTOR, a number above 0, such as energy=1.5.")
    return public_name(name.strip()), factor


def from_percentiles(text: str) -> str:
    """A line of version 0.1, whose values are percentiles from 0 to 100, with quantiles; invalid lines stay."""
    name, equals, points = text.partition("=")
    parts = [part.partition("@") for part in points.split()]
    if not equals or not all(_is_number(value) for value, _, _ in parts):
        return text
    return f"{name}={' '.join(f'{float(value) / 100:g}{at}{second}' for value, at, second in parts)}"


def _elsewhere(name: str) -> str:
    """The included runs that have a control, for a message; nothing if none has."""
    runs = [repr(run) for run, names in INCLUDED.items() if name in names]
    return f"; {' and '.join(runs)} {'has' if len(runs) == 1 else 'have'} {name}" if runs else ""


def _quantile(value: str, line: str) -> float:
    number = _number(value, line)
    # Between 1 and 2 it is more likely a wish for more than the most.
    if 2 <= number <= 100:
        raise _refused(line, f"expected quantiles from 0 to 1; for the percentile {number:g} give {number / 100:g}")
    if not 0 <= number <= 1:
        raise _refused(line, "expected quantiles of the training clips, from 0 to 1, the highest of all")
    return number


def _category(value: str, line: str, words: Sequence[str]) -> float:
    if value not in words:
        raise _refused(line, f"there is no {value!r} in the run; there are: {', '.join(words)}")
    return float(list(words).index(value))


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _number(text: str, line: str) -> float:
    value = float(text) if _is_number(text) else math.nan
    if not math.isfinite(value):
        raise _refused(line, f"{text!r} is not a number")
    return value


def _refused(text: str, why: str) -> InputError:
    return InputError(f"--control {text!r}: {why}.")
