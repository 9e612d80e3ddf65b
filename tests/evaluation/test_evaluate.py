"""The table: the truth is perfect, noise and strangers are not, other right motions lie where theory puts them."""

import dataclasses
import json

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.data.prepare import prepare_recording, write_corpus
from a2g_jax.data.settings import Features
from a2g_jax.data.talker.recordings import cast, talk
from a2g_jax.errors import InputError
from a2g_jax.evaluation import candidates
from a2g_jax.evaluation.evaluate import BASELINES, check_runs, evaluate
from a2g_jax.evaluation.feature_network import load_feature_network
from a2g_jax.evaluation.report import check_comparable, latex, markdown
from a2g_jax.models import find_model
from a2g_jax.training.config import TRAIN_PRESETS
from a2g_jax.training.loop import train
from a2g_jax.training.run import RunConfig


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    """Ten generated recordings of twelve seconds, as 'a2g prepare talker' tells of them."""
    roles = [{**role, "seconds": 12.0} for role in cast(10.0, 5, (), ("neutral", "anger"))[:10]]
    rows = (prepare_recording(talk(**role), Features()) for role in roles)
    recipe = {"reader": "talker", "roles": roles, "fingers": False, "jitter": 0.0, "view": "body"}
    return write_corpus(tmp_path_factory.mktemp("scored") / "corpus", rows, features=Features(), recipe=recipe)


@pytest.fixture(scope="module")
def network(corpus, tmp_path_factory):
    """A feature network that has seen the corpus for a moment."""
    small = dataclasses.replace(
        find_model("motion_autoencoder").presets["tiny"],
        encoder_channels=(16, 16, 16, 24, 8),
        decoder_channels=(8, 16),
        clip_frames=50,
    )
    settings = dataclasses.replace(TRAIN_PRESETS["tiny"], steps=30, batch_size=4)
    out = tmp_path_factory.mktemp("network") / "run"
    config = RunConfig.of("motion_autoencoder", "tiny", small, settings, corpus)
    train(config, corpus, out, resume=False, progress=False)
    return load_feature_network(out, corpus)


@pytest.fixture(scope="module")
def result(corpus, network):
    """The baselines' table."""
    return evaluate({}, corpus, split="train", samples=3, network=network)


def score(result, row, metric):
    """Mean of a cell."""
    (found,) = [each for each in result["rows"] if each["name"] == row]
    return found["scores"][metric]["mean"]


def test_the_truth_is_perfect(result):
    for metric in ("position_l1", "speed_l1", "mpjre", "stft", "lpips", "speed_hellinger"):
        assert score(result, "truth", metric) == pytest.approx(0.0, abs=2e-2), metric
    for metric in ("ssim", "pck"):
        assert score(result, "truth", metric) == pytest.approx(1.0, abs=1e-4)
    assert score(result, "truth", "fgd") == pytest.approx(0.0, abs=1e-3)


def test_more_noise_is_worse(result):
    for metric in ("position_l1", "speed_l1", "mpjre", "stft", "lpips", "fgd", "jerk"):
        little, much = (score(result, f"truth, {name} of noise", metric) for name in ("1 degree", "5 degrees"))
        assert score(result, "truth", metric) < little < much, metric
    # Three components of one degree each turn a joint by 2 sqrt(2 / pi) degrees on average.
    assert score(result, "truth, 1 degree of noise", "mpjre") == pytest.approx(2 * np.sqrt(2 / np.pi), rel=0.03)


def test_other_right_motions_are_the_floor(result):
    """As far as any right motion is from another; nearer in distribution and shape than a stranger's or no motion."""
    right = "another right motion"
    assert score(result, right, "multimodality") > 2.0
    for metric in ("fgd", "speed_hellinger", "stft"):
        assert score(result, right, metric) < score(result, "mean pose", metric)
    assert score(result, right, "ssim") > score(result, "mean pose", "ssim") - 0.2
    assert score(result, "mean pose", "diversity") == 0.0 < score(result, right, "diversity")


def test_a_model_has_its_row_with_the_best_of_its_samples(corpus, toy_run_config, network):
    config = dataclasses.replace(
        toy_run_config(), body=corpus.body, statistics=corpus.statistics, corpus={"emotions": [], "speakers": []}
    )
    import jax

    from a2g_jax.training.run import Run

    code = np.random.default_rng(0).uniform(0.5, 1.0, (4, config.model_config.code_channels)).astype(np.float32)
    run = Run(config, config.build().init(jax.random.key(0)), {"specific_mean": code, "specific_std": code}, 0)
    table = evaluate({"mine": run}, corpus, samples=3, network=network)
    assert [row["name"] for row in table["rows"]] == ["mine", *BASELINES]
    cell = table["rows"][0]["scores"]["position_l1"]
    assert cell["best"] < cell["mean"]
    assert table["rows"][0]["scores"]["multimodality"]["mean"] > 0
    again = evaluate({"mine": run}, corpus, samples=3, network=network, audit=True)
    assert json.dumps(again["rows"]) == json.dumps(table["rows"])
    assert again["audits"]["mine"]["conditions"]["true audio"]["change_cm"] == 0.0
    assert "## Does mine listen?" in markdown(again)
    other = dataclasses.replace(config, fps=25.0)
    with pytest.raises(InputError, match="mine: takes 64 audio values at 25 fps"):
        check_runs({"mine": dataclasses.replace(run, config=other)}, corpus)


def test_reports_say_what_they_are_of(result):
    text = markdown(result)
    assert "| mean pose | 1 |" in text
    assert "No score here is a claim" in text
    assert result["about"]["feature_network"][:16] in text
    assert latex(result).count(r"\\") == len(result["rows"]) + 1
    json.dumps(result, allow_nan=False)


def test_what_cannot_be_compared_is_refused(result):
    other = {**result, "about": {**result["about"], "feature_network": "another"}}
    check_comparable({"a": result, "b": result})
    with pytest.raises(InputError, match="a and b: cannot be compared: feature network is .* and another in the"):
        check_comparable({"a": result, "b": other})


def test_neighbours_are_training_motion_found_by_audio(corpus):
    normalised = corpus.statistics["audio"].normalise(np.asarray(corpus.audio))
    for segment in (corpus.segments("test")[0], corpus.segments("train")[2]):
        found = candidates.nearest_neighbour(corpus, segment)
        assert found.shape == (segment.frames, 22, 6)
        wanted = normalised[segment.start : segment.start + 120]
        distances = {
            row: np.square(normalised[row : row + 120] - wanted).sum()
            for one in corpus.segments("train")
            if one.start != segment.start  # nothing is its own neighbour
            for row in range(one.start, one.stop - 119, 15)
        }
        nearest = min(distances, key=distances.get)
        np.testing.assert_array_equal(found[:120], corpus.pose[nearest : nearest + 120])


def test_of_real_recordings_there_is_no_other_right_motion(corpus):
    real = dataclasses.replace(corpus, recipe={"reader": "folder"})
    assert candidates.right_motions(real, corpus.segments("test")[0], 2, 0) is None


def test_the_command_writes_its_report(corpus, tmp_path, capsys):
    out = tmp_path / "report"
    command = ["evaluate", "--corpus", str(corpus.path), "--out", str(out), "--samples", "2"]
    assert main(command) == 0
    assert "| truth | 1 |" in capsys.readouterr().out
    assert {path.name for path in out.iterdir()} == {"report.json", "report.md", "report.tex", "report.png"}
    assert main([*command, "--split", "nothing"]) == 2
    assert "has no split 'nothing'" in capsys.readouterr().err
    assert main([*command, "--features", str(tmp_path)]) == 2


def test_a_single_recording_is_scored_in_pieces_and_the_report_says_so(corpus):
    one = dataclasses.replace(corpus, splits={"test": corpus.splits["train"][:1]})
    pieces = evaluate({}, dataclasses.replace(one, splits={**one.splits, "train": corpus.splits["train"]}), samples=2)
    assert (pieces["about"]["clips"], pieces["about"]["stretches"]) == (3, 1)
    assert pieces["about"]["seconds"] == 12.0
    assert "pieces of 1 recording(s), which are not independent" in markdown(pieces)
