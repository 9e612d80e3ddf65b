"""Finger motion: hand shapes of each gesture family, timed by the arms' phases.

A hand has twelve channels (radians): flexion of the knuckles (MCP) of index, middle, ring and little finger, flexion
of their middle joints (PIP; the end joints follow by two thirds, as tendons couple them), spread, and the thumb's
opposition, abduction and flexion.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from a2g_jax.talker.gesture_plan import GestureDraws
from a2g_jax.talker.ik import Rotations, turn
from a2g_jax.talker.paths import Track, draw_waves, soft_clip
from a2g_jax.talker.skeleton import FINGERS
from a2g_jax.talker.styles import GestureStyle
from a2g_jax.talker.truth import GestureUnit, PhaseSpan

CHANNELS = 12
DIP_COUPLING = 2.0 / 3.0
"""Flexion of a finger's end joint as a share of its middle joint's (e.g. Rijpkema & Girard 1991)."""
SOFT_LIMITS = np.deg2rad(
    [[-12.0, 85.0]] * 4 + [[2.0, 98.0]] * 4 + [[-4.0, 16.0], [0.0, 55.0], [-30.0, 14.0], [0.0, 50.0]]
)
"""Least and most of each channel, radians; approached smoothly."""

_LAGS = {"Index": 0.02, "Middle": 0.03, "Ring": 0.04, "Pinky": 0.05, "Thumb": 0.015}
"""Fingers open and close one after the other, behind the wrist; seconds, for a relaxed hand."""
_COLUMNS = {"Index": 0, "Middle": 1, "Ring": 2, "Pinky": 3}
_SPREAD = {"Index": 1.0, "Middle": 0.12, "Ring": -0.7, "Pinky": -1.45}
"""Share of the spread channel by finger; positive toward the thumb."""
_THUMB_BEND = np.array([0.25, -0.62, -0.74])
"""Direction in which the thumb's end bends, in the left hand at rest: under the palm."""

Shape = Float[np.ndarray, " 12"]


def _shape(knuckles: tuple[float, ...], middles: tuple[float, ...], spread: float, thumb: tuple[float, ...]) -> Shape:
    return np.deg2rad([*knuckles, *middles, spread, *thumb])


_RELAXED = _shape((17.0, 22.0, 27.0, 31.0), (26.0, 33.0, 37.0, 36.0), 3.0, (18.0, -14.0, 14.0))
_SHAPES: dict[str, Shape] = {
    "relaxed": _RELAXED,
    "open": _shape((4.0, 3.0, 5.0, 8.0), (9.0, 10.0, 12.0, 13.0), 8.0, (8.0, 0.0, 6.0)),
    "flat": _shape((10.0, 8.0, 8.0, 9.0), (8.0, 8.0, 9.0, 9.0), 1.0, (12.0, -20.0, 8.0)),
    "fist": _shape((50.0, 57.0, 60.0, 61.0), (62.0, 68.0, 68.0, 64.0), 0.0, (38.0, -16.0, 32.0)),
    "point": _shape((6.0, 60.0, 66.0, 68.0), (9.0, 80.0, 84.0, 80.0), 0.0, (42.0, -16.0, 38.0)),
    "pinch": _shape((46.0, 34.0, 27.0, 22.0), (46.0, 34.0, 30.0, 26.0), 4.0, (46.0, -8.0, 28.0)),
    "ring": _shape((50.0, 22.0, 14.0, 10.0), (54.0, 22.0, 16.0, 14.0), 6.0, (48.0, -8.0, 32.0)),
    "cup": _shape((20.0, 19.0, 22.0, 26.0), (24.0, 26.0, 29.0, 30.0), 9.0, (34.0, 2.0, 12.0)),
    "claw": _shape((14.0, 12.0, 14.0, 18.0), (40.0, 42.0, 44.0, 44.0), 10.0, (30.0, 6.0, 22.0)),
}
_FAMILY_SHAPES: dict[str, tuple[str, ...]] = {
    "beat": ("relaxed", "fist", "pinch", "cup"),
    "offer": ("open", "cup", "relaxed"),
    "sweep": ("flat", "open", "relaxed"),
    "point": ("point",),
    "list": ("relaxed",),
    "frame": ("cup", "claw", "flat"),
}
"""Shapes that a unit of a family mixes; the weights are drawn once a unit and mostly favour one."""
_REST_SHAPES: dict[str, Shape] = {
    "sides": _RELAXED * 1.12,
    "belly": _shape((14.0, 18.0, 23.0, 27.0), (18.0, 24.0, 28.0, 28.0), 3.0, (16.0, -16.0, 10.0)),
    "clasped": _shape((30.0, 34.0, 38.0, 40.0), (36.0, 40.0, 42.0, 40.0), 1.0, (22.0, -22.0, 14.0)),
}
_IDLE = np.deg2rad([2.0, 2.0, 2.2, 2.6, 2.6, 2.6, 2.8, 3.0, 0.9, 2.0, 2.0, 2.0])


def _counting(number: int) -> Shape:
    """A hand that shows ``number`` fingers, 1 to 5: index first, the thumb last."""
    shape = _SHAPES["point"].copy()
    stretched = _SHAPES["open"]
    for column in range(min(number, 4)):
        shape[column], shape[4 + column] = stretched[column], stretched[4 + column]
    shape[8] = np.deg2rad(4.0) if number > 1 else 0.0
    if number >= 5:
        shape[9:] = stretched[9:]
    return shape


def plan_fingers(
    hand: str, draws: GestureDraws, phases: Sequence[PhaseSpan], style: GestureStyle, rng: np.random.Generator
) -> Track:
    """Channels of one hand over a recording, timed by the strokes of its arm.

    Args:
        hand: 'left' or 'right'.
        draws, phases: of the arms.
        rng: of each unit's hand shape; all draws are continuous.
    """
    rest = _REST_SHAPES[draws.rest_pose] * rng.uniform(0.85, 1.15) + rng.normal(0.0, np.deg2rad(3.0), CHANNELS)
    track = Track(rest)
    strokes = [span for span in phases if span.hand == hand and span.phase == "stroke"]
    taken = 0
    units = [unit for unit in draws.units if unit.hand in (hand, "both")]
    for number, unit in enumerate(units):
        spans = strokes[taken : taken + len(unit.strokes)]
        taken += len(unit.strokes)
        after = strokes[taken].start if number + 1 < len(units) else np.inf
        _gesture(track, unit, spans, after, rest, draws, style, rng)
    return track


def _gesture(
    track: Track,
    unit: GestureUnit,
    spans: Sequence[PhaseSpan],
    after: float,
    rest: Shape,
    draws: GestureDraws,
    style: GestureStyle,
    rng: np.random.Generator,
) -> None:
    """Add one unit: the hand takes shape before each stroke, tightens with it and slackens after it."""
    slack = 1.0 - 0.6 * min(style.tension, 1.0)
    weights: dict[str, np.ndarray] = {}
    for order, (index, span) in enumerate(zip(unit.strokes, spans, strict=True)):
        stroke = draws.strokes[index]
        names = _FAMILY_SHAPES[stroke.family]
        if stroke.family not in weights:
            weights[stroke.family] = rng.dirichlet(np.full(len(names), 0.5))
        shape = sum(weight * _SHAPES[name] for weight, name in zip(weights[stroke.family], names, strict=True))
        if stroke.family == "list":
            shape = _counting(order + 1)
        shape = shape + rng.normal(0.0, np.deg2rad(2.5), CHANNELS)
        # Strong accents and tension bring the hand further from its relaxed shape.
        effort = min(0.75 + 0.25 * stroke.size + 0.2 * style.tension, 1.0)
        shape = _RELAXED + effort * (shape - _RELAXED)
        earlier = spans[order - 1].end if order else span.start - 0.55 / style.speed
        begin = max(earlier, span.start - 0.42 / style.speed)
        ready = track.goal + rng.uniform(0.45, 0.7) * (shape - track.goal)
        ready[:8] += slack * np.deg2rad(rng.uniform(2.0, 8.0))
        track.step_to(ready, begin, span.start + 0.08)
        track.step_to(shape, span.start, max(span.end, span.start + 0.2) + 0.03)
        following = spans[order + 1].start if order + 1 < len(spans) else after
        _slacken(track, rest, span.end, stroke.hold, following, order + 1 == len(spans), slack, style, rng)


def _slacken(
    track: Track,
    rest: Shape,
    end: float,
    hold: float,
    following: float,
    last: bool,
    slack: float,
    style: GestureStyle,
    rng: np.random.Generator,
) -> None:
    begin = end + hold + rng.uniform(0.0, 0.08)
    length = rng.uniform(0.45, 0.75) / style.speed
    room = following - 0.3 - begin
    if room < 0.2:
        return
    share = 1.0 if last and room > length else slack * rng.uniform(0.15, 0.4)
    track.step_to(track.goal + share * (rest - track.goal), begin, begin + min(length, max(room + 0.2, 0.35)))


def finger_rotations(
    track: Track, times: Float[np.ndarray, " T"], side: float, style: GestureStyle, rng: np.random.Generator
) -> Float[np.ndarray, "T 15 3 3"]:
    """Local rotations of one hand's finger joints at ``times`` (seconds), in the skeleton's order.

    Args:
        side: +1 left, -1 right.
        rng: of the fingers' idle movement.
    """
    idle = draw_waves(rng, _IDLE * (1.0 - 0.5 * min(style.tension, 1.0)), 0.1, 0.9).sample(times)
    stiff = 1.0 - 0.6 * min(style.tension, 1.0)
    local = np.empty((len(times), 15, 3, 3))
    for number, finger in enumerate(FINGERS):
        values = soft_clip(track.sample(times - stiff * _LAGS[finger]) + idle, SOFT_LIMITS, 0.05)
        joints = _thumb(values) if finger == "Thumb" else _finger(values, finger)
        local[:, 3 * number : 3 * number + 3] = np.stack(joints, axis=1)
    if side < 0:
        # The right hand is the left one's mirror image.
        mirror = np.array([-1.0, 1.0, 1.0])
        local *= mirror[:, None] * mirror
    return local


def _finger(values: Float[np.ndarray, "T 12"], finger: str) -> tuple[Rotations, Rotations, Rotations]:
    column = _COLUMNS[finger]
    knuckle, middle = values[:, column], values[:, 4 + column]
    # Bent fingers cannot spread: the knuckles' ligaments tighten.
    spread = _SPREAD[finger] * values[:, 8] * np.cos(np.clip(knuckle, 0.0, 0.5 * np.pi))
    return turn(1, -spread) @ turn(2, -knuckle), turn(2, -middle), turn(2, -DIP_COUPLING * middle)


def _thumb(values: Float[np.ndarray, "T 12"]) -> tuple[Rotations, Rotations, Rotations]:
    opposition, abduction, flexion = values[:, 9], values[:, 10], values[:, 11]
    return (
        turn(0, opposition) @ turn(1, -abduction),
        _about(_THUMB_AXIS, 0.8 * flexion),
        _about(_THUMB_AXIS, 1.1 * flexion),
    )


def _thumb_axis() -> Float[np.ndarray, " 3"]:
    along = np.array([0.024, -0.007, 0.021])
    axis = np.cross(along, _THUMB_BEND)
    return axis / np.linalg.norm(axis)


_THUMB_AXIS = _thumb_axis()


def _about(axis: Float[np.ndarray, " 3"], angle: Float[np.ndarray, " T"]) -> Rotations:
    """Rotation matrices about a fixed unit axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle)[:, None, None] * cross + (1.0 - np.cos(angle))[:, None, None] * (cross @ cross)
