"""From drawn strokes to the control track of each arm: preparation, stroke, hold, retraction, rest."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.talker.gesture_plan import LONG_PAUSE, GestureDraws
from a2g_jax.talker.hand_shapes import Control, rest_control, stroke_controls
from a2g_jax.talker.paths import Track
from a2g_jax.talker.speech import SpeechPlan
from a2g_jax.talker.styles import GestureStyle
from a2g_jax.talker.truth import GestureUnit, PhaseSpan, Stroke

ARRIVAL = 0.82
"""Share of a stroke's minimum-jerk step that has passed at the apex: 96 % of the way is done."""

_BLEND = 0.07
"""A preparation ends this long after its stroke began, seconds: the hand turns in a curve and does not stop."""
SMALL_BEAT = 0.12
"""Accents from here on (0 to 1) are felt as small beats where they get no stroke."""
_MIRROR_LAG = 0.06
"""The second hand follows by up to this much, seconds."""


@dataclass(frozen=True)
class StrokeTiming:
    """When one hand makes one stroke; seconds."""

    begin: float
    end: float


@dataclass
class _Arm:
    """One arm being planned: where it is led to, and since when it has been free."""

    hand: str
    rest: Control
    track: Track
    free: float
    spans: list[PhaseSpan]

    def mark(self, phase: str, begin: float, end: float) -> None:
        if end > begin:
            self.spans.append(PhaseSpan(begin, end, phase, self.hand))

    def interrupt(self, time: float) -> None:
        """A new movement sets in at ``time``, maybe before the last retraction has faded out."""
        while self.spans and self.spans[-1].end > time:
            last = self.spans.pop()
            if last.phase == "stroke":
                time = last.end
            self.mark(last.phase, last.start, time)
        self.free = time


def plan_arms(
    plan: SpeechPlan, draws: GestureDraws, style: GestureStyle, rng: np.random.Generator
) -> tuple[dict[str, Track], tuple[PhaseSpan, ...]]:
    """Control tracks of the left and right arm (see :mod:`a2g_jax.talker.hand_shapes`) and their phases."""
    dominant = "right" if style.right_handed >= 0.5 else "left"
    arms = {}
    for hand in ("left", "right"):
        rest = rest_control(draws.rest_pose, hand == dominant)
        arms[hand] = _Arm(hand, rest, Track(rest), 0.0, [])
    for number, unit in enumerate(draws.units):
        strokes = [draws.strokes[index] for index in unit.strokes]
        hands = ("left", "right") if unit.hand == "both" else (unit.hand,)
        lead = dominant if unit.hand == "both" else unit.hand
        timings = [_stroke_timing(stroke, draws.strokes, style, rng) for stroke in strokes]
        shapes = _unit_shapes(strokes, unit, style, rng)
        offset = rng.normal(0.0, (0.025, 0.045, 0.03))
        for hand in ("left", "right"):
            arm = arms[hand]
            follow = _next_stroke(draws, number, hand)
            if hand not in hands:
                _sympathise(arm, strokes, style, rng)
            elif hand == lead:
                _gesture(arm, plan, strokes, timings, shapes, follow, unit.holds, style, rng)
            else:
                lag = rng.uniform(-0.01, _MIRROR_LAG)
                late = [StrokeTiming(timing.begin + lag, timing.end + lag) for timing in timings]
                mirrored = [_second_hand(shape, offset, style, rng) for shape in shapes]
                _gesture(arm, plan, strokes, late, mirrored, follow, unit.holds, style, rng)
    for arm in arms.values():
        arm.mark("rest", arm.free, plan.seconds)
        _small_beats(arm, plan, draws, style, rng)
        _fidget(arm, style, rng)
    spans = sorted((span for arm in arms.values() for span in arm.spans), key=lambda span: (span.hand, span.start))
    return {hand: arm.track for hand, arm in arms.items()}, tuple(spans)


def _unit_shapes(
    strokes: Sequence[Stroke], unit: GestureUnit, style: GestureStyle, rng: np.random.Generator
) -> list[tuple[Control, Control, Control]]:
    """The strokes of a unit; its place drifts from one to the next."""
    shapes: list[tuple[Control, Control, Control]] = []
    drift, before = np.zeros(3), None
    for order, stroke in enumerate(strokes):
        shapes.append(
            stroke_controls(
                stroke.family,
                unit.place,
                unit.hand == "both",
                order,
                len(strokes),
                stroke.size,
                before,
                drift,
                style,
                rng,
            )
        )
        before = shapes[-1][1]
        drift = 0.8 * drift + style.radius * rng.normal(0.0, (0.16, 0.18, 0.10))
    return shapes


def _small_beats(
    arm: _Arm, plan: SpeechPlan, draws: GestureDraws, style: GestureStyle, rng: np.random.Generator
) -> None:
    """Accents too weak for a stroke are felt as small beats of a hand that is up; more in held gestures."""
    taken = {stroke.syllable for stroke in draws.strokes}
    for unit in draws.units:
        if unit.hand not in (arm.hand, "both"):
            continue
        apexes = np.array([draws.strokes[index].apex for index in unit.strokes])
        end = apexes[-1] + draws.strokes[unit.strokes[-1]].hold + 0.1
        for index, syllable in enumerate(plan.syllables):
            inside = apexes[0] < syllable.peak < end and np.abs(apexes - syllable.peak).min() > 0.3
            if not inside or index in taken or syllable.accent < SMALL_BEAT:
                continue
            height = np.zeros(len(arm.rest))
            size = style.radius * (0.10 + 0.25 * syllable.accent) * rng.uniform(0.6, 1.3)
            height[:3] = size * np.array([rng.normal(0.0, 0.3), -0.8, 0.4])
            height[4:6] = rng.normal((0.05, -0.12), 0.06)
            apex = syllable.peak - 0.05
            arm.track.add_pulse(height, apex - 0.2, apex, apex + rng.uniform(0.25, 0.4))


def _fidget(arm: _Arm, style: GestureStyle, rng: np.random.Generator) -> None:
    """Resting hands shift now and then."""
    for span in [span for span in arm.spans if span.phase == "rest"]:
        now = span.start + rng.uniform(0.2, 1.2)
        while now < span.end - 0.8:
            length = rng.uniform(0.35, 0.6)
            stay = rng.uniform(0.1, 0.9)
            height = np.zeros(len(arm.rest))
            height[:3] = style.sway**0.5 * rng.normal(0.0, (0.020, 0.024, 0.020))
            height[3:6] = rng.normal(0.0, (0.14, 0.10, 0.06))
            arm.track.add_pulse(height, now, now + length, now + length + stay + 0.4)
            now += length + stay + rng.exponential(0.9) + 0.2


def _next_stroke(draws: GestureDraws, number: int, hand: str) -> Stroke | None:
    """The first stroke of the next unit after ``number`` that uses ``hand``."""
    for unit in draws.units[number + 1 :]:
        if unit.hand in (hand, "both"):
            return draws.strokes[unit.strokes[0]]
    return None


def _stroke_timing(
    stroke: Stroke, strokes: Sequence[Stroke], style: GestureStyle, rng: np.random.Generator
) -> StrokeTiming:
    # Larger strokes take a little longer (isochrony), tight sequences force shorter ones.
    gaps = [abs(other.apex - stroke.apex) for other in strokes if other is not stroke]
    length = (0.26 + 0.20 * style.radius * (0.25 + 1.05 * stroke.size)) / style.speed * rng.uniform(0.9, 1.1)
    length = float(np.clip(min(length, 0.62 * min(gaps, default=1.0)), 0.18, 0.34))
    begin = stroke.apex - ARRIVAL * length
    return StrokeTiming(begin, begin + length)


def _second_hand(
    shape: tuple[Control, Control, Control],
    offset: Float[np.ndarray, " 3"],
    style: GestureStyle,
    rng: np.random.Generator,
) -> tuple[Control, Control, Control]:
    """The same stroke for the other hand: smaller, elsewhere by ``offset`` (metres), never a mirror image."""
    ready, apex, bow = shape
    middle = 0.5 * (ready + apex)
    share = style.symmetry * rng.uniform(0.45, 1.1)
    wobble = np.concatenate([offset + rng.normal(0.0, 0.022, 3), rng.normal(0.0, 0.10, 3), np.zeros(3)])
    shift = middle + wobble
    return shift + share * (ready - middle), shift + share * (apex - middle), share * bow


def _sympathise(arm: _Arm, strokes: list[Stroke], style: GestureStyle, rng: np.random.Generator) -> None:
    """The idle hand stirs a little with the other hand's strokes."""
    for stroke in strokes:
        height = np.zeros(len(arm.rest))
        size = style.radius * stroke.size * rng.uniform(0.10, 0.40)
        height[:3] = size * np.array([0.1, 0.6, 0.5])
        height[4] = rng.normal(0.0, 0.03)
        arm.track.add_pulse(height, stroke.apex - 0.32, stroke.apex + 0.05, stroke.apex + 0.6)


def _gesture(
    arm: _Arm,
    plan: SpeechPlan,
    strokes: list[Stroke],
    timings: list[StrokeTiming],
    shapes: Sequence[tuple[Control, Control, Control]],
    follow: Stroke | None,
    holds: bool,
    style: GestureStyle,
    rng: np.random.Generator,
) -> None:
    """One gesture unit of one arm."""
    tempo = style.speed
    for order, (timing, (ready, apex, bow)) in enumerate(zip(timings, shapes, strict=True)):
        if order == 0:
            want = rng.uniform(0.50, 0.72) / tempo
            begin = max(timing.begin - want, min(arm.free - 0.15, timing.begin - 0.22))
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
    arm: _Arm,
    before: StrokeTiming,
    timing: StrokeTiming,
    stroke: Stroke,
    holds: bool,
    style: GestureStyle,
    rng: np.random.Generator,
) -> float:
    """What the hand does between two strokes of a unit; returns when the next preparation begins."""
    gap = timing.begin - before.end
    prepare = min(rng.uniform(0.32, 0.5) / style.speed, max(gap + 0.08, 0.2))
    begin = timing.begin - prepare
    release = before.end + (stroke.hold if holds else 0.0) - 0.05
    if timing.begin - release < 0.5:
        middle = max(begin, before.end)
        arm.mark("hold", before.end, middle)
        arm.mark("preparation", middle, timing.begin)
        return begin
    # The hand sinks back and closes a little, as if the effort had left it.
    relax = arm.track.goal.copy()
    ease = (1.0 - 0.6 * min(style.tension, 1.0)) * rng.uniform(0.22, 0.5)
    relax[:6] += ease * (arm.rest - arm.track.goal)[:6]
    end = release + rng.uniform(0.40, 0.60) / style.speed
    arm.track.step_to(relax, release, end)
    let_go, middle = max(release, before.end), max(min(end, begin), before.end)
    arm.mark("hold", before.end, let_go)
    arm.mark("retraction", let_go, middle)
    arm.mark("preparation", max(middle, let_go), timing.begin)
    return begin


def _retract(
    arm: _Arm,
    plan: SpeechPlan,
    stroke: Stroke,
    timing: StrokeTiming,
    follow: Stroke | None,
    style: GestureStyle,
    rng: np.random.Generator,
) -> None:
    """Hold, then lead the arm back to rest; part of the way where the next unit follows soon."""
    length = rng.uniform(0.60, 0.95) / style.speed
    begin = timing.end + stroke.hold - 0.04
    pause = _next_pause(plan, stroke.apex)
    if pause is not None:
        begin = max(min(begin, pause + 0.1), timing.end - 0.04)
    share = 1.0
    if follow is not None:
        # The next stroke's preparation wants about 0.7 s.
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
    """Start of the long pause that follows the phrase spoken at ``after``, if one does."""
    for index, phrase in enumerate(plan.phrases):
        if phrase.end >= after:
            last = index + 1 == len(plan.phrases)
            if last or plan.phrases[index + 1].start - phrase.end > LONG_PAUSE:
                return phrase.end
            return None
    return None
