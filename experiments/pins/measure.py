"""Figures of pinned clips on a run, beside recorded motion over equally long stretches."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.generation.generator import Generator
from a2g_jax.generation.pins.pinned import PinnedClips
from a2g_jax.generation.pins.report import ROUGH_SPEED, SEAM
from a2g_jax.generation.pins.request import Pin, pin_of
from a2g_jax.generation.pins.smooth import resample_smoothly
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.onto import on_skeleton
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.metrics.hands import hand_jerk, hand_speeds, local_places
from a2g_jax.metrics.intervals import mean_interval, share_interval
from a2g_jax.metrics.liveliness import body_of, feet_slide
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from a2g_jax.training.run import Run
from experiments.pins.clips import Take

#: Seconds of the speeches, and how many.
SPEECH, SPEECHES = 12.0, 10


class Given:
    """A sampler of motions that are there."""

    def __init__(self, *motions: Motion) -> None:
        self.motions = motions

    def stream(self, audio: Any, samples: int, seed: int = 0) -> Iterator[Motion]:
        """Yield the motions, whatever the audio and the seed."""
        del audio, seed
        yield from self.motions[:samples]


def corpus_limit(seed: int, recordings: int = 24, seconds: float = 30.0) -> float:
    """The 99th percentile of wrist jerk in generated talk, the corpus of both shipped runs, m/s3."""
    names, values = tuple(SPEAKERS), []
    for number in range(recordings):
        motion = talk(seconds, seed + 400_000 + number, speaker=names[number % len(names)]).motion
        values.append(hand_jerk(local_places(motion), motion.skeleton, motion.fps))
    return float(np.percentile(np.concatenate(values), 99.0))


def plain_samples(run: Run, seed: int) -> list[Motion]:
    """A sample for each of ten speeches."""
    generator = Generator(run)
    speeches = [talk(SPEECH, seed + 200_000 + number) for number in range(SPEECHES)]
    return [next(generator.stream(speech.audio, 1, seed)) for speech in speeches]


def pinned(run: Run, plain: Motion, pins: Sequence[Pin], limit: float) -> tuple[Motion, list[dict[str, Any]]]:
    """A sample with pins, and the report on them."""
    sampler = PinnedClips(run, Given(plain), tuple(pins), None, limit)
    (motion,) = sampler.stream(np.zeros(0), 1)
    return motion, sampler.reports[0]


def measure(
    run: Run, plains: Sequence[Motion], takes: Sequence[Take], count: int, limit: float, seed: int
) -> dict[str, Any]:
    """Figures of clips of one to three seconds from takes in turn, each pinned at a random moment of a sample.

    Recorded motion is measured over the same stretches of its own take: the clip with what was before and after it.
    """
    rng = np.random.default_rng(seed)
    rows: list[dict[str, Any]] = []
    refused: list[str] = []
    for number in range(count):
        take, plain = takes[number % len(takes)], plains[number % len(plains)]
        seconds = float(rng.uniform(1.0, 3.0))
        start = float(rng.uniform(2.0, take.motion.seconds - seconds - 2.0))
        at = float(rng.uniform(0.0, SPEECH - seconds - 0.1))
        try:
            pin = pin_of(take.cut(start, seconds), run, f"{take.source} {start:.2f}+{seconds:.2f}", at)
        except InputError as error:
            refused.append(str(error))
            continue
        motion, (row,) = pinned(run, plain, [pin], limit)
        low, high = (round(row[key] * run.config.fps) for key in ("before", "after"))
        stretch = motion.clip(max(0, pin.first - low), pin.stop + high)
        figures = {"recorded_jerk": _recorded(run, take, start, seconds, row), "turn": _turns(stretch)}
        rows.append({**row, **figures, "slide": feet_slide(body_of(stretch))})
    return {"pins": count, "refused": refused, "rows": rows, **summary(rows, limit)}


def summary(rows: Sequence[dict[str, Any]], limit: float) -> dict[str, Any]:
    """Means and shares over pins, with their 95 % intervals."""

    def mean(value: Callable[[dict[str, Any]], float]) -> dict[str, Any]:
        return mean_interval(np.array([float(value(row)) for row in rows])).to_json()

    def share(value: Callable[[dict[str, Any]], bool], among: Sequence[dict[str, Any]] = rows) -> dict[str, Any]:
        return share_interval(np.array([bool(value(row)) for row in among]), np.ones(len(among))).to_json()

    seams = [row for row in rows if row["seam_jerk"] > 0.0]
    return {
        "wrist_error_cm": mean(lambda row: row["wrist_error_cm"]),
        "unpinned_wrist_error_cm": mean(lambda row: row["unpinned_wrist_error_cm"]),
        "wrist_worst_cm": max(row["wrist_worst_cm"] for row in rows),
        "followed": share(lambda row: row["followed"]),
        "rough": share(lambda row: row["rough"]),
        "smooth": share(lambda row: row["smooth"], seams),
        "smooth_recorded": share(lambda row: row["recorded_jerk"] < limit, seams),
        "smooth_unpinned": share(lambda row: row["unpinned_seam_jerk"] < limit, seams),
        "within_speed": share(lambda row: row["speed"] <= ROUGH_SPEED * row["top_speed"]),
        "within_speed_of_both": share(
            lambda row: row["speed"] <= ROUGH_SPEED * max(row["top_speed"], row["unpinned_speed"])
        ),
        "transition_s": mean_interval(
            np.array([value for row in rows for value in (row["before"], row["after"]) if value > 0.0])
        ).to_json(),
        "largest_turn": max(row["turn"] for row in rows),
        "slide_mm_s": mean(lambda row: row["slide"]),
    }


def _turns(motion: Motion) -> float:
    """Largest turn of a joint between two frames, degrees."""
    rotations = np.asarray(motion.rotations)
    return float(rotation_angle(rotations[1:], rotations[:-1]).max())


def _recorded(run: Run, take: Take, start: float, seconds: float, row: dict[str, Any]) -> float:
    """Largest jerk where the transitions would be, in the take itself."""
    fps = run.config.fps
    margin = 2.0
    part = on_skeleton(
        take.cut(start - margin, seconds + 2 * margin), run.config.skeleton, take.motion.fps, take.source
    )
    part = resample_smoothly(part, fps, round(part.seconds * fps))
    jerks = hand_jerk(local_places(part), part.skeleton, fps)
    first, stop = round(margin * fps), round((margin + seconds) * fps)
    least = round(SEAM * fps)
    stretches = []
    if row["start"] > 0.0:
        stretches.append((first - max(round(row["before"] * fps), least) - 2, first + least))
    if row["end"] < SPEECH - 1e-6:
        stretches.append((stop - least - 2, stop + max(round(row["after"] * fps), least)))
    return max((float(jerks[max(0, low) : high].max(initial=0.0)) for low, high in stretches), default=0.0)


def top_speed(motion: Motion) -> float:
    """Fastest hand, m/s."""
    return float(hand_speeds(local_places(motion), motion.skeleton, motion.fps).max(initial=0.0))
