"""The ``a2g`` command: parsing and printing only."""

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from a2g_jax import __version__
from a2g_jax.errors import A2GError, Interrupted
from a2g_jax.evaluation import arguments as evaluation
from a2g_jax.generation import retarget_arguments as retargeting
from a2g_jax.generation import style_arguments as styling
from a2g_jax.inspection import arguments as inspection

#: Names of the models; the registry itself is imported late, because it costs seconds.
MODEL_NAMES = ("audio2gestures", "speech2gesture", "stylized_flow", "motion_autoencoder", "emotion_classifier")
#: What can be prepared; the readers themselves are imported late for the same reason.
READERS = (
    *("talker", "folder", "trinity", "genea2022", "genea2023", "beat", "beat2", "zeroeggs"),
    *("ted", "ted-expressive", "s2g", "pats", "show"),
)


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


def _reader(text: str) -> str:
    """A name of something to prepare, or a Python file that reads it."""
    if text not in READERS and not text.endswith(".py"):
        raise argparse.ArgumentTypeError(f"expected one of {', '.join(READERS)}, or a reader.py; got {text!r}")
    return text


_positive = _number(float, 1e-6, 1e9, "a number above 0")
_count = _number(int, 1, 1000, "a whole number from 1 to 1000")
_rate = _number(int, 8000, 96000, "a whole number from 8000 to 96000")
_fps = _number(float, 1, 1000, "a number from 1 to 1000")
_seconds = _number(float, 2, 600, "a number from 2 to 600")
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

    talk = command("talk", "A generated recording, several motions that are right for it, and the truth about them.")
    talk.add_argument("--out", required=True, metavar="DIR", help="folder to write to")
    talk.add_argument("--seconds", type=_seconds, help="length (default: 20)")
    talk.add_argument("--speaker", metavar="NAME", help="who talks (default: ada)")
    talk.add_argument("--emotion", metavar="NAME", help="in which emotion (default: neutral)")
    talk.add_argument("--seed", type=_seed, default=0, help="of all that is drawn (default: 0)")
    talk.add_argument("--samples", type=_count, default=5, help="different right motions (default: 5)")
    talk.add_argument("--fps", type=_fps, help="frames per second (default: 30; 15 with --view beat)")
    talk.add_argument("--sample-rate", type=_rate, default=16000, metavar="HZ", help="of the audio (default: 16000)")
    talk.add_argument("--fingers", action="store_true", help="52 joints with fingers instead of the 22 of the body")
    talk.add_argument("--room", action="store_true", help="as heard by some microphone in some room")
    talk.add_argument(
        "--view", choices=("body", "beat"), default="body", help="beat: BEAT's 47 upper-body joints (default: body)"
    )
    talk.add_argument("--corpus", metavar="CORPUS", help="show a recording of this generated corpus instead")
    talk.add_argument("--recording", metavar="NAME", help="which one of the corpus (default: the first)")
    talk.add_argument(
        "--formats",
        default="wav,textgrid,json,bvh,npz,html",
        help="any of wav, textgrid, json, bvh, npz, html, comma-separated (default: all)",
    )

    prepare = command(
        "prepare", "Make a corpus from recordings, or generate one. Stopped before its end, the same command goes on."
    )
    prepare.add_argument(
        "reader", nargs="?", type=_reader, metavar="NAME", help="talker, a data set (see --list), or a reader.py"
    )
    prepare.add_argument("source", nargs="?", metavar="DIR", help="the data set's folder")
    prepare.add_argument("--list", action="store_true", help="say what can be prepared, and do nothing")
    prepare.add_argument("--out", metavar="CORPUS", help="folder to make")
    prepare.add_argument("--seed", type=_seed, default=0, help="of the generated talk and of the splits (default: 0)")
    prepare.add_argument(
        "--workers", type=_count, help="processes; the corpus is the same for any (default: one a core)"
    )
    prepare.add_argument(
        "--features", metavar="PAPER", help="rate, mel bands and poses of a paper (default: audio2gestures; see --list)"
    )
    prepare.add_argument("--fps", type=_fps, help="frames per second (default: what the paper or the data set has)")
    prepare.add_argument(
        "--waveform", action="store_true", help="keep the audio too, for models that look at it otherwise"
    )
    prepare.add_argument(
        "--pose",
        choices=("6d", "exponential", "directions", "keypoints"),
        help="how poses are written down (default: what the paper, the data set or the view has)",
    )
    recorded = prepare.add_argument_group("of recordings")
    recorded.add_argument(
        "--joints",
        choices=("body", "upper-body", "all"),
        help="body: any rig on 22 joints; upper-body: on 47 with fingers; all: the rig as it is (default: body)",
    )
    recorded.add_argument("--random-split", action="store_true", help="split by the seed, not as the authors did")
    recorded.add_argument("--skip-broken", action="store_true", help="leave out recordings that cannot be read")
    recorded.add_argument("--limit", type=_number(int, 1, 10**9, "a whole number above 0"), help="take only so many")
    generated = prepare.add_argument_group("of generated talk")
    generated.add_argument("--minutes", type=_positive, help="minutes of talk to generate (default: 30)")
    generated.add_argument("--speakers", metavar="NAMES", help="who talks, comma-separated (default: all)")
    generated.add_argument("--emotions", metavar="NAMES", help="in which emotions, comma-separated (default: all)")
    generated.add_argument("--jitter", type=_positive, metavar="DEGREES", help="capture noise on the generated motion")
    generated.add_argument("--fingers", action="store_true", help="52 joints with fingers instead of the body's 22")
    generated.add_argument(
        "--view",
        choices=("body", "beat", "ted", "ted-expressive", "s2g"),
        help="show the speakers as a data set does: joints, bone directions or keypoints (default: body)",
    )
    generated.add_argument(
        "--on-demand",
        action="store_true",
        help="store the first 60 minutes; the rest is for training and generated in training, 30 minutes at a time",
    )

    train = command(
        "train", "Train a model on a corpus. Every setting of the model and the training is a flag too: see --settings."
    )
    train.add_argument("model", choices=MODEL_NAMES)
    train.add_argument("--corpus", metavar="CORPUS", help="made by 'a2g prepare'")
    train.add_argument("--out", metavar="RUN", help="folder of the run")
    train.add_argument(
        "--preset",
        default="tiny",
        help="tiny: minutes on 2 cores; paper: as published; of stylized_flow also ted, moglow and moglow_styled"
        " (default: tiny)",
    )
    train.add_argument(
        "--features", metavar="RUN", help="a run of motion_autoencoder, or 'demo', for models with a perceptual loss"
    )
    train.add_argument("--resume", action="store_true", help="go on from the latest checkpoint")
    train.add_argument("--settings", action="store_true", help="list every setting with its value, and do nothing")

    inspect = command("inspect", inspection.DESCRIPTION)
    inspection.add_arguments(inspect)

    evaluate = command("evaluate", evaluation.DESCRIPTION)
    evaluation.add_arguments(evaluate)

    retarget = command("retarget", retargeting.DESCRIPTION)
    retargeting.add_arguments(retarget)

    generate = command("generate", "Make motions for a speech with a trained run.")
    generate.add_argument("run", help="a run folder, or 'demo' or 'demo-flow' for weights that come along")
    generate.add_argument("--audio", required=True, metavar="FILE", help="speech, in any common format")
    generate.add_argument("--out", required=True, metavar="DIR", help="folder to write to")
    generate.add_argument(
        "--keep-shared",
        type=_number(int, 0, 10**6, "a whole number"),
        metavar="N",
        help="lowest DCT bands of S to keep",
    )
    generate.add_argument(
        "--keep-specific",
        type=_number(int, 0, 10**6, "a whole number"),
        metavar="N",
        help="lowest DCT bands of I to keep",
    )
    generate.add_argument(
        "--edit",
        action="append",
        metavar="EDIT",
        help="of DCT bands, such as 'specific scale 0:10 1.5'; may be repeated",
    )
    generate.add_argument(
        "--control",
        action="append",
        metavar="NAME=PERCENTILE",
        help="how high, fast or wide the hands move, such as height=90, or over seconds 'height=10@0 90@5', in"
        " percentiles of the training clips, for runs with --style-controls; may be repeated",
    )
    pin = generate.add_argument_group("clips on the timeline")
    pin.add_argument(
        "--pin",
        action="append",
        metavar="FILE@SECOND[+LENGTH]",
        help="a BVH or NPZ to perform from then on (its first LENGTH seconds); may be repeated",
    )
    pin.add_argument(
        "--pin-blend", type=_number(float, 0.0, 10.0, "seconds"), metavar="SECONDS", help="around each (default: 0.75)"
    )
    pin.add_argument(
        "--pin-shared",
        type=_number(float, 0.0, 1.0, "a number"),
        metavar="SHARE",
        help="of the clip's own shared code beside the audio's (default: 0, as in the paper)",
    )
    pin.add_argument(
        "--pin-corpus",
        metavar="CORPUS",
        help="whose 99th percentile of jerk seams are held against (default: the clip's)",
    )
    styling.add_arguments(generate, _number(float, 0.0, 1.0, "a number from 0 to 1"))
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

        status = getattr(commands, f"run_{options.command}")(options, extra) or 0
        sys.stdout.flush()
        return status
    except KeyboardInterrupt:
        print("a2g: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # Whoever read the output (head, a pager) has seen enough; Python would complain again when it flushes.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
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
