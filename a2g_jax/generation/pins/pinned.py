"""Samples of any run with clips performed in them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.generation.drafts import Draft, drafts_of, enter, recorded
from a2g_jax.generation.generator import Sampler, plant_rotations
from a2g_jax.generation.pins.perform import perform
from a2g_jax.generation.pins.report import Ends, corpus_jerk, report_pins
from a2g_jax.generation.pins.request import Pin, check_pins, read_pin
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.metrics.body.check import Stretch
from a2g_jax.metrics.hands import hand_jerk, hand_joints, local_places
from a2g_jax.training.run import Run

if TYPE_CHECKING:
    from a2g_jax.viz.player import Track

#: Fastest passage of a hand between two clips, m/s, and of a joint, degrees/s: beyond, no person could do both.
_FASTEST, _FASTEST_TURN = 5.0, 1800.0
#: Metres and degrees that clips may differ by where one continues the other without a gap.
_NEAR, _NEAR_TURN = 0.1, 40.0
#: Ratio of the fastest to the mean speed of a path of least jerk.
_PEAK = 1.875
#: Names of the limits of jerk.
OF_CORPUS, OF_MOTIONS = "99th percentile of the corpus", "99th percentile of the clips and the unpinned sample"


@dataclass(frozen=True)
class ClipPins:
    """Options of performing clips."""

    texts: tuple[str, ...]
    """Each ``FILE@SECOND`` or ``FILE@SECOND+LENGTH``."""
    length: float | None = None
    """Seconds of the transition on either side of a clip; None for as short as jerk and speed of the hands allow."""
    corpus: Corpus | None = None
    """Its 99th percentile of wrist jerk limits transitions; without one, that of the clips and the unpinned sample."""

    def place(self, run: Run, sampler: Sampler, frames: int) -> "PinnedClips":
        """The clips in the samples of a sampler, for speech of ``frames`` frames.

        Raises:
            InputError: a clip that cannot be used, one that ends too late, or two that overlap or lie too close.
        """
        config = run.config
        pins = check_pins([read_pin(text, run) for text in self.texts], frames, config.fps)
        return PinnedClips(run, sampler, tuple(pins), self.length, jerk_limit(self.corpus, run))


@dataclass(frozen=True, eq=False)
class PinnedClips:
    """A sampler with clips performed in its samples."""

    run: Run
    sampler: Sampler
    pins: tuple[Pin, ...]
    length: float | None = None
    limit: float | None = None
    """Limit of jerk from the corpus, m/s3; None without one."""

    reports: list[list[dict[str, Any]]] = field(default_factory=list)
    """Report on each sample of :meth:`stream` so far."""

    def __post_init__(self) -> None:
        """Refuse clips that lie too close to pass from one to the other."""
        check_gaps(self.pins)

    def stream(self, audio: Float[np.ndarray, " N"], samples: int, seed: int = 0) -> Iterator[Motion]:
        """The samples of the sampler, with the clips; equal to them, bit by bit, beyond the transitions."""
        return recorded(self.drafts(audio, samples, seed))

    def drafts(self, audio: Float[np.ndarray, " N"], samples: int, seed: int = 0) -> Iterator[Draft]:
        """The motions of :meth:`stream`, which add to the reports when they are recorded."""
        for below in drafts_of(self.sampler, audio, samples, seed):
            limit, source = self.limit, OF_CORPUS
            if limit is None:
                limit, source = own_limit([below.motion, *(pin.motion for pin in self.pins)]), OF_MOTIONS
            motion, placed = perform(below.motion, self.pins, self.standing, limit, self.length)
            spans = ((one.start, one.pin.first) for one in placed), ((one.pin.stop, one.stop) for one in placed)
            transitions = tuple(span for part in spans for span in part if span[1] > span[0])
            record = partial(self._record, below, (limit, source), [one.ends for one in placed])
            yield Draft(motion, record, (*below.transitions, *transitions))

    def _record(self, below: Draft, limit: tuple[float, str], ends: list[Ends], sample: int, motion: Motion) -> None:
        below.record(sample, motion)
        enter(self.reports, sample, report_pins(self.pins, motion, below.motion, *limit, ends))

    @cached_property
    def standing(self) -> tuple[Motion, ...]:
        """The motions of the clips, on their feet as those of the run are."""
        return tuple(plant_rotations(self.run, np.asarray(pin.motion.rotations)) for pin in self.pins)

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """Those of the sampler, and the clips, whose own extremes are allowed where they are higher than the bounds of
        the run: those of the clips as they are performed, on their feet, not of the roots and legs in their files."""
        bounds = self.run.config.body_bounds
        own = tuple(
            Stretch(pin.first, pin.stop, bounds.loosened(standing, pin.name))
            for pin, standing in zip(self.pins, self.standing, strict=True)
        )
        return (*getattr(self.sampler, "stretches", ()), *own)

    @property
    def remedy(self) -> str:
        """What changes the motion in the clips, which another seed does not."""
        own = "pin another clip, another part of it or at another second (FILE@SECOND+LENGTH), or set --pin-blend"
        below = getattr(self.sampler, "remedy", "")
        return f"{own}; {below}" if below else own

    @property
    def caption(self) -> str:
        """The clips and their seconds, for a page's subtitle."""
        return pin_caption(self.pins)

    def lane(self) -> "Track":
        """The pinned stretches as a lane of the page's timeline."""
        return pin_lane(self.pins)


def pin_caption(pins: Sequence[Pin]) -> str:
    """Clips and their seconds in words."""
    return "pinned " + ", ".join(f"{Path(pin.name).name} at {pin.start:g} s" for pin in pins)


def pin_lane(pins: Sequence[Pin]) -> "Track":
    """Pinned stretches as a lane of a page's timeline."""
    from a2g_jax.viz.player import Track

    return Track(
        "pinned", tuple((pin.start, pin.start + pin.motion.seconds, Path(pin.name).stem, "hold") for pin in pins)
    )


def jerk_limit(corpus: Corpus | None, run: Run) -> float | None:
    """The 99th percentile of wrist jerk in a corpus, m/s3; None without one.

    Raises:
        InputError: another skeleton than the run's.
    """
    if corpus is None:
        return None
    if not corpus.skeleton.same_tree(run.config.skeleton):
        raise InputError(f"--pin-corpus {corpus.path}: has another skeleton than the run.")
    return corpus_jerk(corpus)


def own_limit(motions: Sequence[Motion]) -> float:
    """The 99th percentile of wrist jerk in motions, m/s3."""
    values = [hand_jerk(local_places(motion), motion.skeleton, motion.fps) for motion in motions]
    return float(np.percentile(np.concatenate(values), 99.0))


def check_gaps(pins: Sequence[Pin]) -> None:
    """Refuse clips so close that no person could pass from the end of one to the beginning of the next.

    Args:
        pins: in order of time.

    Raises:
        InputError: such clips.
    """
    for before, after in zip(pins, pins[1:], strict=False):
        last, first = before.motion.clip(before.motion.frames - 1, before.motion.frames), after.motion.clip(0, 1)
        hands = hand_joints(last.skeleton)
        way = np.linalg.norm((local_places(first) - local_places(last))[0, hands], axis=-1).max()
        turn = rotation_angle(np.asarray(first.rotations), np.asarray(last.rotations)).max()
        seconds = (after.first - before.stop + 1) / last.fps
        needed = max(way / _FASTEST, turn / _FASTEST_TURN) * _PEAK
        if needed > seconds and (way > _NEAR or turn > _NEAR_TURN):
            gap = after.start - before.stop / before.motion.fps
            raise InputError(
                f"--pin {after.name}@{after.start:g}: begins {gap:.2f} s after {before.name} ends, with hands"
                f" {100 * way:.0f} cm and joints up to {turn:.0f} degrees elsewhere; leave {needed:.2f} s or more"
                " between them."
            )
