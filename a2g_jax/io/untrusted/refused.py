"""Placeholders for what is refused in a file: the rest of it can be read, and they cannot be used for anything."""

from typing import Any, NoReturn

from a2g_jax.errors import InputError


class RefusedError(InputError):
    """Content that is not damaged, but that no reader builds."""


class Refused:
    """An object of a file that was not built; any use of it raises the reason."""

    __slots__ = ("_reason",)

    def __init__(self, reason: str) -> None:
        object.__setattr__(self, "_reason", reason)

    @property
    def error(self) -> RefusedError:
        """The error to raise."""
        return RefusedError(self._reason)

    def __repr__(self) -> str:
        return f"<refused: {self._reason}>"

    def _use(self, *_arguments: Any, **_more: Any) -> NoReturn:
        raise self.error

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # Python's own questions, such as those of copy
            raise AttributeError(name)
        raise self.error

    __setattr__ = __delattr__ = _use
    __getitem__ = __setitem__ = __delitem__ = __contains__ = __len__ = __iter__ = __next__ = __reversed__ = _use
    __call__ = __bool__ = __int__ = __float__ = __complex__ = __index__ = __bytes__ = __array__ = __hash__ = _use
    __eq__ = __ne__ = __lt__ = __le__ = __gt__ = __ge__ = _use  # type: ignore[assignment]
    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = __neg__ = _use


def check_read(value: object) -> None:
    """Raise the reason if a value is one of those that were refused.

    Raises:
        RefusedError: it is.
    """
    if isinstance(value, Refused):
        raise value.error


def first_refused(values: Any) -> Refused | None:
    """The first placeholder among values, or in tuples directly among them."""
    for value in values:
        if isinstance(value, Refused):
            return value
        if type(value) is tuple:
            for part in value:
                if isinstance(part, Refused):
                    return part
    return None
