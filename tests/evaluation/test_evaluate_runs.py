"""Rows of trained runs in the table: samples, seeds, emotions, and poses without a skeleton."""

import dataclasses
import json

import jax
import numpy as np
import pytest
from scores_for_tests import score

from a2g_jax.cli import main
from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.evaluation import baselines as candidates
from a2g_jax.evaluation.emotion_judge import load_emotion_judge
from a2g_jax.evaluation.evaluate import check_runs, evaluate
from a2g_jax.evaluation.feature_network import check_separate
from a2g_jax.evaluation.report import BASELINES, markdown, write_report
from a2g_jax.models import find_model
from a2g_jax.models.base import finished
from a2g_jax.models.train_config import TRAIN_PRESETS
from a2g_jax.training.loop import train
from a2g_jax.training.run import Perceptual, Run, RunConfig, save_run
from tests.toy_model_for_tests import initial


def test_a_run_trained_against_the_scoring_network_is_refused(corpus, network):
    """Its loss made it score well. Another network's hash, or a loss that is off, is no objection."""
    flow = dataclasses.replace(find_model("stylized_flow").presets["tiny"], perceptual_weight=0.1)

    def run(model_config, fingerprint):
        config = RunConfig.of("stylized_flow", "tiny", model_config, TRAIN_PRESETS["tiny"], corpus)
        return Run(dataclasses.replace(config, perceptual=Perceptual(fingerprint)), {}, {}, 0)

    against = run(flow, network.fingerprint)
    with pytest.raises(InputError, match="mine: was trained with a loss on the feature network"):
        evaluate({"mine": against}, corpus, network=network)
    off = run(dataclasses.replace(flow, perceptual_weight=0.0), network.fingerprint)
    check_separate({"another": run(flow, "another"), "off": off}, network)
    check_separate({"mine": against}, None)


def test_a_model_has_its_row_with_the_best_of_its_samples(corpus, toy_run_config, network):
    config = dataclasses.replace(
        toy_run_config(), space=corpus.space, statistics=corpus.statistics, corpus={"emotions": [], "speakers": []}
    )
    code = np.random.default_rng(0).uniform(0.5, 1.0, (4, config.model_config.code_channels)).astype(np.float32)
    run = Run(config, initial(config), {"specific_mean": code, "specific_std": code}, 0)
    table = evaluate({"mine": run}, corpus, samples=2, network=network)
    assert [row["name"] for row in table["rows"]] == ["mine", *BASELINES]
    cell = table["rows"][0]["scores"]["position_l1"]
    assert cell["best"] < cell["mean"]
    assert table["rows"][0]["scores"]["multimodality"]["mean"] > 0
    again = evaluate({"mine": run}, corpus, samples=2, network=network, audit=True, baselines=False)
    assert json.dumps(again["rows"]) == json.dumps(table["rows"][:1])
    assert again["audits"]["mine"]["conditions"]["true audio"]["change_cm"] == 0.0
    assert "## Does mine listen?" in markdown(again)
    other = dataclasses.replace(config, fps=25.0)
    with pytest.raises(InputError, match="mine: takes 64 audio values at 25 fps"):
        check_runs({"mine": dataclasses.replace(run, config=other)}, corpus)


def test_runs_are_described_and_those_of_several_seeds_are_one_row(corpus, toy_run_config, tmp_path, capsys):
    """By the contents of run.json; folders' names say nothing."""
    config = dataclasses.replace(
        toy_run_config(), space=corpus.space, statistics=corpus.statistics, corpus={"emotions": [], "speakers": []}
    )
    code = np.full((4, config.model_config.code_channels), 0.7, np.float32)
    changes = {
        "mine": {"seed": 0},
        "other": {"seed": 1},
        "third": {"seed": 2},
        "mine_seed3": {"seed": 3, "batch_size": 5},
    }
    for name, change in changes.items():
        trained = dataclasses.replace(config, train_config=dataclasses.replace(config.train_config, **change))
        params = initial(trained, change["seed"])
        save_run(tmp_path / name, Run(trained, params, {"specific_mean": code, "specific_std": code}, 12))
    command = ["evaluate", *(str(tmp_path / name) for name in changes), "--corpus", str(corpus.path), "--samples", "2"]
    assert main([*command, "--out", str(tmp_path / "report")]) == 0
    printed = capsys.readouterr().out
    table = json.loads((tmp_path / "report" / "report.json").read_text())
    group, alone, *_ = table["rows"]
    assert (group["name"], group["seeds"]) == (f"{config.model} {config.preset}, seeds 0, 1, 2", 3)
    assert alone["name"] == str(tmp_path / "mine_seed3")
    single = [row["scores"]["position_l1"]["mean"] for row in group["runs"]]
    cell = group["scores"]["position_l1"]
    assert cell["mean"] == pytest.approx(np.mean(single))
    assert cell["high"] - cell["mean"] == pytest.approx(4.3027 * np.std(single, ddof=1) / np.sqrt(3), rel=1e-4)
    for name, row in zip(changes, [*group["runs"], alone], strict=True):
        digest = json.loads((tmp_path / name / "run.json").read_text())["weights_sha256"]
        assert (row["run"]["weights"], row["run"]["seed"], row["run"]["steps"]) == (digest, changes[name]["seed"], 12)
        line = (
            f"| {tmp_path / name} | {config.model} | {config.preset} | 12 | {changes[name]['seed']} | {digest[:16]} |"
        )
        assert line in printed
        assert digest in (tmp_path / "report" / "report.tex").read_text()
    assert "## Single runs" in printed


@pytest.mark.slow
def test_emotions_are_judged_by_a_classifier_that_fits(corpus, tmp_path, capsys):
    small = dataclasses.replace(
        find_model("emotion_classifier").presets["tiny"], channels=(16, 16), hidden=8, clip_frames=50, input="motion"
    )
    settings = dataclasses.replace(TRAIN_PRESETS["tiny"], steps=120, batch_size=8, warmup_steps=5, augmentation=0.0)
    config = RunConfig.of("emotion_classifier", "tiny", small, settings, corpus)
    train(config, corpus, tmp_path / "judge", resume=False, progress=False)
    judge = load_emotion_judge(tmp_path / "judge", corpus)
    table = evaluate({}, corpus, split="train", samples=2, judge=judge)
    assert score(table, "truth", "emotion_accuracy") > 0.7
    assert 0.0 < score(table, "mean pose", "emotion_accuracy") < 1.0
    assert table["about"]["emotion_classifier"] == judge.fingerprint
    # The truth's matrix, and chance beside it.
    (truth,) = [row for row in table["rows"] if row["name"] == "truth"]
    counts = np.array(truth["emotions"]["confusion"])
    assert counts.sum() == 7 * table["about"]["clips"]
    assert np.trace(counts) / counts.sum() == pytest.approx(score(table, "truth", "emotion_accuracy"))
    emotions = [corpus.recordings[segment.recording].emotion for segment in corpus.segments("train")]
    assert table["about"]["emotion_chance"] == {
        "uniform": 0.5,
        "commonest": max(emotions.count(name) for name in ("anger", "neutral")) / len(emotions),
    }
    text = markdown(table)
    assert "## Emotions" in text
    assert "always the commonest one; the truth's row" in text
    assert (tmp_path / "report" / "emotions.png") in write_report(table, tmp_path / "report")
    noisy = dataclasses.replace(config, corpus={**config.corpus, "recipe": {**config.corpus["recipe"], "jitter": 2.0}})
    save_run(tmp_path / "noisy", dataclasses.replace(judge.run, config=noisy))
    with pytest.raises(InputError, match="was trained on motion with capture noise of 2 degrees; train it on the same"):
        load_emotion_judge(tmp_path / "noisy", corpus)
    listens = dataclasses.replace(small, input="audio")
    config = RunConfig.of("emotion_classifier", "tiny", listens, settings, corpus)
    model = config.build()
    params = jax.device_get(jax.jit(lambda key: finished(model, model.init(key)))(jax.random.key(0)))
    save_run(tmp_path / "audio-classifier", Run(config, params, {}, 0))
    with pytest.raises(InputError, match="no classifier of emotions in motion"):
        load_emotion_judge(tmp_path / "audio-classifier", corpus)


@pytest.mark.slow
@pytest.mark.parametrize("view", ["s2g", "ted"])
def test_poses_without_a_skeleton_are_scored(view, tmp_path, monkeypatch):
    """Keypoints in their own unit, bones in metres; a model's samples too."""
    out = tmp_path / "corpus"
    assert main(["prepare", "talker", "--view", view, "--minutes", "8", "--seed", "3", "--out", str(out)]) == 0
    flat = Corpus.open(out)
    changes = {"audio_channels": (8,), "motion_channels": (8,), "decoder_channels": (8,), "clip_frames": 16}
    changes |= {"adversarial_steps": 0}
    config = RunConfig.of(
        "audio2gestures",
        "tiny",
        dataclasses.replace(find_model("audio2gestures").presets["tiny"], **changes),
        dataclasses.replace(TRAIN_PRESETS["tiny"], steps=5, batch_size=4),
        flat,
    )
    run = train(config, flat, tmp_path / "run", resume=False, progress=False)
    table = evaluate({"mine": run}, flat, samples=2)
    unit = "units" if view == "s2g" else "cm"
    assert table["about"]["unit"] == unit
    assert f"position L1, {unit} ↓" in markdown(table)
    assert score(table, "truth", "position_l1") == 0.0
    assert score(table, "truth", "pck") == 1.0
    assert score(table, "mine", "multimodality") > 0
    assert 0.2 < score(table, "mean pose", "pck") <= 1.0
    names = [row["name"] for row in table["rows"]]
    assert "truth, 1 degree of noise" not in names
    assert "nearest neighbour in audio" in names
    assert score(table, "another right motion", "multimodality") > 0
    # Right motions are converted as the corpus's own are.
    monkeypatch.setattr(candidates, "resample_motion", lambda recording, key: (recording.motion, None))
    segment = flat.segments("test")[0]
    (same,) = candidates.right_motions(flat, segment, 1, 0)
    np.testing.assert_allclose(same, flat.pose[segment.start : segment.stop], atol=1e-4)
