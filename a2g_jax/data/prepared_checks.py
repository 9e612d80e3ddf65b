"""Checks of a recording's features and motion before they become part of a corpus."""

import numpy as np

from a2g_jax.data.featurise import Prepared
from a2g_jax.errors import InputError

#: Largest change of a pose value, and of the root in metres, over a recording that is no motion.
_STILL = 1e-5


def check_finite(item: Prepared) -> None:
    """Refuse NaN and infinity.

    Raises:
        InputError: the array, and the first frame of them.
    """
    for name, array in (("audio features", item.audio), ("poses", item.pose), ("root", item.root)):
        wrong = ~np.isfinite(np.asarray(array).reshape(len(array), -1)).all(axis=1)
        if wrong.any():
            where = " and ".join(item.sources) or item.name
            raise InputError(
                f"{where}: recording {item.name!r}: NaN or infinity in its {name}, {int(wrong.sum())} of {len(wrong)}"
                f" frames, the first is {int(np.argmax(wrong))}; correct it, or leave it out with --skip-broken."
            )


def is_still(item: Prepared) -> bool:
    """Whether nothing moves in the whole recording."""
    spread = max(float(np.max(np.ptp(np.asarray(array), axis=0), initial=0.0)) for array in (item.pose, item.root))
    return spread < _STILL
