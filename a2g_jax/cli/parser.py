"""The parser of all commands, their dispatch, and errors as one line and an exit status."""

import argparse
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from types import ModuleType
from typing import Any, NoReturn

from a2g_jax import __version__
from a2g_jax.cli import demo, evaluate, export, generate, inspect, label, prepare, retarget, serve, studio, talk, train
from a2g_jax.errors import A2GError, InputWarning, Interrupted, UnknownFlag

#: The module of each command: ``DESCRIPTION``, ``add_arguments(parser)`` and ``run(options, extra)``, which returns
#: the exit status or None for 0. With ``TAKES_SETTINGS``, unknown flags are ``extra``.
COMMANDS: dict[str, ModuleType] = {
    "demo": demo,
    "talk": talk,
    "prepare": prepare,
    "label": label,
    "train": train,
    "generate": generate,
    "export": export,
    "inspect": inspect,
    "evaluate": evaluate,
    "retarget": retarget,
    "serve": serve,
    "studio": studio,
}


class Parser(argparse.ArgumentParser):
    """A parser that reports bad usage in one line on standard error with status 2, and takes no abbreviated flags."""

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)

    def _parse_optional(self, arg_string: str) -> Any:
        # An axis such as -z is the value of a flag, not a flag.
        return None if arg_string in ("-x", "-y", "-z") else super()._parse_optional(arg_string)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        names = [str(name) for name in action.choices or ()]
        if action.dest == "command" and value not in names and (similar := get_close_matches(str(value), names, 1)):
            self.error(f"there is no command {value!r}; did you mean {similar[0]}?")
        super()._check_value(action, value)

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"a2g: {message} (see '{self.prog} --help')\n")


def make_parser() -> argparse.ArgumentParser:
    """The parser of all commands."""
    debug = "show a traceback when something goes wrong"
    parser = Parser(prog="a2g", description="Speech audio to many different, natural co-speech gestures.")
    parser.add_argument("--debug", action="store_true", help=debug)
    parser.add_argument("--version", action="version", version=f"a2g_jax {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True, parser_class=Parser)
    for name, module in COMMANDS.items():
        sub = commands.add_parser(name, help=module.DESCRIPTION, description=module.DESCRIPTION)
        # Also after the command; without a default of its own it does not undo the one before it.
        sub.add_argument("--debug", action="store_true", default=argparse.SUPPRESS, help=debug)
        module.add_arguments(sub)
    return parser


def flags_of(parser: argparse.ArgumentParser, command: str) -> list[str]:
    """The long flags of a command."""
    (commands,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    actions = commands.choices[command]._actions
    return [flag for action in actions for flag in action.option_strings if flag.startswith("--")]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command.

    Returns:
        The exit status: 0; 1 for warnings with ``inspect --strict`` and for unexpected errors; 2 for bad usage or
        input; 130 when interrupted.

    Raises:
        SystemExit: after ``--help`` and ``--version``, and with status 2 for arguments that argparse refuses.
    """
    parser = make_parser()
    options, extra = parser.parse_known_args(arguments)
    if extra and not getattr(COMMANDS[options.command], "TAKES_SETTINGS", False):
        hint = f"(see 'a2g {options.command} --help')"
        similar = get_close_matches(extra[0].partition("=")[0], flags_of(parser, options.command), 1, 0.7)
        question = f"; did you mean {similar[0]}?" if similar else ""
        print(f"a2g: unknown argument {extra[0]}{question} {hint}", file=sys.stderr)
        return 2
    try:
        with warnings.catch_warnings():
            # A doubt about a file is a line, not a place in the source.
            warnings.simplefilter("always", InputWarning)
            warnings.showwarning = _show(warnings.showwarning)
            status: int = COMMANDS[options.command].run(options, extra) or 0
        sys.stdout.flush()
        return status
    except KeyboardInterrupt:
        print("a2g: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader of the output (head, a pager) has closed it; Python would complain again when it flushes.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        if options.debug:
            raise
        status, line = _explain(error)
        if isinstance(error, UnknownFlag):
            line = error.among(flags_of(parser, options.command))
        try:
            sys.stdout.flush()
        except OSError:  # a full disk; Python would complain again at its end
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        print(f"a2g: {' '.join(line.split())}", file=sys.stderr)
        return status


def _show(otherwise: Callable[..., None]) -> Callable[..., None]:
    """A handler that prints an ``InputWarning`` as one line and gives any other to a handler."""

    def show(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
        if issubclass(category, InputWarning):
            print(f"a2g: note: {' '.join(str(message).split())}", file=sys.stderr)
        else:
            otherwise(message, category, *where, **more)

    return show


def _explain(error: Exception) -> tuple[int, str]:
    """Exit status and message for an error."""
    if isinstance(error, Interrupted):
        return 130, str(error)
    if isinstance(error, A2GError):
        return 2, str(error)
    if isinstance(error, OSError):
        return (
            2,
            f"{error.filename or 'the output'}: cannot be used ({error.strerror or error}); check path and free space.",
        )
    return 1, f"unexpected {type(error).__name__}: {str(error)[:200]}; run again with --debug and report what it shows."
