"""Edits of latent codes in bands of their discrete cosine transform (extended paper, Sec. 6.3), as a small language.

An edit is a line such as ``specific keep 10``: the code (``shared`` or ``specific``), an action, and bands.

- ``keep N``: the lowest N bands stay, all others become zero; ``keep 0`` clears the code.
- ``zero A:B``: bands A to B - 1 become zero.
- ``scale A:B FACTOR``: bands A to B - 1 are multiplied.
- ``sample A:B NUMBER``: bands A to B - 1 are taken from an independent draw of that number.
- ``swap A:B``: bands A to B - 1 are taken from another code; from Python only, see :func:`apply_edits`.

A band is half a period in ``points`` frames: with 128 points at 30 frames a second, band k is at 0.117 k Hz. Band 0 is
the code's mean over these frames.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from a2g_jax.errors import InputError
from a2g_jax.features.dct import block_dct, block_idct
from a2g_jax.models.audio2gestures.edit_presets import EDIT_PRESETS

CODES = ("shared", "specific")


class Edit(NamedTuple):
    """An edit of the DCT bands of a code."""

    code: str
    """``"shared"`` or ``"specific"``."""
    action: str
    """``"zero"``, ``"scale"``, ``"sample"`` or ``"swap"``; ``keep N`` is ``zero N:``."""
    first: int
    stop: int
    """Bands from ``first`` to ``stop - 1``."""
    value: float = 0.0
    """The factor of ``scale``, the number of ``sample``."""


def parse_edit(text: str, points: int) -> Edit:
    """Parse the line of an edit.

    Raises:
        InputError: not of the forms above, or bands beyond ``points``.
    """
    words = text.split()
    if len(words) < 3 or words[0] not in CODES:
        names = ", ".join(EDIT_PRESETS)
        raise _refused(text, f"it begins with 'shared' or 'specific', an action and bands, or is one of: {names}")
    code, action, bands, *values = words
    if action == "keep" and not values:
        count = _whole(bands, text)
        if count > points:
            raise _refused(text, f"there are {points} bands")
        return Edit(code, "zero", count, points)
    if action not in ("zero", "scale", "sample", "swap"):
        raise _refused(text, "the actions are keep, zero, scale, sample and swap")
    if len(values) != (action in ("scale", "sample")):
        raise _refused(
            text, f"'{action}' takes {'a number after the bands' if not values else 'no number after the bands'}"
        )
    low, colon, high = bands.partition(":")
    if not colon:
        raise _refused(text, "bands are written first:stop, such as 0:10")
    first, stop = _whole(low or "0", text), _whole(high or str(points), text)
    if not first < stop <= points:
        raise _refused(text, f"bands go from 0 to {points}, the second number above the first")
    if action == "sample":
        return Edit(code, action, first, stop, _whole(values[0], text))
    try:
        value = float(values[0]) if values else 0.0
    except ValueError:
        raise _refused(text, f"{values[0]!r} is not a number") from None
    if not abs(value) < float("inf"):
        raise _refused(text, "the factor must be finite")
    return Edit(code, action, first, stop, value)


def apply_edits(
    code: Float[Array, "*batch T C"],
    edits: Sequence[Edit],
    points: int,
    other: Callable[[Edit], Float[Array, "*batch T C"]] | None = None,
) -> Float[Array, "*batch T C"]:
    """A code in time with its bands edited, in the order of the edits.

    Args:
        edits: of this code.
        points: frames of a block; T is a multiple of it.
        other: the code that ``sample`` and ``swap`` take their bands from, in time.

    Raises:
        ValueError: ``other`` is needed and was not given.
    """
    if not edits:
        return code
    bands = block_dct(code, points)
    number = jnp.arange(code.shape[-2]) % points
    for edit in edits:
        inside = ((number >= edit.first) & (number < edit.stop))[:, None]
        inside = inside.reshape((1,) * (code.ndim - 2) + inside.shape)
        if edit.action in ("sample", "swap"):
            if other is None:
                raise ValueError(f"'{edit.action}' takes bands from another code; give one")
            new = block_dct(other(edit), points)
        else:
            new = bands * edit.value
        bands = jnp.where(inside, new, bands)
    return block_idct(bands, points)


def _whole(text: str, where: str) -> int:
    if not text.isdecimal():
        raise _refused(where, f"{text!r} is not a whole number")
    return int(text)


def _refused(text: str, why: str) -> InputError:
    return InputError(f"edit {text!r}: {why}; for example 'specific keep 10' or 'shared scale 50:128 0.5'.")
