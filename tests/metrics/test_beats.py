"""Beat alignment in both forms, and its null."""

import numpy as np
import pytest
from scipy import signal

from a2g_jax.metrics import beats as m


def test_motion_beats_are_where_joints_slow_down():
    fps, times = 60.0, np.arange(600) / 60.0
    # Speed |cos| of a swing of 0.5 Hz is least at its turning points: 0.5, 1.5, 2.5 ... s.
    positions = np.stack([np.sin(np.pi * times), np.zeros(600), np.zeros(600)], axis=-1)[:, None]
    np.testing.assert_allclose(m.motion_beats(positions, fps), np.arange(0.5, 10.0, 1.0), atol=0.01)


def test_motion_beats_are_scipys_minima_of_the_summed_speed():
    positions = np.cumsum(np.random.default_rng(0).normal(size=(200, 5, 3)), axis=0)
    speed = np.sqrt((np.diff(positions, axis=0) ** 2).sum(-1)).sum(-1)
    expected = (signal.find_peaks(-speed)[0] + 0.5) / 30.0
    np.testing.assert_allclose(m.motion_beats(positions, 30.0), expected)
    assert len(m.motion_beats(positions, 30.0, smoothing=0.2)) < 0.5 * len(expected)


def test_alignment_is_the_formula_and_asymmetric():
    of, to = np.array([1.0, 2.0, 3.0]), np.array([1.1, 3.0])
    expected = np.mean(np.exp(-(np.array([0.1, 0.9, 0.0]) ** 2) / (2 * 0.1**2)))
    assert m.beat_alignment(of, to, 0.1) == pytest.approx(expected)
    assert m.beat_alignment(to, of, 0.1) == pytest.approx(np.mean(np.exp(-(np.array([0.1, 0.0]) ** 2) / 0.02)))
    assert m.beat_alignment(of, np.zeros(0), 0.1) == m.beat_alignment(np.zeros(0), of, 0.1) == 0.0


def test_a_click_is_scored_where_it_is():
    """At 16 kHz; taken for 22.05 kHz it would be at 41.3 s."""
    audio = 1e-3 * np.random.default_rng(0).normal(size=60 * 16000).astype(np.float32)
    audio[57 * 16000 : 57 * 16000 + 400] += np.hanning(400).astype(np.float32)
    onsets = m.audio_onsets(audio, 16000)
    assert np.abs(onsets - 57.0).min() < 0.06
    assert np.abs(onsets - 41.3).min() > 0.2


def test_chance_is_far_from_zero_and_the_null_says_so():
    random = np.random.default_rng(1)
    audio = np.sort(random.uniform(0, 60, 180))
    score = lambda motion, onsets: m.beat_alignment(motion, onsets, 0.3)  # noqa: E731
    chance = m.with_null(score, np.sort(random.uniform(0, 60, 120)), audio, 60.0)
    # The notes: random beats score 0.66 at this sigma.
    assert chance.value == pytest.approx(0.85, abs=0.1)
    assert abs(chance.z) < 3
    sharp = lambda motion, onsets: m.beat_alignment(motion, onsets, 0.05)  # noqa: E731
    aligned = m.with_null(sharp, audio[::2] + random.normal(0, 0.02, 90), audio, 60.0)
    assert aligned.value > 0.85 > aligned.null_mean
    assert aligned.z > 5
