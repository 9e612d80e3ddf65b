"""Metrics as records: a name, how to read the value, and the function that computes it.

A metric of another package is a :class:`Metric` that its package offers as an entry point of the group
``a2g_jax.metrics``, or that is named as ``module:name``; no file of this package changes.
"""

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any, Literal

from a2g_jax.errors import InputError
from a2g_jax.plugins import METRICS as GROUP
from a2g_jax.plugins import entry_points_of, load_entry_point, load_object

Scope = Literal["pair", "motion", "clip", "set"]


@dataclass(frozen=True)
class Metric:
    """A metric: how its column is named and read, what it measures, and its function."""

    title: str
    unit: str
    better: Literal["lower", "higher", "truth"]
    """``"truth"``: a value near that of recorded motion is better."""
    source: str
    """Paper and equation."""
    digits: int = 3
    """Decimals in a table."""
    _: KW_ONLY
    key: str = ""
    """Name in ``report.json``."""
    measures: str = ""
    """What is computed, in a sentence."""
    blind_spots: str = ""
    """What the value does not show."""
    scope: Scope = "motion"
    """What the function gets: ``"pair"`` a :class:`~a2g_jax.metrics.context.PairContext`, compiled with the others of
    that scope, so it must be traceable by JAX; ``"motion"`` a :class:`~a2g_jax.metrics.context.MotionContext`;
    ``"clip"`` a :class:`~a2g_jax.metrics.context.ClipContext`; ``"set"`` a
    :class:`~a2g_jax.metrics.context.SetContext`."""
    against_target: bool = False
    """Whether it compares with the recorded motion frame by frame or window by window; a report's first table."""
    bounds: tuple[float, float] = (float("-inf"), float("inf"))
    """Least and greatest value; an interval does not go beyond."""
    outcome: bool = False
    """Whether the value is the share of clips with an outcome, such as a class: its interval is a score interval."""
    distance: bool = False
    """For the scope ``"set"``: whether it is a distance of made from recorded vectors through their covariances. It
    needs :data:`~a2g_jax.metrics.distribution.LEAST_VECTORS` times as many vectors as features, and a report has that
    of two halves of the truth beside it."""
    function: Callable[[Any], Any] | None = None
    """The value for a context; NaN or None where it is not defined."""

    @property
    def per_sample(self) -> bool:
        """Whether it is a number for each motion; others are one for a clip or one for a split."""
        return self.scope in ("pair", "motion")


def find_metrics(references: Sequence[str] = (), taken: Sequence[str] = ()) -> tuple[Metric, ...]:
    """Metrics of installed packages (entry-point group ``a2g_jax.metrics``), then those of the references.

    Args:
        references: each ``module:name``.
        taken: keys that they may not have.

    Raises:
        InputError: one cannot be loaded, is no :class:`Metric`, or has a key that another one has.
    """
    loaded = [(f"metric {n!r}", p.value, load_entry_point(p, "metric")) for n, p in entry_points_of(GROUP).items()]
    loaded += [(f"metric {reference}", reference, load_object(reference, "metric")) for reference in references]
    found: dict[str, Metric] = {}
    for name, reference, metric in loaded:
        if not isinstance(metric, Metric) or metric.function is None or not metric.key:
            raise InputError(
                f"{name}: {reference} is no Metric with a key and a function; see a2g_jax.metrics.registry."
            )
        if found.get(metric.key) == metric:
            continue  # named as an entry point and as a reference
        if metric.key in taken or metric.key in found:
            raise InputError(f"{name}: there is already a metric with the key {metric.key!r}; choose another key.")
        found[metric.key] = metric
    return tuple(found.values())
