"""The shipped weights: there, trained on generated data alone, and listening."""

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.generation.generator import Generator
from a2g_jax.io.bvh import read_bvh
from a2g_jax.metrics.rhythm import agreement_with_null, wrist_speed
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import demo_run


def test_demo_writes_motions_and_a_page(tmp_path, capsys):
    assert main(["demo", "--out", str(tmp_path / "demo"), "--samples", "3"]) == 0
    assert "open" in capsys.readouterr().out
    assert (tmp_path / "demo" / "index.html").stat().st_size > 100_000
    motions = [read_bvh(path) for path in sorted((tmp_path / "demo").glob("*.bvh"))]
    assert [motion.frames for motion in motions] == [600, 600, 600]
    assert np.abs(motions[0].positions() - motions[1].positions()).max() > 0.05


@pytest.mark.smoke
def test_two_seconds_of_speech():
    first, second = Generator(demo_run()).generate(talk(2.0, 5).audio, 2, seed=0)
    assert first.frames == 60
    assert np.isfinite(first.positions()).all()
    assert np.abs(first.rotations - second.rotations).max() > 1e-3


def test_no_recording_went_into_the_weights():
    run = demo_run()
    assert run.config.corpus["recipe"]["reader"] == "talker"
    assert run.steps > 0


def test_the_shipped_model_listens():
    """Strokes follow the speech, against the same motion shifted; the README has the figures."""
    generator = Generator(demo_run())
    take = talk(30.0, 987654, speaker="felix")
    motions = generator.generate(take.audio, 3, seed=1)
    scores = [agreement_with_null(motion, take.audio, 16000, lead=0.15) for motion in motions]
    assert np.mean([score.value for score in scores]) > np.mean([score.null_mean for score in scores]) + 0.03
    for motion in motions:
        assert 0.05 < wrist_speed(motion).mean() < 1.0
