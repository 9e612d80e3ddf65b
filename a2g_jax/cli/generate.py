"""``a2g generate``: motions for a speech with a trained run."""

import argparse
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

from a2g_jax.cli import clips, sampling
from a2g_jax.cli.argument_types import whole
from a2g_jax.cli.paths import existing_file, existing_run
from a2g_jax.errors import InputError

if TYPE_CHECKING:
    from a2g_jax.training.run import Run

DESCRIPTION = "Make motions for a speech with a trained run."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g generate``."""
    parser.add_argument("run", help="a run folder, or 'demo' or 'demo-flow' for those that come with the package")
    parser.add_argument("--audio", required=True, metavar="FILE", help="speech, in any common format")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder to write to")
    parser.add_argument("--keep-shared", type=whole, metavar="N", help="lowest DCT bands of S to keep")
    parser.add_argument("--keep-specific", type=whole, metavar="N", help="lowest DCT bands of I to keep")
    parser.add_argument(
        "--edit",
        action="append",
        metavar="EDIT",
        help="of DCT bands, such as 'specific scale 0:10 1.5'; may be repeated",
    )
    parser.add_argument(
        "--control",
        action="append",
        metavar="NAME=PERCENTILE",
        help="hand height, speed or radius, such as height=90, or over seconds 'height=10@0 90@5', in percentiles of"
        " the training clips, for runs with --style-controls; may be repeated",
    )
    clips.add_arguments(parser)
    sampling.add_arguments(parser)


def run(options: argparse.Namespace, _extra: list[str]) -> None:
    """Generate, write and print.

    Raises:
        InputError: a run, audio, clip or folder that cannot be used, or flags that do not fit the run.
    """
    clips.check_flags(options)
    existing_run(options.run)
    existing_file(options.audio)
    clips.check_files(options)

    from a2g_jax.compilations import keep_compilations
    from a2g_jax.generation.audio2gestures.pin_report import describe
    from a2g_jax.io.audio import read_audio
    from a2g_jax.io.files import read_json
    from a2g_jax.training.run import open_run

    keep_compilations()
    trained = _controlled(_edited(open_run(options.run), options), options)
    audio = read_audio(options.audio, trained.config.mel.sample_rate)
    pins, styling = clips.pins_of(options), clips.styling_of(options)
    sampling.write_samples(trained, audio, options, Path(options.audio).name, pins=pins, styling=styling)
    for note in () if styling is None else styling.notes:
        print(note)
    if pins is not None:
        for sample, rows in enumerate(read_json(Path(options.out) / "pins.json")):
            for row in rows:
                print(f"sample {sample}, {describe(row)}")


def _edited(trained: "Run", options: argparse.Namespace) -> "Run":
    """The run with the edits of latent bands in the flags."""
    kept = (("shared", options.keep_shared), ("specific", options.keep_specific))
    edits = [f"{name} keep {bands}" for name, bands in kept if bands is not None] + (options.edit or [])
    if not edits:
        return trained
    if not hasattr(trained.config.model_config, "edits"):
        raise InputError(f"{options.run}: is a run of {trained.config.model}, whose codes have no DCT bands to edit.")
    return _with_settings(trained, edits=tuple(edits))


def _controlled(trained: "Run", options: argparse.Namespace) -> "Run":
    """The run with the style controls in the flags."""
    if not options.control:
        return trained
    if not getattr(trained.config.model_config, "style_controls", ()):
        raise InputError(
            f"--control {options.control[0]!r}: {options.run} was trained without style controls; train one with"
            " 'a2g train stylized_flow --style-controls height,speed,radius'."
        )
    return _with_settings(trained, control_curves=tuple(options.control))


def _with_settings(trained: "Run", **changes: tuple[str, ...]) -> "Run":
    settings = dataclasses.replace(trained.config.model_config, **changes)
    return dataclasses.replace(trained, config=dataclasses.replace(trained.config, model_config=settings))
