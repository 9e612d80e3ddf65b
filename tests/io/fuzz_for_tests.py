"""Damage to bytes, and what a decoder spends on them."""

import sys
import tracemalloc
from collections.abc import Callable
from typing import Any

from hypothesis import strategies as st

from a2g_jax.errors import InputError

_NUMBERS = [b"\0", b"\xff", b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\x80", b"\0\0\0\0\1\0\0\0", b"\1\0\0\0"]


@st.composite
def damaged(draw: st.DrawFn, wholes: list[bytes]) -> bytes:
    """One of the payloads with bytes changed, cut, moved, repeated, or replaced by a piece of another payload."""
    data = draw(st.sampled_from(wholes))
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, max(len(data) - 1, 0)))
        length = draw(st.one_of(st.integers(1, 8), st.integers(1, max(len(data), 1))))
        match draw(st.sampled_from(["set", "set", "flip", "cut", "hole", "repeat", "splice"])):
            case "set":
                new = draw(st.one_of(st.binary(min_size=1, max_size=8), st.sampled_from(_NUMBERS)))
                data = data[:at] + new + data[at + len(new) :]
            case "flip" if data:
                data = data[:at] + bytes([data[at] ^ 1 << draw(st.integers(0, 7))]) + data[at + 1 :]
            case "cut":
                data = data[:at]
            case "hole":
                data = data[:at] + data[at + length :]
            case "repeat":
                data = data[: at + length] + data[at:]
            case "splice":
                other = draw(st.sampled_from(wholes))
                start = draw(st.integers(0, len(other) - 1))
                data = data[:at] + other[start : start + length] + data[at:]
    return data


def peak_memory(decode: Callable[..., Any], *arguments: Any) -> int:
    """Bytes that ``decode`` held at most beside its arguments, whether it ended well or with an InputError."""
    tracemalloc.start()
    try:
        decode(*arguments)
    except InputError:
        pass
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    return peak


def calls_made(decode: Callable[..., Any], *arguments: Any) -> int:
    """Calls of functions, the same on every machine unlike seconds; whether ``decode`` ends well or not."""
    calls = 0

    def count(_frame: Any, event: str, _argument: Any) -> None:
        nonlocal calls
        calls += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        decode(*arguments)
    except InputError:
        pass
    finally:
        sys.setprofile(before)
    return calls
