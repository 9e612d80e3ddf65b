"""Tables of the papers: records, intervals over seeds, and what is said of a claim."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig
from a2g_jax.training.run import Perceptual
from experiments.audio2gestures import select
from experiments.tables import records as store
from experiments.tables import ruler, training
from experiments.tables.claims import Claim, difference, judge, over_seeds
from experiments.tables.markdown import render
from experiments.tables.records import all_tables, append, name_of, records
from experiments.tables.ruler import Ruler, check_networks, units_of
from experiments.tables.runs import WHOLE, _same
from experiments.tables.setting import Setting, Variant
from experiments.tables.training import described

TABLE = "audio2gestures/made_up"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "EXPERIMENTS", tmp_path)
    return tmp_path / "audio2gestures" / "results"


def cell(value, **more):
    return {"mean": value, "low": None, "high": None, "best": None, **more}


def add(variant, seed, value, steps=100, scores=None, **more):
    about = {"corpus": "c", "feature_network": None, "samples": 2, "steps": steps, "train_seconds": 60.0, "clips": 3}
    append(TABLE, {"variant": variant, "seed": seed, **about, **more, "scores": {"fgd": cell(value), **(scores or {})}})


def test_the_last_of_equal_records_counts_and_lines_are_json(folder):
    add("a", 0, 1.0)
    add("a", 0, 2.0)
    add("a", 1, 3.0)
    assert [record["scores"]["fgd"]["mean"] for record in records(TABLE)] == [2.0, 3.0]
    assert all(json.loads(line) for line in (folder / "made_up.jsonl").read_text().splitlines())
    assert list(all_tables("audio2gestures")) == [TABLE]
    assert records("audio2gestures/none") == []


def test_intervals_are_students(folder):
    values = [1.0, 2.0, 4.0]
    for seed, value in enumerate(values):
        add("a", seed, value)
    mean, half, count = over_seeds(TABLE, "a", "fgd")
    low, high = stats.t.interval(0.95, 2, loc=np.mean(values), scale=stats.sem(values))
    np.testing.assert_allclose([mean - half, mean + half, count], [low, high, 3])
    assert over_seeds(TABLE, "b", "fgd") is None


def test_differences_are_paired_by_seed_and_claims_judged_by_them(folder):
    claim = Claim("b is larger", "b", "a", "fgd", 1)
    for seed, (a, b) in enumerate([(1.0, 2.0), (5.0, 6.1)]):
        add("a", seed, a)
        add("b", seed, b)
    assert judge(TABLE, claim) == "undecided: fewer than 3 seeds"
    add("a", 2, 9.0)
    assert difference(TABLE, "b", "a", "fgd")[2] == 2  # seed 2 has no partner yet
    add("b", 2, 9.9)
    assert judge(TABLE, claim).startswith("holds: +1")
    assert judge(TABLE, Claim("b is smaller", "b", "a", "fgd", -1)).startswith("does not hold: +1")
    add("b", 2, 3.0)
    assert judge(TABLE, claim).startswith("undecided")


def moving(speed, diversity=8.0):
    return {"wrist_speed": cell(speed), "diversity": cell(diversity)}


@pytest.mark.parametrize("still", [moving(0.1), moving(0.4, 1.0)])
def test_a_baseline_that_stands_still_decides_nothing(folder, still):
    """By either of wrist speed and diversity, below a quarter of the truth's."""
    lower, more = Claim("lower", "ours", "theirs", "fgd", -1), Claim("more", "ours", "theirs", "bits_per_dim", -1)
    add("truth", 0, 0.0, steps=0, scores=moving(0.5))
    for seed in range(3):
        add("ours", seed, 1.0 + 0.1 * seed, scores=moving(0.3) | {"bits_per_dim": cell(-2.0 + 0.1 * seed)})
        add("theirs", seed, 9.0, scores=moving(0.2, 3.0) | {"bits_per_dim": cell(1.0)})
    assert judge(TABLE, lower).startswith("holds: -7.9")
    for seed in range(3):
        add("theirs", seed, 9.0, scores=still | {"bits_per_dim": cell(1.0)})
    assert judge(TABLE, lower).startswith("not decided (theirs stands still): -7.9")
    assert judge(TABLE, more).startswith("holds")  # a density does not depend on how samples move
    # A row that stands still contradicts a claim about itself, and supports none.
    assert judge(TABLE, Claim("x", "theirs", "ours", "fgd", -1)).startswith("does not hold")
    assert judge(TABLE, Claim("x", "theirs", "ours", "fgd", 1)).startswith("not decided (theirs stands still)")
    assert judge(TABLE, Claim("x", "theirs", "ours", "fgd", -1, "theirs")).startswith(
        "not decided (theirs stands still)"
    )


def test_a_table_is_in_the_units_of_its_records_and_states_vectors(folder):
    speed = {"speed_l1": cell(0.6678)}
    fgd = {"fgd": cell(2.0, vectors=64, features=128)}
    for seed in range(3):
        add("old", seed, 1.0, scores={"speed_l1": cell(12.4), "position_l1": cell(7.0)})
    old = render(TABLE, "Made up", ["old"], (), {"A2G": "speed 0.668"})
    assert "speed L1, cm/s ↓" in old
    assert "These records are in our own units" in old
    assert "do not state the number of vectors" in old
    for seed in range(3):
        add("ours", seed, 1.0, scores=speed | fgd, units="audio2gestures", split="test")
    new = render(TABLE, "Made up", ["ours", "old"], (), {"A2G": "speed 0.668"})
    assert "| ours | 3 | 0.668 +- 0.000 | 2.00 +- 0.00 (n = 64, too few) |" in new
    assert "speed L1, cm/frame ↓" in new
    assert "not in value, though in the same units:" in new
    assert "too few vectors for a covariance of 128 features" in new
    assert "| old |" not in new  # records in other units do not stand in one table


def test_records_of_another_classifier_keep_their_other_scores(folder):
    """Trained again on another machine it is another one; rows of it continue a table, without emotions."""
    emotions = {"emotion_accuracy": cell(0.5), "kept neutral": cell(0.4)}
    for seed in range(3):
        add("ours", seed, 1.0, scores=emotions, emotion_classifier="first", requests={}, emotions={})
        add("truth", seed, 0.0, steps=0, scores=emotions, emotion_classifier="first")
        add("truth", seed, 0.0, steps=0, scores=emotions, emotion_classifier="second")
    add("theirs", 0, 2.0, scores=emotions, emotion_classifier="first")
    for seed in (1, 2):
        add("theirs", seed, 2.0, scores=emotions, emotion_classifier="second", requests={}, emotions={})
    assert over_seeds(TABLE, "theirs", "fgd") == (2.0, 0.0, 3)
    assert over_seeds(TABLE, "theirs", "emotion_accuracy")[2] == 1
    assert over_seeds(TABLE, "ours", "emotion_accuracy")[2] == over_seeds(TABLE, "truth", "kept neutral")[2] == 3
    assert sum("requests" in record for record in store.current(TABLE)) == 3


def test_old_rows_with_a_perceptual_loss_are_marked(folder):
    """Their loss used the network that scores."""
    for name, changes in (("plain", {}), ("+ LPIPS", {"lpips_weight": 0.002})):
        add(name, 0, 1.0, changes=changes)
    assert "The losses of + LPIPS used the feature network" in render(TABLE, "Made up", ["plain"], (), {})


def test_a_perceptual_loss_needs_a_network_that_does_not_score(toy_corpus, monkeypatch):
    where = Setting(toy_corpus.path, Path("score"), Path("runs"), 100, 2, (0,), 1.0)
    with pytest.raises(InputError, match="perceptual: has a perceptual loss; give --perceptual"):
        described("perceptual", Variant({"lpips_weight": 0.1}), {}, 0, toy_corpus, where)
    for module in (ruler, training):
        monkeypatch.setattr(module, "load_perceptual", lambda folder, corpus: Perceptual(str(folder), None))
    own = replace(where, perceptual=Path("loss"))
    config = described("perceptual", Variant({"lpips_weight": 0.1}), {}, 0, toy_corpus, own)[1]
    assert config.perceptual.fingerprint == "loss"
    for weights, refused in (("loss", True), ("others", False)):
        scoring = Ruler(toy_corpus, SimpleNamespace(fingerprint=weights), 2)
        if refused:
            with pytest.raises(InputError, match="--perceptual: loss has the weights of --features score"):
                check_networks(own, scoring)
        else:
            check_networks(own, scoring)
        check_networks(where, scoring)


def test_a_table_is_scored_in_the_units_of_its_paper():
    assert (units_of("audio2gestures/table1").key, units_of("stylized_flow/table1").key) == (
        "audio2gestures",
        "stylized-flow",
    )


def test_settings_are_chosen_on_seeds_that_are_not_reported(folder):
    with pytest.raises(InputError, match="--seeds: the tables report 2; choose by others, from 10 on"):
        select.check_seeds((2, 10))
    select.check_seeds((10, 11))
    first, second, still = list(select.CANDIDATES)[:3]
    add_to = {"steps": 100, "corpus": "c", "samples": 2}
    for name, fgd, speed in (("truth", 0.0, 0.5), (first, 9.0, 0.4), (second, 5.0, 0.3), (still, 1.0, 0.2)):
        scores = {"fgd": cell(fgd), "wrist_speed": cell(speed)}
        append(select.TABLE, {"variant": name, "seed": 10, **add_to, "scores": scores})
    assert select.chosen() == second


def test_runs_of_other_lengths_do_not_stand_in_one_table(folder):
    add("truth", 0, 0.0, steps=0)
    for seed in range(3):
        add("ours", seed, 9.0, steps=50)
        add("ours", seed, 1.0, steps=100)
    assert over_seeds(TABLE, "ours", "fgd")[0] == 1.0
    assert over_seeds(TABLE, "truth", "fgd")[0] == 0.0
    add("ours", 0, 4.0, steps=200)
    assert over_seeds(TABLE, "ours", "fgd")[::2] == (4.0, 1)


def test_a_table_shows_its_rows_its_budget_and_what_it_is_not(folder):
    for seed in range(3):
        add("ours", seed, 1.0 + seed)
    add("truth", 0, 0.0, steps=0)
    text = render(TABLE, "Made up", ["ours", "not run"], (), {"ours": "FID 2.22"})
    assert "| ours | 3 | 2.00 +- 2.48 |" in text
    assert "| truth | 1 | 0.00 |" in text
    assert "not run" not in text
    assert "3 minutes of training" in text
    assert "other data" in text


def test_a_record_serves_another_table_only_if_it_was_scored_alike(folder):
    conditions = {"corpus": "c", "steps": 100}
    append("audio2gestures/first", {"variant": "a", "seed": 0, **conditions, "settings": "d", "scored": "speakers"})
    assert _same("audio2gestures/second", "d", conditions, "speakers")["variant"] == "a"
    assert _same("audio2gestures/second", "d", conditions, WHOLE) is None
    assert _same("audio2gestures/second", "d", {**conditions, "steps": 50}, "speakers") is None
    assert _same("stylized_flow/second", "d", conditions, "speakers") is None


def corpus(recipe, fingerprint="f" * 64):
    mel = MelConfig()
    return SimpleNamespace(recipe=recipe, fingerprint=fingerprint, space=SimpleNamespace(kind="6d"), fps=30.0, mel=mel)


def test_a_generated_corpus_is_known_by_its_recipe_and_a_recorded_one_by_its_arrays():
    recipe = {"reader": "talker", "minutes": 90.0, "seed": 6, "roles": ["as", "drawn"]}
    ours = name_of(corpus(recipe))
    assert ours == name_of(corpus(recipe, "0" * 64))
    assert ours.startswith("talker ")
    assert name_of(corpus({**recipe, "seed": 7})) != ours
    assert name_of(corpus({"reader": "beat"})) == "f" * 16


def test_rows_of_equal_computing_say_their_steps_and_seconds(folder):
    score = {"fgd": {"mean": 1.0, "low": None, "high": None, "best": None}}
    for name, trained, seconds in (("ours", 100, 60.0), ("theirs", 140, 58.0)):
        about = {"corpus": "c", "feature_network": None, "samples": 2, "steps": 100, "clips": 3, "train_seconds": 60.0}
        spent = {"trained_steps": trained, "train_cpu_seconds": seconds}
        append(TABLE, {"variant": name, "seed": 0, **about, **spent, "scores": score})
    text = render(TABLE, "Made up", ["ours", "theirs"], (), {})
    assert "- ours: 100 steps, 60 s" in text
    assert "- theirs: 140 steps, 58 s" in text


def test_a_row_may_have_more_steps_than_its_table(toy_corpus):
    where = Setting(toy_corpus.path, None, Path("runs"), 100, 2, (0,), 1.0)
    rows = {"plain": Variant({}), "longer": Variant({}, steps=1.5), "edited": Variant({}, trained_as="longer")}
    steps = {name: described(name, row, rows, 0, toy_corpus, where)[1].train_config.steps for name, row in rows.items()}
    assert steps == {"plain": 100, "longer": 150, "edited": 150}


@pytest.mark.parametrize(
    ("model", "changes", "expected"),
    [
        ("audio2gestures", {"rest_smoothing": 0}, "251aa93e077a34b8"),
        ("stylized_flow", {}, "d93f90b3d1a73dd5"),
        ("emotion_gesture", {}, "6cc56303545f63db"),
    ],
)
def test_settings_that_are_off_leave_stored_records_valid(toy_corpus, model, changes, expected):
    """The digests of commit e2a0cd8: a new setting must not enter them while it is off."""
    where = Setting(toy_corpus.path, None, Path("runs"), 100, 2, (0,), 1.0)
    assert described("plain", Variant(changes, model=model), {}, 0, toy_corpus, where)[0] == expected


def test_a_setting_that_is_on_has_another_digest(toy_corpus):
    where = Setting(toy_corpus.path, None, Path("runs"), 100, 2, (0,), 1.0)
    rows = [Variant({"recompute": on}, model="stylized_flow") for on in (False, True)]
    off, on = (described("plain", row, {}, 0, toy_corpus, where)[0] for row in rows)
    assert off != on
