"""One gesture unit of one arm in Kendon's phases: preparation, strokes, holds, retraction."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2g_jax.talker.gesture_plan import LONG_PAUSE
from a2g_jax.talker.hand_shapes import Control
from a2g_jax.talker.paths import Track
from a2g_jax.talker.speech import SpeechPlan
from a2g_jax.talker.styles import GestureStyle
from a2g_jax.talker.truth import PhaseSpan, Stroke

ARRIVAL = 0.82
"""Share of a stroke's minimum-jerk step that has passed at the apex: 96 % of the way is done."""

_BLEND = 0.07
"""A preparation ends this long after its stroke began, seconds: the hand turns in a curve and does not stop."""


@dataclass(frozen=True)
class StrokeTiming:
    """When one hand makes one stroke; seconds."""

    begin: float
    end: float


@dataclass
class Arm:
    """One arm while it is planned: its control track, its phases, and when its last movement ends (``free``)."""

    hand: str
    rest: Control
    track: Track
    free: float
    spans: list[PhaseSpan]

    def mark(self, phase: str, begin: float, end: float) -> None:
        if end > begin:
            self.spans.append(PhaseSpan(begin, end, phase, self.hand))

    def interrupt(self, time: float) -> None:
        """Begin a movement at ``time``, which may be before the last retraction ends; phases are shortened to fit."""
        while self.spans and self.spans[-1].end > time:
            last = self.spans.pop()
            if last.phase == "stroke":
                time = last.end
            self.mark(last.phase, last.start, time)
        self.free = time


def stroke_timing(
    stroke: Stroke, strokes: Sequence[Stroke], style: GestureStyle, rng: np.random.Generator
) -> StrokeTiming:
    # Larger strokes take a little longer (isochrony), tight sequences force shorter ones.
    gaps = [abs(other.apex - stroke.apex) for other in strokes if other is not stroke]
    length = (0.26 + 0.20 * style.radius * (0.25 + 1.05 * stroke.size)) / style.speed * rng.uniform(0.9, 1.1)
    length = float(np.clip(min(length, 0.62 * min(gaps, default=1.0)), 0.18, 0.34))
    begin = stroke.apex - ARRIVAL * length
    return StrokeTiming(begin, begin + length)


def perform_unit(
    arm: Arm,
    plan: SpeechPlan,
    strokes: list[Stroke],
    timings: list[StrokeTiming],
    shapes: Sequence[tuple[Control, Control, Control]],
    follow: Stroke | None,
    holds: bool,
    style: GestureStyle,
    rng: np.random.Generator,
) -> None:
    """Add one gesture unit to one arm."""
    tempo = style.speed
    for order, (timing, (ready, apex, bow)) in enumerate(zip(timings, shapes, strict=True)):
        if order == 0:
            length = rng.uniform(0.50, 0.72) / tempo
            begin = max(timing.begin - length, min(arm.free - 0.15, timing.begin - 0.22))
            arm.mark("rest", arm.free, begin)
            arm.interrupt(begin)
            arm.mark("preparation", arm.free, timing.begin)
        else:
            begin = _between(arm, timings[order - 1], timing, strokes[order - 1], holds, style, rng)
        arm.track.step_to(ready, begin, timing.begin + _BLEND)
        arm.track.step_to(apex, timing.begin, timing.end)
        arm.track.add_bump(bow, timing.begin, timing.end)
        arm.mark("stroke", timing.begin, timing.end)
        arm.free = timing.end
    _retract(arm, plan, strokes[-1], timings[-1], follow, style, rng)


def _between(
    arm: Arm,
    before: StrokeTiming,
    timing: StrokeTiming,
    stroke: Stroke,
    holds: bool,
    style: GestureStyle,
    rng: np.random.Generator,
) -> float:
    """Add hold, relaxing and preparation between two strokes of a unit; returns when the preparation begins."""
    gap = timing.begin - before.end
    prepare = min(rng.uniform(0.32, 0.5) / style.speed, max(gap + 0.08, 0.2))
    begin = timing.begin - prepare
    release = before.end + (stroke.hold if holds else 0.0) - 0.05
    if timing.begin - release < 0.5:
        middle = max(begin, before.end)
        arm.mark("hold", before.end, middle)
        arm.mark("preparation", middle, timing.begin)
        return begin
    # The hand sinks back and closes a little, as it relaxes.
    relax = arm.track.goal.copy()
    ease = (1.0 - 0.6 * min(style.tension, 1.0)) * rng.uniform(0.22, 0.5)
    relax[:6] += ease * (arm.rest - arm.track.goal)[:6]
    end = release + rng.uniform(0.40, 0.60) / style.speed
    arm.track.step_to(relax, release, end)
    released, middle = max(release, before.end), max(min(end, begin), before.end)
    arm.mark("hold", before.end, released)
    arm.mark("retraction", released, middle)
    arm.mark("preparation", max(middle, released), timing.begin)
    return begin


def _retract(
    arm: Arm,
    plan: SpeechPlan,
    stroke: Stroke,
    timing: StrokeTiming,
    follow: Stroke | None,
    style: GestureStyle,
    rng: np.random.Generator,
) -> None:
    """Add a hold and the way back to rest, only part of it where the next unit follows soon."""
    length = rng.uniform(0.60, 0.95) / style.speed
    begin = timing.end + stroke.hold - 0.04
    pause = _next_pause(plan, stroke.apex)
    if pause is not None:
        begin = max(min(begin, pause + 0.1), timing.end - 0.04)
    share = 1.0
    if follow is not None:
        # The next stroke's preparation takes about 0.7 s.
        room = follow.apex - 0.75 - begin
        if room < length:
            begin = max(min(begin, follow.apex - 1.0), timing.end - 0.04)
            share = float(np.clip((follow.apex - 0.6 - begin) / (length + 0.25), 0.10, 1.0)) ** 1.5
            length = float(np.clip(follow.apex - 0.6 - begin, 0.45, length))
    goal = arm.track.goal + share * (arm.rest - arm.track.goal)
    arm.track.step_to(goal, begin, begin + length)
    bow = np.zeros(len(goal))
    bow[0] = 0.025 * share
    arm.track.add_bump(bow, begin, begin + length)
    arm.mark("hold", timing.end, begin)
    arm.mark("retraction", max(begin, timing.end), begin + length)
    arm.free = begin + length


def _next_pause(plan: SpeechPlan, after: float) -> float | None:
    """Start of the long pause after the phrase that is spoken at ``after``; None without one."""
    for index, phrase in enumerate(plan.phrases):
        if phrase.end >= after:
            last = index + 1 == len(plan.phrases)
            if last or plan.phrases[index + 1].start - phrase.end > LONG_PAUSE:
                return phrase.end
            return None
    return None
