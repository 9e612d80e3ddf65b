"""Pickles read as data, by an interpreter of the opcodes that can only build plain values.

``pickle.Unpickler`` with an allow-list in ``find_class`` would be less code, but it would still call allowed functions
with any arguments of the file's choice, run ``__setstate__`` on ``BUILD``, and allocate any size in C (gigabytes for a
single ``LONG_BINPUT`` of 2**31). Here no opcode calls anything of the file's choice: ``REDUCE`` selects a function of
this package by the name of the global, and that function checks its arguments.

The opcodes and their arguments are read with the tables of Python's ``pickletools`` (protocols 0 to 5).
"""

import os
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.io.files import check_readable
from a2g_jax.io.untrusted.budget import Budget, Limits
from a2g_jax.io.untrusted.pickle_machine import PickleMachine
from a2g_jax.io.untrusted.values import check_value

#: Memory that a pickle may take: this, and so much for each of its bytes.
_LEAST, _TIMES = 2**28, 100


def read_pickle(path: str | os.PathLike[str], limits: Limits | None = None) -> Any:
    """The value in a pickle file, decoded without executing any of it.

    The value consists of None, bool, int, float, complex, str, bytes, bytearray, list, tuple, dict, set, frozenset,
    and NumPy arrays, scalars and types of plain numbers and text; ``OrderedDict`` becomes dict. The byte strings of
    Python 2 become str where they are ASCII, else bytes. In place of any other object is a
    :class:`~a2g_jax.io.untrusted.refused.Refused`, which raises its error (with its name and place) when it is used.

    Raises:
        InputError: no such file, damaged, beyond the limits, or an object that is refused as a whole or as a key.
    """
    path = check_readable(path, "a pickle file")
    budget = Budget(str(path), limits or Limits())
    try:
        budget.charge(path.stat().st_size, 0)
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the disk.") from None
    return _decode(data, budget, limits)


def decode_pickle(data: bytes, name: str, limits: Limits | None = None) -> Any:
    """The value of pickled bytes, decoded as by :func:`read_pickle`; errors call the data ``name``."""
    return _decode(data, Budget(name, limits or Limits()), limits)


def _decode(data: bytes, budget: Budget, limits: Limits | None) -> Any:
    # No opcode takes 100 bytes of memory a byte of its own; arrays that are made of one value again and again do.
    if limits is None:
        budget.bound(_LEAST + _TIMES * len(data))
    return decode_with(data, budget, placeholders=True)


def decode_with(data: bytes, budget: Budget, placeholders: bool = False) -> Any:
    """The value of pickled bytes, charged to a budget.

    Args:
        placeholders: whether objects that are refused become placeholders instead of raising their error.
    """
    machine = PickleMachine(data, budget, placeholders)
    try:
        value = machine.run()
    except InputError:
        raise
    except (ValueError, OverflowError, MemoryError) as error:  # UnicodeError is a ValueError
        raise budget.damage(machine.at, type(error).__name__) from None
    check_value(value, budget, machine.at)
    return value
