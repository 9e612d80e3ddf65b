"""Control tracks of both arms from the drawn strokes, with small beats and the movements of resting hands."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from a2g_jax.talker.gesture_plan import GestureDraws
from a2g_jax.talker.gesture_unit import Arm, StrokeTiming, perform_unit, stroke_timing
from a2g_jax.talker.hand_shapes import Control, rest_control, stroke_controls
from a2g_jax.talker.paths import Track
from a2g_jax.talker.speech import SpeechPlan
from a2g_jax.talker.styles import GestureStyle
from a2g_jax.talker.truth import GestureUnit, PhaseSpan, Stroke

SMALL_BEAT = 0.12
"""Smallest accent (0 to 1) that gets a small beat where it gets no stroke."""
_MIRROR_LAG = 0.06
"""Largest lag of the second hand, seconds."""


def plan_arms(
    plan: SpeechPlan, draws: GestureDraws, style: GestureStyle, rng: np.random.Generator
) -> tuple[dict[str, Track], tuple[PhaseSpan, ...]]:
    """Control tracks of the left and right arm (see :mod:`a2g_jax.talker.hand_shapes`) and their phases."""
    dominant = "right" if style.right_handed >= 0.5 else "left"
    arms = {}
    for hand in ("left", "right"):
        rest = rest_control(draws.rest_pose, hand == dominant)
        arms[hand] = Arm(hand, rest, Track(rest), 0.0, [])
    for number, unit in enumerate(draws.units):
        strokes = [draws.strokes[index] for index in unit.strokes]
        hands = ("left", "right") if unit.hand == "both" else (unit.hand,)
        lead = dominant if unit.hand == "both" else unit.hand
        timings = [stroke_timing(stroke, draws.strokes, style, rng) for stroke in strokes]
        shapes = _unit_shapes(strokes, unit, style, rng)
        offset = rng.normal(0.0, (0.025, 0.045, 0.03))
        for hand in ("left", "right"):
            arm = arms[hand]
            follow = _next_stroke(draws, number, hand)
            if hand not in hands:
                _move_idle_hand(arm, strokes, style, rng)
            elif hand == lead:
                perform_unit(arm, plan, strokes, timings, shapes, follow, unit.holds, style, rng)
            else:
                lag = rng.uniform(-0.01, _MIRROR_LAG)
                late = [StrokeTiming(timing.begin + lag, timing.end + lag) for timing in timings]
                mirrored = [_second_hand(shape, offset, style, rng) for shape in shapes]
                perform_unit(arm, plan, strokes, late, mirrored, follow, unit.holds, style, rng)
    for arm in arms.values():
        arm.mark("rest", arm.free, plan.seconds)
        _small_beats(arm, plan, draws, style, rng)
        _fidget(arm, style, rng)
    spans = sorted((span for arm in arms.values() for span in arm.spans), key=lambda span: (span.hand, span.start))
    return {hand: arm.track for hand, arm in arms.items()}, tuple(spans)


def _unit_shapes(
    strokes: Sequence[Stroke], unit: GestureUnit, style: GestureStyle, rng: np.random.Generator
) -> list[tuple[Control, Control, Control]]:
    """Start, arrival and bow of each stroke of a unit, whose place drifts from stroke to stroke."""
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
    arm: Arm, plan: SpeechPlan, draws: GestureDraws, style: GestureStyle, rng: np.random.Generator
) -> None:
    """Add small beats of a raised hand at accents too weak for a stroke; held units have more of them."""
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


def _fidget(arm: Arm, style: GestureStyle, rng: np.random.Generator) -> None:
    """Add the occasional shifts of a resting hand."""
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


def _move_idle_hand(arm: Arm, strokes: list[Stroke], style: GestureStyle, rng: np.random.Generator) -> None:
    """Add small movements of the idle hand along with the other hand's strokes."""
    for stroke in strokes:
        height = np.zeros(len(arm.rest))
        size = style.radius * stroke.size * rng.uniform(0.10, 0.40)
        height[:3] = size * np.array([0.1, 0.6, 0.5])
        height[4] = rng.normal(0.0, 0.03)
        arm.track.add_pulse(height, stroke.apex - 0.32, stroke.apex + 0.05, stroke.apex + 0.6)
