"""Print ``docs/commands.md``: ``python -m a2g_jax.cli.reference > docs/commands.md``."""

import argparse
from collections.abc import Iterator

from a2g_jax.cli.parser import make_parser
from a2g_jax.config import settings_lines
from a2g_jax.models.registry import find_model, model_names

_INTRODUCTION = """# Commands

Every command and flag of `a2g`, from the parsers themselves (`python -m a2g_jax.cli.reference > docs/commands.md`).
`a2g COMMAND --help` prints the same. The exit status is 0; 1 for warnings with `a2g inspect --strict`, and for an
unexpected error; 2 for bad usage or input, with one line that names the place and the remedy; 130 when interrupted.
`--debug` adds a traceback, and `a2g --version` prints the version.
"""
_SETTINGS = """## Settings of generation

They depend on the model, and are flags of `a2g generate RUN`, which changes nothing in the run. `a2g generate RUN
--settings` lists those of a run with its own values; these are the papers'. `a2g train MODEL --settings` lists those of
training.
"""


def markdown() -> str:
    """The page of all commands."""
    parts = [_INTRODUCTION]
    for name, parser in _commands(make_parser()).items():
        parts += [f"## a2g {name}\n", f"{_text(parser.description or '')}\n", *_usage(parser), *_flags(parser)]
    parts.append(_SETTINGS)
    for model in model_names():
        lines = settings_lines(find_model(model).sampling())
        if lines:
            parts += [f"### {model}\n", "```text", *lines, "```", ""]
    return "\n".join(parts).rstrip() + "\n"


def _commands(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    (action,) = (one for one in parser._actions if isinstance(one, argparse._SubParsersAction))
    return dict(action.choices)


def _usage(parser: argparse.ArgumentParser) -> Iterator[str]:
    named = [f"{_value(one)}" for one in parser._actions if not one.option_strings]
    yield f"`{' '.join([parser.prog, *named, '[flags]'])}`\n"


def _flags(parser: argparse.ArgumentParser) -> Iterator[str]:
    yield "| | |\n|---|---|"
    for action in parser._actions:
        if action.help == argparse.SUPPRESS or isinstance(action, argparse._HelpAction):
            continue
        value = f" {_value(action)}" if action.option_strings and action.nargs != 0 else ""
        name = ", ".join(action.option_strings) or _value(action)
        yield f"| `{_cell(name + value)}` | {_text(_expanded(action, parser))} |"
    yield ""


def _value(action: argparse.Action) -> str:
    """The placeholder of an argument's value."""
    name = "|".join(map(str, action.choices)) if action.choices is not None else None
    shown = action.metavar or name or action.dest.upper()
    text = " ".join(shown) if isinstance(shown, tuple) else str(shown)
    return {"*": f"[{text} ...]", "+": f"{text} [{text} ...]", "?": f"[{text}]"}.get(str(action.nargs), text)


def _expanded(action: argparse.Action, parser: argparse.ArgumentParser) -> str:
    values = {**vars(action), "prog": parser.prog}
    return (action.help or "") % {name: value for name, value in values.items() if value is not None}


def _text(text: str) -> str:
    return _cell(" ".join(text.split())).replace("<", "&lt;").replace("*", r"\*")


def _cell(text: str) -> str:
    return text.replace("|", r"\|")


if __name__ == "__main__":
    print(markdown(), end="")
