"""The ``a2g`` command: parsing and printing only."""

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from a2g_jax import __version__
from a2g_jax.errors import A2GError, Interrupted

#: Names of the models; the registry itself is imported late, because it costs seconds.
MODEL_NAMES = ("audio2gestures",)


class _Parser(argparse.ArgumentParser):
    """Bad usage is one line on standard error and status 2; flags are written out, for scripts' sake."""

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"a2g: {message} (see '{self.prog} --help')\n")


def _number(kind: Callable[[str], Any], low: float | int, high: float | int, meaning: str) -> Callable[[str], Any]:
    """A converter that refuses, in words, what is not a number between ``low`` and ``high``."""

    def convert(text: str) -> Any:
        try:
            value = kind(text)
        except ValueError:
            value = float("nan")
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"expected {meaning}; got {text!r}")
        return value

    return convert


_positive = _number(float, 1e-6, 1e9, "a number above 0")
_count = _number(int, 1, 1000, "a whole number from 1 to 1000")
_seed = _number(int, 0, 2**31 - 1, "a whole number from 0 to 2147483647")


def make_parser() -> argparse.ArgumentParser:
    """The command line of all subcommands."""
    parser = _Parser(prog="a2g", description="Speech audio to many different, natural co-speech gestures.")
    parser.add_argument("--debug", action="store_true", help="show a traceback when something goes wrong")
    parser.add_argument("--version", action="version", version=f"a2g_jax {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True, parser_class=_Parser)

    def command(name: str, text: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=text, description=text)
        # Also after the command; without a default of its own it does not undo the one before it.
        sub.add_argument(
            "--debug", action="store_true", default=argparse.SUPPRESS, help="show a traceback when something goes wrong"
        )
        return sub

    def sampling(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("--samples", type=_count, default=5, help="different motions to make (default: 5)")
        sub.add_argument("--seed", type=_seed, default=0, help="of all that is drawn (default: 0)")
        sub.add_argument(
            "--formats", default="bvh,npz,html", help="any of bvh, npz, html, comma-separated (default: all three)"
        )

    demo = command("demo", "Speech in, several gestures out, and a page to look at, with the weights that come along.")
    demo.add_argument("--audio", metavar="FILE", help="your speech (default: a generated one)")
    demo.add_argument("--train", action="store_true", help="train the tiny preset on a generated corpus first")
    demo.add_argument("--out", default="demo", metavar="DIR", help="folder to write to (default: demo)")
    sampling(demo)

    prepare = command("prepare", "Make a corpus from recordings, or generate one.")
    prepare.add_argument("reader", choices=("talker", "folder"), help="talker: generate; folder: WAV and BVH pairs")
    prepare.add_argument("source", nargs="?", help="the folder of recordings (for 'folder')")
    prepare.add_argument("--out", required=True, metavar="CORPUS", help="folder to make")
    prepare.add_argument("--minutes", type=_positive, help="minutes of talk to generate (default: 30)")
    prepare.add_argument("--seed", type=_seed, default=0, help="of the generated talk and of the splits (default: 0)")
    prepare.add_argument("--fps", type=_positive, default=30.0, help="frames per second (default: 30)")
    prepare.add_argument(
        "--joints",
        choices=("body", "all"),
        help="body: the 22 body joints, if they can be found by name; all: the rig as it is (default: body)",
    )

    train = command(
        "train", "Train a model on a corpus. Every setting of the model and the training is a flag too: see --settings."
    )
    train.add_argument("model", choices=MODEL_NAMES)
    train.add_argument("--corpus", metavar="CORPUS", help="made by 'a2g prepare'")
    train.add_argument("--out", metavar="RUN", help="folder of the run")
    train.add_argument("--preset", default="tiny", help="tiny: minutes on 2 cores; paper: as published (default: tiny)")
    train.add_argument("--resume", action="store_true", help="go on from the latest checkpoint")
    train.add_argument("--settings", action="store_true", help="list every setting with its value, and do nothing")

    generate = command("generate", "Make motions for a speech with a trained run.")
    generate.add_argument("run", help="a run folder, or 'demo' for the weights that come along")
    generate.add_argument("--audio", required=True, metavar="FILE", help="speech, in any common format")
    generate.add_argument("--out", required=True, metavar="DIR", help="folder to write to")
    sampling(generate)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit status: 0, 2 for bad usage or input, 130 when interrupted."""
    options, extra = make_parser().parse_known_args(arguments)
    if extra and options.command != "train":
        print(f"a2g: unknown argument {extra[0]} (see 'a2g {options.command} --help')", file=sys.stderr)
        return 2
    try:
        from a2g_jax import commands  # late: importing JAX takes seconds, and --help should not

        getattr(commands, f"run_{options.command}")(options, extra)
    except KeyboardInterrupt:
        print("a2g: interrupted", file=sys.stderr)
        return 130
    except Exception as error:
        if options.debug:
            raise
        status, line = _explain(error)
        print(f"a2g: {' '.join(line.split())}", file=sys.stderr)
        return status
    return 0


def _explain(error: Exception) -> tuple[int, str]:
    """Exit status and message for an error."""
    if isinstance(error, Interrupted):
        return 130, str(error)
    if isinstance(error, A2GError):
        return 2, str(error)
    if isinstance(error, OSError):
        return (
            2,
            f"{error.filename or 'a file'}: cannot be used ({error.strerror or error}); check path and free space.",
        )
    return 1, f"unexpected {type(error).__name__}: {str(error)[:200]}; run again with --debug and report what it shows."


if __name__ == "__main__":
    sys.exit(main())
