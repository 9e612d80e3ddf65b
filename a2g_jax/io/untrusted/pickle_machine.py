"""The stack machine of pickles, limited to operations that build plain values."""

from collections.abc import Callable
from typing import Any

from a2g_jax.io.untrusted.pickle_objects import Unfinished, find_global, finish, reduce
from a2g_jax.io.untrusted.pickle_stack import CONTAINER, SMALL, PickleStack
from a2g_jax.io.untrusted.refused import Refused, RefusedError, check_read
from a2g_jax.io.untrusted.values import check_key

_HIGHEST_PROTOCOL = 5


class PickleMachine(PickleStack):
    """Executes one pickle as data."""

    def run(self) -> Any:
        """The value of the whole pickle.

        Raises:
            InputError: damaged, or with other than plain values (with ``placeholders``, if it is one as a whole).
        """
        for name, argument in self.opcodes:
            act = _ACTIONS.get(name)
            if act is None:  # of a Python to come
                raise self.damage(f"opcode {name} is unknown")
            act(self, argument)
        value = self.pop()
        if self.stack or self.outer:
            raise self.damage("it stops with values left over")
        if self.opcodes.left:
            raise self.damage(f"{self.opcodes.left} bytes follow its end")
        check_read(value)
        return value

    def add_pairs(self, target: dict, items: list[Any]) -> None:
        if len(items) % 2:
            raise self.damage("a dictionary has a key without a value")
        self.budget.charge(SMALL * len(items), self.at)
        for key, value in zip(items[::2], items[1::2], strict=True):
            check_key(key, target, self.budget, self.at)
            target[key] = value

    def add_members(self, target: set, items: list[Any]) -> None:
        self.budget.charge(SMALL * len(items), self.at)
        for item in items:
            check_key(item, target, self.budget, self.at)
            target.add(item)

    def text(self, text: str) -> None:
        text.encode("utf-8")  # pickletools lets half a surrogate pair pass, which is no text
        self.push(text)

    def python2_text(self, raw: bytes) -> None:
        self.push(raw.decode("ascii") if raw.isascii() else raw)

    def global_stack(self) -> None:
        name, module = self.pop(), self.pop()
        if type(name) is not str or type(module) is not str:
            raise self.damage("a global without a name")
        self.find(module, name)

    def find(self, module: str, name: str) -> None:
        self.budget.work(3, self.at)  # slower than other opcodes
        try:
            self.push(find_global(module, name, self.budget, self.at))
        except RefusedError as error:
            self.refuse(error)

    def call(self) -> None:
        arguments, function = self.pop(), self.pop()
        try:
            self.push(reduce(function, arguments, self.budget, self.at), CONTAINER)
        except RefusedError as error:
            self.refuse(error)

    def build(self) -> None:
        self.budget.work(1, self.at)
        state, thing = self.pop(), self.pop()
        try:
            self.push(finish(thing, state, self.budget, self.at))
        except RefusedError as error:
            self.refuse(error)
            if isinstance(thing, Unfinished):  # which the memo may hold
                thing.value, thing.done = self.stack[-1], True

    def instance(self, name: str, arguments: int) -> None:
        """An instance of a class, which is below its arguments on the stack."""
        for _ in range(arguments):
            self.pop()
        known = self.pop()
        if isinstance(known, Refused):
            self.refuse(known.error)
        else:
            self.refuse_opcode(name)

    def marked_instance(self) -> None:
        items = self.marked()
        if items and isinstance(items[0], Refused):
            self.refuse(items[0].error)
        else:
            self.refuse_opcode("OBJ")

    def named_instance(self) -> None:
        self.marked()
        self.refuse_opcode("INST")

    def stored_object(self) -> None:
        self.pop()
        self.refuse_opcode("BINPERSID")

    def tuple_of(self, count: int) -> None:
        self.budget.work(1, self.at)
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
        self.push(result, CONTAINER)

    def make_frozenset(self) -> None:
        members: set[Any] = set()
        self.add_members(members, self.marked())
        self.push(frozenset(members), CONTAINER)

    def make_list(self) -> None:
        items = self.marked()
        self.push(items, CONTAINER + 16 * len(items))

    def make_tuple(self) -> None:
        items = self.marked()
        self.push(tuple(items), CONTAINER + 8 * len(items))

    def protocol(self, version: int) -> None:
        if version > _HIGHEST_PROTOCOL:
            raise self.budget.error(self.at, f"is a pickle of protocol {version}; expected 0 to {_HIGHEST_PROTOCOL}.")

    def frame(self, size: int) -> None:
        if size > self.opcodes.left:
            raise self.damage(f"a frame of {size} bytes with {self.opcodes.left} left")


_ACTIONS: dict[str, Callable[[PickleMachine, Any], None]] = {
    "PROTO": PickleMachine.protocol,
    "FRAME": PickleMachine.frame,
    "NONE": lambda m, _: m.push(None),
    "NEWTRUE": lambda m, _: m.push(True),
    "NEWFALSE": lambda m, _: m.push(False),
    # Numbers, text and bytes.
    **dict.fromkeys(
        ("INT", "BININT", "BININT1", "BININT2", "LONG", "LONG1", "LONG4", "FLOAT", "BINFLOAT"), PickleMachine.push
    ),
    **dict.fromkeys(("UNICODE", "BINUNICODE", "SHORT_BINUNICODE", "BINUNICODE8"), PickleMachine.text),
    **dict.fromkeys(("BINBYTES", "SHORT_BINBYTES", "BINBYTES8", "BYTEARRAY8"), PickleMachine.push),
    "STRING": PickleMachine.python2_text,
    "BINSTRING": lambda m, text: m.python2_text(text.encode("latin-1")),
    "SHORT_BINSTRING": lambda m, text: m.python2_text(text.encode("latin-1")),
    # Containers.
    "MARK": lambda m, _: m.mark(),
    "EMPTY_LIST": lambda m, _: m.push([], CONTAINER),
    "LIST": lambda m, _: m.make_list(),
    "APPEND": lambda m, _: m.append(),
    "APPENDS": lambda m, _: m.appends(),
    "EMPTY_TUPLE": lambda m, _: m.push(()),
    "TUPLE": lambda m, _: m.make_tuple(),
    "TUPLE1": lambda m, _: m.tuple_of(1),
    "TUPLE2": lambda m, _: m.tuple_of(2),
    "TUPLE3": lambda m, _: m.tuple_of(3),
    "EMPTY_DICT": lambda m, _: m.push({}, CONTAINER),
    "DICT": lambda m, _: m.make_dict(),
    "SETITEM": lambda m, _: m.set_item(),
    "SETITEMS": lambda m, _: m.set_items(),
    "EMPTY_SET": lambda m, _: m.push(set(), CONTAINER),
    "ADDITEMS": lambda m, _: m.add_items(),
    "FROZENSET": lambda m, _: m.make_frozenset(),
    # The stack and the memo.
    "POP": lambda m, _: m.drop(),
    "POP_MARK": lambda m, _: m.drop_marked(),
    "DUP": lambda m, _: m.duplicate(),
    **dict.fromkeys(("PUT", "BINPUT", "LONG_BINPUT"), PickleMachine.remember),
    "MEMOIZE": lambda m, _: m.remember(len(m.memo)),
    **dict.fromkeys(("GET", "BINGET", "LONG_BINGET"), PickleMachine.recall),
    # Globals and calls.
    "GLOBAL": lambda m, names: m.find(names[0], names[1]),
    "STACK_GLOBAL": lambda m, _: m.global_stack(),
    "REDUCE": lambda m, _: m.call(),
    "BUILD": lambda m, _: m.build(),
    # What is never built.
    "NEWOBJ": lambda m, _: m.instance("NEWOBJ", 1),
    "NEWOBJ_EX": lambda m, _: m.instance("NEWOBJ_EX", 2),
    "OBJ": lambda m, _: m.marked_instance(),
    "INST": lambda m, _: m.named_instance(),
    "PERSID": lambda m, _: m.refuse_opcode("PERSID"),
    "BINPERSID": lambda m, _: m.stored_object(),
    "EXT1": lambda m, _: m.refuse_opcode("EXT1"),
    "EXT2": lambda m, _: m.refuse_opcode("EXT2"),
    "EXT4": lambda m, _: m.refuse_opcode("EXT4"),
    "NEXT_BUFFER": lambda m, _: m.refuse_opcode("NEXT_BUFFER"),
    "READONLY_BUFFER": lambda m, _: m.refuse_opcode("READONLY_BUFFER"),
}
