"""Settings as frozen dataclasses, from JSON and from command-line text."""

import dataclasses
import types
import typing
from collections.abc import Mapping
from typing import Any, TypeVar

from a2g_jax.errors import InputError

Config = TypeVar("Config")


def from_json(cls: type[Config], values: Mapping[str, Any], where: str) -> Config:
    """A settings object from JSON values; lists become tuples.

    Raises:
        InputError: an unknown field, or a value of another type than the field's; the message starts with ``where``.
    """
    hints = typing.get_type_hints(cls)
    fields = {field.name for field in dataclasses.fields(cls)}  # type: ignore[arg-type]
    for name in values:
        if name not in fields:
            raise InputError(f"{where}: has an unknown setting {name!r}; the settings are {', '.join(sorted(fields))}.")
    return cls(**{name: _checked(value, hints[name], f"{where}: {name}") for name, value in values.items()})


def parse_text(cls: type[Any], name: str, text: str) -> Any:
    """The value of field ``name`` written as command-line text; tuples are comma-separated.

    Raises:
        InputError: the text is not a value of the field's type.
    """
    kind = typing.get_type_hints(cls)[name]
    flag = "--" + name.replace("_", "-")
    return _parse(text, kind, flag)


def _parse(text: str, kind: Any, flag: str) -> Any:
    if typing.get_origin(kind) in (types.UnionType, typing.Union):
        if text.lower() == "none":
            return None
        kind = next(part for part in typing.get_args(kind) if part is not type(None))
    if typing.get_origin(kind) is tuple:
        return tuple(_parse(part, typing.get_args(kind)[0], flag) for part in text.split(",") if part.strip())
    if kind is bool:
        if text.lower() in ("true", "yes", "1", "false", "no", "0"):
            return text.lower() in ("true", "yes", "1")
        raise InputError(f"{flag}: expected true or false; got {text!r}.")
    try:
        if kind is int:
            return int(text.replace("_", ""))
        return kind(text)
    except ValueError:
        word = {"int": "a whole number", "float": "a number"}.get(kind.__name__, kind.__name__)
        raise InputError(f"{flag}: expected {word}; got {text!r}.") from None


def _checked(value: Any, kind: Any, where: str) -> Any:
    if typing.get_origin(kind) in (types.UnionType, typing.Union):
        if value is None:
            return None
        kind = next(part for part in typing.get_args(kind) if part is not type(None))
    if typing.get_origin(kind) is tuple and isinstance(value, list | tuple):
        return tuple(_checked(part, typing.get_args(kind)[0], where) for part in value)
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if typing.get_origin(kind) is None and isinstance(value, kind) and (kind is bool or not isinstance(value, bool)):
        return value
    raise InputError(f"{where}: expected {getattr(kind, '__name__', kind)}; got {value!r}.")
