"""The simulation of intervals: its methods, and its page."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from experiments import interval_coverage as m

RESULTS = Path(m.__file__).parent / "results" / "interval_coverage"


def test_bootstraps_are_scipys():
    values = np.random.default_rng(3).lognormal(size=(1, 15))
    found = m.bootstrap_ends(np.repeat(values, 40, axis=0), np.random.default_rng(0))
    for method, name in (("percentile bootstrap", "percentile"), ("BCa", "BCa")):
        ends = stats.bootstrap((values[0],), np.mean, method=name, rng=1, n_resamples=20_000).confidence_interval
        width = ends.high - ends.low
        for side, end in zip(found[method], ends, strict=True):
            assert abs(side.mean() - end) < 0.06 * width, method


def test_coverage_of_a_few_simulations():
    rows = {(row["scores"], row["n"], row["method"]): row for row in m.of_means(100, 1)}
    assert len(rows) == 2 * len(m.NUMBERS) * 3
    for count in m.NUMBERS:
        assert rows["normal", count, "Student's t"]["coverage"] > 0.88
    assert rows["normal", 3, "percentile bootstrap"]["coverage"] < 0.87
    assert rows["log-normal", 3, "BCa"]["coverage"] < 0.78


def test_the_page_is_what_the_figures_say():
    figures = json.loads((RESULTS / "interval_coverage.json").read_text(encoding="utf-8"))
    assert (RESULTS / "interval_coverage.md").read_text(encoding="utf-8") == m.markdown(figures)
    of_t = [row["coverage"] for row in figures["means"] if (row["scores"], row["method"]) == ("normal", "Student's t")]
    assert of_t == pytest.approx([0.95] * len(m.NUMBERS), abs=0.015)
