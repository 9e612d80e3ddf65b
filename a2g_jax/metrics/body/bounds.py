"""Bounds on the figures of a body: those of a training split with margins, within those of any person who gestures."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.metrics.body.figures import Reference

#: Highest value of each figure by name, a value for each of :attr:`Reference.parts`.
Values = Mapping[str, Float[np.ndarray, " _"]]

#: Quantile of a corpus's frames that counts as its extreme. The maximum of hours of motion capture is often a fault of
#: the capture; a single frame in ten thousand is not what a person does either.
QUANTILE = 0.9999
#: Seconds of training motion from which extremes stand alone: less has too few gestures to tell what a person does not
#: do.
LEAST_SECONDS = 60.0
#: Frames of which they are measured at most: more than an hour changes nothing.
MOST_FRAMES = 200_000


@dataclass(frozen=True)
class Margin:
    """A figure's bound: ``times * extreme + plus``, at least ``least``."""

    times: float = 1.0
    plus: float = 0.0
    least: float = -np.inf


#: Margins over the extremes of a corpus. Speeds: half as fast again, for a single frame that the corpus lacks is no
#: fault; jerk, whose extremes are rarest, 2.5 times. Angles: 30 degrees of a joint's range, which its movements about
#: other axes share, and 15 of a hinge. The least bounds are too small to be noticed: 180 degrees/s are 6 degrees
#: in a frame at 30 fps, elbows of many people overextend by 15 degrees, a shift of weight or half a step moves the
#: pelvis at 0.8 m/s, and feet placed by inverse kinematics move by centimetres.
MARGINS: Mapping[str, Margin] = {
    "turn": Margin(times=1.5, least=180.0),
    "range": Margin(plus=30.0, least=40.0),
    "tilt": Margin(plus=15.0, least=20.0),
    "bend": Margin(plus=15.0),
    "backwards": Margin(plus=15.0, least=15.0),
    "sideways": Margin(plus=15.0),
    "wrist_speed": Margin(times=1.5, least=1.0),
    "wrist_jerk": Margin(times=2.5, least=1000.0),
    "root_speed": Margin(times=1.5, least=0.8),
    "sink": Margin(plus=0.02, least=0.03),
    "lift": Margin(plus=0.02, least=0.03),
    "slide": Margin(times=1.5, plus=0.01, least=0.04),
}

#: Degrees between the mean pose and the furthest pose of joints: the active ranges of the American Academy of
#: Orthopaedic Surgeons (1965) from one end to the other, since the mean pose may be anywhere in between.
_RANGES = {
    "Spine1": 60.0, "Spine2": 60.0, "Spine3": 60.0, "Neck": 80.0, "Head": 80.0, "Collar": 60.0, "Wrist": 150.0,
    "Hip": 150.0, "Knee": 165.0, "Ankle": 80.0, "Foot": 90.0,
}  # fmt: skip
#: Fastest turn of trunk and head, degrees/s; limbs have 1800. A pitcher's pelvis and trunk reach 600 and 1200, and the
#: elbow 2300 (Fleisig et al. 1999), which no gesture comes near; a flip by 90 degrees in a frame at 30 fps is 2700.
_TRUNK_TURN = 1200.0
_TRUNK = ("Pelvis", "Spine1", "Spine2", "Spine3", "Neck", "Head", "L_Collar", "R_Collar")
#: Highest values of the others. Hinges: full flexion with soft tissue, and hyperextension of lax joints, 15 degrees,
#: with as much for the error of a mean axis. A boxer's fist reaches 10 m/s, a run 5 m/s; one jumps half a metre.
_ANYBODY = {
    "turn": 1800.0, "range": 180.0, "tilt": 75.0, "bend": 165.0, "backwards": 30.0, "sideways": 60.0,
    "wrist_speed": 10.0, "wrist_jerk": 20_000.0, "root_speed": 5.0, "sink": 0.1, "lift": 0.5, "slide": 0.3,
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class BodyBounds:
    """Bounds of a body's figures."""

    reference: Reference
    high: Values
    """Highest allowed value of each figure."""
    source: str
    """What they are measured on, for messages."""

    def to_json(self) -> dict[str, dict[str, float]]:
        """Bounds by figure and joint."""
        rounded = lambda values: [float(f"{value:.6g}") for value in values]  # noqa: E731
        return {
            name: dict(zip(self.reference.parts[name], rounded(values), strict=True))
            for name, values in self.high.items()
        }

    def loosened(self, motion: Motion, source: str) -> "BodyBounds":
        """These bounds where they are higher, elsewhere those of a motion's own extremes: for a clip that is performed
        as it is. They stay within those of any person.

        Args:
            motion: on the skeleton of the bounds.
        """
        own = widened(extremes([motion], self.reference), self.reference)
        return replace(self, high={name: np.maximum(self.high[name], own[name]) for name in self.high}, source=source)


def extremes(motions: Iterable[Motion], reference: Reference) -> dict[str, Float[np.ndarray, " _"]]:
    """The 99.99th percentile of each figure over frames; left and right share the higher one.

    A body that lifts its left arm high may do so with the right one, also where a corpus has right-handed people only,
    or where training mirrors its clips.

    Raises:
        ValueError: no motions.
    """
    rows = [reference.figures(motion) for motion in motions]
    return {
        name: _both_sides(np.quantile(np.concatenate([row[name] for row in rows]), QUANTILE, axis=0), name, reference)
        for name in reference.parts
    }


def anybody(reference: Reference) -> BodyBounds:
    """Bounds that hold for every person who gestures, whatever a run was trained on."""
    high = {name: np.full(len(parts), _ANYBODY[name]) for name, parts in reference.parts.items()}
    for role, joint in reference.joints.items():
        if role in _TRUNK:
            high["turn"][joint] = _TRUNK_TURN
        high["range"][joint] = _RANGES.get(role.removeprefix("L_").removeprefix("R_"), _ANYBODY["range"])
    return BodyBounds(reference, high, "any person")


def bounds_of(reference: Reference, found: Values | None) -> BodyBounds:
    """Bounds from a corpus's extremes; those of any person without them."""
    if found is None:
        return anybody(reference)
    high = {**anybody(reference).high, **widened(found, reference)}
    return BodyBounds(reference, high, "the training split with margins")


def widened(found: Values, reference: Reference) -> dict[str, Float[np.ndarray, " _"]]:
    """Extremes with :data:`MARGINS`, within the bounds of any person."""
    most = anybody(reference).high
    return {
        name: np.minimum(np.maximum(MARGINS[name].times * values + MARGINS[name].plus, MARGINS[name].least), most[name])
        for name, values in found.items()
    }


def extremes_to_json(found: Values) -> dict[str, list[float]]:
    """Extremes as JSON values, a list for each figure."""
    return {name: [float(f"{value:.6g}") for value in values] for name, values in found.items()}


def extremes_from_json(value: object, reference: Reference, where: str) -> dict[str, Float[np.ndarray, " _"]]:
    """Inverse of :func:`extremes_to_json`. Figures may be missing, as those of elbows and wrists are in runs
    of upper bodies by earlier versions.

    Args:
        where: file and entry, for the error.

    Raises:
        InputError: other figures, numbers of joints or values.
    """
    expected = {name: (len(parts),) for name, parts in reference.parts.items()}
    try:
        assert isinstance(value, dict)
        found = {str(name): np.asarray(values, np.float64) for name, values in value.items()}
        assert all(values.shape == expected.get(name) for name, values in found.items())
        assert {"turn", "range"} <= found.keys()
        assert all(np.isfinite(values).all() for values in found.values())
    except (AssertionError, TypeError, ValueError):
        raise InputError(f"{where}: is damaged; restore the file, or remove the entry.") from None
    return found


def _both_sides(values: Float[np.ndarray, " _"], name: str, reference: Reference) -> Float[np.ndarray, " _"]:
    """Values with the higher one of left and right in both."""
    parts = reference.parts[name]
    values = values.copy()
    for role, joint in reference.joints.items():
        other = reference.joints.get("R_" + role[2:]) if role.startswith("L_") else None
        if other is None:
            continue
        pair = [reference.skeleton.names[at] for at in (joint, other)]
        if all(part in parts for part in pair):
            columns = [parts.index(part) for part in pair]
            values[columns] = values[columns].max()
    return values
