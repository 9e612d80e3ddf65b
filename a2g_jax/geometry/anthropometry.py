"""Units of length from the proportions of people: the unit in which the limbs of a skeleton are those of an adult.

Bones along a limb have the same length in every pose, so that no reference pose is needed. Shares of the stature: arm
from shoulder to wrist 0.332, leg from hip to ankle 0.491 (Drillis and Contini 1966, Body Segment Parameters).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from a2g_jax.geometry.skeleton import Skeleton

_SHARES = ((("Shoulder", "Elbow", "Wrist"), 0.332, 1.0), (("Hip", "Knee", "Ankle"), 0.491, 2.0))
#: Largest ratios of left and right, and of the statures by arms and by legs.
_ALIKE, _PROPORTIONS = 1.15, 1.6
#: Statures of people in general, metres: a small child and a very tall adult, with rigs' errors.
_PEOPLE = (0.85, 2.4)
#: Statures of adults to which an unusual unit has to bring a skeleton; their ratio is less than that of any two units.
_ADULTS = (1.3, 2.2)
#: Metres in one unit, with names; the first two are used wherever they fit any person.
UNITS = (
    ("centimetres", 0.01),
    ("metres", 1.0),
    ("inches", 0.0254),
    ("1/0.45 inch = 5.644 cm, as in CMU's data", 0.0254 / 0.45),
    ("millimetres", 0.001),
    ("feet", 0.3048),
    ("decimetres", 0.1),
)


@dataclass(frozen=True)
class Unit:
    """The unit of a file's lengths."""

    name: str
    metres: float
    stature: float | None = None
    """Stature in metres that the limbs then have; None for a skeleton without the limbs of a body."""
    usual: bool = True
    """Whether a usual unit fits a person."""

    @property
    def plain(self) -> bool:
        """Whether these are metres or centimetres, without a doubt."""
        return self.usual and self.name in ("centimetres", "metres", "as given")

    def __str__(self) -> str:
        """A sentence with the uncertainty."""
        if self.stature is None:
            return f"lengths are in {self.name}"
        if not self.usual:
            return (
                f"no usual unit fits a person; lengths are read as {self.name}, which by its limbs makes the body "
                f"{self.stature:.3g} m tall"
            )
        if self.plain:
            return f"lengths are in {self.name}; by its limbs the person is {self.stature:.2f} m tall"
        return (
            f"lengths are in {self.name}: by its limbs the person is then {self.stature:.2f} m tall (within 10 %), and "
            "no other usual unit fits an adult"
        )


def stature(skeleton: Skeleton, roles: Mapping[str, int]) -> float | None:
    """Stature of a person with the limbs of a skeleton, in its unit; None if they are not those of a person.

    Left and right have to be alike, and arms and legs to belong to statures that are.

    Args:
        roles: joint of each part, as of a rig.
    """
    found = []
    for parts, share, weight in _SHARES:
        lengths = [_along(skeleton, [roles.get(f"{side}_{part}", -1) for part in parts]) for side in "LR"]
        if min(lengths) > 0:
            if max(lengths) > _ALIKE * min(lengths):
                return None
            found.append((math.log(sum(lengths) / 2 / share), weight))
    logs = [log for log, _ in found]
    if not found or max(logs) - min(logs) > math.log(_PROPORTIONS):
        return None
    weights = sum(weight for _, weight in found)
    return math.exp(sum(log * weight for log, weight in found) / weights)


def _along(skeleton: Skeleton, chain: list[int]) -> float:
    """Length of the bones from the first joint of a limb to its last; 0 if one is missing."""
    if min(chain) < 0:
        return 0.0
    offsets, length, joint = np.asarray(skeleton.offsets, np.float64), 0.0, chain[-1]
    while joint not in (chain[0], -1):
        length += float(np.linalg.norm(offsets[joint]))
        joint = skeleton.parents[joint]
    return length if joint == chain[0] else 0.0


def find_unit(units_tall: float, guess: float) -> Unit:
    """The unit of a skeleton.

    Args:
        units_tall: stature in units of the file.
        guess: metres in a unit (0.01 or 1) by the size of the skeleton, which stands where it fits any person.
    """
    if _PEOPLE[0] <= units_tall * guess <= _PEOPLE[1]:
        return Unit("centimetres" if guess < 1 else "metres", guess, units_tall * guess)
    for name, metres in UNITS:
        if _ADULTS[0] <= units_tall * metres <= _ADULTS[1]:
            return Unit(name, metres, units_tall * metres)
    return Unit("centimetres" if guess < 1 else "metres", guess, units_tall * guess, usual=False)
