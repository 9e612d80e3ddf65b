"""PyTorch's side of the structural and perceptual losses (Audio2Gestures, extended, Eq. 6 to 14).

Written from the equations, with PyTorch's own transform; signals are (clips, frames, coordinates).
"""

from collections.abc import Sequence

import torch
from torch import Tensor

from a2g_jax.features.similarity import SSIM_C1, SSIM_C2, STFT_EPSILON, STFT_HOP, STFT_WINDOW


def stft_distance(predicted: Tensor, target: Tensor) -> Tensor:
    """Mean absolute difference of log magnitudes."""
    return (_log_magnitudes(predicted) - _log_magnitudes(target)).abs().mean()


def _log_magnitudes(signal: Tensor) -> Tensor:
    rows = signal.transpose(1, 2).flatten(0, 1)
    window = torch.hann_window(STFT_WINDOW, periodic=True, dtype=signal.dtype)
    spectrum = torch.stft(rows, STFT_WINDOW, STFT_HOP, window=window, center=False, return_complex=True)
    return torch.log(torch.sqrt(torch.view_as_real(spectrum).square().sum(-1) + STFT_EPSILON**2))


def ssim(predicted: Tensor, target: Tensor) -> Tensor:
    """Luminance, contrast and structure one by one (Eq. 8 to 10)."""
    mean_p, mean_q = predicted.mean(1), target.mean(1)
    p, q = predicted - mean_p[:, None], target - mean_q[:, None]
    count = predicted.shape[1] - 1
    var_p, var_q, covariance = p.square().sum(1) / count, q.square().sum(1) / count, (p * q).sum(1) / count
    # A joint that never moves has zero variance, whose root has no gradient.
    spread_p, spread_q = (value.clamp(min=torch.finfo(p.dtype).tiny).sqrt() for value in (var_p, var_q))
    luminance = (2 * mean_p * mean_q + SSIM_C1) / (mean_p**2 + mean_q**2 + SSIM_C1)
    contrast = (2 * spread_p * spread_q + SSIM_C2) / (var_p + var_q + SSIM_C2)
    structure = (covariance + SSIM_C2 / 2) / (spread_p * spread_q + SSIM_C2 / 2)
    return (luminance * contrast * structure).mean()


def lpips(predicted: Sequence[Tensor], target: Sequence[Tensor]) -> Tensor:
    """Squared distance of features (B, C, T), averaged over frames and summed over blocks."""
    parts = [(p - q).square().sum(1).mean() for p, q in zip(predicted, target, strict=True)]
    return torch.stack(parts).sum()
