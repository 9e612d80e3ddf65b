"""Which runs differ in nothing but their seed, and their mean."""

import copy
import dataclasses

import numpy as np
import pytest

from a2g_jax.evaluation.report import merge
from a2g_jax.evaluation.seeds import describe_run, group_seeds, single_rows
from a2g_jax.training.run import Run, load_run, save_run
from a2g_jax.training.run_config import Source
from tests.toy_model_for_tests import initial


def row(name, seed, mean, settings="s", weights=None, **cell):
    """A row of a run."""
    run = {"model": "flow", "preset": "tiny", "steps": 10, "seed": seed, "settings": settings}
    best = None if mean is None else mean - 1.0
    scores = {"x": {"mean": mean, "low": None, "high": None, "best": best, "clips": 7, **cell}}
    run |= {"weights": weights or f"{name} {seed}", "corpus": "c"}
    return {"name": name, "samples": 2, "scores": scores, "emotions": None, "run": run}


def baseline(name="truth"):
    """A row that is no run."""
    return {**row(name, 0, 0.0), "run": None}


def test_only_the_seed_may_differ(toy_run_config):
    config = toy_run_config()
    params = initial(config)

    def settings(steps=12, **changes):
        trained = {key: changes.pop(key) for key in ("seed", "batch_size", "patience") if key in changes}
        changed = dataclasses.replace(
            config, train_config=dataclasses.replace(config.train_config, **trained), **changes
        )
        return describe_run(Run(changed, params, {}, steps))["settings"]

    assert settings() == settings(seed=5)
    others = [
        settings(steps=13),
        settings(batch_size=config.train_config.batch_size + 1),
        settings(preset="paper"),
        settings(fps=config.fps + 5),
        settings(corpus={**config.corpus, "fingerprint": "another"}),
        settings(model_config=dataclasses.replace(config.model_config, dropout=0.25)),
        settings(source=Source("a", 1, "w", "c")),
    ]
    assert len({settings(), *others}) == len(others) + 1
    # Early stopping ends at another step with another seed; the name of a source's folder is no setting.
    assert settings(patience=3) == settings(patience=3, steps=13) != settings()
    assert settings(source=Source("a", 1, "w", "c")) == settings(source=Source("b", 1, "w", "c"))
    assert settings(source=Source("a", 1, "w", "c")) != settings(source=Source("a", 1, "v", "c"))


def test_the_hash_is_that_of_the_file(toy_run_config, tmp_path):
    import hashlib

    config = toy_run_config()
    run = Run(config, initial(config), {}, 3)
    save_run(tmp_path, run)
    digest = hashlib.sha256((tmp_path / "weights.safetensors").read_bytes()).hexdigest()
    assert describe_run(run)["weights"] == describe_run(load_run(tmp_path))["weights"] == digest
    assert describe_run(Run(config, initial(config, 1), {}, 3))["weights"] != digest


def test_the_interval_is_students_over_seeds():
    rows = [row("a", 0, 1.0), row("z", 9, 8.0, "other"), row("b", 1, 2.0), row("c", 2, 6.0), baseline()]
    group, alone, truth = group_seeds(rows)
    assert group["name"] == "flow tiny, seeds 0, 1, 2"
    assert [one["name"] for one in (alone, truth)] == ["z", "truth"]
    cell = group["scores"]["x"]
    half = 4.302653 * np.sqrt(7.0) / np.sqrt(3.0)
    assert (cell["mean"], cell["best"], cell["seeds"]) == (3.0, 2.0, 3)
    assert (cell["low"], cell["high"]) == pytest.approx((3.0 - half, 3.0 + half))
    assert "clips" not in cell
    assert single_rows({"rows": [group, alone, truth]}) == [rows[0], rows[2], rows[3], rows[1], rows[4]]


def test_the_order_of_runs_does_not_matter():
    rows = [row("a", 0, 1.0), row("b", 1, 2.0), row("c", 2, 6.0)]
    cells = [group_seeds([rows[k] for k in order])[0]["scores"]["x"] for order in ((0, 1, 2), (2, 0, 1))]
    assert cells[0] == pytest.approx(cells[1])


def test_two_seeds_have_a_mean_and_no_interval():
    (group,) = group_seeds([row("a", 0, 1.0), row("b", 1, 2.0)])
    cell = group["scores"]["x"]
    assert (cell["mean"], cell["low"], cell["high"]) == (1.5, None, None)
    assert cell["reason"] == "2 seeds: an interval over seeds needs 3 or more"


def test_copies_and_repeated_seeds_count_once():
    rows = [row("a", 0, 1.0), row("copy", 1, 1.0, weights="a 0"), row("again", 0, 5.0), row("b", 2, 3.0)]
    group, copied, again = group_seeds(rows)
    assert (group["name"], group["scores"]["x"]["mean"]) == ("flow tiny, seeds 0, 2", 2.0)
    assert [one["name"] for one in (copied, again)] == ["copy", "again"]
    assert group_seeds(rows[:2]) == rows[:2]


def test_a_dash_of_one_seed_is_a_dash_of_all():
    rows = [row("a", 0, 1.0), row("b", 1, None, reason="too few"), row("c", 2, 2.0)]
    cell = group_seeds(rows)[0]["scores"]["x"]
    assert [cell[key] for key in ("mean", "low", "high", "best")] == [None] * 4


def test_settings_are_named_where_names_would_be_the_same():
    rows = [row(f"{settings}{seed}", seed, 1.0, settings) for settings in ("s", "t") for seed in (0, 1)]
    assert [one["name"] for one in group_seeds(rows)] == [f"flow tiny, seeds 0, 1, settings {key}" for key in "st"]


def test_seeds_of_different_reports_are_put_together():
    about = dict.fromkeys(
        ("skeleton", "corpus", "split", "samples", "clips", "wrist_to_wrist", "feature_network", "emotion_classifier")
    )
    results = {
        name: {
            "about": about,
            "rows": group_seeds([*(row(f"{name}{seed}", seed, float(seed)) for seed in seeds), baseline()]),
        }
        for name, seeds in (("one", (0, 1)), ("two", (2,)), ("three", (3, 4)))
    }
    before = copy.deepcopy(results)
    merged = merge(results)
    group, truth = merged["rows"]
    assert (group["seeds"], group["scores"]["x"]["mean"], truth["name"]) == (5, 2.0, "truth")
    assert results == before
    assert merge({"again": merged})["rows"] == merged["rows"]
