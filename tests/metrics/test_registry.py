"""Metrics are records with functions; those of other packages are found, and the document is up to date."""

from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.metrics import registry
from a2g_jax.metrics.catalogue import METRICS
from a2g_jax.metrics.context import MotionContext
from a2g_jax.metrics.document import COMMAND, markdown
from a2g_jax.metrics.registry import Metric, find_metrics

REACH = Metric(
    "reach",
    "cm",
    "truth",
    "ours",
    1,
    key="reach",
    function=lambda context: context.scale * np.abs(context.wrists).max(),
)
NOTHING = "no metric"


def test_the_document_is_up_to_date():
    path = Path(__file__).parents[2] / "docs" / "metrics.md"
    assert path.read_text(encoding="utf-8") == markdown(METRICS.values()), f"run {COMMAND}"


def test_every_record_is_complete():
    for key, metric in METRICS.items():
        assert metric.key == key
        assert metric.function is not None
        assert metric.source, key
        assert (metric.measures + metric.blind_spots).count(".") >= 2, key


def test_metrics_of_other_packages_are_found(monkeypatch):
    here = f"{__name__}:REACH"
    point = EntryPoint("reach", here, registry.GROUP)
    monkeypatch.setattr(registry, "entry_points_of", lambda group: {"reach": point} if group == registry.GROUP else {})
    assert find_metrics() == find_metrics([here]) == (REACH,)
    positions = np.ones((5, 2, 3), np.float32)
    context = MotionContext(positions, positions, positions, positions, 30.0, True, np.zeros(0))
    assert find_metrics()[0].function(context) == 100.0


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        (f"{__name__}:NOTHING", "is no Metric"),
        (f"{__name__}:REACH", "already a metric with the key 'reach'"),
        ("no_such_package:REACH", "no_such_package"),
        (f"{__name__}:MISSING", "MISSING"),
    ],
)
def test_what_is_no_metric_is_refused(reference, message, monkeypatch):
    monkeypatch.setattr(registry, "entry_points_of", lambda group: {})
    with pytest.raises(InputError, match=message):
        find_metrics([reference], taken=("reach",))


def test_two_metrics_of_one_key_are_refused(monkeypatch):
    monkeypatch.setattr(registry, "entry_points_of", lambda group: {})
    monkeypatch.setitem(globals(), "OTHER", replace(REACH, title="another"))
    with pytest.raises(InputError, match="choose another key"):
        find_metrics([f"{__name__}:REACH", f"{__name__}:OTHER"])
