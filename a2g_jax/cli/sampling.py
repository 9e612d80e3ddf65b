"""Flags and output of the commands that generate motions with a run: ``a2g demo`` and ``a2g generate``."""

import argparse
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2g_jax.cli.argument_types import TIER, count, formats, seed
from a2g_jax.cli.paths import existing_file
from a2g_jax.config import check_needs, from_json, parse_flags
from a2g_jax.errors import InputError
from a2g_jax.generation.formats import ORDERS, PAGE, format_names, known_formats
from a2g_jax.models.registry import find_trained_model
from a2g_jax.training.run_file import RUN_FILE, read_description, run_folder, split_settings

if TYPE_CHECKING:
    from a2g_jax.generation.generator import Sampler
    from a2g_jax.training.run import Run


#: Number of motions, unless ``--samples`` gives another.
SAMPLES = 5


def add_arguments(
    parser: argparse.ArgumentParser, samples: int | None = SAMPLES, default: str = f"default: {SAMPLES}"
) -> None:
    """Add ``--control``, ``--samples``, ``--seed``, ``--formats`` and ``--strict``.

    Args:
        samples: the default of ``--samples``, which ``default`` describes.
    """
    usual, known = format_names(), known_formats()
    parser.add_argument(
        "--control",
        action="append",
        metavar="NAME=VALUE",
        help="energy, height, radius, rate or handedness of the hands, from 0 to 1 as quantiles of people"
        " (energy=0.9; over seconds energy=0.2@0,0.9@10), or an emotion (emotion=anger); may be repeated; see"
        " docs/controls.md",
    )
    parser.add_argument("--samples", type=count, default=samples, help=f"number of motions ({default})")
    parser.add_argument("--seed", type=seed, default=0, help="seed of the random numbers (default: 0)")
    parser.add_argument(
        "--formats",
        "--format",
        type=formats(known),
        default=",".join(usual),
        help=f"any of {', '.join(known)}, comma-separated (default: {','.join(usual)}; with --to the character's own in"
        " place of bvh)",
    )
    parser.add_argument(
        "--transcript",
        metavar="FILE",
        help="words of the speech with their times, for the page: TextGrid, TSV, or JSON of Google's speech-to-text,"
        " Whisper, WhisperX or Gentle",
    )
    parser.add_argument("--tier", metavar="NAME", help=TIER)
    parser.add_argument(
        "--strict",
        action="store_true",
        help="an error, and no files, if a motion stays outside the bounds of a body after three more draws"
        " (default: it is reported, also in checks.json)",
    )
    parser.add_argument(
        "--order",
        choices=ORDERS,
        default=ORDERS[0],
        help="order of the samples on the page: by number, or best first by a score of how well strokes meet the speech"
        " (docs/first_motion.md); files keep their names (default: number)",
    )


def sampling_settings(name: str, flags: list[str]) -> Any:
    """Sampling settings of a run, changed by flags such as ``["--temperature", "0.8"]``.

    Args:
        name: a run folder, or the name of a shipped run.

    Raises:
        InputError: not a run, an unknown flag, or a value that does not fit it.
    """
    folder = run_folder(name)
    values = read_description(folder)
    entry = find_trained_model(str(values.get("model")), str(folder / RUN_FILE))
    about = folder / RUN_FILE
    model, sampling = split_settings(entry, values, about)
    stored: Any = from_json(entry.sampling, sampling, str(about))
    (changed,) = parse_flags(flags, stored, hint=f"'a2g generate {name} --settings'")
    check_needs(stored, changed, model)
    return changed


def check_transcript(options: argparse.Namespace) -> None:
    """Refuse flags of a transcript that would have no effect.

    Raises:
        InputError: no such file, no page for its words, or a tier of no transcript.
    """
    existing_file(options.transcript)
    if options.transcript is None and options.tier is not None:
        raise InputError("--tier: belongs to a transcript; name it with --transcript.")
    if options.transcript is not None and PAGE not in options.formats:
        raise InputError(f"--transcript: its words are shown on the page; add {PAGE} to --formats.")


def control_flags(options: argparse.Namespace) -> list[str]:
    """``--control`` as flags of sampling settings."""
    return [part for text in options.control or () for part in ("--control", text)]


def changed_settings(stored: Any, changed: Any) -> str:
    """The sampling settings that differ from those of a run, without the controls, which every page names."""
    found = []
    for field in dataclasses.fields(changed) if changed is not None else ():
        value = getattr(changed, field.name)
        if field.name != "controls" and value != getattr(stored, field.name):
            shown = " ".join(map(str, value)) if isinstance(value, tuple) else value
            found.append(f"{field.metadata.get('flag', field.name).replace('-', ' ').replace('_', ' ')} {shown}")
    return ", ".join(found)


def write_samples(
    run: "Run", sampler: "Sampler", audio: Any, options: argparse.Namespace, title: str, **about: Any
) -> None:
    """Generate, check and write the samples with a progress bar; print the number of files and the result of the check.

    Args:
        audio: (N,), mono, at the run's sample rate.
        title: of the speech, for the page's heading.
        about: further arguments of :func:`~a2g_jax.generation.export.export`.
    """
    from a2g_jax.generation.checked import Checked
    from a2g_jax.generation.export import export
    from a2g_jax.generation.ranking import read_scores
    from a2g_jax.progress import progress_bar

    checked = Checked(run, sampler, strict=options.strict)
    with progress_bar(options.samples, "generating", "motion") as bar:
        written = export(
            run,
            checked,
            audio,
            options.out,
            samples=options.samples,
            seed=options.seed,
            formats=options.formats,
            title=title,
            report=lambda done: bar.update(done - bar.n),
            order=options.order,
            **about,
        )
    print_written(options.out, written)
    for line in checked.lines():
        print(line)
    if scores := read_scores(options.out):
        print("best first:", ", ".join(f"sample {one.sample} ({one.score:.2f})" for one in scores))


def print_written(out: str, written: dict[str, int]) -> None:
    """Print the number of files of each format, and where the page is."""
    print(f"{out}: {', '.join(f'{number} {kind}' for kind, number in written.items())}")
    if PAGE in written:
        print(f"open {Path(out) / 'index.html'} in a browser")
