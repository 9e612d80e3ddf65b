"""Samples in the order of their score."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

from a2g_jax import rank_samples
from a2g_jax.errors import InputError
from a2g_jax.generation.export import export
from a2g_jax.generation.ranking import Scorer, read_scores
from a2g_jax.talker.recordings import resample_motion, talk
from a2g_jax.training.body_extremes import corpus_extremes
from a2g_jax.training.run import Run
from tests.viz.test_player_page import page_data

SPEECH = talk(10.0, 3)


@pytest.fixture(scope="module")
def run(toy_run_config, toy_corpus):
    """A run without weights."""
    return Run(replace(toy_run_config(), body_extremes=corpus_extremes(toy_corpus, toy_run_config())), {}, {}, 0)


def shifted(motion, seconds):
    """The motion that much later."""
    by = round(seconds * motion.fps)
    return replace(motion, rotations=np.roll(motion.rotations, by, axis=0), root=np.roll(motion.root, by, axis=0))


def still(motion):
    return replace(motion, rotations=np.repeat(motion.rotations[:1], motion.frames, axis=0), root=0 * motion.root)


def test_motion_that_goes_with_the_speech_comes_first(run):
    true = SPEECH.motion
    ranked = rank_samples(run, [still(true), shifted(true, 2.3), true], SPEECH.audio)
    assert ranked[0].sample == 2
    assert ranked[-1].sample == 0
    assert [one.score for one in ranked] == sorted((one.score for one in ranked), reverse=True)


def test_other_true_motions_score_higher_than_shifted_ones(run):
    scorer = Scorer(run, SPEECH.audio)
    motions = [resample_motion(SPEECH, key)[0] for key in range(6)]
    true = np.array([scorer.score(0, motion).score for motion in motions])
    late = np.array([scorer.score(0, shifted(motion, s)).score for motion in motions for s in (1.7, 3.1)])
    assert true.mean() > late.mean() + 0.15
    assert np.median(true) > np.percentile(late, 90)


def test_what_a_body_cannot_do_is_a_penalty(run):
    true = SPEECH.motion
    rotations = np.array(true.rotations)
    rotations[60, true.skeleton.names.index("Head")] = np.diag([-1.0, 1.0, -1.0])
    broken = replace(true, rotations=rotations)
    good, bad = (Scorer(run, SPEECH.audio).score(0, motion) for motion in (true, broken))
    assert good.body == 0 < 0.5 < bad.body
    assert good.score > bad.score + 0.4


def test_unusual_size_is_a_penalty(run):
    config = run.config
    pose = config.statistics["pose"]
    other = {**config.statistics, "pose": type(pose)(pose.mean, pose.std / 4)}
    usual = Scorer(run, SPEECH.audio).score(0, SPEECH.motion)
    large = Scorer(replace(run, config=replace(config, statistics=other)), SPEECH.audio).score(0, SPEECH.motion)
    assert usual.usual == 0
    assert 0.2 < large.usual < 0.6


@dataclass
class Given:
    """A sampler of given motions."""

    motions: list

    def stream(self, audio, samples, seed=0):
        yield from self.motions[:samples]


def test_export_keeps_names_and_writes_the_order(run, tmp_path):
    motions = [still(SPEECH.motion), shifted(SPEECH.motion, 2.3), SPEECH.motion]
    about = {"samples": 3, "seed": 0, "title": "speech", "formats": ("npz", "html")}
    export(run, Given(motions), SPEECH.audio, tmp_path / "best", order="best", **about)
    export(run, Given(motions), SPEECH.audio, tmp_path / "plain", **about)
    scores = read_scores(tmp_path / "best")
    assert read_scores(tmp_path / "plain") == []
    order = json.loads((tmp_path / "best/checks.json").read_text())["order"]
    assert order == [one.sample for one in scores] == [2, 1, 0]
    assert "order" not in json.loads((tmp_path / "plain/checks.json").read_text())
    for name in ("sample_00.npz", "sample_01.npz", "sample_02.npz"):
        assert (tmp_path / "best" / name).read_bytes() == (tmp_path / "plain" / name).read_bytes()
    page, plain = ((tmp_path / folder / "index.html").read_text() for folder in ("best", "plain"))
    assert page.index('"sample 2"') < page.index('"sample 1"') < page.index('"sample 0"')
    assert plain.index('"sample 0"') < plain.index('"sample 1"')
    figures = page_data(page)["figures"]
    assert [figure["number"] for figure in figures] == order  # the colour of a sample is the same in any order
    assert [figure["note"].split(";")[0] for figure in figures] == [f"score {one.score:.2f}" for one in scores]
    assert "best first" in page
    assert "best first" not in plain
    with pytest.raises(InputError, match="order 'worst': expected number or best"):
        export(run, Given(motions), SPEECH.audio, tmp_path / "no", order="worst", **about)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[]", r"checks\.json: not the checks of samples; generate them again with --order best"),
        ('{"scores": 3}', r"checks\.json: not the checks of samples"),
        ('{"scores": [{}]}', r"checks\.json: scores\[0\]: expected numbers sample, score, .* --order best"),
        ('{"scores": [[1, 2]]}', r"scores\[0\]: expected numbers"),
        (
            '{"scores": [{"sample": "0", "score": 1, "agreement": 1, "correlation": 0, "body": 0, "usual": 0}]}',
            r"scores\[0\]: expected numbers",
        ),
    ],
)
def test_damaged_scores_are_refused(text, message, tmp_path):
    (tmp_path / "checks.json").write_text(text)
    with pytest.raises(InputError, match=message):
        read_scores(tmp_path)
