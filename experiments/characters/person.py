"""One person in a T-pose, whose joints all rigs of the experiment have in their own way."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

#: Places of the parts of a person 1.72 m tall in a T-pose: metres, x left, y up, z forward.
PLACES: dict[str, tuple[float, float, float]] = {
    "Ground": (0.0, 0.0, 0.0),
    "Pelvis": (0.0, 0.95, 0.0),
    "Spine1": (0.0, 1.03, -0.005),
    "Spine2": (0.0, 1.13, -0.01),
    "Spine3": (0.0, 1.24, -0.015),
    "Spine4": (0.0, 1.32, -0.02),
    "Spine5": (0.0, 1.38, -0.02),
    "Neck": (0.0, 1.46, -0.02),
    "Neck2": (0.0, 1.50, -0.01),
    "Head": (0.0, 1.55, 0.0),
    "HeadTop": (0.0, 1.72, 0.0),
    "Collar": (0.03, 1.41, 0.0),
    "Shoulder": (0.17, 1.42, -0.02),
    "Elbow": (0.45, 1.42, -0.02),
    "Wrist": (0.70, 1.42, -0.02),
    "HandTip": (0.88, 1.42, -0.02),
    "Hip": (0.09, 0.90, 0.0),
    "Knee": (0.10, 0.49, 0.01),
    "Ankle": (0.10, 0.085, -0.02),
    "Foot": (0.10, 0.02, 0.11),
    "ToeTip": (0.10, 0.02, 0.19),
}
_KNUCKLES = {"Index": (0.090, 0.024), "Middle": (0.092, 0.002), "Ring": (0.086, -0.018), "Pinky": (0.077, -0.036)}
_BONES = {"Index": (0.042, 0.025, 0.02), "Middle": (0.046, 0.029, 0.021), "Ring": (0.043, 0.027, 0.02)}
for _finger, (_along, _across) in _KNUCKLES.items():
    _x, _y, _z = PLACES["Wrist"]
    PLACES[f"{_finger}0"] = (_x + 0.03, _y, _z + 0.5 * _across)
    _reach = np.cumsum([_along, *_BONES.get(_finger, (0.034, 0.019, 0.018))])
    for _number in range(4):
        PLACES[f"{_finger}{_number + 1}"] = (_x + float(_reach[_number]), _y - 0.004, _z + _across)
for _number, _place in enumerate(
    ((0.024, -0.012, 0.024), (0.052, -0.022, 0.05), (0.078, -0.03, 0.068), (0.1, -0.034, 0.08))
):
    PLACES[f"Thumb{_number + 1}"] = tuple(float(a + b) for a, b in zip(PLACES["Wrist"], _place, strict=True))

_ARM = ("Shoulder", "Elbow", "Wrist", "HandTip")


@dataclass(frozen=True)
class Stance:
    """A rest pose: how far the arms hang below a T-pose, and how far fingers are curled, degrees."""

    lowered: float = 0.0
    curl: float = 0.0
    spread: float = 0.0
    """Of the legs."""

    def place(self, part: str) -> Float[np.ndarray, "3"]:
        """Where a part is: ``L_Elbow``, ``Head``, or a point between two, ``L_Shoulder>L_Elbow:0.5``."""
        if ">" in part:
            ends, _, share = part.partition(":")
            first, second = (self.place(end) for end in ends.split(">"))
            return first + (second - first) * float(share)
        side, _, name = part.rpartition("_")
        point = np.array(PLACES[name])
        arm = name in _ARM or name[:-1] in (*_KNUCKLES, "Thumb")
        if name[:-1] in _KNUCKLES and self.curl:
            point = self._curled(name, point)
        if arm:
            pivot = np.array(PLACES["Shoulder"])
            point = pivot + Rotation.from_euler("z", -self.lowered, degrees=True).apply(point - pivot)
        if name in ("Knee", "Ankle", "Foot", "ToeTip") and self.spread:
            pivot = np.array(PLACES["Hip"])
            point = pivot + Rotation.from_euler("z", self.spread, degrees=True).apply(point - pivot)
        return point * (-1.0 if side == "R" else 1.0, 1.0, 1.0)

    def _curled(self, name: str, point: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        finger, number = name[:-1], int(name[-1])
        for at in range(number - 1, 0, -1):
            pivot = np.array(PLACES[f"{finger}{at}"])
            point = pivot + Rotation.from_euler("z", -self.curl, degrees=True).apply(point - pivot)
        return point


def bone_axes(along: Float[np.ndarray, "3"], main: str, up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Axes of a joint whose ``main`` axis (``X``, ``Y`` or ``-X``) is along its bone."""
    first = along / np.linalg.norm(along)
    second = up - first * (up @ first)
    if np.linalg.norm(second) < 1e-3:
        second = np.array([0.0, 0.0, 1.0]) - first * first[2]
    second /= np.linalg.norm(second)
    third = np.cross(first, second)
    columns = {"X": (first, second, third), "Y": (third, first, second), "-X": (-first, -second, third)}[main]
    return np.stack(columns, axis=1)
