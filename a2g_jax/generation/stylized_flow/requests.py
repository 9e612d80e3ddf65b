"""Requests of style controls that bring the motion for a speech to a clip's height, speed and radius of the hands.

Motion follows a request in part, and how far depends on the speech, on the other controls and on the style code. So a
request is corrected by what motion did with it: a few samples are drawn, measured, and what is lacking is added.
"""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from a2g_jax.metrics.style import HandStyle

#: Corrections of a request. In three the distance of the hands from the goal falls to a third on generated speakers.
PASSES = 3

Values = Float[np.ndarray, " K"]


def matching_requests(
    draw: Callable[[Values], Values], goal: Values, training: Float[np.ndarray, "N K"], gains: Sequence[float] = ()
) -> Values:
    """Requests, as quantiles of the training clips, with which drawn motion has about the goal's controls.

    Requests stay within the range of the training clips, so that a goal beyond it is reached as far as the model can.

    Args:
        draw: mean controls of motion that is drawn with such requests; the same draws for each call.
        goal: controls, metres and m/s.
        training: mean controls of every training clip.
        gains: factors of the run on the distance of a request from the median; 1 if empty. They make up for a weak
            response as well, and doing so twice would overshoot and swing.
    """
    low, high, median = training.min(axis=0), training.max(axis=0), np.median(training, axis=0)

    def quantiles(values: Values) -> Values:
        return as_quantiles(median + (values - median) / np.array(gains or 1.0), training)

    requested = np.clip(goal, low, high)
    for _ in range(PASSES):
        requested = np.clip(requested + goal - draw(quantiles(requested)), low, high)
    return quantiles(requested)


def as_quantiles(values: Values, training: Float[np.ndarray, "N K"]) -> Values:
    """Quantiles of the training clips that have these values; 0 and 1 beyond their range."""
    ranks = np.linspace(0.0, 1.0, len(training))
    columns = zip(values, np.sort(training, axis=0).T, strict=True)
    return np.array([np.interp(value, column, ranks) for value, column in columns], np.float32)


def requested_hands(
    clip: HandStyle, names: Sequence[str], training: Float[np.ndarray, "N K"], quantiles: Float[np.ndarray, "T K"]
) -> HandStyle:
    """Mean hands that a style and requests of a speech stand for together.

    Args:
        clip: hands of the style's clip, which hold for what is not requested.
        names: of the controls.
        training: mean controls of every training clip.
        quantiles: requests by frame; NaN where there is none.
    """
    found: dict[str, list[float]] = {}
    for column, name in enumerate(names):
        # Some runs have a height of each hand.
        field = name.rpartition("_")[2]
        if field in clip._fields and not np.isnan(quantiles[:, column]).all():
            values = np.quantile(training[:, column], np.nan_to_num(quantiles[:, column]))
            own = np.where(np.isnan(quantiles[:, column]), getattr(clip, field), values)
            found.setdefault(field, []).append(float(own.mean()))
    return clip._replace(**{field: float(np.mean(values)) for field, values in found.items()})
