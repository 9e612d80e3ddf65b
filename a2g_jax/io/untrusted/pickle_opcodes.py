"""The opcodes of a pickle and their arguments, by the tables of Python's ``pickletools``.

``pickletools.genops`` reads every argument whatever its length, and decodes byte strings of Python 2 as ASCII. So the
loop over its table is written out here, on a source of bytes that checks each length against what is left in the data
and in the budget before anything is read.
"""

import codecs
import pickletools
from collections.abc import Callable, Iterator
from typing import Any, NoReturn

from a2g_jax.errors import InputError
from a2g_jax.io.untrusted.budget import Budget

_LONGEST_INTEGER = 1024
_LONGEST_NAME = 1024
#: Longest arguments, in bytes, of the opcodes for numbers and names.
_LONGEST = {
    "INT": _LONGEST_INTEGER,
    "LONG": 2 * _LONGEST_INTEGER,
    "LONG1": _LONGEST_INTEGER,
    "LONG4": _LONGEST_INTEGER,
    **dict.fromkeys(("FLOAT", "GLOBAL", "INST", "PERSID", "PUT", "GET"), _LONGEST_NAME),
}
#: Bytes of memory that a byte of the argument may take when decoded.
_COST = {
    **dict.fromkeys(("BINBYTES", "SHORT_BINBYTES", "BINBYTES8", "LONG", "LONG1", "LONG4"), 1),
    **dict.fromkeys(("BYTEARRAY8", "BINSTRING", "SHORT_BINSTRING", "STRING"), 2),
    **dict.fromkeys(("BINUNICODE", "SHORT_BINUNICODE", "BINUNICODE8"), 4),
    "UNICODE": 8,
}
#: What opcodes that are refused hold.
REFUSED = {
    **dict.fromkeys(("PERSID", "BINPERSID"), "a persistent id, as torch.save writes"),
    **dict.fromkeys(("EXT1", "EXT2", "EXT4"), "a registered extension"),
    **dict.fromkeys(("NEXT_BUFFER", "READONLY_BUFFER"), "a buffer kept outside the file"),
    **dict.fromkeys(("INST", "OBJ", "NEWOBJ", "NEWOBJ_EX"), "an instance of a class"),
}


class Opcodes:
    """Iterates over the names and arguments of the opcodes up to ``STOP``, which ends it.

    Attributes:
        at: byte of the current opcode.
        left: bytes after what was read.

    Raises:
        InputError: an unknown opcode, too many, or an argument that is damaged or beyond the limits.
    """

    def __init__(self, data: bytes, budget: Budget) -> None:
        self.at = 0
        self._data = data
        self._budget = budget
        self._position = 0
        self._cost, self._longest = 0, len(data)

    @property
    def left(self) -> int:
        return len(self._data) - self._position

    def __iter__(self) -> Iterator[tuple[str, Any]]:
        data, everything, budget = self._data, len(self._data), self._budget
        while True:
            self.at = self._position
            if self.at >= everything:
                self._damage("it ends without STOP")
            known = _OPCODES.get(data[self.at])
            if known is None:
                self._damage(f"no pickle has an opcode {data[self.at]:#04x}")
            self._position += 1
            name, read = known
            if name == "STOP":
                return
            budget.steps -= 1
            if budget.steps < 0:
                budget.work(0, self.at)
            yield name, None if read is None else self._argument(name, read)

    def _argument(self, name: str, read: Callable[[Any], Any]) -> Any:
        self._cost, self._longest = _COST.get(name, 0), _LONGEST.get(name, len(self._data))
        try:
            return read(self)
        except InputError:
            raise
        except ValueError:
            self._damage(f"the argument of {name} is not valid")

    def read(self, count: int) -> bytes:
        """The next ``count`` bytes, as the readers of ``pickletools`` call it."""
        if count > self.left:
            self._damage(f"{count} bytes are announced and {self.left} are left")
        if count > self._longest:
            self._damage(f"a whole number of {count} bytes")
        return self._take(self._position + count)

    def readline(self) -> bytes:
        """The next line with its line feed, as the readers of ``pickletools`` call it."""
        end = self._data.find(b"\n", self._position, self._position + self._longest + 1)
        if end < 0:
            self._damage("a line does not end")
        return self._take(end + 1)

    def _take(self, end: int) -> bytes:
        if self._cost:
            self._budget.charge(self._cost * (end - self._position), self.at)
        part = self._data[self._position : end]
        self._position = end
        return part

    def _damage(self, what: str) -> NoReturn:
        raise self._budget.damage(self.at, what)


def _byte_string(source: Opcodes) -> bytes:
    # The reader of pickletools allows ASCII only.
    quoted = source.readline()[:-1]
    if len(quoted) < 2 or quoted[:1] not in (b"'", b'"') or quoted[-1:] != quoted[:1]:
        raise ValueError("a string without quotes")
    return codecs.escape_decode(quoted[1:-1])[0]


def _module_and_name(source: Opcodes) -> tuple[str, str]:
    # The reader of pickletools joins the two by a space.
    return source.readline()[:-1].decode("utf-8"), source.readline()[:-1].decode("utf-8")


_OWN: dict[str, Callable[[Opcodes], Any]] = {
    "STRING": _byte_string,
    "GLOBAL": _module_and_name,
    "INST": _module_and_name,
}
#: Name of each opcode and the function that reads its argument.
_OPCODES = {
    ord(opcode.code): (opcode.name, _OWN.get(opcode.name) or (opcode.arg.reader if opcode.arg else None))
    for opcode in pickletools.opcodes
}
