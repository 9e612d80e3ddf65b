"""Ends of a clip at which a recording shakes: no transition could continue them."""

import numpy as np

from a2g_jax.geometry.motion import Motion
from a2g_jax.metrics.hands import hand_jerk, local_places

#: Jerk of hands that shake, m/s3: twice that of the liveliest talk.
SHAKY = 2500.0
#: Seconds of a clip that may be left out at either end, and that have to stay between.
_MOST, _LEFT = 0.25, 0.5
#: Frames from an end within which shaking spoils a transition.
_NEAR = 4


def sound_ends(motion: Motion) -> tuple[int, int]:
    """First frame, and the frame after the last one, of a motion without hands that shake at its ends.

    Up to a quarter of a second is left out at either end, unless less than half a second would be left.
    """
    jerks = hand_jerk(local_places(motion), motion.skeleton, motion.fps)
    most = round(_MOST * motion.fps)
    first, cut = _shaking(jerks, most), _shaking(jerks[::-1], most)
    if (motion.frames - first - cut) / motion.fps < _LEFT:
        return 0, motion.frames
    return first, motion.frames - cut


def _shaking(jerks: np.ndarray, most: int) -> int:
    """Frames from the beginning after which the hands no longer shake; 0 if they do not begin with it.

    Value k is of frames k to k + 3.
    """
    bad = np.flatnonzero(jerks[:most] > SHAKY)
    if len(bad) == 0 or bad[0] >= _NEAR:
        return 0
    return int(bad[-1]) + 1
