"""Settings as frozen dataclasses, from JSON and from command-line text."""

import ast
import dataclasses
import inspect
import textwrap
import types
import typing
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, TypeVar

from a2g_jax.errors import InputError, UnknownFlag, brief

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


def checked_value(cls: type[Any], name: str, value: Any, where: str) -> Any:
    """A JSON or TOML value as that of field ``name``; a list becomes a tuple.

    Raises:
        InputError: it is of another type; the message starts with ``where``.
    """
    return _checked(value, typing.get_type_hints(cls)[name], where)


def parse_text(cls: type[Any], name: str, text: str) -> Any:
    """The value of field ``name`` written as command-line text; tuples are comma-separated.

    Raises:
        InputError: the text is not a value of the field's type.
    """
    kind = typing.get_type_hints(cls)[name]
    flag = "--" + name.replace("_", "-")
    return _parse(text, kind, flag)


def flag_of(field: dataclasses.Field[Any]) -> str:
    """The command-line flag of a setting: its name, unless its metadata give another ``flag``."""
    return "--" + str(field.metadata.get("flag", field.name)).replace("_", "-")


def parse_flags(pairs: Sequence[str], *owners: Any, hint: str) -> tuple[Any, ...]:
    """Settings changed by flags such as ``["--learning-rate", "3e-4"]``.

    Fields whose metadata have ``repeat`` take one element of a tuple with each flag.

    Args:
        owners: dataclass instances; a flag belongs to the first one with such a setting.
        hint: the command that lists the flags, for the error.

    Returns:
        The owners with the values of the flags.

    Raises:
        InputError: an unknown flag, or a value that does not fit it.
    """
    known = {
        flag_of(field): (number, field)
        for number, owner in reversed(list(enumerate(owners)))
        for field in fields(owner)
    }
    changes: list[dict[str, Any]] = [{} for _ in owners]
    rest = list(pairs)
    while rest:
        text = rest.pop(0)
        if not text.startswith("--"):
            raise InputError(f"unexpected argument {text!r}; settings are written --name value.")
        flag, equals, value = text.partition("=")
        if flag not in known:
            raise UnknownFlag(flag, list(known), hint)
        number, field = known[flag]
        if not equals:
            if rest and not rest[0].startswith("--"):
                value = rest.pop(0)
            elif isinstance(getattr(owners[number], field.name), bool):
                value = "true"
            else:
                raise InputError(f"{flag}: needs a value.")
        mine = changes[number]
        if field.metadata.get("repeat"):
            mine[field.name] = (*mine.get(field.name, ()), value)
        else:
            mine[field.name] = parse_text(type(owners[number]), field.name, value)
    return tuple(dataclasses.replace(owner, **mine) for owner, mine in zip(owners, changes, strict=True))


def check_needs(before: Any, after: Any, model: Mapping[str, Any]) -> None:
    """Refuse changes of settings that have no effect on a model.

    Args:
        before: settings with the values that a run stores; ``after``: those that are requested. A field whose metadata
            have ``needs``, the name of a setting of the model, has an effect only where that one is neither zero nor
            empty.
        model: settings of the model.

    Raises:
        InputError: such a setting is changed.
    """
    for field in fields(after):
        needs = field.metadata.get("needs")
        if needs and getattr(before, field.name) != getattr(after, field.name) and not model.get(needs):
            flag = "--" + needs.replace("_", "-")
            raise InputError(f"{flag_of(field)}: has no effect on this run, which was trained without {flag}.")


def settings_lines(settings: Any) -> list[str]:
    """The flag, value and description of each setting, as ``--settings`` prints them."""
    about = describe_settings(type(settings))
    lines = []
    for field in fields(settings):
        value = getattr(settings, field.name)
        text = ",".join(map(str, value)) if isinstance(value, tuple) else str(value)
        lines.append(f"{flag_of(field)} {text.lower() if value is None or isinstance(value, bool) else text}".rstrip())
        lines += textwrap.wrap(about.get(field.name, ""), 96, initial_indent="    ", subsequent_indent="    ")
    return lines


def describe_settings(cls: type) -> dict[str, str]:
    """The first paragraph of the docstring below each field of a dataclass, where the source is available."""
    try:
        (body,) = ast.parse(textwrap.dedent(inspect.getsource(cls))).body
    except (OSError, SyntaxError, ValueError):
        return {}
    found = {}
    statements = getattr(body, "body", [])
    for field, text in zip(statements, statements[1:], strict=False):
        if (
            isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(text, ast.Expr)
            and isinstance(text.value, ast.Constant)
        ):
            found[field.target.id] = " ".join(str(text.value.value).split("\n\n")[0].split())
    return found


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
    raise InputError(f"{where}: expected {getattr(kind, '__name__', kind)}; got {brief(repr(value))}.")
