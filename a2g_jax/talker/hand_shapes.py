"""Hand positions and wrist angles of each gesture family and rest pose.

An arm's control has nine channels: the wrist's place ``out`` (away from the midline, to its own side), ``up`` and
``fwd`` from the chest joint (metres, upright axes that turn with the chest), ``supination``, ``palmar`` flexion and
``radial`` deviation (radians), how far the elbow points ``out`` (0 = down, 1 = 45 degrees), ``shrug`` (radians), and
``life``: how much the arm wanders by itself (1 while it gestures, less at rest).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.talker.skeleton import FOREARM, UPPER_ARM
from a2g_jax.talker.styles import GestureStyle

CHANNELS = 9
Control = Float[np.ndarray, " 9"]

_SHOULDER = np.array([0.172, 0.142, 0.0])
"""The shoulder from the chest joint, metres: out, up, forward."""
_COMFORT = 0.945 * (UPPER_ARM + FOREARM)
"""Largest distance of a stroke from the shoulder, metres: elbows stay bent by 38 degrees or more."""
_CLOSEST = 0.27
"""Smallest distance of a stroke from the shoulder, metres: an arm folded further is in the way."""

_PLACES: dict[str, tuple[float, float, float]] = {
    "center": (0.155, -0.085, 0.295),
    "low": (0.20, -0.20, 0.25),
    "high": (0.20, 0.075, 0.29),
    "wide": (0.31, -0.07, 0.23),
}


def control(
    place: tuple[float, float, float],
    supination: float = 0.0,
    palmar: float = 0.0,
    radial: float = 0.0,
    elbow: float = 0.35,
    shrug: float = 0.0,
    life: float = 0.3,
) -> Control:
    """One arm's control from metres and degrees."""
    angles = np.deg2rad([supination, palmar, radial])
    return np.array([*place, *angles, elbow, np.deg2rad(shrug), life])


def rest_control(rest_pose: str, dominant: bool) -> Control:
    """The arm's control at rest; the dominant hand lies over the other."""
    if rest_pose == "sides":
        return control((0.246, -0.348, 0.040), supination=-12.0, palmar=12.0, radial=-4.0, elbow=0.35, life=0.9)
    if rest_pose == "belly":
        place = (0.088, -0.130, 0.220) if dominant else (0.102, -0.168, 0.178)
        return control(place, supination=-22.0 if dominant else 8.0, palmar=28.0, radial=2.0, elbow=0.62, life=0.7)
    place = (0.080, -0.205, 0.235) if dominant else (0.082, -0.228, 0.190)
    return control(place, supination=-28.0 if dominant else -14.0, palmar=24.0, radial=-6.0, elbow=0.55, life=0.65)


def _at_most(value: float, most: float, width: float) -> float:
    return float(most - width * np.logaddexp(0.0, (most - value) / width))


def _within_reach(place: Float[np.ndarray, " 3"], closest: float) -> tuple[float, float, float]:
    """Move a place to where arms are comfortable: bent elbows, not over the shoulder, not close to the chest.

    ``closest`` is the least distance from the midline: two working hands leave room for each other's fingers.
    """
    out, up, fwd = place
    out = -_at_most(-out, -closest, 0.02)
    out, up, fwd = _at_most(out, 0.50, 0.04), _at_most(up, 0.20, 0.03), -_at_most(-fwd, -0.19, 0.03)
    away = np.array([out, up, fwd]) - _SHOULDER
    reach = float(np.linalg.norm(away))
    comfort = -_at_most(-_at_most(reach, _COMFORT, 0.02), -_CLOSEST, 0.02)
    out, up, fwd = _SHOULDER + away * (comfort / reach)
    return float(out), float(up), float(fwd)


@dataclass(frozen=True, eq=False)
class _Shape:
    """A stroke of one family: places relative to its center, in stroke radii (out, up, fwd), and the hand's angles."""

    begin: tuple[float, float, float]
    arrive: tuple[float, float, float]
    bow: tuple[float, float, float]
    """Bump on the way."""
    begin_hand: tuple[float, float, float]
    """Supination, palmar flexion, radial deviation at the start, degrees."""
    arrive_hand: tuple[float, float, float]
    elbow: tuple[float, float] = (0.0, 0.0)
    """Added to the elbow channel at start and arrival."""


_SHAPES: dict[str, _Shape] = {
    # Palm in, a flick down and forward.
    "beat": _Shape((-0.08, 0.34, -0.16), (0.1, -0.34, 0.24), (0.02, 0.0, 0.12), (10.0, -4.0, 16.0), (4.0, 4.0, -14.0)),
    # Opens outward and forward through a low arc until the palm is up.
    "offer": _Shape(
        (-0.32, 0.1, -0.2), (0.4, -0.08, 0.34), (0.0, -0.16, 0.04), (18.0, 18.0, 4.0), (68.0, -16.0, -6.0), (0.0, -0.05)
    ),
    # Palm down, sideways; the wrist trails.
    "sweep": _Shape(
        (-0.5, 0.05, 0.05), (0.5, 0.03, -0.08), (0.0, 0.06, 0.18), (-40.0, 14.0, 0.0), (-30.0, -14.0, 0.0), (0.12, 0.15)
    ),
    "point": _Shape(
        (-0.05, 0.05, -0.55), (0.12, 0.12, 0.55), (0.06, 0.1, 0.0), (-8.0, 10.0, 8.0), (-42.0, -6.0, 0.0), (0.05, 0.12)
    ),
    # Down beside the last item, palm half up.
    "list": _Shape((-0.1, 0.42, -0.1), (0.15, -0.32, 0.12), (0.1, 0.0, 0.08), (30.0, 6.0, 10.0), (48.0, -8.0, -8.0)),
    # Palms in, as if setting down something held between the hands.
    "frame": _Shape(
        (-0.22, 0.36, -0.1), (0.2, -0.3, 0.16), (0.06, 0.0, 0.06), (12.0, -2.0, 10.0), (6.0, 2.0, -8.0), (0.05, 0.08)
    ),
}
_ADVANCE = {"list": 0.55, "frame": 0.25}
"""How far a unit's strokes move outward from the first to the last, in stroke radii."""


def stroke_controls(
    family: str,
    place: str,
    two_handed: bool,
    order: int,
    count: int,
    size: float,
    before: Control | None,
    drift: Float[np.ndarray, " 3"],
    style: GestureStyle,
    rng: np.random.Generator,
) -> tuple[Control, Control, Control]:
    """Draw one stroke: where it starts, where it arrives, and how far its path bows (a bump on the way).

    Args:
        order, count: which stroke of how many in the unit.
        size: 0 to 1, from the accent.
        before: where the unit's last stroke arrived; the hand does not go all the way back for the next one.
        drift: how far the unit has wandered from its place, metres.
    """
    shape = _SHAPES[family]
    radius = style.radius * (0.25 + 1.05 * size) * rng.uniform(0.75, 1.3)
    center = np.array(_PLACES[place]) + np.array([style.spread, style.height, 0.0]) + drift
    center += rng.normal(0.0, (0.036, 0.046, 0.042))
    center[0] += _ADVANCE.get(family, 0.0) * (order / max(count - 1, 1) - 0.5) * radius
    # Sweeps go out and come back.
    back = -0.8 if family == "sweep" and order % 2 else 1.0
    mild = np.array([1.0, 1.0 - 0.6 * min(style.tension, 1.0), 1.0 - 0.6 * min(style.tension, 1.0)])
    jitter = rng.normal(0.0, (5.0, 4.0, 3.0), (2, 3))
    # No two strokes of a unit take the same direction: they lean to one side and the other.
    tilt = rng.normal(0.0, 0.30) + (0.22 if order % 2 else -0.12)
    turned = np.array([[np.cos(tilt), -np.sin(tilt), 0.0], [np.sin(tilt), np.cos(tilt), 0.0], [0.0, 0.0, 1.0]])
    ends = []
    for offset, hand, elbow, noise in (
        (shape.begin, shape.begin_hand, shape.elbow[0], jitter[0]),
        (shape.arrive, shape.arrive_hand, shape.elbow[1], jitter[1]),
    ):
        supination, palmar, radial = (mild * np.array(hand) + noise).tolist()
        ends.append(
            control(
                _within_reach(center + back * radius * (turned @ np.array(offset)), 0.13 if two_handed else 0.07),
                supination,
                back * palmar,
                radial,
                style.elbow_out + elbow,
                3.0 * style.tension,
                1.0 - 0.4 * min(style.tension, 1.0),
            )
        )
    bow = np.zeros(CHANNELS)
    bow[:3] = radius * np.array(shape.bow) * rng.uniform(-0.4, 1.8) + radius * rng.normal(0.0, 0.07, 3)
    begin, arrive = ends
    if before is not None:
        begin = begin + rng.uniform(0.0, 0.4) * (before - begin)
    return begin, arrive, bow
