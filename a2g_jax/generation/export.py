"""Generated motions as files, and a page that plays them."""

import os
from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from a2g_jax.generation.formats import PAGE, MotionFiles, check_page_size
from a2g_jax.generation.generator import Sampler, audio_frames
from a2g_jax.io.words import Word
from a2g_jax.training.run import Run
from a2g_jax.viz.player import Figure, Track, write_page

#: Reports of an earlier call, which belong to other motions.
_REPORTS = r"pins\.json"


def export(
    run: Run,
    sampler: Sampler,
    audio: Float[np.ndarray, " N"],
    out: str | os.PathLike[str],
    *,
    samples: int,
    seed: int,
    formats: Sequence[str],
    title: str,
    label: str = "",
    words: Sequence[Word] = (),
    lanes: Sequence[Track] = (),
    report: Callable[[int], None] = lambda done: None,
) -> dict[str, int]:
    """Generate and write ``sample_00.bvh``, ``sample_00.npz``, ... and ``index.html``.

    Args:
        run: the sampler's.
        audio: mono, at the run's sample rate.
        formats: names of :func:`~a2g_jax.generation.formats.motion_formats`, and ``html``.
        title: name of the speech, for the page's heading.
        label: description of the sampler, for the page's subtitle.
        lanes: further tracks of the page's timeline.
        report: called with the number of samples done.

    Returns:
        How many files of each format were written.

    Raises:
        InputError: a folder that cannot be used, audio shorter than a frame, or too large a page.
    """
    if PAGE in formats:
        check_page_size(samples, audio_frames(run, audio), run.config.skeleton.joints)
    files, figures = MotionFiles(out, "sample", formats, _REPORTS), []
    for number, motion in enumerate(sampler.stream(audio, samples, seed)):
        files.write(number, motion)
        if PAGE in formats:
            figures.append(Figure(motion=motion, label=f"sample {number}"))
        report(number + 1)
    if figures:
        write_page(
            files.folder / "index.html",
            figures,
            audio,
            run.config.mel.sample_rate,
            title=f"{samples} gestures for {title}" if samples > 1 else f"A gesture for {title}",
            subtitle=f"{run.config.model}, {run.config.preset} preset, {run.steps} training steps, seed {seed}"
            + (f", {label}" if label else ""),
            words=words,
            lanes=lanes,
        )
    return {kind: 1 if kind == PAGE else samples for kind in formats}
