"""``a2g demo``: motions for a speech with the weights that come with the package, or newly trained ones."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from a2g_jax.cli import sampling
from a2g_jax.cli.argument_types import CHANNEL, channel
from a2g_jax.cli.paths import existing_file, existing_run, writable_folder
from a2g_jax.cli.speech import read_speech, read_words, warn_of_range
from a2g_jax.errors import InputError

DESCRIPTION = "Several motions for a speech, and a page to look at, with the weights that come with the package."
#: Minutes of generated recordings that ``--train`` trains on.
DEMO_MINUTES = 20.0
#: Motions of each system with ``--compare``, and of each emotion with ``--emotions``.
COMPARED_SAMPLES, EMOTION_SAMPLES = 2, 1
#: The run of ``--emotions``.
EMOTION_RUN = "demo-emotion"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g demo``."""
    parser.add_argument("--audio", metavar="FILE", help="your speech (default: a short English one of the package)")
    parser.add_argument("--channel", type=channel, metavar="left|right|N", help=CHANNEL)
    parser.add_argument("--train", action="store_true", help="train the tiny preset on a generated corpus first")
    parser.add_argument(
        "--compare",
        nargs="*",
        metavar="RUN",
        help="all systems with included weights on one page, beside the true talker of the package's speech; and these"
        " runs",
    )
    parser.add_argument(
        "--emotions",
        nargs="?",
        const=EMOTION_RUN,
        metavar="RUN",
        help=f"one motion for each emotion on one page, of {EMOTION_RUN} or another run with emotions",
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        help="folder to write to; files of an earlier call in it are replaced (default: demo; with --compare"
        " comparison, with --emotions emotions)",
    )
    sampling.add_arguments(
        parser,
        None,
        f"default: {sampling.SAMPLES}; with --compare {COMPARED_SAMPLES} of each system, with --emotions"
        f" {EMOTION_SAMPLES} of each",
    )


def run(options: argparse.Namespace, _extra: list[str]) -> None:
    """Generate, write and print.

    Raises:
        InputError: audio, a run or a folder that cannot be used, or flags that exclude each other.
    """
    existing_file(options.audio)
    sampling.check_transcript(options)
    if options.transcript is not None and options.audio is None:
        raise InputError("--transcript: belongs to a speech; name it with --audio.")
    chosen = [flag for flag, on in _modes(options).items() if on]
    if len(chosen) > 1:
        raise InputError(
            f"{' and '.join(chosen)} exclude each other; to see a run of your own, train it first and name it:"
            " --compare RUN."
        )
    page, samples, command = {
        "--compare": ("comparison", COMPARED_SAMPLES, _compare),
        "--emotions": ("emotions", EMOTION_SAMPLES, _emotions),
    }.get("".join(chosen), ("demo", sampling.SAMPLES, _demo))
    if options.order != "number" and page != "demo":
        raise InputError(f"--order: orders the samples of one run; leave it out with {chosen[0]}.")
    options.out = options.out or page
    options.samples = options.samples or samples
    writable_folder(options.out)
    command(options)


def _modes(options: argparse.Namespace) -> dict[str, bool]:
    """Whether each flag is given of those of which one page can have only one."""
    return {
        "--train": options.train,
        "--compare": options.compare is not None,
        "--emotions": options.emotions is not None,
    }


def _demo(options: argparse.Namespace) -> None:
    """Motions of the default run, or of a newly trained one."""
    from a2g_jax.compilations import keep_compilations
    from a2g_jax.features.mel import MelConfig
    from a2g_jax.generation.controls import control_rows
    from a2g_jax.generation.generator import Generator, audio_frames
    from a2g_jax.talker.demo_speech import demo_speech
    from a2g_jax.training.run import demo_run

    keep_compilations()
    shipped = demo_run()
    # Bad audio is refused before minutes of training.
    words: Any = ()
    if options.audio is not None:
        rate = MelConfig().sample_rate
        audio, title = read_speech(options.audio, options.channel).at(rate), Path(options.audio).name
        if not options.train:
            warn_of_range(shipped, "demo", audio, options.audio)
        words = read_words(options.transcript, options.tier, len(audio) / rate)
    else:
        speech = demo_speech()
        audio, title, words = speech.audio, "the speech of the demo", speech.words
    if options.control:
        # Refused before minutes of training, too.
        control_rows(shipped, options.control, audio_frames(shipped, audio))
    trained = _train(Path(options.out)) if options.train else shipped
    trained = replace(trained, config=trained.config.with_sampling(controls=tuple(options.control or ())))
    sampling.write_samples(trained, Generator(trained), audio, options, title, words=words)


def _compare(options: argparse.Namespace) -> None:
    """Motions of all systems on one page."""
    for name in options.compare:
        existing_run(name)

    from a2g_jax.generation.comparison import systems

    _side_by_side(options, systems(options.compare), "system")


def _emotions(options: argparse.Namespace) -> None:
    """Motions of all emotions on one page."""
    existing_run(options.emotions)

    from a2g_jax.generation.comparison import emotions

    _side_by_side(options, emotions(options.emotions), "emotion")


def _side_by_side(options: argparse.Namespace, runs: dict[str, Any], kind: str) -> None:
    """One page of several runs."""
    from a2g_jax.compilations import keep_compilations
    from a2g_jax.generation.comparison import Speech, compare, demo_speech_with_truth
    from a2g_jax.progress import progress_bar

    keep_compilations()
    speech = demo_speech_with_truth()
    if options.audio is not None:
        sound = read_speech(options.audio, options.channel)
        seconds = len(sound.samples) / sound.info.sample_rate
        words = read_words(options.transcript, options.tier, seconds)
        speech = Speech(Path(options.audio).name, sound.at, words)
    with progress_bar(options.samples * len(runs), "generating", "motion") as bar:
        compared = compare(
            runs,
            speech,
            options.out,
            samples=options.samples,
            seed=options.seed,
            formats=options.formats,
            controls=options.control or (),
            strict=options.strict,
            kind=kind,
            report=lambda: bar.update(),
        )
    sampling.print_written(options.out, compared.written)
    for line in compared.lines:
        print(line)


def _train(out: Path) -> Any:
    """The run in ``out / "run"``, trained or resumed on the corpus in ``out / "corpus"``."""
    from a2g_jax.data.generated import TalkerOptions
    from a2g_jax.data.prepare import prepare_talker
    from a2g_jax.models import find_model
    from a2g_jax.training.start import run_training

    if not (out / "corpus").exists():
        prepare_talker(out / "corpus", TalkerOptions(minutes=DEMO_MINUTES))
    entry = find_model("audio2gestures")
    model, training = entry.presets["tiny"], entry.training_preset("tiny")
    return run_training("audio2gestures", "tiny", model, training, out / "corpus", out / "run", resume=True)
