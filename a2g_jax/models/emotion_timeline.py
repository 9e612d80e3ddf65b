"""Emotions over a speech, as an animator writes them; importable without JAX.

``happiness`` throughout; ``happiness:0.7,neutral:0.3`` is a blend; ``neutral@0,anger@12.5`` changes at second 12.5, and
``neutral@0,anger:0.5,fear:0.5@12.5`` to a blend.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError

#: Seconds over which one emotion becomes the next, from the second at which that begins.
FADE = 0.5


class Point(NamedTuple):
    """Emotions from a second on."""

    second: float
    shares: tuple[tuple[str, float], ...]
    """Emotions with their shares, which sum to 1."""


def parse_timeline(text: str) -> tuple[Point, ...]:
    """The points of a line such as ``neutral@0,anger@12.5``, in their order.

    Raises:
        InputError: another form, seconds that do not ascend, or shares that cannot be.
    """
    points: list[Point] = []
    shares: dict[str, float] = {}
    parts = [part.strip() for part in text.split(",")]
    timed = any("@" in part for part in parts)
    for number, part in enumerate(parts):
        blend, at, second = part.partition("@")
        name, colon, share = (piece.strip() for piece in blend.partition(":"))
        if not name:
            raise _refused(
                text,
                "expected an emotion, a blend such as happiness:0.7,neutral:0.3, or emotions with their"
                " seconds such as neutral@0,anger@12.5",
            )
        if name in shares:
            raise _refused(text, f"{name} is named twice for one time")
        shares[name] = _number(share, text, "a share above 0") if colon else 1.0
        if shares[name] <= 0:
            raise _refused(text, f"{share} is not a share above 0")
        last = number == len(parts) - 1
        if at or (last and not timed):
            begin = _number(second, text, "a second") if at else 0.0
            if begin < 0 or (points and begin <= points[-1].second):
                raise _refused(text, "expected seconds from 0 on, in ascending order")
            total = math.fsum(shares.values())
            points.append(Point(begin, tuple((name, share / total) for name, share in shares.items())))
            shares = {}
    if shares:
        raise _refused(text, f"{next(iter(shares))} has no second; write {next(iter(shares))}@SECOND")
    return tuple(points)


def check_emotions(points: Sequence[Point], emotions: Sequence[str], text: str) -> None:
    """Refuse emotions that a run was not trained on.

    Raises:
        InputError: one of them.
    """
    for point in points:
        for name, _ in point.shares:
            if name not in emotions:
                raise _refused(text, f"the run has no emotion {name!r}; it has: {', '.join(emotions) or 'none'}")


def emotion_rows(
    points: Sequence[Point], emotions: Sequence[str], frames: int, fps: float, text: str
) -> Float[np.ndarray, "T E"]:
    """Weights of the emotions at each frame: those of the last point, with a linear change of half a second.

    Before the first point its emotions hold.

    Raises:
        InputError: a point after the end of the speech, or an emotion that a run was not trained on.
    """
    check_emotions(points, emotions, text)
    if points[-1].second >= frames / fps:
        raise _refused(
            text, f"second {points[-1].second:g} is past the end of the speech, which lasts {frames / fps:.2f} s"
        )
    begins = np.array([point.second for point in points])
    index = np.searchsorted(begins, np.arange(frames) / fps, side="right") - 1
    rows = np.array([_weights(point, emotions) for point in points])[np.maximum(index, 0)]
    return np.asarray(faded(rows, fps), np.float32)


def faded(rows: Any, fps: float) -> Any:
    """Rows whose changes from frame to frame take half a second, linearly: the mean of the frames before each.

    Before the first row is as that. Works on arrays of NumPy and JAX.

    Args:
        rows: (T, ...), a row a frame.
    """
    span, frames = FADE * fps, np.arange(len(rows))
    parts = [min(1.0, span - back) * rows[np.maximum(frames - back - 1, 0)] for back in range(math.ceil(span))]
    return sum(parts[1:], parts[0]) / span


def _weights(point: Point, emotions: Sequence[str]) -> Float[np.ndarray, " E"]:
    shares = dict(point.shares)
    return np.array([shares.get(name, 0.0) for name in emotions])


def _number(text: str, line: str, what: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise _refused(line, f"{text.strip()!r} is not {what}")
    return value


def _refused(text: str, why: str) -> InputError:
    return InputError(f"--emotion {text!r}: {why}.")
