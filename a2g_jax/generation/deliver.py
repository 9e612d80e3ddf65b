"""Generated motions as files: BVH, NPZ and a page to look at."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.data.recording import Word
from a2g_jax.errors import InputError
from a2g_jax.generation.generate import Generator
from a2g_jax.io.bvh import write_bvh
from a2g_jax.io.npz import write_motion_npz
from a2g_jax.training.run import Run

FORMATS = ("bvh", "npz", "html")


def check_formats(text: str) -> tuple[str, ...]:
    """The formats in a comma-separated list.

    Raises:
        InputError: none, or one that is not known.
    """
    formats = tuple(part.strip().lower() for part in text.split(",") if part.strip())
    for name in formats:
        if name not in FORMATS:
            raise InputError(f"--formats: no format {name!r}; there are: {', '.join(FORMATS)}.")
    if not formats:
        raise InputError(f"--formats: name at least one of {', '.join(FORMATS)}.")
    return formats


def deliver(
    run: Run,
    audio: Float[np.ndarray, " N"],
    out: str | os.PathLike[str],
    *,
    samples: int,
    seed: int,
    formats: str,
    title: str,
    words: Sequence[Word] = (),
    report: Callable[[int], None] = lambda done: None,
) -> dict[str, int]:
    """Generate and write ``sample_00.bvh``, ``sample_00.npz``, ... and ``index.html``.

    Args:
        audio: mono, at the run's sample rate.
        formats: comma-separated; see :func:`check_formats`.
        title: what was spoken, for the page's heading.
        report: called with the number of samples done.

    Returns:
        How many files of each format were written.
    """
    from a2g_jax.viz.player import Figure, write_page

    kinds = check_formats(formats)
    out = Path(out)
    if out.is_file():
        raise InputError(f"{out}: is a file; name a folder to write to.")
    motions = Generator(run).generate(audio, samples, seed, report)
    out.mkdir(parents=True, exist_ok=True)
    for number, motion in enumerate(motions):
        if "bvh" in kinds:
            write_bvh(out / f"sample_{number:02d}.bvh", motion)
        if "npz" in kinds:
            write_motion_npz(out / f"sample_{number:02d}.npz", motion)
    if "html" in kinds:
        write_page(
            out / "index.html",
            [Figure(motion=motion, label=f"sample {number}") for number, motion in enumerate(motions)],
            audio,
            run.config.mel.sample_rate,
            title=f"{samples} gestures for {title}" if samples > 1 else f"A gesture for {title}",
            subtitle=f"{run.config.model}, {run.config.preset} preset, {run.steps} training steps, seed {seed}",
            words=words,
        )
    return {kind: 1 if kind == "html" else samples for kind in kinds}
