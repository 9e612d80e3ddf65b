"""Final check of a decoded value: plain, without cycles, and within the limits when written out."""

from typing import Any

import numpy as np

from a2g_jax.io.untrusted.budget import CONVERT, Budget, clip
from a2g_jax.io.untrusted.refused import Refused, check_read

#: Bytes charged for a slot in a container.
SLOT = 16
_ATOMS = frozenset({type(None), bool, int, float, complex})
_TEXTS = frozenset({str, bytes, bytearray})
_CONTAINERS = frozenset({list, tuple, dict, set, frozenset})
_KEYS = frozenset({type(None), bool, int, float, str, bytes})
_NUMPY_KEYS = (np.bool_, np.integer, np.floating, np.str_, np.bytes_)
#: The author of a file can choose tuples with equal hashes, so that each look-up compares with all others.
_MOST_TUPLE_KEYS = 4096
_LONGEST_TUPLE_KEY = 16
#: Bytes charged for the comparison with one other tuple: the memory limit also bounds the time of look-ups.
_TUPLE_KEY = 32


def check_value(value: Any, budget: Budget, at: int) -> None:
    """Refuse values that are not plain, contain themselves, nest too deeply, or are too large when written out.

    Placeholders for what was refused pass.

    A few bytes can describe a list that holds the same list twice, which holds the same list twice ...: it is small in
    memory, but traversing it takes exponential time. So each value counts once for each reference.

    Raises:
        InputError: for each of these.
    """
    # Id of a finished container -> (bytes written out, levels of nesting); None while it is being traversed.
    sizes: dict[int, tuple[int, int] | None] = {}
    if not _is_container(value):
        _add(_leaf(value, budget, at), budget, at)
        return
    sizes[id(value)] = None
    # Each frame: the container, its members still to come, bytes so far, levels so far.
    frames: list[list[Any]] = [[value, _members(value), 0, 0]]
    while frames:
        frame = frames[-1]
        for member in frame[1]:
            budget.steps -= 1
            if budget.steps < 0:
                budget.work(0, at)
            if not _is_container(member):
                frame[2] += _leaf(member, budget, at)
                continue
            key = id(member)
            if key in sizes:
                done = sizes[key]
                if done is None:
                    raise budget.error(at, f"holds a {type(member).__name__} that holds itself; {CONVERT}.")
                frame[2] += done[0] + SLOT
                frame[3] = max(frame[3], done[1])
                continue
            sizes[key] = None
            frames.append([member, _members(member), 0, 0])
            break
        else:
            frames.pop()
            size, levels = frame[2], frame[3] + 1
            _add(size, budget, at)
            sizes[id(frame[0])] = (size, levels)
            if frames:
                frames[-1][2] += size + SLOT
                frames[-1][3] = max(frames[-1][3], levels)
        if len(frames) > budget.limits.depth or (frames and frames[-1][3] >= budget.limits.depth):
            raise budget.error(at, f"is nested more than {budget.limits.depth} levels deep; expected a flatter value.")


def check_key(key: Any, owner: dict | set | list, budget: Budget, at: int) -> None:
    """Refuse keys of dictionaries and members of sets that cannot be hashed, or only slowly."""
    if type(key) is tuple:
        if len(key) > _LONGEST_TUPLE_KEY or len(owner) > _MOST_TUPLE_KEYS:
            raise budget.error(at, f"has too many or too long tuples as keys; {CONVERT}.")
        budget.charge(_TUPLE_KEY * len(owner), at)
        parts: tuple[Any, ...] = key
    else:
        parts = (key,)
    for part in parts:
        check_read(part)
        if type(part) not in _KEYS and not isinstance(part, _NUMPY_KEYS):
            raise budget.error(
                at, f"has a key of type {type(part).__name__}; expected text, numbers or tuples of them."
            )
        if type(part) is int and not -(2**63) <= part < 2**64:
            raise budget.error(at, "has a key beyond 64 bits; expected a smaller number.")


def _is_container(value: Any) -> bool:
    return type(value) in _CONTAINERS or (type(value) is np.ndarray and value.dtype.hasobject)


def _members(value: Any) -> Any:
    if type(value) is dict:
        return (part for pair in value.items() for part in pair)
    return iter(value.ravel().tolist()) if type(value) is np.ndarray else iter(value)


def _leaf(value: Any, budget: Budget, at: int) -> int:
    kind = type(value)
    if kind in _ATOMS:
        return SLOT
    if kind in _TEXTS:
        return SLOT + len(value)
    if kind is np.ndarray or isinstance(value, np.generic):
        return SLOT + int(value.nbytes)
    if isinstance(value, np.dtype | Refused):
        return SLOT
    raise budget.error(at, f"has {clip(value)} where a plain value is expected; {CONVERT}.")


def _add(size: int, budget: Budget, at: int) -> None:
    if size > budget.limits.size:
        raise budget.error(
            at,
            f"holds the same values so often that it comes to more than {budget.limits.size} bytes written out; "
            "if you trust the file, raise the limit.",
        )
