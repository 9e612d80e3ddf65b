"""The ``a2g`` command: parsing and printing only."""

import argparse
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from a2g_jax import __version__
from a2g_jax.errors import A2GError

#: Names of the models; the registry itself is imported late, because it costs seconds.
MODEL_NAMES = ("audio2gestures",)


class _Parser(argparse.ArgumentParser):
    """Bad usage is one line on standard error and status 2; flags are written out, for scripts' sake."""

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"a2g: {message} (see '{self.prog} --help')\n")


def _positive(text: str) -> float:
    value = float(text)
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"expected a number above 0; got {text}")
    return value


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"expected 1 or more; got {text}")
    return value


def _seed(text: str) -> int:
    value = int(text)
    if not 0 <= value < 2**31:
        raise argparse.ArgumentTypeError(f"expected a whole number from 0 to 2147483647; got {text}")
    return value


def make_parser() -> argparse.ArgumentParser:
    """The command line of all subcommands."""
    parser = _Parser(prog="a2g", description="Speech audio to many different, natural co-speech gestures.")
    parser.add_argument("--version", action="version", version=f"a2g_jax {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True, parser_class=_Parser)

    def command(name: str, text: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=text, description=text)
        sub.add_argument("--debug", action="store_true", help="show a traceback when something goes wrong")
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
    prepare.add_argument("--minutes", type=_positive, default=30.0, help="minutes of talk to generate (default: 30)")
    prepare.add_argument("--seed", type=_seed, default=0, help="of the generated talk and of the splits (default: 0)")
    prepare.add_argument("--fps", type=_positive, default=30.0, help="frames per second (default: 30)")
    prepare.add_argument(
        "--joints",
        choices=("body", "all"),
        default="body",
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
    except A2GError as error:
        if options.debug:
            raise
        print(f"a2g: {' '.join(str(error).split())}", file=sys.stderr)
        from a2g_jax.training.loop import Interrupted

        return 130 if isinstance(error, Interrupted) else 2
    except KeyboardInterrupt:
        print("a2g: interrupted", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
