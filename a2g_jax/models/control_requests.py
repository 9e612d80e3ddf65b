"""Requested quantiles as values of the training clips, with over-requesting."""

from collections.abc import Sequence

import jax.numpy as jnp
from jaxtyping import Array, Float


def requested_values(
    quantiles: Float[Array, "T K"], training: Float[Array, "N K"], gains: Sequence[float]
) -> Float[Array, "T K"]:
    """Values of requested quantiles, their distance from the median times a gain; NaN where the request is NaN.

    Motion follows a request only in part; the gain is the inverse of that part. Values stay within those of the
    training clips.

    Args:
        quantiles: from 0 to 1.
        training: values of every training clip.
        gains: of each control; 1 for the requested value itself.
    """
    columns = []
    for number, gain in enumerate(gains):
        own = training[:, number]
        value = jnp.quantile(own, quantiles[:, number])
        if gain != 1.0:
            median = jnp.median(own)
            value = jnp.clip(median + gain * (value - median), jnp.min(own), jnp.max(own))
        columns.append(value)
    return jnp.stack(columns, axis=-1)


def ranks(values: Float[Array, " M"], training: Float[Array, " N"]) -> Float[Array, " M"]:
    """Share of the training clips below each value, from 0 to 1; equal clips count half."""
    ordered = jnp.sort(training)
    below, upto = (jnp.searchsorted(ordered, values, side=side) for side in ("left", "right"))
    return 0.5 * (below + upto) / len(training)
