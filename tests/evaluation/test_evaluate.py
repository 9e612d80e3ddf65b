"""The table: the truth is perfect, noise and strangers are not, other right motions lie where theory puts them."""

import dataclasses
import json

import numpy as np
import pytest
from scores_for_tests import score

from a2g_jax.errors import InputError
from a2g_jax.evaluation import baselines as candidates
from a2g_jax.evaluation import report_notes
from a2g_jax.evaluation.emotion_judge import relevance
from a2g_jax.evaluation.evaluate import evaluate
from a2g_jax.evaluation.feature_network import vectors_of
from a2g_jax.evaluation.report import BASELINES, HALVES, latex, markdown, merge
from a2g_jax.evaluation.scores import Metric, Scorer, Target
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.metrics.pointwise import wrist_to_wrist


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


def test_a_single_recording_is_scored_in_pieces_and_the_report_says_so(corpus):
    one = dataclasses.replace(corpus, splits={"test": corpus.splits["train"][:1]})
    pieces = evaluate({}, dataclasses.replace(one, splits={**one.splits, "train": corpus.splits["train"]}), samples=2)
    assert (pieces["about"]["clips"], pieces["about"]["stretches"]) == (3, 1)
    assert pieces["about"]["seconds"] == 12.0
    text = markdown(pieces)
    assert "over 1 recording by" in text
    assert text.count("not independent") == 1
    assert "over 1 recording." in latex(pieces)


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
