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


def read_pickle(path: str | os.PathLike[str], limits: Limits | None = None) -> Any:
    """The value in a pickle file, decoded without executing any of it.

    The value consists of None, bool, int, float, complex, str, bytes, bytearray, list, tuple, dict, set, frozenset,
    and NumPy arrays, scalars and types of plain numbers and text; ``OrderedDict`` becomes dict. The byte strings of
    Python 2 become str where they are ASCII, else bytes.

    Raises:
        InputError: no such file, damaged, beyond the limits, or any other content (with its name and place).
    """
    path = check_readable(path, "a pickle file")
    budget = Budget(str(path), limits or Limits())
    try:
        budget.charge(path.stat().st_size, 0)
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the disk.") from None
    return decode_with(data, budget)


def decode_pickle(data: bytes, name: str, limits: Limits | None = None) -> Any:
    """The value of pickled bytes, decoded as by :func:`read_pickle`; errors call the data ``name``."""
    return decode_with(data, Budget(name, limits or Limits()))


def decode_with(data: bytes, budget: Budget) -> Any:
    """The value of pickled bytes, charged to a budget."""
    machine = PickleMachine(data, budget)
    try:
        value = machine.run()
    except InputError:
        raise
    except (ValueError, OverflowError, MemoryError) as error:  # UnicodeError is a ValueError
        raise budget.damage(machine.at, type(error).__name__) from None
    check_value(value, budget, machine.at)
    return value
