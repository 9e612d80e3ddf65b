"""Spectral and structural similarity beside SciPy and the paper's formulas; gradients beside differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads
from scipy import signal

from a2g_jax.features import similarity as m


def pair(seed, frames=80, width=5):
    """Two random smooth signals."""
    random = np.random.default_rng(seed)
    return np.cumsum(random.normal(0, 0.02, (2, frames, width)), axis=1)


def test_magnitudes_are_scipys(x64):
    a, _ = pair(0)
    hann = signal.get_window("hann", 32)
    _, _, spectrum = signal.stft(a, window=hann, nperseg=32, noverlap=24, boundary=None, padded=False, axis=0)
    expected = np.moveaxis(np.abs(spectrum) * hann.sum(), -1, 0)  # SciPy divides by the window's sum
    np.testing.assert_allclose(m.stft_magnitudes(jnp.asarray(a)), expected, atol=2e-5)


def test_stft_distance_is_the_mean_difference_of_logs(x64):
    a, b = pair(1)
    logs = [np.log(np.asarray(m.stft_magnitudes(jnp.asarray(x)))) for x in (a, b)]
    np.testing.assert_allclose(m.stft_distance(jnp.asarray(a), jnp.asarray(b)), np.abs(logs[0] - logs[1]).mean())
    assert float(m.stft_distance(jnp.asarray(a), jnp.asarray(a))) == 0.0


def test_a_shift_in_place_changes_the_spectrum_little_and_the_speed_much():
    a, _ = pair(2, frames=120)
    base = jnp.asarray(a)
    slow = jnp.asarray(np.repeat(a, 2, axis=0)[:120])
    assert float(m.stft_distance(base, slow)) > 0.3


def by_the_papers_formulas(p, q):
    """Eq. 7 to 13, coordinate by coordinate."""
    scores = []
    for x, y in zip(p.T, q.T, strict=True):
        n = len(x)
        mx, my = x.sum() / n, y.sum() / n
        sx, sy = (np.sqrt(((v - v.mean()) ** 2).sum() / (n - 1)) for v in (x, y))
        cov = ((x - mx) * (y - my)).sum() / (n - 1)
        c1, c2 = 0.01**2, 0.03**2
        luminance = (2 * mx * my + c1) / (mx**2 + my**2 + c1)
        contrast = (2 * sx * sy + c2) / (sx**2 + sy**2 + c2)
        scores.append(luminance * contrast * (cov + c2 / 2) / (sx * sy + c2 / 2))
    return np.mean(scores)


def test_ssim_is_the_papers(x64):
    for seed in range(5):
        a, b = pair(seed)
        np.testing.assert_allclose(m.ssim(jnp.asarray(a), jnp.asarray(b)), by_the_papers_formulas(a, b), rtol=1e-9)
        np.testing.assert_allclose(m.ssim(jnp.asarray(a), jnp.asarray(a)), 1.0)


def test_lpips_is_the_sum_over_blocks(x64):
    random = np.random.default_rng(4)
    a, b = ([jnp.asarray(random.normal(size=(2, 6, width))) for width in (3, 5)] for _ in range(2))
    expected = [
        sum(
            np.mean([((np.asarray(x[n, t]) - np.asarray(y[n, t])) ** 2).sum() for t in range(6)])
            for x, y in zip(a, b, strict=True)
        )
        for n in range(2)
    ]
    np.testing.assert_allclose(m.lpips(a, b), expected)


@pytest.mark.parametrize("score", [m.stft_distance, m.ssim, lambda a, b: m.lpips([a, 2 * a], [b, 2 * b])])
def test_gradients(x64, score):
    a, b = (jnp.asarray(x) for x in pair(5, frames=40, width=3))
    check_grads(lambda x: score(x, b), (a,), order=1, modes=["rev"], atol=1e-5, rtol=1e-4, eps=1e-6)


def test_gradients_are_finite_where_nothing_moves():
    still, other = jnp.zeros((40, 3)), jnp.asarray(pair(6, frames=40, width=3)[0], jnp.float32)
    for score in (m.stft_distance, m.ssim):
        assert np.isfinite(jax.grad(score)(still, other)).all()
        assert np.isfinite(jax.grad(score)(still, still)).all()


def test_too_short_for_a_window():
    with pytest.raises(ValueError, match="expected 32 frames or more"):
        m.stft_distance(jnp.zeros((31, 2)), jnp.zeros((31, 2)))


def test_ssim_is_scikit_images_with_one_window_over_all_frames(x64):
    """Per coordinate a signal of odd length under a single flat window is the paper's global form (Eq. 7 to 13)."""
    metrics = pytest.importorskip("skimage.metrics")
    a, b = pair(7, frames=81)
    expected = [
        metrics.structural_similarity(
            a[:, c], b[:, c], win_size=81, data_range=1.0, gaussian_weights=False, use_sample_covariance=True
        )
        for c in range(a.shape[1])
    ]
    np.testing.assert_allclose(float(m.ssim(jnp.asarray(a), jnp.asarray(b))), np.mean(expected), atol=1e-9)
