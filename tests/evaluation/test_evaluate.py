"""The table: the truth is perfect, noise and strangers are not, other right motions lie where theory puts them."""

import dataclasses
import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_writer import prepare_recording, write_corpus
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError
from a2g_jax.evaluation import baselines as candidates
from a2g_jax.evaluation import report_notes
from a2g_jax.evaluation.emotion_judge import load_emotion_judge, relevance
from a2g_jax.evaluation.evaluate import check_runs, evaluate
from a2g_jax.evaluation.feature_network import check_separate, load_feature_network, vectors_of
from a2g_jax.evaluation.report import BASELINES, HALVES, MOTIONS, check_comparable, latex, markdown, merge, write_report
from a2g_jax.evaluation.scores import Metric, Scorer, Target
from a2g_jax.geometry.pose_rows import rotations_from_rows
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.rotation import axis_angle_from_matrix
from a2g_jax.metrics.pointwise import wrist_to_wrist
from a2g_jax.models import find_model
from a2g_jax.models.base import finished
from a2g_jax.models.train_config import TRAIN_PRESETS
from a2g_jax.talker.recordings import cast, talk
from a2g_jax.training.loop import train
from a2g_jax.training.run import Perceptual, Run, RunConfig, save_run
from tests.toy_model_for_tests import initial


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    """Ten generated recordings of twelve seconds, as of 'a2g prepare talker'."""
    roles = [{**role, "seconds": 12.0} for role in cast(10.0, 5, (), ("neutral", "anger"))[:10]]
    rows = (prepare_recording(talk(**role), Features()) for role in roles)
    recipe = {"reader": "talker", "roles": roles, "fingers": False, "jitter": 0.0, "view": "body"}
    return write_corpus(tmp_path_factory.mktemp("scored") / "corpus", rows, features=Features(), recipe=recipe)


@pytest.fixture(scope="module")
def network(corpus, tmp_path_factory):
    """A feature network trained on the corpus for a moment."""
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


@pytest.fixture(scope="module")
def plain(corpus):
    """The baselines' table of the test split, without a feature network."""
    return evaluate({}, corpus, samples=2)


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


def test_noise_is_the_same_in_every_representation_of_rotations(corpus):
    """Noise on exponential maps turns joints by the angles of noise on 6D."""
    pose = np.asarray(corpus.pose[:50])
    rotations = rotations_from_rows(pose, "6d")
    maps = np.asarray(axis_angle_from_matrix(jnp.asarray(rotations)))
    noisy = candidates.with_noise(corpus.space, pose, 5.0, np.random.default_rng(0))
    same = candidates.with_noise(PoseSpace(corpus.body, "exponential"), maps, 5.0, np.random.default_rng(0))
    assert same.shape == maps.shape
    np.testing.assert_allclose(rotations_from_rows(same, "exponential"), rotations_from_rows(noisy, "6d"), atol=1e-4)


def test_exponential_maps_have_their_noise_rows(corpus, tmp_path):
    features = Features(pose="exponential")
    roles = corpus.recipe["roles"][:2]
    rows = (prepare_recording(talk(**{**role, "seconds": 5.0}), features) for role in roles)
    maps = write_corpus(tmp_path / "corpus", rows, features=features, recipe={"reader": "folder"})
    table = evaluate({}, maps, split="train", samples=1)
    little, much = (score(table, f"truth, {name} of noise", "mpjre") for name in ("1 degree", "5 degrees"))
    assert little == pytest.approx(2 * np.sqrt(2 / np.pi), rel=0.05)
    assert much > 4 * little


def test_other_right_motions_are_the_floor(result):
    """As far as any right motion is from another; nearer in distribution and shape than a stranger's or no motion."""
    right = "another right motion"
    assert score(result, right, "multimodality") > 2.0
    for metric in ("fgd", "speed_hellinger", "stft"):
        assert score(result, right, metric) < score(result, "mean pose", metric)
    assert score(result, right, "ssim") > score(result, "mean pose", "ssim") - 0.2
    assert score(result, "mean pose", "diversity") == 0.0 < score(result, right, "diversity")


def test_a_held_pose_does_not_move(corpus, result):
    """Its FGD is nearer to the truth than the mean pose's, so a table needs both rows."""
    held = "first pose held"
    for metric in ("diversity", "wrist_speed", "jerk"):
        assert score(result, held, metric) == 0.0 < score(result, "truth", metric)
    assert score(result, "another right motion", "wrist_speed") == pytest.approx(
        score(result, "truth", "wrist_speed"), rel=0.5
    )
    pose = np.asarray(corpus.pose[:50])
    np.testing.assert_array_equal(candidates.first_pose(pose)[[0, -1]], pose[[0, 0]])


def test_every_fgd_states_its_number_of_vectors(result):
    """Ten clips of twelve seconds, eight of them for training, give seven vectors of 50 frames each."""
    cells = {row["name"]: row["scores"]["fgd"] for row in result["rows"]}
    assert set(cells) == set(BASELINES)
    floor = cells.pop(HALVES)
    assert {(cell["vectors"], cell["features"]) for cell in cells.values()} == {(56, 24)}
    assert (floor["vectors"], floor["mean"]) == (28, result["about"]["floor"])
    assert floor["mean"] > 0.0 == pytest.approx(cells["truth"]["mean"], abs=1e-3)
    for name, cell in cells.items():
        assert (cell["floor"], cell["half_vectors"], cell["clips"]) == (floor["mean"], 28, 8), name
        assert 0.0 <= cell["low"] <= cell["mean"] <= cell["high"], name
    # Halves of the truth are the floor; another clip's motion, the truth in another order, is no longer perfect.
    assert cells["truth"]["halves"] == floor["mean"]
    assert (
        cells["another clip's motion"]["halves"]
        > 0.0
        == pytest.approx(cells["another clip's motion"]["mean"], abs=1e-3)
    )
    text = f"(n = 56; of halves, n = 28: {cells['mean pose']['halves']:.2f}, floor {floor['mean']:.2f}) |"
    assert text in markdown(result)
    assert "(n = 28) |" in markdown(result)
    assert f"FGD of 56 vectors; its floor, two halves of the truth, is {floor['mean']:.2f} at 28." in latex(result)


def with_clips_of(network, frames):
    """The network, its feature vectors taken from longer clips."""
    config = network.run.config
    changed = dataclasses.replace(config, model_config=dataclasses.replace(config.model_config, clip_frames=frames))
    return dataclasses.replace(network, run=dataclasses.replace(network.run, config=changed))


def test_few_vectors_have_no_fgd_few_recordings_no_interval_and_less_than_two_vectors_are_refused(corpus, network):
    three = dataclasses.replace(corpus, splits={**corpus.splits, "few": corpus.splits["train"][:3]})
    table = evaluate({}, three, split="few", network=network, samples=1)
    assert [row["name"] for row in table["rows"]] == list(BASELINES)
    for row in table["rows"]:
        assert [row["scores"]["fgd"][key] for key in ("mean", "low", "high", "best")] == [None] * 4
        if row["name"] == HALVES:
            continue
        cell = row["scores"]["position_l1"]
        assert cell["mean"] >= 0.0
        assert (cell["low"], cell["high"], cell["clips"]) == (None, None, 3)
    json.dumps(table, allow_nan=False)
    for text in (markdown(table), latex(table)):
        assert "A dash: 21 feature vectors: a Fréchet distance needs 2 or more for each of the 24 features, 48." in text
        assert "A dash: 3 recordings: an interval needs 5 or more." in text
    held = next(row["scores"]["position_l1"]["mean"] for row in table["rows"] if row["name"] == "mean pose")
    assert f"| {held:.2f} [-] |" in markdown(table)
    assert f"{held:.2f} [--]" in latex(table)
    fgd = next(line for line in markdown(table).splitlines() if line.startswith("| | samples | FGD"))
    assert "| truth | 1 | - |" in markdown(table)[markdown(table).index(fgd) :]
    with pytest.raises(InputError, match="test split: feature vectors are of 300 frames, and in clips of at most 360"):
        evaluate({}, corpus, network=with_clips_of(network, 300), samples=1)
    assert vectors_of([100, 49, 160], 50, "here") == (5, 1)
    about = {"feature_vectors": 5, "feature_width": 24, "short_clips": 1, "clips": 3}
    assert "**1 of 3 clips are shorter than a clip of the network" in report_notes.too_few(about)


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


def test_reports_say_what_they_are_of(result):
    text = markdown(result)
    assert "| mean pose | 1 |" in text
    assert "No score here measures" in text
    assert result["about"]["feature_network"][:16] in text
    json.dumps(result, allow_nan=False)


def test_what_cannot_be_compared_is_refused(result):
    other = {**result, "about": {**result["about"], "feature_network": "another"}}
    check_comparable({"a": result, "b": result})
    with pytest.raises(InputError, match="a and b: cannot be compared: feature network is .* and another in the"):
        check_comparable({"a": result, "b": other})
    paper = {**result, "about": {**result["about"], "units": "audio2gestures"}}
    with pytest.raises(InputError, match="units is ours in one and audio2gestures in the other"):
        check_comparable({"a": result, "b": paper})


def test_a_report_of_the_first_version_says_how_it_scaled_errors(result):
    """L1* was by the length of the bones; units were not stated."""
    about = {key: value for key, value in result["about"].items() if key not in ("units", "wrist_to_wrist")}
    check_comparable({"a": {**result, "about": about}, "b": {**result, "about": {**about, "units": "ours"}}})
    assert "position L1* (by the bones' length, as in 0.1), cm" in markdown({**result, "about": about})
    assert "position L1*, cm" in markdown(result)


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
    command = ["evaluate", "--corpus", str(corpus.path), "--out", str(out), "--samples", "1"]
    assert main([*command, "--beat-sigma", "0.3"]) == 0
    printed = capsys.readouterr().out
    assert "| truth | 1 |" in printed
    assert "beat alignment, motion to audio, 0.3 s" in printed
    assert {path.name for path in out.iterdir()} == {"report.json", "report.md", "report.tex", "report.png"}
    assert main([*command, "--units", "audio2gestures"]) == 0
    printed = capsys.readouterr().out
    assert "speed L1, cm/frame ↓ | acceleration L1, cm/frame2 ↓" in printed
    assert "on a skeleton of 120.64 cm" in printed
    assert json.loads((out / "report.json").read_text())["about"]["units"] == "audio2gestures"
    assert json.loads((out / "report.json").read_text())["about"]["beat_sigma"] == pytest.approx(1 / 6)
    with pytest.raises(SystemExit):
        main([*command, "--beat-sigma", "5"])
    assert "seconds from 0.01 to 2; got '5'" in capsys.readouterr().err
    assert main([*command, "--units", "feet"]) == 2
    assert "there are no 'feet'; there are: ours, audio2gestures, stylized-flow" in capsys.readouterr().err
    assert main([*command, "--split", "nothing"]) == 2
    assert "has no split 'nothing'" in capsys.readouterr().err
    assert main([*command, "--features", str(tmp_path)]) == 2


def test_a_single_recording_is_scored_in_pieces_and_the_report_says_so(corpus):
    one = dataclasses.replace(corpus, splits={"test": corpus.splits["train"][:1]})
    pieces = evaluate({}, dataclasses.replace(one, splits={**one.splits, "train": corpus.splits["train"]}), samples=2)
    assert (pieces["about"]["clips"], pieces["about"]["stretches"]) == (3, 1)
    assert pieces["about"]["seconds"] == 12.0
    text = markdown(pieces)
    assert "over 1 recording by" in text
    assert text.count("not independent") == 1
    assert "over 1 recording." in latex(pieces)


def test_a_metric_of_another_package_has_its_column(corpus, plain):
    """The other scores do not change; the report is readable where that package is not installed."""
    hands = Metric("hands", "cm", "lower", "ours", 1, key="hands", function=lambda motion: motion.wrists.max())
    pairs = Metric("x", "", "higher", "ours", key="x", scope="pair", function=lambda pair: pair.positions.max())
    spread = Metric("y", "", "truth", "ours", key="y", scope="clip", function=lambda clip: len(clip.motions))
    more = evaluate({}, corpus, samples=2, extra_metrics=(hands, pairs, spread))
    assert score(more, "another right motion", "y") == 2.0
    for before, after in zip(plain["rows"], more["rows"], strict=True):
        assert {name: cell for name, cell in after["scores"].items() if name not in ("hands", "x", "y")} == before[
            "scores"
        ]
    text = markdown(merge({"a": plain, "b": json.loads(json.dumps(more))}))
    assert "hands, cm ↓" in text


def save_report(result, folder):
    """The part of a report that is read again; the tables and the picture take longer than the scores."""
    folder.mkdir()
    (folder / "report.json").write_text(json.dumps(result))


def test_reports_are_put_side_by_side(corpus, plain, tmp_path, capsys):
    """Two reports of the same thing become one; the baselines are there once, clashing names say their report."""
    table = plain
    mean = next(row for row in table["rows"] if row["name"] == "mean pose")
    for name in ("first", "second"):
        mine = {**mean, "name": "mine"}
        save_report({**table, "rows": [mine, *table["rows"]], "audits": {}}, tmp_path / name)
    out = tmp_path / "both"
    command = ["evaluate", "--compare", str(tmp_path / "first"), str(tmp_path / "second"), "--out", str(out)]
    assert main(command) == 0
    names = [row["name"] for row in json.loads((out / "report.json").read_text())["rows"]]
    assert names == [f"mine ({tmp_path / 'first'})", f"mine ({tmp_path / 'second'})", *MOTIONS]
    capsys.readouterr()
    assert main([*command[:4], "--out", str(out), "--corpus", str(corpus.path)]) == 2
    assert main([*command, "--units", "audio2gestures"]) == 2
    assert main(["evaluate", "--compare", str(tmp_path), "--out", str(out)]) == 2
    assert "is no report" in capsys.readouterr().err
    other = {**table, "about": {**table["about"], "clips": 99}}
    save_report(other, tmp_path / "third")
    assert main(["evaluate", "--compare", str(tmp_path / "first"), str(tmp_path / "third"), "--out", str(out)]) == 2
    assert "clips is" in capsys.readouterr().err
    assert main(["evaluate", "--out", str(out)]) == 2
    assert "--corpus is needed" in capsys.readouterr().err


def test_speakers_are_grouped_by_their_motion_but_not_by_the_mean_pose(result):
    """Six speakers move differently; a pose that is the same for all tells none of them apart."""
    assert score(result, "truth", "chi") > 1.0 > abs(score(result, "truth", "silhouette"))
    rows = {row["name"]: row["scores"] for row in result["rows"]}
    assert rows["mean pose"]["silhouette"]["mean"] == pytest.approx(0.0, abs=1e-6)


def test_the_reach_of_the_skeleton_scales_the_starred_error(corpus, result):
    row = next(row for row in result["rows"] if row["name"] == "mean pose")["scores"]
    reach = wrist_to_wrist(corpus.body)
    assert reach == pytest.approx(1.364, abs=1e-5)
    expected = row["position_l1"]["mean"] * 1.2064 / reach
    assert row["position_l1_star"]["mean"] == pytest.approx(expected, rel=1e-6)
    assert row["position_l2"]["mean"] < row["position_l1"]["mean"]


def test_semantic_labels_are_weights_of_frames(corpus):
    """SRGR counts the labelled frames alone."""
    segment = corpus.segments("test")[0]
    labels = [{"label": "deictic", "start": 1.0, "end": 2.0, "score": 0.5}]
    labelled = dataclasses.replace(corpus)
    object.__setattr__(labelled, "annotations", lambda recording: {"semantic": labels})
    values = relevance(labelled, segment)
    assert values.shape == (segment.frames,)
    assert set(np.nonzero(values)[0]) == set(range(30, 60))
    assert relevance(corpus, segment) is None
    scorer = Scorer(PoseSpace(corpus.body), corpus.fps, None)
    pose = np.asarray(corpus.pose[segment.start : segment.stop])
    target = Target(pose, scorer.space.positions(pose), np.arange(5.0), "neutral", values)
    spoilt = pose.copy()
    spoilt[100:] = pose[:1]
    assert scorer.sample(spoilt, target)["srgr"] == 1.0
    spoilt[30:60] = candidates.with_noise(corpus.space, pose[30:60], 60.0, np.random.default_rng(0))
    assert scorer.sample(spoilt, target)["srgr"] < 0.9


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
