"""Clips written over a generated motion: their own rotations, with transitions around them and feet that stand."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from a2g_jax.generation.pins.feet import Feet, feet_of, lifted, share_of_clip, step_over, steps_itself
from a2g_jax.generation.pins.offsets import turned
from a2g_jax.generation.pins.report import ROUGH_SPEED, Ends
from a2g_jax.generation.pins.request import Pin
from a2g_jax.generation.pins.transitions import Limits, Seam, Transition, plan
from a2g_jax.geometry.footholds import reach_goals
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.metrics.hands import hand_speeds, local_places

#: Shortest transition of a clip with feet of its own, seconds: two steps, one after the other.
_TWO_STEPS = 0.8
#: Top speed of hands that counts for a clip that is calmer, m/s: else they would take seconds to come to it.
_CALM = 0.5
#: Fastest turn of a joint that is ordinary, degrees per second.
_TURN = 900.0
#: Turn of hips, knees and ankles in a transition, degrees per second, or in times that of the clip and of the motion,
#: from which longer transitions are tried: of these least lengths, seconds. One is taken if it takes a tenth off.
_LEG_TURN, _LEG_TURNS, _LONGER, _WORTH = 150.0, 1.5, (0.5, 0.8, 1.25, 2.0), 0.9
#: Frames at either end of a changed stretch over which the root's lowering begins and ends.
_EDGE = 6


@dataclass(frozen=True, eq=False)
class Placed:
    """A clip in a motion."""

    pin: Pin
    clip: Motion
    """On its feet, beside which the motion's stand."""
    feet: Feet | None
    """Ankles of the clip; None where those of the motion stay."""
    before: Transition
    after: Transition

    @property
    def start(self) -> int:
        """First frame that differs from the motion without the clip."""
        return self.pin.first - len(self.before.root)

    @property
    def stop(self) -> int:
        """Frame after the last one that differs."""
        return self.pin.stop + len(self.after.root)

    @property
    def ends(self) -> Ends:
        """Lengths of the transitions."""
        return Ends(len(self.before.root), len(self.after.root))


def perform(
    plain: Motion, pins: Sequence[Pin], standing: Sequence[Motion], jerk: float, length: float | None = None
) -> tuple[Motion, list[Placed]]:
    """A motion with clips in it, and how they were placed.

    Trunk, head and arms have the rotations of the clip in its frames. Its pelvis moves above the feet as in the clip:
    posture, height, and turns relative to its mean facing are kept, its path along the floor is not. Feet stay where
    the generated ones stand, unless the clip steps or stands turned by more than 35 degrees. Frames beyond the
    transitions are those of the motion, bit by bit.

    Args:
        plain: the generated motion, on its feet.
        pins: in order of time, apart, and within the motion.
        standing: their motions, on their feet by the same rule as the generated one.
        jerk: limit for the hands in transitions, m/s3.
        length: seconds of each transition; None for as short as jerk, speed, and turns of the legs allow.
    """
    feet, least = feet_of(plain), [0.0] * len(pins)
    result, placed = _perform(plain, feet, pins, standing, jerk, length, least)
    if feet is None or length is not None:
        return result, placed
    # Legs are placed by inverse kinematics after the transitions are planned, over the footholds of all clips.
    limits = [_leg_limit(plain, feet, one) for one in placed]
    turns = [_leg_turn(result, feet, one) for one in placed]
    for longer in _LONGER:
        fast = [number for number in range(len(pins)) if turns[number] > limits[number]]
        if not fast:
            break
        tried = [longer if number in fast else value for number, value in enumerate(least)]
        other, there = _perform(plain, feet, pins, standing, jerk, length, tried)
        slower = {number: _leg_turn(other, feet, there[number]) for number in fast}
        taken = [number for number in fast if slower[number] < _WORTH * turns[number]]
        if not taken:
            continue
        for number in taken:
            least[number], turns[number] = longer, slower[number]
        result, placed = (
            (other, there) if least == tried else _perform(plain, feet, pins, standing, jerk, length, least)
        )
    return result, placed


def _leg_limit(plain: Motion, feet: Feet, one: Placed) -> float:
    """Turn of leg joints from which a longer transition is tried, degrees per second."""
    around = plain.clip(max(one.start - 1, 0), min(one.stop + 1, plain.frames))
    own = max(_turn_of_legs(motion, feet) for motion in (around, one.clip))
    return max(_LEG_TURN, _LEG_TURNS * own)


def _leg_turn(motion: Motion, feet: Feet, one: Placed) -> float:
    """Fastest turn of a leg joint in the transitions of a clip, degrees per second."""
    spans = ((one.start - 1, one.pin.first + 1), (one.pin.stop - 1, one.stop + 1))
    return max(_turn_of_legs(motion.clip(max(low, 0), min(high, motion.frames)), feet) for low, high in spans)


def _turn_of_legs(motion: Motion, feet: Feet) -> float:
    joints = [joint for leg in feet.legs for joint in (leg.hip, leg.knee, leg.ankle)]
    rotations = np.asarray(motion.rotations, np.float64)[:, joints]
    return float(rotation_angle(rotations[1:], rotations[:-1]).max(initial=0.0)) * motion.fps


def _perform(
    plain: Motion,
    feet: Feet | None,
    pins: Sequence[Pin],
    standing: Sequence[Motion],
    jerk: float,
    length: float | None,
    least: Sequence[float],
) -> tuple[Motion, list[Placed]]:
    """The motion with clips in it whose transitions have a least length each."""
    placed = [
        _place(plain, feet, pins, number, clip, jerk, length, least[number]) for number, clip in enumerate(standing)
    ]
    rotations = np.array(plain.rotations, np.float64)
    root = np.array(plain.root, np.float64)
    for one in placed:
        for transition in (one.before, one.after):
            frames = transition.frames
            rotations[frames] = turned(rotations[frames], transition.rotations)
            root[frames] += transition.root
    for one in placed:
        inside = slice(one.pin.first, one.pin.stop)
        rotations[inside], root[inside] = one.clip.rotations, one.clip.root
    result_rotations, result_root = np.array(plain.rotations), np.array(plain.root)
    for low, high, group in _stretches(placed):
        part = replace(plain, rotations=rotations[low:high].astype(np.float32), root=root[low:high].astype(np.float32))
        if feet is not None:
            part = _on_feet(part, feet, low, high, plain.frames, group)
        result_rotations[low:high], result_root[low:high] = part.rotations, part.root
    return replace(plain, rotations=result_rotations, root=result_root), placed


def _place(
    plain: Motion,
    feet: Feet | None,
    pins: Sequence[Pin],
    number: int,
    clip: Motion,
    jerk: float,
    length: float | None,
    least: float,
) -> Placed:
    pin = pins[number]
    inside = slice(pin.first, pin.stop)
    own = None
    if feet is not None:
        clip_feet, there = feet_of(clip), Feet(feet.legs, feet.places[:, inside], feet.world[:, inside])
        assert clip_feet is not None
        shift = (there.middle() - clip_feet.middle()) * [1.0, 0.0, 1.0]
        if steps_itself(clip_feet, there, plain.fps):
            # Roots keep the middle between the ankles at one height, so that a lifted foot sinks the other.
            shift = shift + lifted(clip_feet, there, plain.fps)[:, None] * [0.0, 1.0, 0.0]
            own = replace(clip_feet, places=clip_feet.places + shift)
        clip = replace(clip, root=(np.asarray(clip.root, np.float64) + shift).astype(np.float32))
    top = hand_speeds(local_places(clip), clip.skeleton, clip.fps).max(initial=0.0)
    turns = rotation_angle(np.asarray(clip.rotations)[1:], np.asarray(clip.rotations)[:-1]).max() * clip.fps
    limits = Limits(jerk, ROUGH_SPEED * max(float(top), _CALM), max(float(turns), _TURN))
    left = pins[number - 1].stop if number > 0 else 0
    right = pins[number + 1].first if number + 1 < len(pins) else plain.frames
    least = max(least, 0.0 if own is None else _TWO_STEPS)
    seams = (
        Seam(pin.first, -1, pin.first - left, number == 0),
        Seam(pin.stop - 1, 1, right - pin.stop, number + 1 == len(pins)),
    )
    before, after = (plan(plain, clip, pin.first, seam, limits, length, least) for seam in seams)
    return Placed(pin, clip, own, before, after)


def _stretches(placed: Sequence[Placed]) -> list[tuple[int, int, list[Placed]]]:
    """Changed stretches of the motion, with the clips in them; those that touch are one."""
    found: list[tuple[int, int, list[Placed]]] = []
    for one in placed:
        if found and one.start <= found[-1][1]:
            low, high, group = found[-1]
            found[-1] = (low, max(high, one.stop), [*group, one])
        else:
            found.append((one.start, one.stop, [one]))
    return found


def _on_feet(part: Motion, feet: Feet, low: int, high: int, frames: int, group: Sequence[Placed]) -> Motion:
    """Legs that reach the footholds of the motion, and those of clips with feet of their own."""
    goals = {}
    for number, leg in enumerate(feet.legs):
        place, world = feet.places[number, low:high].copy(), feet.world[number, low:high].copy()
        for one in group:
            if one.feet is None:
                continue
            rows = slice(one.start - low, one.stop - low)
            inside = one.pin.motion.frames
            share = share_of_clip(
                one.ends.before, inside, one.ends.after, number, (not one.before.shape.held, not one.after.shape.held)
            )
            there = np.clip(np.arange(len(share)) - one.ends.before, 0, inside - 1)
            place[rows], world[rows] = step_over(
                place[rows], world[rows], one.feet.places[number, there], one.feet.world[number, there], share
            )
        goals[leg] = (place, world)
    ramp = np.arange(high - low)
    lowering = np.ones(high - low)
    if low > 0:
        lowering = np.minimum(lowering, ramp / _EDGE)
    if high < frames:
        lowering = np.minimum(lowering, ramp[::-1] / _EDGE)
    return reach_goals(part, goals, lowering)
