"""Scores of continued clips: rows of baselines, and L1 distances as the paper averages them."""

from types import SimpleNamespace

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.evaluation.report import HALVES
from a2g_jax.metrics.intervals import Interval
from a2g_jax.metrics.units import UNITS
from experiments.stylized_flow import bits
from experiments.stylized_flow.protocol import Protocol, nulls, starts_of
from experiments.tables.ruler import Ruler

PROTOCOL = Protocol(30, 5, 25)


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    """A generated corpus of bone directions."""
    out = tmp_path_factory.mktemp("ted") / "corpus"
    command = ["prepare", "talker", "--view", "ted", "--minutes", "8", "--seed", "3", "--out", str(out)]
    assert main([*command, "--features", "stylized-flow-ted"]) == 0
    return Corpus.open(out)


def network(frames):
    """Means and deviations of a clip as its features."""

    def clip_features(pose):
        clips = [pose[k * frames : (k + 1) * frames] for k in range(len(pose) // frames)]
        return np.array([[clip.mean(), clip.std(), clip[..., 0].mean()] for clip in clips]).reshape(len(clips), 3)

    return SimpleNamespace(clip_frames=frames, clip_features=clip_features)


@pytest.mark.slow
def test_every_table_has_the_rows_that_its_scores_are_read_against(corpus):
    rows = nulls(Ruler(corpus, network(10), 3, UNITS["stylized-flow"]), PROTOCOL)
    names = ["truth", "another right motion", "another clip's motion", "first pose held", "mean pose", HALVES]
    assert list(rows) == names
    clips = len(starts_of(corpus, PROTOCOL))
    assert {(row["fgd"]["vectors"], row["fgd"]["features"]) for row in rows.values()} == {(2 * clips, 3), (clips, 3)}
    assert rows[HALVES]["fgd"]["vectors"] == clips
    assert rows["truth"]["position_l1"]["mean"] == 0.0 < rows["another right motion"]["position_l1"]["mean"]
    assert rows["another right motion"]["multimodality"]["mean"] > 0.0
    assert rows["first pose held"]["wrist_speed"]["mean"] == 0.0 < rows["truth"]["wrist_speed"]["mean"]
    sums = nulls(Ruler(corpus, None, 3), PROTOCOL)
    assert list(sums) == names[:-1]
    for name, row in sums.items():
        for metric in ("position_l1", "diversity"):
            assert rows[name][metric]["mean"] == pytest.approx(row[metric]["mean"] / 3, rel=1e-5, abs=1e-9)


@pytest.mark.slow
def test_a_network_with_longer_clips_than_are_generated_is_refused(corpus):
    with pytest.raises(InputError, match="feature vectors are of 21 frames, and in clips of at most 20 there are 0"):
        nulls(Ruler(corpus, network(21), 3), PROTOCOL)


def test_models_with_a_density_have_bits(monkeypatch, toy_run_config):
    """Audio2Gestures has none; the capability is that of a real model, so that its name is checked too."""
    monkeypatch.setattr(bits, "continued", lambda protocol: lambda *arguments: {"scores": {}})
    found = Interval(-1.0, -1.1, -0.9, 3)
    monkeypatch.setattr(bits, "bits_per_dim", lambda run, corpus, seed: SimpleNamespace(noisy=found))
    model = toy_run_config().build()
    score = bits.continued_with_bits(PROTOCOL)
    for density, keys in ((None, []), (lambda params, batch: batch, ["bits_per_dim"])):
        made = model._replace(density=density)
        run = SimpleNamespace(config=SimpleNamespace(build=lambda made=made: made))
        assert list(score("a", run, SimpleNamespace(corpus=None), 0)["scores"]) == keys
