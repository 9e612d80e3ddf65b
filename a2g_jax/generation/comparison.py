"""Runs side by side: motions of several systems, or of one with several emotions, for one speech.

The talker's own motion stands beside them where there is one.
"""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.generation.checked import Checked
from a2g_jax.generation.compared_controls import with_controls
from a2g_jax.generation.export import checked_figure
from a2g_jax.generation.formats import PAGE, REPORTS, MotionFiles, check_page_size
from a2g_jax.generation.generator import Generator, audio_frames
from a2g_jax.generation.talk.page import gesture_lane
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.files import check_folder_writable, write_json
from a2g_jax.io.words import Word
from a2g_jax.talker.demo_speech import demo_recording
from a2g_jax.talker.speech import plan_from_json
from a2g_jax.training.run import Run, open_run
from a2g_jax.training.run_file import SHIPPED
from a2g_jax.viz.player import Figure, write_page

#: Stem of the files of the talker's own motion.
TALKER = "talker"
#: The checks of all systems.
CHECKS = "checks.json"
_FORMAT = "a2g_jax checks of systems"


@dataclass(frozen=True, eq=False)
class Speech:
    """The speech of a comparison."""

    title: str
    """Its name, for the page's heading."""
    audio: Callable[[int], Float[np.ndarray, " N"]]
    """Mono samples at a sample rate."""
    words: Sequence[Word] = ()
    truth: Figure | None = None
    """The motion that the speech was generated with; None where no motion belongs to it."""


def demo_speech_with_truth() -> Speech:
    """The speech of ``a2g demo`` with the motion of its talker."""
    recording, truth = demo_recording()
    plan = plan_from_json(recording.annotations["speech"])
    figure = Figure(recording.motion, TALKER, "the true motion", (gesture_lane(truth, plan),))

    def audio(sample_rate: int) -> Float[np.ndarray, " N"]:
        return demo_recording(sample_rate)[0].audio

    return Speech("the speech of the demo", audio, recording.words, figure)


def systems(others: Sequence[str] = ()) -> dict[str, Run]:
    """The shipped runs that generate motion of a skeleton from audio, then other runs, by name.

    Args:
        others: folders of runs, or names of shipped ones.

    Raises:
        InputError: not a run, one that does not animate a skeleton, or two of one name.
    """
    found = {name: run for name in SHIPPED if _animates(run := open_run(name))}
    for folder in others:
        if folder in SHIPPED:
            continue
        run, name = open_run(folder), Path(folder).resolve().name
        _ = run.config.skeleton  # keypoints and directions are refused
        if run.config.build().sample is None:
            raise InputError(f"{folder}: is a run of {run.config.model}, which generates no motion; leave it out.")
        if name in found or name == TALKER:
            raise InputError(f"{folder}: another system of the page has the name {name!r}; rename the folder.")
        found[name] = run
    return found


def emotions(name: str) -> dict[str, Run]:
    """A run with each emotion of its corpus as its setting, by emotion; neutral first.

    Args:
        name: folder of a run, or name of a shipped one.

    Raises:
        InputError: not a run, or one without the setting.
    """
    run = open_run(name)
    _ = run.config.skeleton
    names = sorted(run.config.corpus.get("emotions", ()), key=lambda emotion: (emotion != "neutral", emotion))
    if not names or not hasattr(run.config.sampling, "emotion"):
        raise InputError(f"{name}: a run of {run.config.model} has no setting --emotion; name one that has.")
    return {each: replace(run, config=run.config.with_sampling(emotion=each)) for each in names}


def _animates(run: Run) -> bool:
    return run.config.space.has_rotations and run.config.build().sample is not None


@dataclass(frozen=True)
class Compared:
    """What a comparison wrote."""

    written: dict[str, int]
    """How many files of each format."""
    lines: tuple[str, ...]
    """Result of the check of each system, and the requests that it did not take, for the terminal."""


def compare(
    runs: Mapping[str, Run],
    speech: Speech,
    out: str | os.PathLike[str],
    *,
    samples: int,
    seed: int,
    formats: Sequence[str],
    controls: Sequence[str] = (),
    strict: bool = False,
    kind: str = "system",
    report: Callable[[], None] = lambda: None,
) -> Compared:
    """Write the motions of every run for a speech, one page of them all, and ``checks.json``.

    Files are named after the runs: ``demo_00.bvh``, ``demo_01.bvh``, ..., and ``talker_00.bvh`` for the truth. Each run
    generates as alone: its sample k is that of ``a2g generate RUN`` with the same seed. Nothing is written before all
    motions are generated and checked; then the files of an earlier call are removed.

    Args:
        runs: by name.
        samples: motions of each run.
        formats: names of :func:`~a2g_jax.generation.formats.motion_formats`, and ``html``.
        controls: requests such as ``energy=0.9``, for the runs that have the control.
        strict: whether a motion that stays outside the bounds of a body is an error.
        kind: what each run is, for the heading.
        report: called after each motion of a run.

    Raises:
        InputError: a folder that cannot be used, audio shorter than a frame, too large a page, a request that no run
            can follow, or a motion that is refused.
    """
    runs, without = with_controls(runs, controls)
    first = next(iter(runs.values())).config
    audio = {run.config.mel.sample_rate: speech.audio(run.config.mel.sample_rate) for run in runs.values()}
    if PAGE in formats:
        sizes = [(audio_frames(run, audio[run.config.mel.sample_rate]), run.config.skeleton) for run in runs.values()]
        frames, body = max(sizes, key=lambda size: size[0] * size[1].joints)
        check_page_size(samples * len(runs) + 1, frames, body.joints)
    check_folder_writable(out)  # before any work
    generators: dict[str, Generator] = {}
    for name, run in runs.items():
        # One run with several emotions is compiled once.
        before = next((one for one in generators.values() if one.run.params is run.params), None)
        generators[name] = Generator(run) if before is None else Generator(run, like=before)
    checked = {name: Checked(run, generators[name], strict=strict) for name, run in runs.items()}
    motions = {
        name: _motions(name, each, audio[runs[name].config.mel.sample_rate], samples, seed, report)
        for name, each in checked.items()
    }
    # This removes the talker's motion of an earlier speech, also where this one has none.
    stems = tuple(dict.fromkeys((*_stems_before(Path(out)), "sample", TALKER, *runs)))
    figures = [] if speech.truth is None else [speech.truth]
    sound = (audio[first.mel.sample_rate], first.mel.sample_rate)
    with MotionFiles(out, stems, formats, REPORTS, speech=sound) as files:
        for name, made in motions.items():
            for number, motion in enumerate(made):
                files.write(number, motion, name)
                label = f"{name} {number}" if samples > 1 else name
                findings = checked[name].reports[number].findings
                note = _note(runs[name], without.get(name, ()))
                figures.append(checked_figure(motion, label, findings, note, files.names(number, name)))
        if speech.truth is not None:
            files.write(0, speech.truth.motion, TALKER)
            figures[0] = replace(speech.truth, files=files.names(0, TALKER))
        systems = {name: one.to_json() for name, one in checked.items()}
        write_json(files.folder / CHECKS, {"format": _FORMAT, "systems": systems})
        if PAGE in formats:
            write_page(
                files.folder / "index.html",
                figures,
                audio[first.mel.sample_rate],
                first.mel.sample_rate,
                title=f"{_count(len(runs), kind)} for {speech.title}",
                subtitle=_subtitle(speech, samples, seed) + (f"; {', '.join(controls)}" if controls else ""),
                words=speech.words,
            )
    lines = [f"{name}: {line}" for name, each in checked.items() for line in each.lines()]
    lines += [f"{name}: has no control for {', '.join(rest)}" for name, rest in without.items()]
    return Compared({kind: 1 if kind == PAGE else len(figures) for kind in formats}, tuple(lines))


def _motions(
    name: str,
    checked: Checked,
    audio: Float[np.ndarray, " N"],
    samples: int,
    seed: int,
    report: Callable[[], None],
) -> list[Motion]:
    """Checked motions of a system, which an error names."""
    motions = []
    try:
        for motion in checked.stream(audio, samples, seed):
            motions.append(motion)
            report()
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    return motions


def _stems_before(folder: Path) -> tuple[str, ...]:
    """Stems of the files that an earlier comparison wrote to a folder."""
    try:
        found = json.loads((folder / CHECKS).read_text(encoding="utf-8"))
        return tuple(found["systems"]) if found["format"] == _FORMAT else ()
    except (OSError, ValueError, KeyError, TypeError):
        return ()


def _note(run: Run, without: Sequence[str]) -> str:
    """Text below the label of a motion."""
    return f"{run.config.model}, without {', '.join(without)}" if without else run.config.model


def _count(runs: int, kind: str) -> str:
    words = ("No", "One", "Two", "Three", "Four", "Five", "Six", "Seven", "Eight")
    return f"{words[runs] if runs < len(words) else runs} {kind}{'' if runs == 1 else 's'}"


def _subtitle(speech: Speech, samples: int, seed: int) -> str:
    motions = "one motion" if samples == 1 else f"{samples} motions"
    # Short enough for one line on a phone.
    if speech.truth is None:
        return f"{motions} of each, seed {seed}; this speech has no true talker"
    return f"{motions} of each, seed {seed}; the talker's own is one of many"
