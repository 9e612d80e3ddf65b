"""Generated motions as files, and a page that plays them."""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from a2g_jax.errors import InputError
from a2g_jax.generation.checked import Checked
from a2g_jax.generation.delivery import PLAIN, Delivery
from a2g_jax.generation.formats import ORDERS, PAGE, REPORTS, MotionFiles, check_page_size
from a2g_jax.generation.generator import Sampler, audio_frames, speech_at_rate
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.files import check_folder_writable, write_json
from a2g_jax.io.words import Word
from a2g_jax.metrics.body.check import BodyFinding
from a2g_jax.training.run import Run
from a2g_jax.viz.player import Figure, Track, write_page

if TYPE_CHECKING:
    from a2g_jax.generation.ranking import Score


def export(
    run: Run,
    sampler: Sampler,
    audio: Any,
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
    sample_rate: int | None = None,
    delivery: Delivery = PLAIN,
    order: str = "number",
) -> dict[str, int]:
    """Generate, check and write ``sample_00.bvh``, ``sample_00.npz``, ..., ``index.html`` and ``checks.json``.

    Every motion is checked, and drawn again where a body could not do it: see
    :class:`~a2g_jax.generation.checked.Checked`. ``checks.json`` has the bounds, and the findings on each sample.

    Example:
        >>> import a2g_jax
        >>> run, audio = a2g_jax.demo_run(), a2g_jax.talk(2.0, seed=5).audio
        >>> about = {"samples": 2, "seed": 0, "title": "two seconds", "formats": ["bvh", "html"]}
        >>> a2g_jax.export(run, a2g_jax.Generator(run), audio, "gestures", **about)
        {'bvh': 2, 'html': 1}

    Args:
        run: the sampler's.
        sampler: a ``Checked`` one is used as it is; with ``strict``, nothing is written before all samples are good.
        audio: (N,), mono.
        formats: names of :func:`~a2g_jax.generation.formats.motion_formats`, and ``html``.
        title: name of the speech, for the page's heading.
        label: what was requested besides controls, for the page's subtitle; its footer names the run and the seed.
        lanes: further tracks of the page's timeline.
        report: called with the number of samples done: with ``strict`` once they are checked, else once written.
        sample_rate: of the audio, Hz, which is resampled to the run's; None for the run's own.
        delivery: the character and the frame rate to write for. Motions are checked before, on the run's skeleton.
        order: of the figures on the page, by number, or ``"best"`` first (:mod:`a2g_jax.generation.ranking`); then
            ``checks.json`` has order and scores, which :func:`~a2g_jax.generation.ranking.read_scores` reads. Files
            keep their names.

    Returns:
        How many files of each format were written.

    Raises:
        InputError: a folder that cannot be used, audio shorter than a frame, too large a page, or a motion that is
            refused. Without ``strict``, those before it stay in the folder, and ``checks.json`` has the findings.
        OutputError: the disk is full, or the folder cannot be written to; files of an earlier call stay.
    """
    if order not in ORDERS:
        raise InputError(f"order {order!r}: expected {' or '.join(ORDERS)}.")
    audio, config = speech_at_rate(run, audio, sample_rate), run.config
    if PAGE in formats:
        frames = round(audio_frames(run, audio) * (delivery.fps or config.fps) / config.fps)
        check_page_size(samples, frames, delivery.page_points(config.skeleton))
    checked = sampler if isinstance(sampler, Checked) else Checked(run, sampler)
    motions: Iterable[Motion] = checked.stream(audio, samples, seed)
    scorer = None
    if order == "best":
        from a2g_jax.generation.ranking import Scorer, best_first

        scorer = Scorer(run, audio)
    ranked: list[Score] = []
    check_folder_writable(out)  # before any work
    if checked.strict:
        motions = list(_counted(motions, report))
    figures: list[Figure] = []
    speech = (audio, run.config.mel.sample_rate)
    with MotionFiles(out, ("sample",), formats, REPORTS, speech=speech, writers=delivery.writers()) as files:
        done = 0
        try:
            for number, motion in enumerate(motions):
                made = delivery.make(motion)
                skin = delivery.skin(made.shown.skeleton) if PAGE in formats or files.drawn else None
                files.write(number, made.shown, own=made.by_format(delivery.own_format), skin=skin)
                done, findings = number + 1, checked.reports[number].findings
                if scorer is not None:
                    ranked.append(scorer.score(number, motion, findings))
                if PAGE in formats:
                    figure = checked_figure(made.shown, f"sample {number}", findings, files=files.names(number))
                    figures.append(replace(figure, number=number, skin=skin))
                if not checked.strict:
                    report(done)
        finally:
            if done or any(files.folder.iterdir()):  # files before an error stay, with the findings on all motions
                ranked = [] if scorer is None else best_first(ranked)
                write_json(files.folder / "checks.json", checked.to_json() | _order_to_json(ranked))
        if figures:
            figures = [_scored(figures[one.sample], one) for one in ranked] or figures
            write_page(
                files.folder / "index.html",
                figures,
                audio,
                config.mel.sample_rate,
                title=f"{samples} gestures for {title}" if samples > 1 else f"A gesture for {title}",
                subtitle=requested(checked, samples, label, "best first" if len(ranked) > 1 else ""),
                words=words,
                lanes=lanes,
                footer=f"{config.model}, {config.preset} preset, {run.steps} training steps, seed {seed}",
            )
    return {kind: 1 if kind == PAGE else samples for kind in formats}


def _scored(figure: Figure, score: "Score") -> Figure:
    """The figure with its score in the text under it."""
    return replace(figure, note="; ".join(filter(None, (f"score {score.score:.2f}", figure.note))))


def _order_to_json(ranked: "Sequence[Score]") -> dict[str, Any]:
    """The order of ranked samples, and their scores; nothing where none are ranked."""
    if not ranked:
        return {}
    return {"order": [one.sample for one in ranked], "scores": [one.to_json() for one in ranked]}


def requested(checked: Checked, samples: int, label: str, order: str = "") -> str:
    """What the page shows, and what was requested."""
    what = "The same speech, and different gestures for it" if samples > 1 else ""
    controls = " ".join(getattr(checked.run.config.sampling_settings, "controls", ()))
    caption = getattr(checked.sampler, "caption", "")
    return "; ".join(part for part in (what, controls, label, caption, order) if part)


def _counted(motions: Iterable[Motion], report: Callable[[int], None]) -> Iterator[Motion]:
    """The motions, with a call after each."""
    for done, motion in enumerate(motions, start=1):
        report(done)
        yield motion


def checked_figure(
    motion: Motion, label: str, findings: Sequence[BodyFinding], note: str = "", files: tuple[str, ...] = ()
) -> Figure:
    """A motion on the page; if it is outside the bounds of a body, with the worst finding under it and a lane of all.

    Args:
        note: under the label of a motion without findings.
        files: names of its files beside the page.
    """
    if not findings:
        return Figure(motion, label, note, files=files)
    return Figure(motion, label, *describe_findings(findings, motion.fps), files)


def describe_findings(findings: Sequence[BodyFinding], fps: float) -> tuple[str, tuple[Track, ...]]:
    """The worst finding for the text under a figure, and a lane of all; empty without any."""
    if not findings:
        return "", ()
    spans = tuple(
        (one.first / fps, one.stop / fps, str(one), "#c0392b") for one in sorted(findings, key=lambda one: one.first)
    )
    return f"outside the bounds of a body at {findings[0]}", (Track("outside bounds", spans),)
