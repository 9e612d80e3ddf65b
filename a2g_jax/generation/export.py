"""Generated motions as files: BVH, NPZ and a page to look at."""

import os
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.data.recording import Word
from a2g_jax.errors import InputError
from a2g_jax.generation.audio2gestures.pinned import Pins
from a2g_jax.generation.engine import Generator
from a2g_jax.generation.stylized_flow.styled import Styling
from a2g_jax.io.bvh import write_bvh
from a2g_jax.io.files import make_folder, write_json
from a2g_jax.io.npz import write_motion_npz
from a2g_jax.training.run import Run

#: Most joint positions that a page may hold: about 200 MB of HTML.
_PAGE_LIMIT = 20_000_000


def deliver(
    run: Run,
    audio: Float[np.ndarray, " N"],
    out: str | os.PathLike[str],
    *,
    samples: int,
    seed: int,
    formats: Sequence[str],
    title: str,
    words: Sequence[Word] = (),
    pins: Pins | None = None,
    styling: Styling | None = None,
    report: Callable[[int], None] = lambda done: None,
) -> dict[str, int]:
    """Generate and write ``sample_00.bvh``, ``sample_00.npz``, ... and ``index.html``; with pins also ``pins.json``.

    Args:
        audio: mono, at the run's sample rate.
        formats: any of :data:`a2g_jax.generation.formats.FORMATS`.
        title: what was spoken, for the page's heading.
        pins: clips that are pinned to moments of every sample; not with ``styling``.
        styling: clips whose style every sample takes on, or that it goes on from.
        report: called with the number of samples done.

    Returns:
        How many files of each format were written.

    Raises:
        InputError: a folder that cannot be used, audio shorter than a frame, too large a page, or clips
            that cannot be used.
    """
    from a2g_jax.viz.player import Figure, write_page

    generator = Generator(run)
    pinned = None if pins is None else pins.place(run, generator.frames(audio))
    styled = None if styling is None else styling.place(run, samples)
    frames, joints = generator.frames(audio), run.config.skeleton.joints
    if "html" in formats and samples * frames * joints > _PAGE_LIMIT:
        raise InputError(
            f"a page of {samples} motions of {frames} frames would be too large for a browser;"
            " ask for fewer --samples, or for --formats bvh,npz."
        )
    out = make_folder(out)
    # What an earlier run left here would stand beside motions for another speech.
    for old in (*out.glob("sample_*.bvh"), *out.glob("sample_*.npz"), *out.glob("index.html"), *out.glob("pins.json")):
        if re.fullmatch(r"sample_\d+\.(bvh|npz)|index\.html|pins\.json", old.name):
            old.unlink()
    figures: list[Figure] = []
    followed: list[list[dict[str, Any]]] = []
    if styled is not None:
        motions = styled.stream(audio, samples, seed)
    elif pinned is not None:
        motions = pinned.stream(audio, samples, seed, followed)
    else:
        motions = generator.stream(audio, samples, seed)
    for number, motion in enumerate(motions):
        if "bvh" in formats:
            write_bvh(out / f"sample_{number:02d}.bvh", motion)
        if "npz" in formats:
            write_motion_npz(out / f"sample_{number:02d}.npz", motion)
        if "html" in formats:
            figures.append(Figure(motion=motion, label=f"sample {number}"))
        report(number + 1)
    if pinned is not None:
        write_json(out / "pins.json", followed)
    if figures:
        write_page(
            out / "index.html",
            figures,
            audio,
            run.config.mel.sample_rate,
            title=f"{samples} gestures for {title}" if samples > 1 else f"A gesture for {title}",
            subtitle=f"{run.config.model}, {run.config.preset} preset, {run.steps} training steps, seed {seed}"
            + ("" if styling is None else f", {styling.label}"),
            words=words,
            lanes=() if pinned is None else (pinned.lane(),),
        )
    return {kind: 1 if kind == "html" else samples for kind in formats}
