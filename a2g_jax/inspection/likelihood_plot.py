"""A picture of a motion's log-likelihood over time; needs Matplotlib."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.inspection.unlikely import Moment, robust_scale
from a2g_jax.io.files import atomic_path
from a2g_jax.viz.plots import COLOURS


def likelihood_over_time(
    axes: Any,
    seconds: Float[np.ndarray, " N"],
    log_likelihood: Float[np.ndarray, " N"],
    moments: Sequence[Moment] = (),
) -> None:
    """Log-likelihood of every frame, its median with a band of three robust standard deviations, numbered moments.

    Args:
        axes: Matplotlib axes.
        moments: in the order of their numbers.
    """
    median, scale = robust_scale(log_likelihood)
    axes.axhspan(median - 3 * scale, median + 3 * scale, color=COLOURS[0], alpha=0.25, linewidth=0)
    axes.axhline(median, color=COLOURS[0], linewidth=1)
    axes.plot(seconds, log_likelihood, color=COLOURS[1], linewidth=1)
    for number, moment in enumerate(moments, start=1):
        second = moment.seconds
        axes.plot([second], [moment.log_likelihood], "o", color=COLOURS[2], markersize=5)
        joint = f" {moment.joints[0]}" if moment.joints else ""
        axes.annotate(
            f"{number}{joint}", (second, moment.log_likelihood), (5, -3), textcoords="offset points", fontsize=8
        )
    axes.set_xlabel("seconds")
    axes.set_ylabel("log-likelihood, nats a frame")
    axes.margins(x=0.01)
    axes.spines[["top", "right"]].set_visible(False)


def save_likelihood(
    path: Path,
    seconds: Float[np.ndarray, " N"],
    log_likelihood: Float[np.ndarray, " N"],
    moments: Sequence[Moment] = (),
) -> None:
    """:func:`likelihood_over_time` as a PNG file.

    Raises:
        InputError: Matplotlib is not installed.
    """
    try:
        import matplotlib
    except ImportError:
        raise InputError("--picture: needs Matplotlib; install it with 'pip install matplotlib'.") from None
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(11, 3.2), layout="constrained")
    likelihood_over_time(axes, seconds, log_likelihood, moments)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=110, format="png")
    pyplot.close(figure)
