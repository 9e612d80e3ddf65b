"""Augmentation changes the microphone, never the rhythm."""

import jax
import numpy as np
import pytest

from a2g_jax.features.augment import augment_log_mel

augment = jax.jit(augment_log_mel)


def clip(seed=0, frames=20, bands=8):
    decibels = np.random.default_rng(seed).uniform(-20, 40, (frames, bands)).astype(np.float32)
    decibels[3] = -20.0  # the floor of the clip
    return decibels


def test_strength_zero_is_the_identity_above_the_noise_floor():
    decibels = clip()
    result = augment(jax.random.key(0), decibels, 0.0)
    # Noise at the clip's minimum doubles the power there, 3 dB, and fades to nothing 40 dB above.
    power = 10 ** (decibels / 10)
    np.testing.assert_allclose(result, 10 * np.log10(power + power.min()), atol=1e-3)
    high = decibels > decibels.min() + 40
    assert high.any()
    np.testing.assert_allclose(result[high], decibels[high], atol=1e-3)


@pytest.mark.parametrize("seed", range(5))
def test_rhythm_is_untouched(seed):
    """Every band gets a gain of its own that is constant in time, where speech drowns the noise."""
    decibels = clip() + np.float32(200) * (np.arange(20) != 3)[:, None]
    change = np.asarray(augment(jax.random.key(seed), decibels, 1.0)) - decibels
    loud = change[np.arange(20) != 3]
    np.testing.assert_allclose(loud, np.broadcast_to(loud[:1], loud.shape), atol=1e-3)
    assert np.ptp(loud[0]) > 0.1
    assert np.abs(loud).max() < 3 + 6 + 6 + 0.01


def test_order_of_loudness_is_kept_in_each_band():
    decibels = clip()
    result = np.asarray(augment(jax.random.key(3), decibels, 1.0))
    for band in range(8):
        order = np.argsort(decibels[:, band])
        assert (np.diff(result[order, band]) >= -1e-4).all()


def test_strength_scales_the_change():
    decibels = clip() + np.float32(200)
    decibels[3] -= 200
    half, full = (np.asarray(augment(jax.random.key(1), decibels, strength)) - decibels for strength in (0.5, 1.0))
    loud = np.arange(20) != 3
    np.testing.assert_allclose(half[loud], full[loud] / 2, atol=1e-3)


def test_noise_stays_below_its_limit():
    results = np.stack([augment(jax.random.key(seed), clip(), 1.0) for seed in range(20)])
    valley = results[:, 3] - clip().min()
    # The clip's own floor, moved by at most 15 dB, and the noise, at most 15 + 4 dB above it.
    assert valley.max() <= 10 * np.log10(10**1.5 + 10**1.9) + 1e-3
    assert np.isfinite(results).all()


def test_the_key_decides():
    first, again, other = (augment(jax.random.key(seed), clip(), 1.0) for seed in (0, 0, 1))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.5
