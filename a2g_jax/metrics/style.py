"""Style statistics of the hands of a clip, and the transfer of a style to generated motion.

Height, speed and radius are the control signals of StyleGestures (Alexanderson et al. 2020, Sec. 3), averaged
over clips. Positions in metres, y up.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from a2g_jax.features.style_controls import hand_height, hand_radius, hand_speed
from a2g_jax.geometry.skeleton import BODY_JOINTS

#: Rows among the 22 body joints.
PELVIS = BODY_JOINTS.index("Pelvis")
WRISTS = (BODY_JOINTS.index("L_Wrist"), BODY_JOINTS.index("R_Wrist"))


class HandStyle(NamedTuple):
    """Means over a clip and both hands; for :func:`share_of_the_way`, shares."""

    height: float
    """Height of the wrists above the pelvis, metres."""
    speed: float
    """Speed of the wrists relative to the pelvis, m/s."""
    radius: float
    """Distance of the wrists from the vertical through the pelvis, metres."""


def hand_style(
    positions: Float[Array | np.ndarray, "T J 3"],
    fps: float,
    wrists: tuple[int, ...] = WRISTS,
    pelvis: int = PELVIS,
) -> HandStyle:
    """Height, speed and radius of a clip's hands.

    Args:
        positions: world positions of the joints, two frames or more.
        wrists: rows of the hands; by default those of the 22 body joints.
        pelvis: row of the reference joint.

    Raises:
        ValueError: fewer than two frames, which have no speed.
    """
    if len(positions) < 2:
        raise ValueError(f"expected 2 frames or more; got {len(positions)}")
    points = np.asarray(positions, np.float32)
    root = points[:, pelvis]
    hands = points[:, list(wrists)]
    # Speed relative to the pelvis: locomotion is not part of the style of the hands.
    relative = hands - root[:, None]
    values = (hand_height(hands, root, fps, 0.0), hand_speed(relative, fps, 0.0), hand_radius(hands, root, fps, 0.0))
    return HandStyle(*(float(np.mean(np.asarray(value, np.float64))) for value in values))


def share_of_the_way(source: HandStyle, target: HandStyle, made: HandStyle, least: float = 1e-3) -> HandStyle:
    """Share of the difference between the source's and the target's style that generated motion covers: 0 none, 1 all.

    Args:
        source: statistics of motion generated for the same speech without the style.
        target: statistics of the clip whose style is requested.
        made: statistics of motion generated with the style.
        least: smallest difference of source and target (metres, m/s) for a share; NaN below it.
    """
    shares = []
    for start, end, reached in zip(source, target, made, strict=True):
        way = end - start
        shares.append((reached - start) / way if abs(way) > least else float("nan"))
    return HandStyle(*shares)
