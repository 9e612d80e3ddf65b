"""Augmentation of the generated corpus's audio."""

import numpy as np
from voice_for_tests import RATE, energy_db, render, rendered_peaks

from a2g_jax.talker.augment import augment


def test_augment_keeps_length_and_timing_and_is_deterministic():
    plan, audio = render("ada", seconds=15.0, seed=9)
    level, _ = energy_db(audio)
    for seed in range(6):
        changed = augment(audio, RATE, np.random.default_rng(seed))
        assert changed.shape == audio.shape
        assert changed.dtype == np.float32
        assert np.all(np.isfinite(changed))
        assert np.max(np.abs(changed)) < 1.0
        assert np.array_equal(changed, augment(audio, RATE, np.random.default_rng(seed)))
        assert not np.allclose(changed, audio, atol=1e-3)
        strong = np.array([s.accent > 0.5 for s in plan.syllables])
        moved = rendered_peaks(plan, changed)[strong, 0] - rendered_peaks(plan, audio)[strong, 0]
        assert np.median(np.abs(moved)) < 0.02
        assert np.corrcoef(level, energy_db(changed)[0])[0, 1] > 0.7


def test_augment_survives_silence():
    silent = augment(np.zeros(8000, np.float32), RATE, np.random.default_rng(0))
    assert np.all(np.isfinite(silent))
    assert np.max(np.abs(silent)) < 1e-3
