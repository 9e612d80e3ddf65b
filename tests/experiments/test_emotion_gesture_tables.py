"""Tables of EmotionGesture: rows, rendering from records, claims, the seam, requests, and what is refused."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.models import find_model
from a2g_jax.models.emotion_gesture.config import EmotionGestureConfig
from experiments.emotion_gesture import claims, jitter, mining, page, table1, table2, table3, table4
from experiments.emotion_gesture.bench import CLIP, FIRST, MADE, Bench, check_independent
from experiments.emotion_gesture.requests import _Tally
from experiments.emotion_gesture.scores import seam
from experiments.emotion_gesture.settings import BASE, PRESET_STEPS, TINY, scaled
from experiments.tables import records as store
from experiments.tables.claims import Claim
from experiments.tables.records import append
from experiments.tables.ruler import Ruler

TABLES = {module.__name__.split(".")[-1]: module.TABLE for module in (table1, table2, table3, table4, mining, jitter)}
ABOUT = {"corpus": "c", "feature_network": "n", "emotion_classifier": "j", "samples": 2, "units": "ours"}
ABOUT |= {"split": "test", "clips": 5, "unit": "cm"}


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "EXPERIMENTS", tmp_path)
    return tmp_path / "emotion_gesture" / "results"


def add(table, variant, seed, steps=100, requests=None, **scores):
    cells = {key: value if isinstance(value, dict) else {"mean": value} for key, value in scores.items()}
    timing = {"trained_steps": steps, "train_seconds": 6.0, "train_cpu_seconds": 5.0}
    line = {"variant": variant, "seed": seed, **ABOUT, "steps": steps, **timing, "scores": cells, "requests": requests}
    append(f"emotion_gesture/{table}", line)


def settings_of(variant, variants):
    """The configuration of a row."""
    variant = variants.get(variant.trained_as, variant)
    entry = find_model(variant.model)
    known = set(entry.presets[variant.preset].__dataclass_fields__)
    return replace(
        entry.presets[variant.preset], **{key: value for key, value in variant.changes.items() if key in known}
    )


@pytest.mark.parametrize("name", TABLES)
def test_rows_are_settings_that_models_accept_and_claims_are_of_rows(name):
    table = TABLES[name]
    for variant in table.variants.values():
        settings_of(variant, table.variants)
    rows = {*table.variants, "truth", "another right motion", "first pose held", "mean pose"}
    for claim in table.claims:
        assert {claim.first, claim.second} <= rows, claim
        assert claim.baseline in ("", claim.first, claim.second)
    assert not any("," in one for one in table.variants)  # --only separates names by commas
    # A row whose settings equal another's would be a copy of it.
    own = [variant for variant in table.variants.values() if not variant.trained_as]
    assert len({str((one.model, settings_of(one, table.variants))) for one in own}) == len(own)


def test_the_ladder_has_the_papers_parts_one_after_another():
    rows = [settings_of(table3.VARIANTS[name], table3.VARIANTS) for name in list(table3.VARIANTS)[:8]]
    changed = [
        {key for key in EmotionGestureConfig.__dataclass_fields__ if getattr(one, key) != getattr(other, key)}
        for one, other in zip(rows, rows[1:], strict=False)
    ]
    parts = ["branches", "branches", "emotion_weight", "beat_weight", "prompter", "prompter", "smooth_weight"]
    assert [one - {"vae_steps", "mining_steps"} for one in changed] == [{part} for part in parts]
    full, default = rows[-1], EmotionGestureConfig()
    assert full.prompter == "spatial-temporal"
    assert min(full.beat_weight, full.emotion_weight, full.smooth_weight, full.vae_steps) > 0
    for name in ("emotion_span", "beat_normalised", "exchange", "beat_form"):
        assert getattr(full, name) == getattr(default, name)
        assert name in BASE
    assert (full.channels, full.reconstruction_weight) == (TINY.channels, TINY.reconstruction_weight)
    assert settings_of(table4.VARIANTS["L = 10"], {}) == full  # it shares the run


def test_a_page_has_our_rows_the_nulls_and_the_papers_figures():
    chance, fgd = {"mean": 0.4, "chance": 0.125}, {"mean": 2.0, "vectors": 400, "features": 128}
    for seed in range(3):
        add("table2", table2.CONSTANT, seed, position_l2=4.0 + seed, emotion_balanced=chance, fgd=fgd)
        add("table2", table2.S2G, seed, position_l2=6.0 + seed, emotion_balanced={"mean": 0.2, "chance": 0.125})
        add("table2", "mean pose", seed, 0, position_l2=5.0)
    text = page.render(replace(table2.TABLE, claims=(Claim("lower", table2.CONSTANT, table2.S2G, "position_l2", -1),)))
    assert "| ours (constant) | 3 | 5.00 +- 2.48 | 2.00 +- 0.00 | 40.0 +- 0.0 |" in text  # other columns are empty
    assert "FGD is of 400 vectors" in text
    assert "- lower: **holds: -2 +- 0 over 3 seeds**" in text
    assert "chance is 12.5 %" in text
    assert text.index("| ours (constant) |") < text.index("| mean pose |") < text.index("- Ours, constant: 1.59")


def test_the_first_table_has_a_picture_of_all_seeds(folder):
    pytest.importorskip("matplotlib")
    for seed in range(2):
        line = {"variant": table1.AUDIO, "seed": seed, **ABOUT, "steps": 9, "trained_steps": 9, "train_seconds": 1.0}
        line |= {"train_cpu_seconds": 1.0, "emotions": ["neutral", "anger"], "confusion": [[3, 1], [0, 4]]}
        append("emotion_gesture/table1", {**line, "scores": {"neutral": {"mean": 0.75}, "anger": {"mean": 1.0}}})
    table1.picture()
    assert (folder / "table1.png").stat().st_size > 5000
    assert "| audio | 2 | 75.0 +- 0.0 | 100.0 +- 0.0 |" in page.render(table1.TABLE)


def test_verdicts():
    assert claims.verdict([1.0, 1.1, 0.9]).startswith("holds: +1")
    assert claims.verdict([-1.0, -1.1, -0.9]).startswith("does not hold: -1")
    assert claims.verdict([-1.0, 1.1, 0.9]).startswith("undecided: +0.333")
    assert claims.verdict([1.0, 1.0]) == "undecided: fewer than 3 seeds"


def test_a_row_that_stands_still_supports_no_claim():
    add("table2", "truth", 0, 0, wrist_speed=0.5)
    for seed in range(3):
        add("table2", "calm", seed, wrist_speed=0.1, beat_alignment=0.9 + 0.01 * seed)
        add("table2", "alive", seed, wrist_speed=0.4, beat_alignment=0.9 + 0.01 * seed)
    line = claims.within("x", "emotion_gesture/table2", "calm", "beat_alignment", 0.5)
    assert line.startswith("- x: **not decided (calm stands still): +0.41")
    assert "**holds" in claims.within("x", "emotion_gesture/table2", "alive", "beat_alignment", 0.5)


def test_the_page_of_claims():
    assert claims.page().count("No records yet.") == len(claims.SECTIONS)
    counts, sure = [[4, 0], [1, 3]], {"emotion_balanced": {"mean": 0.4, "chance": 0.125}}
    for seed in range(3):
        add("table2", table2.CONSTANT, seed, **sure, **{"emotion_balanced shuffled": 0.1 + 0.01 * seed})
        own = {"above_neutral anger": {"mean": 0.8, "null": 0.25}, "kept neutral": 0.1}
        add("table3", table3.OURS, seed, requests=counts, requested_other_accuracy=0.75, **own)
        add("mining", mining.OURS, seed, onset_beat=0.8, onset_emotion=0.6, emotion_emotion=0.5, emotion_beat=0.6)
    text = claims.page()
    assert "above chance (12.5 %): **holds: +27.5 +- 0 over 3 seeds**" in text
    assert "more than gestures for another recording's speech do: **holds" in text
    assert "other than the speech's is shown above chance (50.0 %): **holds: +25" in text
    assert (
        "tiny: anger is more probable than neutral in 80 % of its clips (25 % of neutral's); above 50 %: **holds"
        in text
    )
    assert "tiny: neutral is the most probable of all in 10 % of its clips; above 12.5 %: **does not hold" in text
    assert "AUC: 0.8 and 0.6; **holds: +0.2" in text
    assert "%: 50 and 60; **does not hold: -10" in text


def test_the_seam_is_compared_at_the_same_frames():
    """A step at the seam alone, of the size of the truth's own steps, doubles speed at one of two steps."""
    truth = np.zeros((2, CLIP, 3, 3))
    truth[..., 0] = np.arange(CLIP)[None, :, None]
    bench = SimpleNamespace(places=truth)
    made = truth[:, None, FIRST:].copy()
    assert {key: one["mean"] for key, one in seam(made, bench).items() if "jerk" not in key} == {
        "seam_speed": 1.0,
        "seam_speed_error": 0.0,
    }
    made[..., 0] += 1.0
    found = seam(made, bench)
    assert found["seam_speed"]["mean"] == pytest.approx(1.5, rel=1e-5)
    assert found["seam_speed_error"]["mean"] == pytest.approx(np.log(1.5))
    wave = truth + np.sin(np.arange(CLIP))[None, :, None, None]
    calm = SimpleNamespace(places=wave)
    assert seam(wave[:, None, FIRST:], calm)["seam_jerk"]["mean"] == pytest.approx(1.0)
    late = wave[:, None, FIRST:].copy()
    late[:, :, 3:] += 9.0  # frame 13 is beyond the seam
    assert seam(late, calm)["seam_jerk"]["mean"] == pytest.approx(1.0)
    late[:, :, 2:] += 9.0
    assert seam(late, calm)["seam_jerk"]["mean"] > 2.0


def judge(rows=None, frames=MADE, **about):
    """A classifier that gives these probabilities."""
    config = SimpleNamespace(model_config=SimpleNamespace(clip_frames=frames), corpus={"fingerprint": "j", **about})
    names = ("neutral", "anger", "fear")
    return SimpleNamespace(
        run=SimpleNamespace(config=config), emotions=names, probabilities=lambda pose: np.array(rows)
    )


def test_requests_are_counted_beside_neutral():
    tally = _Tally(judge([[0.2, 0.5, 0.3], [0.6, 0.1, 0.3]]))
    tally.add(None, "anger")
    tally.judge = judge([[0.5, 0.4, 0.1]])
    tally.add(None, "neutral")
    assert tally.counts.tolist() == [[1, 0, 0], [1, 1, 0], [0, 0, 0]]
    assert tally.accuracy == 0.75  # fear was not requested
    found = tally.above()
    assert set(found) == {"above_neutral anger", "kept neutral"}
    assert (found["above_neutral anger"]["mean"], found["above_neutral anger"]["null"]) == (0.5, 0.0)
    assert found["kept neutral"]["mean"] == 1.0


def test_a_judge_of_the_same_recordings_or_of_other_clips_is_refused(toy_corpus):
    with pytest.raises(InputError, match="--judge: was trained on recordings of"):
        check_independent(judge(fingerprint=toy_corpus.fingerprint), toy_corpus)
    role = {"recipe": {"roles": [{"seed": 5}]}}
    corpus = SimpleNamespace(fingerprint="c", path="C", recipe={"roles": [{"seed": 5}]})
    with pytest.raises(InputError, match="train it on a corpus of another --seed"):
        check_independent(judge(**role), corpus)
    check_independent(judge(**role), replace(toy_corpus))
    with pytest.raises(InputError, match="--judge: is of clips of 60 frames"):
        Bench(Ruler(toy_corpus, None, 2, judge=judge(frames=60)))


def test_jitter_is_compared_with_the_same_recordings(toy_corpus):
    noisy = replace(toy_corpus, recipe={**toy_corpus.recipe, "jitter": 2.0})
    jitter.check_same(noisy, toy_corpus)
    with pytest.raises(InputError, match="--clean .*: is not of the recordings of"):
        jitter.check_same(replace(noisy, recipe={**noisy.recipe, "seed": 99}), toy_corpus)
    for corpora in ((toy_corpus, toy_corpus), (noisy, noisy)):
        with pytest.raises(InputError, match="needs motion prepared with --jitter"):
            jitter.check_same(*corpora)


def test_probes_find_what_is_there():
    pytest.importorskip("sklearn")
    rng = np.random.default_rng(0)
    fit, test = (rng.normal(size=(40, 20, 3)) for _ in range(2))
    onsets, held = fit[..., 0] > 0.8, test[..., 0] > 0.8
    assert mining.onset_auc(fit, onsets, test, held, 0) > 0.99
    assert abs(mining.onset_auc(fit[..., 1:], onsets, test[..., 1:], held, 0) - 0.5) < 0.1
    labels = np.arange(40) % 2
    for values in (fit, test):
        values[..., 2] *= np.where(labels, 3.0, 1.0)[:, None]
    assert mining.emotion_share(fit, labels, test, labels) > 0.95
    assert mining.emotion_share(fit[..., :2], labels, test[..., :2], labels) < 0.8


def test_stages_are_scaled_with_the_steps_of_a_table():
    half = scaled(table3.VARIANTS, PRESET_STEPS // 2)
    full = scaled(table3.VARIANTS, PRESET_STEPS)
    for name, variant in full.items():
        for setting in variant.changes:
            if setting.endswith("_steps") and setting != "vae_steps":
                own = getattr(settings_of(table3.VARIANTS[name], table3.VARIANTS), setting)
                assert variant.changes[setting] == own * variant.steps or variant.trained_as
                assert half[name].changes[setting] == pytest.approx(variant.changes[setting] / 2, abs=0.5)
    assert scaled(table3.VARIANTS, 5)[table3.OURS].changes["vae_steps"] == 5 * table3.WHOLE
    assert scaled(table3.VARIANTS, 400)[table3.OURS].changes["sampled_steps"] == TINY.sampled_steps
    assert full[table3.BASELINE].changes["vae_steps"] == 0
    others = {name: variant for name, variant in table2.VARIANTS.items() if variant.model != "emotion_gesture"}
    assert {name: scaled(table2.VARIANTS, 5)[name] for name in others} == others


def test_trainings_are_put_side_by_side(tmp_path):
    from experiments.emotion_gesture import trainings

    judged = {"emotions": ["anger"], "seeds": [0], "run": {"scores": {"requested_accuracy": {"mean": 0.5}}}}
    judged[trainings.TRUTH] = {"scores": {"requested_accuracy": {"mean": 0.6}}}
    first = trainings.scores_of(judged)
    page = trainings.page([first, {"requested_accuracy": 0.7}], trainings.scores_of(judged, trainings.TRUTH))
    # Half the width of the interval of two values is 12.706 times half of their difference.
    assert "| requested accuracy | 0.50 | 0.70 | 0.60 ± 1.27 | 0.60 |" in page
