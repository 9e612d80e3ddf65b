"""``a2g generate``: motions for a speech with a trained run."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2g_jax.cli import characters, clips, sampling
from a2g_jax.cli.argument_types import CHANNEL, channel
from a2g_jax.cli.paths import existing_file, existing_run, writable_folder
from a2g_jax.cli.speech import range_warning, read_speech, read_words
from a2g_jax.config import settings_lines
from a2g_jax.errors import InputError

if TYPE_CHECKING:
    from a2g_jax.generation.delivery import Delivery
    from a2g_jax.training.run import Run

DESCRIPTION = (
    "Generate motions for a speech with a trained run. Every setting of the model's generation is a flag too, such as"
    " --temperature or --edit: 'a2g generate RUN --settings' lists them."
)
#: Further flags are settings.
TAKES_SETTINGS = True


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g generate``; those of settings are read later, since they depend on the run."""
    parser.add_argument(
        "run",
        metavar="RUN",
        help="a run folder, or one that is shipped with the package: 'demo', 'demo-flow' or 'demo-emotion'",
    )
    parser.add_argument(
        "--audio", metavar="FILE", help="speech, in any common format; M4A, AAC, MP4, WebM, WMA and AMR need ffmpeg"
    )
    parser.add_argument("--channel", type=channel, metavar="left|right|N", help=CHANNEL)
    parser.add_argument("--out", metavar="DIR", help="folder to write to; files of an earlier call in it are replaced")
    parser.add_argument("--settings", action="store_true", help="list the sampling settings, and exit")
    clips.add_arguments(parser)
    sampling.add_arguments(parser)
    parser.set_defaults(formats=None)  # the character decides
    characters.add_arguments(parser)


def run(options: argparse.Namespace, extra: list[str]) -> None:
    """Generate, write and print; or list the settings.

    Args:
        extra: sampling settings, such as ``["--temperature", "0.8"]``.

    Raises:
        InputError: a run, audio, clip or folder that cannot be used, or flags that do not fit the run.
    """
    existing_run(options.run)
    settings = sampling.sampling_settings(options.run, [*extra, *sampling.control_flags(options)])
    if options.settings:
        lines = settings_lines(settings) or ["none"]
        print("# sampling settings", *lines, sep="\n")
        return
    for name in ("audio", "out"):
        if getattr(options, name) is None:
            raise InputError(f"--{name} is needed (see 'a2g generate --help').")
    check(options, extra)
    writable_folder(options.out)

    from a2g_jax.compilations import keep_compilations
    from a2g_jax.progress import say

    keep_compilations()
    ready = prepare(options, settings)
    if ready.warning:
        say(ready.warning)
    for line in ready.lines:
        print(line)
    sampling.write_samples(
        ready.run, ready.chosen.sampler, ready.audio, options, ready.title, delivery=ready.delivery, **ready.about
    )
    for line in ready.report(Path(options.out)):
        print(line)


def check(options: argparse.Namespace, extra: Sequence[str] = ()) -> None:
    """Refuse flags that do not fit each other and files that do not exist; set ``options.formats`` where none were
    requested. Nothing heavy is imported.

    Args:
        extra: flags of sampling settings.

    Raises:
        InputError: such a flag or file.
    """
    clips.check_flags(options, extra)
    existing_file(options.audio)
    characters.check(options)
    sampling.check_transcript(options)  # after the formats are settled
    clips.check_files(options)


@dataclass(frozen=True, eq=False)
class Ready:
    """A request that is ready to generate."""

    run: "Run"
    """With the sampling settings of the request."""
    chosen: clips.Chosen
    audio: Any
    """(N,), mono, at the run's sample rate."""
    title: str
    """Of the speech."""
    delivery: "Delivery"
    about: dict[str, Any] = field(default_factory=dict)
    """Further arguments of :func:`~a2g_jax.generation.export.export`: label, words and lanes."""
    lines: tuple[str, ...] = ()
    """Remarks before the work, for the user."""
    warning: str = ""
    """A line about a speech that is unlike the training speech of the run; empty if it is not."""

    def report(self, out: Path) -> list[str]:
        """Write reports to the output folder after the motions; the lines to print."""
        return [*self.delivery.lines(), *self.chosen.report(out)]


def prepare(options: argparse.Namespace, settings: Any, opened: "Run | None" = None) -> Ready:
    """Read everything that a request names: the run, the speech, its words, clips and the character.

    Args:
        options: checked with :func:`check`.
        settings: sampling settings, of :func:`a2g_jax.cli.sampling.sampling_settings`.
        opened: the run, where it is open already.

    Raises:
        InputError: a run, audio, clip or character that cannot be used.
    """
    from a2g_jax.training.run import open_run

    delivery = characters.delivery(options)
    opened = open_run(options.run) if opened is None else opened
    trained = replace(opened, config=replace(opened.config, sampling=settings))
    _ = trained.config.skeleton  # a run on poses without one is refused before any work
    lines = tuple(characters.lines(delivery, trained))
    rate = trained.config.mel.sample_rate
    audio = read_speech(options.audio, options.channel).at(rate)
    warning = range_warning(trained, options.run, audio, options.audio)
    words = read_words(options.transcript, options.tier, len(audio) / rate)
    chosen = clips.sampler_of(trained, audio, options)
    parts = (chosen.about.get("label", ""), sampling.changed_settings(opened.config.sampling_settings, settings))
    about = {**chosen.about, "label": ", ".join(part for part in parts if part), "words": words}
    return Ready(trained, chosen, audio, Path(options.audio).name, delivery, about, lines, warning)
