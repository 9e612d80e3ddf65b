"""Whether the positions of a root are in another unit than the offsets of the joints."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.skeleton import Skeleton

#: Ratios of usual units to one another that no pose explains.
_RATIOS = {1000.0: "1000", 100.0: "100", 39.37: "39.4", 10.0: "10"}
#: Relative error of the ratio for a person who stands, and relative spread of the height that shows standing.
_WITHIN, _STEADY = 0.1, 0.1
#: Lengths of legs of people, metres.
_LEGS = (0.5, 1.3)


def root_unit_doubt(skeleton: Skeleton, root: Float[np.ndarray, "T 3"], roles: Mapping[str, int]) -> str:
    """A sentence on a root whose steady height is a power of ten (or 39.37) away from the length of the legs.

    A root at the origin, or one that moves about, shows nothing.

    Args:
        root: metres, by the unit of the offsets.
        roles: joints of the body by part.
    """
    ankles = [roles[name] for name in ("L_Ankle", "R_Ankle") if name in roles]
    if not ankles:
        return ""
    rest = np.zeros((skeleton.joints, 3))
    for joint in range(1, skeleton.joints):
        rest[joint] = rest[skeleton.parents[joint]] + skeleton.offsets[joint]
    down = rest[ankles].mean(axis=0)
    axis = int(np.argmax(np.abs(down)))
    legs, heights = abs(float(down[axis])), np.asarray(root[:, axis], np.float64)
    height = float(np.median(heights))
    if not (_LEGS[0] < legs < _LEGS[1]) or height == 0 or float(np.ptp(heights)) > _STEADY * abs(height):
        return ""
    for ratio, text in _RATIOS.items():
        for factor, words in ((ratio, f"{text} times too small"), (1 / ratio, f"{text} times too large")):
            # Ankles are some centimetres above the floor.
            if abs(abs(height) * factor / (1.08 * legs) - 1) < _WITHIN:
                return (
                    f"positions of the root seem to be in another unit than the offsets: {words} for legs of"
                    f" {100 * legs:.0f} cm (the root is at {100 * height:.2g} cm)"
                )
    return ""
