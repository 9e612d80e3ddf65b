"""The stack, the marks and the memo of the pickle machine, with a charge for every value."""

from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.io.untrusted.budget import CONVERT, Budget, clip
from a2g_jax.io.untrusted.pickle_objects import Unfinished
from a2g_jax.io.untrusted.pickle_opcodes import REFUSED, Opcodes
from a2g_jax.io.untrusted.refused import Refused, RefusedError

#: Bytes charged for a value and its place on the stack.
SMALL, CONTAINER, _PLACEHOLDER = 64, 240, 1000


class PickleStack:
    """Values of one pickle while it is read.

    Args:
        placeholders: whether objects that are refused become :class:`Refused` instead of raising their error.
    """

    def __init__(self, data: bytes, budget: Budget, placeholders: bool = False) -> None:
        self.placeholders = placeholders
        self.opcodes = Opcodes(data, budget)
        self.budget = budget
        self.stack: list[Any] = []
        self.outer: list[list[Any]] = []  # the stacks below each mark
        self.memo: dict[int, Any] = {}

    @property
    def at(self) -> int:
        """Byte of the current opcode."""
        return self.opcodes.at

    def damage(self, what: str) -> InputError:
        return self.budget.damage(self.at, what)

    def push(self, value: Any, size: int = SMALL) -> None:
        self.budget.charge(size, self.at)
        self.stack.append(value)

    def pop(self) -> Any:
        if not self.stack:
            raise self.damage("it uses a value of an empty stack")
        return self.stack.pop()

    def refuse(self, error: RefusedError) -> None:
        """Push a placeholder, or raise the error."""
        if not self.placeholders:
            raise error
        self.budget.work(4, self.at)
        self.budget.charge(_PLACEHOLDER, self.at)
        self.push(Refused(str(error)))

    def refuse_opcode(self, name: str) -> None:
        what = f"holds {REFUSED[name]}, which is refused, and nothing was run; {CONVERT}."
        self.refuse(self.budget.refused(self.at, what))

    def top(self, kind: type) -> Any:
        """The container on the stack; a new one, which is dropped, on top of an object that was refused."""
        if self.stack and isinstance(self.stack[-1], Refused):
            return kind()
        if not self.stack or type(self.stack[-1]) is not kind:
            raise self.damage(f"it adds to a {kind.__name__} that does not exist")
        return self.stack[-1]

    def marked(self) -> list[Any]:
        if not self.outer:
            raise self.damage("it uses a mark that does not exist")
        items, self.stack = self.stack, self.outer.pop()
        return items

    def mark(self) -> None:
        self.budget.charge(CONTAINER, self.at)
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

    def remember(self, key: int) -> None:
        if not self.stack:
            raise self.damage("it stores a value of an empty stack")
        self.budget.charge(SMALL, self.at)
        self.memo[key] = self.stack[-1]

    def recall(self, key: int) -> None:
        if key not in self.memo:
            raise self.damage(f"it recalls value {clip(key)}, which it never stored")
        value = self.memo[key]
        if isinstance(value, Unfinished):
            if not value.done:
                raise self.damage("it uses an array before its content")
            value = value.value
        self.push(value)
