"""The stack machine that pickles are programs for, with the opcodes that build plain values."""

import codecs
import re
import struct
from collections.abc import Callable
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.io.untrusted.budget import CONVERT, Budget, clip
from a2g_jax.io.untrusted.pickle_objects import Unfinished, find_global, finish, reduce
from a2g_jax.io.untrusted.values import check_key

#: Bytes that a value and its place on the stack count for.
_SMALL, _CONTAINER = 64, 240
_LONGEST_INTEGER = 1024
_LONGEST_NAME = 1024
_DECIMAL = re.compile(rb"[+-]?[0-9]{1,2048}")
_HIGHEST_PROTOCOL = 5
_REFUSED = {
    "P": "a persistent id, as torch.save writes",
    "Q": "a persistent id, as torch.save writes",
    "\x82": "a registered extension",
    "\x83": "a registered extension",
    "\x84": "a registered extension",
    "\x97": "a buffer kept outside the file",
    "\x98": "a buffer kept outside the file",
    "i": "an instance of a class",
    "o": "an instance of a class",
    "\x81": "an instance of a class",
    "\x92": "an instance of a class",
}


class PickleMachine:
    """One run over one pickle; ``at`` is the byte of the opcode at work."""

    def __init__(self, data: bytes, budget: Budget) -> None:
        self.data = data
        self.budget = budget
        self.position = 0
        self.at = 0
        self.stack: list[Any] = []
        self.outer: list[list[Any]] = []  # the stacks below each mark
        self.memo: dict[int, Any] = {}

    def run(self) -> Any:
        """The value of the whole pickle.

        Raises:
            InputError: damaged, or not made of plain values.
        """
        while True:
            self.at = self.position
            code = self.take(1)[0]
            if code == 0x2E:  # STOP
                break
            act = _ACTIONS.get(code)
            if act is None:
                raise self.refusal(code)
            act(self)
        value = self.pop()
        if self.stack or self.outer:
            raise self.damage("it stops with values left over")
        if self.position != len(self.data):
            raise self.damage(f"{len(self.data) - self.position} bytes follow its end")
        return value

    def damage(self, what: str) -> InputError:
        return self.budget.damage(self.at, what)

    def refusal(self, code: int) -> InputError:
        what = _REFUSED.get(chr(code))
        if what is None:
            return self.damage(f"no pickle has an opcode {code:#04x}")
        return self.budget.error(self.at, f"holds {what}, which is refused, and nothing was run; {CONVERT}.")

    def take(self, count: int, cost: int = 0) -> bytes:
        """The next ``count`` bytes, each of which counts for ``cost`` bytes of memory."""
        end = self.position + count
        if count < 0 or end > len(self.data):
            raise self.damage(f"{count} bytes are announced and {len(self.data) - self.position} are left")
        self.budget.charge(cost * count, self.at)
        part = self.data[self.position : end]
        self.position = end
        return part

    def number(self, format: str) -> Any:
        return struct.unpack(format, self.take(struct.calcsize(format)))[0]

    def line(self, longest: int | None = None) -> bytes:
        stop = len(self.data) if longest is None else min(len(self.data), self.position + longest)
        end = self.data.find(b"\n", self.position, stop)
        if end < 0:
            raise self.damage("a line does not end")
        part = self.data[self.position : end]
        self.position = end + 1
        return part

    def push(self, value: Any, size: int = _SMALL) -> None:
        self.budget.charge(size, self.at)
        self.stack.append(value)

    def pop(self) -> Any:
        if not self.stack:
            raise self.damage("it takes a value that is not there")
        return self.stack.pop()

    def top(self, kind: type) -> Any:
        if not self.stack or type(self.stack[-1]) is not kind:
            raise self.damage(f"it adds to a {kind.__name__} that is not there")
        return self.stack[-1]

    def marked(self) -> list[Any]:
        if not self.outer:
            raise self.damage("it goes back to a mark that is not there")
        items, self.stack = self.stack, self.outer.pop()
        return items

    def add_pairs(self, target: dict, items: list[Any]) -> None:
        if len(items) % 2:
            raise self.damage("a dictionary has a key without a value")
        self.budget.charge(_SMALL * len(items), self.at)
        for key, value in zip(items[::2], items[1::2], strict=True):
            check_key(key, target, self.budget, self.at)
            target[key] = value

    def add_members(self, target: set, items: list[Any]) -> None:
        self.budget.charge(_SMALL * len(items), self.at)
        for item in items:
            check_key(item, target, self.budget, self.at)
            target.add(item)

    def text(self, format: str) -> None:
        self.push(self.take(self.number(format), 4).decode("utf-8"))

    def blob(self, format: str) -> None:
        self.push(self.take(self.number(format), 1))

    def old_text(self, raw: bytes) -> None:
        self.push(raw.decode("ascii") if raw.isascii() else raw)

    def remember(self, key: int) -> None:
        if not self.stack:
            raise self.damage("it remembers a value that is not there")
        self.budget.charge(_SMALL, self.at)
        self.memo[key] = self.stack[-1]

    def recall(self, key: int) -> None:
        if key not in self.memo:
            raise self.damage(f"it recalls value {key}, which it never made")
        value = self.memo[key]
        if isinstance(value, Unfinished):
            if not value.done:
                raise self.damage("it uses an array before its content")
            value = value.value
        self.push(value)

    def index(self) -> int:
        return int(self.decimal(self.line(_LONGEST_NAME)))

    def decimal(self, text: bytes) -> bytes:
        if not _DECIMAL.fullmatch(text):
            raise self.damage(f"{clip(text, 40)} is no whole number")
        return text

    def integer(self) -> None:
        text = self.line(_LONGEST_INTEGER)
        self.push({b"00": False, b"01": True}[text] if text in (b"00", b"01") else int(self.decimal(text)))

    def long_line(self) -> None:
        text = self.line(2 * _LONGEST_INTEGER)
        self.push(int(self.decimal(text.removesuffix(b"L"))), _SMALL + len(text))

    def long(self, format: str) -> None:
        size = self.number(format)
        if not 0 <= size <= _LONGEST_INTEGER:
            raise self.damage(f"a whole number of {size} bytes")
        self.push(int.from_bytes(self.take(size), "little", signed=True), _SMALL + size)

    def decimal_float(self) -> None:
        self.push(float(self.line(_LONGEST_NAME).decode("ascii")))

    def quoted(self) -> None:
        raw = self.line()
        if len(raw) < 2 or raw[:1] not in (b"'", b'"') or raw[-1:] != raw[:1]:
            raise self.damage("a string without quotes")
        self.budget.charge(2 * len(raw), self.at)
        self.old_text(codecs.escape_decode(raw[1:-1])[0])

    def escaped(self) -> None:
        raw = self.line()
        self.budget.charge(8 * len(raw), self.at)
        text = raw.decode("raw-unicode-escape")
        text.encode("utf-8")  # half a surrogate pair is no text
        self.push(text)

    def global_lines(self) -> None:
        module, name = self.line(_LONGEST_NAME).decode("utf-8"), self.line(_LONGEST_NAME).decode("utf-8")
        self.push(find_global(module, name, self.budget, self.at))

    def global_stack(self) -> None:
        name, module = self.pop(), self.pop()
        if type(name) is not str or type(module) is not str:
            raise self.damage("a global without a name")
        self.push(find_global(module, name, self.budget, self.at))

    def call(self) -> None:
        arguments, function = self.pop(), self.pop()
        self.push(reduce(function, arguments, self.budget, self.at), _CONTAINER)

    def build(self) -> None:
        state, thing = self.pop(), self.pop()
        self.push(finish(thing, state, self.budget, self.at))

    def tuple_of(self, count: int) -> None:
        items = [self.pop() for _ in range(count)][::-1]
        self.push(tuple(items))

    def append(self) -> None:
        item = self.pop()
        self.top(list).append(item)
        self.budget.charge(16, self.at)

    def appends(self) -> None:
        items = self.marked()
        self.top(list).extend(items)
        self.budget.charge(16 * len(items), self.at)

    def set_item(self) -> None:
        value, key = self.pop(), self.pop()
        self.add_pairs(self.top(dict), [key, value])

    def set_items(self) -> None:
        items = self.marked()
        self.add_pairs(self.top(dict), items)

    def add_items(self) -> None:
        items = self.marked()
        self.add_members(self.top(set), items)

    def make_dict(self) -> None:
        result: dict[Any, Any] = {}
        self.add_pairs(result, self.marked())
        self.push(result, _CONTAINER)

    def make_frozen(self) -> None:
        members: set[Any] = set()
        self.add_members(members, self.marked())
        self.push(frozenset(members), _CONTAINER)

    def make_list(self) -> None:
        items = self.marked()
        self.push(items, _CONTAINER + 16 * len(items))

    def make_tuple(self) -> None:
        items = self.marked()
        self.push(tuple(items), _CONTAINER + 8 * len(items))

    def mark(self) -> None:
        self.budget.charge(_CONTAINER, self.at)
        self.outer.append(self.stack)
        self.stack = []

    def drop(self) -> None:
        if self.stack:
            self.stack.pop()
        else:
            self.marked()

    def drop_marked(self) -> None:
        self.marked()

    def duplicate(self) -> None:
        self.push(self.pop(), 0)
        self.push(self.stack[-1])

    def protocol(self) -> None:
        version = self.number("<B")
        if version > _HIGHEST_PROTOCOL:
            raise self.budget.error(self.at, f"is a pickle of protocol {version}; expected 0 to {_HIGHEST_PROTOCOL}.")

    def frame(self) -> None:
        size = self.number("<Q")
        if size > len(self.data) - self.position:
            raise self.damage(f"a frame of {size} bytes with {len(self.data) - self.position} left")


_ACTIONS: dict[int, Callable[[PickleMachine], None]] = {
    ord(letter): act
    for letter, act in {
        "\x80": PickleMachine.protocol,
        "\x95": PickleMachine.frame,
        # Atoms.
        "N": lambda m: m.push(None),
        "\x88": lambda m: m.push(True),
        "\x89": lambda m: m.push(False),
        "I": PickleMachine.integer,
        "J": lambda m: m.push(m.number("<i")),
        "K": lambda m: m.push(m.number("<B")),
        "M": lambda m: m.push(m.number("<H")),
        "L": PickleMachine.long_line,
        "\x8a": lambda m: m.long("<B"),
        "\x8b": lambda m: m.long("<i"),
        "F": PickleMachine.decimal_float,
        "G": lambda m: m.push(m.number(">d")),
        # Text and bytes.
        "S": PickleMachine.quoted,
        "T": lambda m: m.old_text(m.take(m.number("<i"), 2)),
        "U": lambda m: m.old_text(m.take(m.number("<B"), 2)),
        "V": PickleMachine.escaped,
        "X": lambda m: m.text("<I"),
        "\x8c": lambda m: m.text("<B"),
        "\x8d": lambda m: m.text("<Q"),
        "B": lambda m: m.blob("<I"),
        "C": lambda m: m.blob("<B"),
        "\x8e": lambda m: m.blob("<Q"),
        "\x96": lambda m: m.push(bytearray(m.take(m.number("<Q"), 2))),
        # Containers.
        "(": PickleMachine.mark,
        "]": lambda m: m.push([], _CONTAINER),
        "l": PickleMachine.make_list,
        "a": PickleMachine.append,
        "e": PickleMachine.appends,
        ")": lambda m: m.push(()),
        "t": PickleMachine.make_tuple,
        "\x85": lambda m: m.tuple_of(1),
        "\x86": lambda m: m.tuple_of(2),
        "\x87": lambda m: m.tuple_of(3),
        "}": lambda m: m.push({}, _CONTAINER),
        "d": PickleMachine.make_dict,
        "s": PickleMachine.set_item,
        "u": PickleMachine.set_items,
        "\x8f": lambda m: m.push(set(), _CONTAINER),
        "\x90": PickleMachine.add_items,
        "\x91": PickleMachine.make_frozen,
        # The stack and the memo.
        "0": PickleMachine.drop,
        "1": PickleMachine.drop_marked,
        "2": PickleMachine.duplicate,
        "p": lambda m: m.remember(m.index()),
        "q": lambda m: m.remember(m.number("<B")),
        "r": lambda m: m.remember(m.number("<I")),
        "\x94": lambda m: m.remember(len(m.memo)),
        "g": lambda m: m.recall(m.index()),
        "h": lambda m: m.recall(m.number("<B")),
        "j": lambda m: m.recall(m.number("<I")),
        # Named things.
        "c": PickleMachine.global_lines,
        "\x93": PickleMachine.global_stack,
        "R": PickleMachine.call,
        "b": PickleMachine.build,
    }.items()
}
