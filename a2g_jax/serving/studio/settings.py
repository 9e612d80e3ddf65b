"""A request of the page as the arguments of ``a2g generate``, and its errors beside the fields they are about.

The page sends what its fields hold; every value becomes one argument ``--flag=value``, so that no value can be another
flag, and the command's own checks judge it. Files are named by identifiers of uploads.
"""

import re
import shlex
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from a2g_jax.errors import InputError, brief
from a2g_jax.io.character import character_suffix
from a2g_jax.serving.studio.uploads import Upload, Uploads, with_client_name

#: Samples of one request at most: more do not fit side by side.
MOST_SAMPLES = 12
#: Pins, and points of a curve, at most.
MOST_PINS, MOST_POINTS = 20, 200
_LONGEST_TEXT = 2000
#: Fields of the page by flags of the command; those of sampling settings are ``settings.NAME``.
_FIELDS = {
    "--samples": "samples",
    "--seed": "seed",
    "--audio": "speech",
    "--control": "controls",
    "--emotion": "emotion",
    "--pin": "pins",
    "--pin-blend": "pins",
    "--style": "style",
    "--style-audio": "style",
    "--style-share": "style",
    "--style-with": "style_with",
    "--style-mix": "style_with",
    "--seed-clip": "continue",
    "--to": "character",
}
_KNOWN = {
    "speech", "system", "samples", "seed", "emotion", "controls", "pins", "style", "style_share", "style_with",
    "style_mix", "continue", "character", "settings",
}  # fmt: skip
_NAME = re.compile(r"[a-z][a-z0-9-]{0,40}")


@dataclass(frozen=True)
class Request:
    """A request of the page, checked."""

    system: str
    speech: Upload
    samples: int
    arguments: tuple[str, ...]
    """Of ``a2g generate``, without ``--out``."""
    command: str
    """The same for a shell, with the names of the client's files."""
    used: tuple[Upload, ...]
    """The files that it names."""
    character: bool = False


class FieldError(InputError):
    """An error about one field of the page."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(message)
        self.field = field


def read_request(
    values: Any, systems: Mapping[str, str], uploads: Uploads, settings: Callable[[str], Container[str]]
) -> Request:
    """Check the form of a request, and write it as arguments; the command checks values.

    Args:
        values: JSON of the page.
        systems: names of runs by what the page calls them.
        settings: names of a system's sampling settings; other flags of the command, which name files, are refused.

    Raises:
        FieldError: a field that is missing, unknown or of another form.
    """
    if not isinstance(values, dict):
        raise FieldError("", "expected a request as a JSON object.")
    if unknown := sorted(set(map(str, values)) - _KNOWN):
        raise FieldError("", f"no field {brief(unknown[0])!r}.")
    used: list[Upload] = []

    def file(field: str, kind: str) -> str | None:
        return _file(values.get(field), field, kind, uploads, used)

    system = values.get("system")
    if not isinstance(system, str) or system not in systems:
        raise FieldError("system", f"choose a system: {', '.join(systems)}.")
    speech = file("speech", "speech")
    if speech is None:
        raise FieldError("speech", "choose a recording of speech first.")
    samples = _whole(values.get("samples", 3), "samples", 1, MOST_SAMPLES)
    arguments = [systems[system], f"--audio={speech}", f"--samples={samples}"]
    arguments.append(f"--seed={_whole(values.get('seed', 0), 'seed', 0, 2**31 - 1)}")
    if emotion := _text(values.get("emotion"), "emotion"):
        arguments.append(f"--emotion={emotion}")
    arguments += [f"--control={line}" for line in _controls(values.get("controls", {}))]
    for pin in _list(values.get("pins", []), "pins", MOST_PINS):
        arguments.append(f"--pin={_pin(pin, uploads, used)}")
    if (style := file("style", "clip")) is not None:
        arguments.append(f"--style={style}")
        if values.get("style_share") is not None:
            arguments.append(f"--style-share={_number(values['style_share'], 'style'):g}")
    if (second := file("style_with", "clip")) is not None:
        arguments.append(f"--style-with={second}")
        if values.get("style_mix") is not None:
            arguments.append(f"--style-mix={_number(values['style_mix'], 'style_with'):g}")
    if (clip := file("continue", "clip")) is not None:
        arguments.append(f"--seed-clip={clip}")
    formats = "npz"
    if (rig := file("character", "character")) is not None:
        arguments.append(f"--to={rig}")
        formats = f"{character_suffix(rig).removeprefix('.')},npz"
    if changed := values.get("settings"):
        arguments += _settings(changed, settings(system))
    sent = [upload for upload in used if not upload.keep]
    shown = shlex.join(["a2g", "generate", *(named(one, sent) for one in arguments), "--out=gestures"])
    return Request(
        system, used[0], samples, (*arguments, f"--formats={formats}"), shown, tuple(used), character=rig is not None
    )


def field_of(message: str, request: Request) -> dict[str, str]:
    """An error of the command in plain words, and the field of the page that it is about.

    Args:
        message: one line; it may name files as the server calls them.
    """
    found = re.match(r"(?:argument )?(--[a-z][a-z-]*)([^:]*): (.*)", message, re.DOTALL)
    field, text = "", message
    if found:
        flag = found[1]
        field = _FIELDS.get(flag, f"settings.{flag.removeprefix('--')}")
        text = found[3]
        line = re.search(r"'([a-z_]+)=", found[2])
        if field == "controls" and line:
            field = f"controls.{line[1]}"
    for upload in request.used:
        if not field and str(upload.path) in message:
            field = {"speech": "speech", "character": "character"}.get(upload.kind, "")
    text = named(text, request.used)
    text = text.replace("--samples", "the number of samples").replace("--seed", "the seed")
    text = re.sub(r" \(see 'a2g [^']*'\)", "", text)
    return {"field": field, "message": text[:1].upper() + text[1:]}


def named(text: str, used: Sequence[Upload]) -> str:
    """Text with the client's names of files."""
    for upload in used:
        text = with_client_name(text, upload.path, upload.name)
    return text


def _file(id: object, field: str, kind: str, uploads: Uploads, used: list[Upload]) -> str | None:
    if id is None or id == "":
        return None
    try:
        upload = uploads.find(id, kind)
    except InputError as error:
        raise FieldError(field, str(error)) from None
    if upload not in used:
        used.append(upload)
    return str(upload.path)


def _pin(pin: object, uploads: Uploads, used: list[Upload]) -> str:
    if not isinstance(pin, dict) or set(pin) - {"clip", "start", "length"}:
        raise FieldError("pins", "expected a clip, the second at which it starts, and its length.")
    path = _file(pin.get("clip"), "pins", "clip", uploads, used)
    if path is None:
        raise FieldError("pins", "choose a clip.")
    start = _number(pin.get("start"), "pins")
    if start < 0:
        raise FieldError("pins", f"clips start at second 0 or later; got {start:g}.")
    text = f"{path}@{start:.3f}"
    if pin.get("length") is not None:
        length = _number(pin["length"], "pins")
        if length <= 0:
            raise FieldError("pins", f"expected a length above 0 seconds; got {length:g}.")
        text += f"+{length:.3f}"
    return text


def _controls(controls: object) -> list[str]:
    """Lines such as ``energy=0.2@0,0.9@10`` from values, and from curves of (second, value)."""
    if not isinstance(controls, dict):
        raise FieldError("controls", "expected values by the names of controls.")
    lines = []
    for name, value in controls.items():
        field = f"controls.{brief(name)}"
        if not _NAME.fullmatch(str(name).replace("_", "-")):
            raise FieldError("controls", f"no control {brief(name)!r}.")
        if isinstance(value, list):
            points = [_point(point, field) for point in _list(value, field, MOST_POINTS)]
            if not points:
                raise FieldError(field, "a curve needs a point at least.")
            lines.append(f"{name}={','.join(points)}")
        else:
            lines.append(f"{name}={_value(value, field)}")
    return lines


def _point(point: object, field: str) -> str:
    if not isinstance(point, list | tuple) or len(point) != 2:
        raise FieldError(field, "expected points of a second and a value.")
    return f"{_value(point[1], field)}@{_number(point[0], field):.3f}"


def _value(value: object, field: str) -> str:
    """A quantile, or the name of a category."""
    if isinstance(value, str):
        if not re.fullmatch(r"[\w .-]{1,60}", value) or re.search(r"[,@=\s]", value):
            raise FieldError(field, f"no value {brief(value)!r}.")
        return value
    return f"{_number(value, field):.4g}"


def _settings(settings: object, known: Container[str]) -> list[str]:
    """Flags of sampling settings that the page changes."""
    if not isinstance(settings, dict):
        raise FieldError("settings", "expected values by the names of settings.")
    flags = []
    for name, value in settings.items():
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise FieldError("settings", f"no setting {brief(name)!r}.")
        if name not in known:
            raise FieldError(f"settings.{name}", f"this system has no setting {name!r}.")
        values = value if isinstance(value, list) else [value]
        flags += [f"--{name}={_text(one, f'settings.{name}')}" for one in values]
    return flags


def _text(value: object, field: str) -> str:
    if value is None:
        return ""
    text = str(value).lower() if isinstance(value, bool) else str(value)
    if not isinstance(value, str | int | float) or len(text) > _LONGEST_TEXT or not text.isprintable():
        raise FieldError(field, "expected a short text or a number.")
    return text


def _list(value: object, field: str, most: int) -> list[Any]:
    if not isinstance(value, list):
        raise FieldError(field, "expected a list.")
    if len(value) > most:
        raise FieldError(field, f"expected {most} at most; got {len(value)}.")
    return value


def _number(value: object, field: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e9:
        raise FieldError(field, f"expected a number; got {brief(value)!r}.")
    return float(value)


def _whole(value: object, field: str, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise FieldError(field, f"expected a whole number from {low} to {high}; got {brief(value)!r}.")
    return value
