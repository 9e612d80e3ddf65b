"""Similarity of motions over time: STFT distance, structural similarity and distance of deep features.

Signals are (..., T, C): C coordinates of joints over T frames. All functions are differentiable everywhere, to serve as
metrics and as training losses (Audio2Gestures, extended, Sec. 4.1.2 to 4.1.4).
"""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

Signal = Float[Array | np.ndarray, "*batch T _"]

#: As in the extended paper: frames in a Hann window and a transform, and frames between windows (a quarter).
STFT_WINDOW, STFT_HOP = 32, 8
#: Added inside the logarithm: spectra of positions in metres are of the order of 0.01, those of still joints zero.
STFT_EPSILON = 1e-5
#: Constants of Eq. 8 to 10.
SSIM_C1, SSIM_C2 = 0.01**2, 0.03**2


def stft_magnitudes(signal: Signal, window: int = STFT_WINDOW, hop: int = STFT_HOP) -> Float[Array, "*batch W F C"]:
    """Magnitudes of the short-time Fourier transform over time, of windows entirely within the signal.

    The Hann window is periodic, and magnitudes are not divided by its sum.

    Raises:
        ValueError: the signal is shorter than a window.
    """
    frames = signal.shape[-2]
    if frames < window:
        raise ValueError(f"expected {window} frames or more for a short-time Fourier transform; got {frames}")
    starts = jnp.arange(0, frames - window + 1, hop)
    pieces = signal[..., starts[:, None] + jnp.arange(window)[None], :]
    hann = 0.5 - 0.5 * jnp.cos(2.0 * jnp.pi * jnp.arange(window) / window)
    spectrum = jnp.fft.rfft(
        pieces * hann[:, None].astype(signal.dtype).reshape((1,) * (pieces.ndim - 2) + (window, 1)), axis=-2
    )
    power = jnp.square(spectrum.real) + jnp.square(spectrum.imag)
    # A root has no gradient at zero, the value of a still joint.
    return jnp.sqrt(power + STFT_EPSILON**2)


def stft_distance(
    predicted: Signal, target: Signal, window: int = STFT_WINDOW, hop: int = STFT_HOP
) -> Float[Array, "*batch"]:
    """Mean absolute difference of log magnitudes (Eq. 6).

    ``mean |log |STFT(p)| - log |STFT(q)||`` over windows, frequencies and coordinates. The paper divides by the number
    of frames instead, so that the value depends on the number of joints.
    """
    ours, theirs = (jnp.log(stft_magnitudes(signal, window, hop)) for signal in (predicted, target))
    return jnp.mean(jnp.abs(ours - theirs), axis=(-3, -2, -1))


def ssim(predicted: Signal, target: Signal) -> Float[Array, "*batch"]:
    """Structural similarity of each coordinate over time, averaged over coordinates (Eq. 7 to 13); at most 1.

    ``l c s`` with ``l`` of means, ``c`` of standard deviations and ``s`` of covariances (N - 1), C1 = 0.01^2, C2 =
    0.03^2, C3 = C2 / 2; computed as ``c s = (2 cov + C2) / (var_p + var_q + C2)``, without roots.
    """
    count = predicted.shape[-2] - 1
    mean_p, mean_q = (jnp.mean(signal, axis=-2) for signal in (predicted, target))
    p, q = predicted - jnp.expand_dims(mean_p, -2), target - jnp.expand_dims(mean_q, -2)
    var_p, var_q = (jnp.sum(jnp.square(centred), axis=-2) / count for centred in (p, q))
    covariance = jnp.sum(p * q, axis=-2) / count
    luminance = (2.0 * mean_p * mean_q + SSIM_C1) / (jnp.square(mean_p) + jnp.square(mean_q) + SSIM_C1)
    structure = (2.0 * covariance + SSIM_C2) / (var_p + var_q + SSIM_C2)
    return jnp.mean(luminance * structure, axis=-1)


def lpips(predicted: Sequence[Signal], target: Sequence[Signal]) -> Float[Array, "*batch"]:
    """Learned perceptual distance: over blocks, the mean over frames of the squared L2 distance of features (Eq. 14).

    Args:
        predicted: features of one motion, one array for each block of a network; the same network for both motions.
    """
    parts = [
        jnp.mean(jnp.sum(jnp.square(ours - theirs), axis=-1), axis=-1)
        for ours, theirs in zip(predicted, target, strict=True)
    ]
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total
