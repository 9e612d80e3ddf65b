"""NumPy types and arrays from their descriptions in files."""

import math
import re

import numpy as np

from a2g_jax.io.untrusted.budget import CONVERT, Budget, clip

_TYPE = re.compile(r"[<>=|]?(?:\?|b1|[iu][1248]|f[248]|c(?:8|16)|[SU][1-9][0-9]{0,6})")
_OBJECTS = re.compile(r"\|?O8?")
_MOST_AXES = 32


def plain_type(text: object, budget: Budget, at: int, objects: bool = False) -> np.dtype:
    """The NumPy type with the description ``text`` (such as ``<f8``): numbers, booleans or text of fixed width.

    Args:
        objects: whether Python objects (``O``) are allowed.

    Raises:
        InputError: any other type, such as records, dates and long doubles, or an invalid description.
    """
    if isinstance(text, str) and len(text) < 16:
        if _TYPE.fullmatch(text):
            return np.dtype(text)
        if objects and _OBJECTS.fullmatch(text):
            return np.dtype(object)
    raise budget.refused(at, f"has an array of type {clip(text)}; expected plain numbers or text; {CONVERT}.")


def check_shape(shape: object, budget: Budget, at: int) -> tuple[int, ...]:
    """``shape`` as a tuple of valid sizes.

    Raises:
        InputError: not a tuple of whole numbers, a negative size, or too many elements.
    """
    if isinstance(shape, int) and not isinstance(shape, bool):
        shape = (shape,)
    if not isinstance(shape, tuple) or len(shape) > _MOST_AXES or any(type(size) is not int for size in shape):
        raise budget.error(at, f"has an array of shape {clip(shape)}; expected up to {_MOST_AXES} whole numbers.")
    if any(size < 0 for size in shape) or math.prod(max(size, 1) for size in shape) > budget.limits.size:
        raise budget.error(at, f"has an array of shape {clip(shape)}, which is negative or beyond the limit.")
    return shape


def plain_array(
    data: bytes | bytearray | memoryview, dtype: np.dtype, shape: tuple[int, ...], order: str, budget: Budget, at: int
) -> np.ndarray:
    """A writable array of ``shape`` from its raw bytes.

    Args:
        order: ``"C"`` or ``"F"``: whether the last or the first axis varies fastest in ``data``.

    Raises:
        InputError: too few or too many bytes, booleans other than 0 and 1, or text that is not Unicode.
    """
    expected = math.prod(shape) * dtype.itemsize
    if dtype.hasobject or len(data) != expected:
        raise budget.damage(at, f"{dtype} of shape {clip(shape)} takes {expected} bytes and has {len(data)}")
    budget.charge(expected + 128, at)
    if expected == 0:
        return np.empty(shape, dtype)
    flat = np.frombuffer(data, dtype).copy()
    if dtype.kind == "b" and flat.view(np.uint8).max() > 1:
        raise budget.damage(at, "a boolean is neither 0 nor 1")
    if dtype.kind == "U":
        points = flat.view(np.dtype(np.uint32).newbyteorder(dtype.byteorder))
        if points.max() > 0x10FFFF or np.any((points >= 0xD800) & (points <= 0xDFFF)):
            raise budget.damage(at, "a character is not Unicode")
    return flat.reshape(shape, order="F" if order == "F" else "C")


def object_array(items: list, shape: tuple[int, ...], order: str, budget: Budget, at: int) -> np.ndarray:
    """An array of Python objects.

    Raises:
        InputError: their number differs from that of the shape.
    """
    if len(items) != math.prod(shape):
        raise budget.damage(at, f"an array of shape {clip(shape)} comes with {len(items)} values")
    budget.charge(8 * len(items) + 128, at)
    budget.work(len(items), at)
    flat = np.empty(len(items), object)
    for index, item in enumerate(items):  # assigning a slice would unpack lists
        flat[index] = item
    return flat.reshape(shape, order="F" if order == "F" else "C")
