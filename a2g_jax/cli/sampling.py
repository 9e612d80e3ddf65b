"""Flags and output of the commands that generate motions with a run: ``a2g demo`` and ``a2g generate``."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2g_jax.cli.argument_types import count, formats, seed
from a2g_jax.generation.formats import FORMATS

if TYPE_CHECKING:
    from a2g_jax.data.recording import Word
    from a2g_jax.training.run import Run


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--samples``, ``--seed`` and ``--formats``."""
    parser.add_argument("--samples", type=count, default=5, help="number of motions (default: 5)")
    parser.add_argument("--seed", type=seed, default=0, help="of the random numbers (default: 0)")
    parser.add_argument(
        "--formats",
        type=formats(FORMATS),
        default=",".join(FORMATS),
        help="any of bvh, npz, html, comma-separated (default: all three)",
    )


def write_samples(
    run: "Run", audio: Any, options: argparse.Namespace, title: str, *, words: "Sequence[Word]" = (), **clips: Any
) -> None:
    """Generate and write the samples with a progress bar, and print what was written.

    Args:
        audio: (N,), mono, at the run's sample rate.
        title: of the speech, for the page's heading.
        words: of the speech, for the page.
        clips: ``pins`` or ``styling``; see :func:`~a2g_jax.generation.export.deliver`.
    """
    from a2g_jax.generation.export import deliver
    from a2g_jax.progress import progress_bar

    with progress_bar(options.samples, "generating", "motion") as bar:
        written = deliver(
            run,
            audio,
            options.out,
            samples=options.samples,
            seed=options.seed,
            formats=options.formats,
            title=title,
            words=words,
            report=lambda done: bar.update(done - bar.n),
            **clips,
        )
    print_written(options.out, written)


def print_written(out: str, written: dict[str, int]) -> None:
    """Print the number of files of each format, and where the page is."""
    print(f"{out}: {', '.join(f'{number} {kind}' for kind, number in written.items())}")
    if "html" in written:
        print(f"open {Path(out) / 'index.html'} in a browser")
