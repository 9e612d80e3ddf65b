"""How a clip's hands move on the whole, and how far a style has arrived in made motion.

Height, speed and radius are those that StyleGestures steers by (Alexanderson et al. 2020, Sec. 3), over whole clips.
Positions in metres, y up.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from a2g_jax.features.style_controls import hand_height, hand_radius, hand_speed
from a2g_jax.geometry.skeleton import BODY_JOINTS

#: Of the 22 body joints.
PELVIS = BODY_JOINTS.index("Pelvis")
WRISTS = (BODY_JOINTS.index("L_Wrist"), BODY_JOINTS.index("R_Wrist"))


class HandStyle(NamedTuple):
    """Means over a clip and both hands; or, of :func:`share_of_the_way`, shares."""

    height: float
    """Of the wrists above the pelvis, metres."""
    speed: float
    """Of the wrists against the pelvis, m/s."""
    radius: float
    """From the wrists to the vertical through the pelvis, metres."""


def hand_style(
    positions: Float[Array | np.ndarray, "T J 3"],
    fps: float,
    wrists: tuple[int, ...] = WRISTS,
    pelvis: int = PELVIS,
) -> HandStyle:
    """Height, speed and radius of a clip's hands.

    Args:
        positions: of the joints in the world, two frames or more.
        wrists: which joints are the hands; those of the 22 body joints unless told otherwise.
        pelvis: which joint they are measured from.

    Raises:
        ValueError: fewer than two frames, which tell no speed.
    """
    if len(positions) < 2:
        raise ValueError(f"expected 2 frames or more; got {len(positions)}")
    places = np.asarray(positions, np.float32)
    root = places[:, pelvis]
    hands = places[:, list(wrists)]
    # Speed against the pelvis: how the whole body goes is no style of the hands.
    against = hands - root[:, None]
    values = (hand_height(hands, root, fps, 0.0), hand_speed(against, fps, 0.0), hand_radius(hands, root, fps, 0.0))
    return HandStyle(*(float(np.mean(np.asarray(value, np.float64))) for value in values))


def share_of_the_way(source: HandStyle, target: HandStyle, made: HandStyle, least: float = 1e-3) -> HandStyle:
    """How far made motion went from the source's style to the target's: 0 not at all, 1 all the way, above 1 beyond.

    Args:
        source: of motion made for the same speech without the style.
        target: of the clip whose style is wanted.
        made: of motion made with it.
        least: statistics of source and target that are nearer (metres, m/s) have no way between them: NaN.
    """
    shares = []
    for start, end, reached in zip(source, target, made, strict=True):
        way = end - start
        shares.append((reached - start) / way if abs(way) > least else float("nan"))
    return HandStyle(*shares)
