"""Settings of a training as a TOML file: a table ``[model]`` and a table ``[training]``."""

import hashlib
import json
import re
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from a2g_jax.config import checked_value
from a2g_jax.errors import InputError
from a2g_jax.io.files import check_readable

TABLES = ("model", "training")


@dataclass(frozen=True)
class SettingsFile:
    """A file of settings."""

    path: Path
    text: str
    values: Mapping[str, Mapping[str, Any]]
    """By table."""

    def record(self) -> dict[str, str]:
        """What a run keeps of it."""
        digest = hashlib.sha256(self.text.encode()).hexdigest()
        return {"name": self.path.name, "sha256": digest, "text": self.text}

    def applied(self, table: str, settings: Any) -> Any:
        """Settings with the values of one of the file's tables.

        Raises:
            InputError: a name or value that does not fit, with the file and the line.
        """
        given = self.values.get(table, {})
        changes: dict[str, Any] = {}
        known = {field.name for field in fields(settings)}
        for name, value in given.items():
            if name not in known:
                raise InputError(
                    f"{self._line(table, name)}: [{table}] has no setting {name!r}; 'a2g train MODEL --settings --toml'"
                    " prints all."
                )
            changes[name] = checked_value(type(settings), name, value, f"{self._line(table, name)}: {name}")
        try:
            return replace(settings, **changes)
        except InputError as error:  # a value out of range; the message begins with its flag
            name = str(error).partition(":")[0].removeprefix("--").replace("-", "_")
            raise InputError(f"{self._line(table, name)}: {error}") from None

    def _line(self, table: str, name: str) -> str:
        """The file and the line of a setting."""
        inside = ""
        for number, line in enumerate(self.text.splitlines(), 1):
            if found := re.match(r"\s*\[\s*([\w-]+)\s*\]", line):
                inside = found[1]
            key = re.match(r"\s*(?:([\w-]+)\s*\.\s*)?[\"']?([\w-]+)[\"']?\s*=", line)
            if key and (key[1] or inside) == table and key[2].replace("-", "_") == name:
                return f"{self.path}, line {number}"
        return str(self.path)


def read_settings(path: str) -> SettingsFile:
    """Read a file of settings.

    Raises:
        InputError: it cannot be read, is no TOML, or has other tables.
    """
    file = check_readable(path, "a TOML file")
    try:
        text = file.read_text(encoding="utf-8-sig")  # editors on Windows begin files with a mark
        values = tomllib.loads(text)
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{path}: is no TOML ({error}); see 'a2g train MODEL --settings --toml'.") from None
    for name, table in values.items():
        if name not in TABLES or not isinstance(table, dict):
            raise InputError(f"{path}: has {name!r}; expected the tables [model] and [training] alone.")
    tables = {name: {key.replace("-", "_"): value for key, value in table.items()} for name, table in values.items()}
    return SettingsFile(file, text, tables)


def settings_text(model: Any, training: Any) -> str:
    """Settings as a TOML file; those that are None are left out."""
    parts = []
    for table, settings in zip(TABLES, (model, training), strict=True):
        lines = [f"[{table}]"]
        lines += [
            f"# {name} = none" if value is None else f"{name} = {json.dumps(value)}"
            for name, value in asdict(settings).items()
        ]
        parts.append("\n".join(lines))
    return "\n\n".join(parts)
