"""Torso, head and pelvis over time: posture, sway, breathing, gaze, nods, and reactions to the arms' movement."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.talker.gesture_plan import GestureDraws, accented_syllables
from a2g_jax.talker.paths import Track, Waves, draw_waves
from a2g_jax.talker.speech import SpeechPlan
from a2g_jax.talker.styles import GestureStyle

CHANNELS = 12
"""Pelvis x, y, z (metres); yaw, roll, pitch (radians) of pelvis, chest over pelvis, head over chest."""
_PELVIS, _PELVIS_TURN, _CHEST, _HEAD = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
_KNEE_EASE = 0.007
"""Height that the pelvis loses in a relaxed stance, metres."""
NOD_SPACING = 0.5
"""Smallest time between nods, seconds."""


@dataclass(frozen=True, eq=False)
class Stance:
    """Positions of the feet, fixed for a recording."""

    lateral: float
    """Ankles' distance from the midline, metres."""
    stagger: float
    """Left ankle ahead of the right one, metres."""
    toe_out: tuple[float, float]
    """Yaw of left and right foot, outward positive, radians."""


@dataclass(frozen=True, eq=False)
class PosturePlan:
    """The posture of a recording, which can be sampled at any time."""

    stance: Stance
    track: Track
    sway: Waves
    breath: tuple[float, float, float]
    """Frequency in Hz and two phases."""

    def sample(self, times: Float[np.ndarray, " T"]) -> tuple[Float[np.ndarray, "T 12"], Float[np.ndarray, " T"]]:
        """The twelve channels, and the shoulders' lift by breathing in radians."""
        values = self.track.sample(times) + self.sway.sample(times)
        rate, phase, drift = self.breath
        breath = np.sin(2.0 * np.pi * rate * times + phase + 0.7 * np.sin(2.0 * np.pi * 0.043 * times + drift))
        values[:, 8] -= np.deg2rad(0.55) * breath
        values[:, 11] += np.deg2rad(0.40) * breath
        return values, np.deg2rad(1.0) * breath


def plan_posture(plan: SpeechPlan, draws: GestureDraws, style: GestureStyle, rng: np.random.Generator) -> PosturePlan:
    """Draw the posture of one recording."""
    stance = Stance(
        rng.uniform(0.095, 0.125), rng.normal(0.0, 0.02), tuple(np.deg2rad(rng.uniform(5.0, 14.0, 2)).tolist())
    )
    base = np.zeros(CHANNELS)
    lean = np.deg2rad(style.lean)
    base[1] = -_KNEE_EASE
    base[2] = -0.25 * lean
    base[5], base[8] = 0.3 * lean, 0.7 * lean
    # The head stays upright on a leaning torso.
    base[11] = np.deg2rad(style.head_pitch + 2.0) - 0.8 * lean
    track = Track(base)
    _shift_weight(track, plan.seconds, draws.posture, style, rng)
    _shift_gaze(track, plan.seconds, style, rng)
    _nod(track, plan, style, rng)
    _follow_arms(track, draws, style, rng)
    degrees = np.deg2rad([2.7, 0.8, 1.2, 5.8, 3.6, 4.0, 4.0, 2.8, 3.6])
    sizes = np.concatenate([[0.019, 0.0014, 0.018], degrees]) * style.sway
    sway = draw_waves(rng, sizes, 0.08, 1.3)
    breath = (rng.uniform(0.21, 0.29), rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.0, 2.0 * np.pi))
    return PosturePlan(stance, track, sway, breath)


def _move(track: Track, change: dict[int, float], begin: float, end: float) -> None:
    goal = track.goal.copy()
    for channel, value in change.items():
        goal[channel] = value
    track.step_to(goal, begin, end)


def _shift_weight(track: Track, seconds: float, posture: str, style: GestureStyle, rng: np.random.Generator) -> None:
    """Move the pelvis over one foot: the hip over the loaded leg rises, the chest bends back over the feet."""
    home = {"even": 0.0, "left": 0.03, "right": -0.03}[posture]
    base = track.start.copy()

    def targets() -> dict[int, float]:
        side = home + rng.normal(0.0, 0.028 * style.sway)
        roll = 1.25 * side + np.deg2rad(rng.normal(0.0, 0.3))
        yaw = np.deg2rad(rng.normal(0.0, 5.0 * style.sway))
        return {
            0: side,
            1: base[1] - 0.12 * abs(side),
            2: base[2] + rng.normal(0.0, 0.006 * style.sway),
            3: yaw,
            4: roll,
            7: base[7] - 1.15 * roll,
            6: -0.5 * yaw,
        }

    for channel, value in targets().items():
        track.start[channel] = value
    now = rng.uniform(1.0, 4.0)
    while now < seconds:
        length = rng.uniform(0.8, 1.6)
        _move(track, targets(), now, now + length)
        now += length + rng.uniform(0.5, 3.5)


def _shift_gaze(track: Track, seconds: float, style: GestureStyle, rng: np.random.Generator) -> None:
    """Turn the head to another listener every few seconds; the chest follows later and less."""
    level, follow = track.start[11], track.start.copy()
    yaw = np.deg2rad(rng.normal(0.0, 0.6 * style.gaze))
    track.start[9] += 0.8 * yaw
    now = rng.uniform(0.4, 2.0)
    while now < seconds:
        length = rng.uniform(0.35, 0.75)
        target = np.deg2rad(rng.normal(0.0, style.gaze))
        roll = np.deg2rad(rng.normal(0.0, 2.8)) - 0.08 * target
        pitch = level + np.deg2rad(rng.normal(0.0, 3.2))
        _move(track, {9: 0.8 * target, 10: roll, 11: pitch}, now, now + length)
        _move(track, {6: follow[6] + 0.4 * target}, now + 0.1, now + 0.25 + 1.8 * length)
        now += length + rng.exponential(1.2) + 0.4


def _nod(track: Track, plan: SpeechPlan, style: GestureStyle, rng: np.random.Generator) -> None:
    """Nod on accents: time and size follow the audio, the shape varies a little."""
    threshold = max(0.12, style.threshold - 0.15)
    for index in accented_syllables(plan, threshold, NOD_SPACING):
        syllable = plan.syllables[index]
        size = np.deg2rad(style.nod) * (0.35 + 0.65 * syllable.accent)
        height = np.zeros(CHANNELS)
        height[11] = size
        height[8] = 0.10 * size
        height[9:11] = size * rng.normal(0.0, (0.25, 0.22))
        begin = syllable.peak - rng.uniform(0.15, 0.21)
        top = syllable.peak + rng.uniform(0.0, 0.05)
        track.add_pulse(height, begin, top, top + rng.uniform(0.32, 0.50))
        # A small lift before the nod, as heads do.
        lift = np.zeros(CHANNELS)
        lift[11] = -0.25 * size
        track.add_bump(lift, begin - 0.32, begin + 0.12)


def _follow_arms(track: Track, draws: GestureDraws, style: GestureStyle, rng: np.random.Generator) -> None:
    """Turn torso and head a little toward the gesturing hand, and move the trunk a little with each stroke."""
    for unit in draws.units:
        strokes = [draws.strokes[index] for index in unit.strokes]
        side = {"left": 1.0, "right": -1.0, "both": 0.0}[unit.hand]
        reach = style.radius / 0.43
        turn = np.zeros(CHANNELS)
        turn[6] = np.deg2rad(rng.uniform(2.0, 8.0)) * side * reach
        turn[7] = -np.deg2rad(rng.uniform(0.0, 1.8)) * side * reach
        turn[8] = np.deg2rad(rng.uniform(0.0, 2.5))
        turn[9] = -0.5 * turn[6]
        turn[0] = 0.004 * side * reach
        track.add_pulse(turn, strokes[0].apex - 0.75, strokes[0].apex + 0.1, strokes[-1].apex + rng.uniform(1.0, 1.8))
        for stroke in strokes:
            push = np.zeros(CHANNELS)
            push[6] = np.deg2rad(rng.normal(6.0, 3.0)) * (side or rng.choice((-0.6, 0.6))) * stroke.size * reach
            push[7] = np.deg2rad(rng.normal(0.0, 3.0)) * stroke.size
            push[8] = np.deg2rad(rng.uniform(2.5, 7.0)) * stroke.size * reach
            push[11] = -0.5 * push[8]
            push[1] = -0.002 * stroke.size
            track.add_pulse(push, stroke.apex - 0.32, stroke.apex + 0.05, stroke.apex + 0.6)
