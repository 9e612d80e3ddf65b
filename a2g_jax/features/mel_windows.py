"""Spectrograms of short windows of speech: the images that EmotionGesture's audio encoder looks at."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy import fft, signal

from a2g_jax.features.mel import mel_filters


@dataclass(frozen=True)
class MelWindowConfig:
    """How a window is looked at; the defaults give 128 bands by 124 spectra for 4 seconds, as EmotionGesture has."""

    sample_rate: int = 16000
    seconds: float = 4.0
    bands: int = 128
    window: int = 1024
    """Length of the Hann window and of the Fourier transform, samples."""
    hop: int = 512
    """From one spectrum to the next, samples."""
    range_db: float = 80.0
    """Bands quieter than the loudest one of the window by more than this are raised to that floor."""

    @property
    def samples(self) -> int:
        """Audio in a window."""
        return round(self.seconds * self.sample_rate)

    @property
    def spectra(self) -> int:
        """Spectra in a window: those that lie wholly within it."""
        return 1 + (self.samples - self.window) // self.hop


def mel_windows(
    audio: Float[np.ndarray, "*batch N"], config: MelWindowConfig = MelWindowConfig()
) -> Float[np.ndarray, "*batch bands spectra"]:
    """Log-mel spectrograms in dB of windows of speech.

    Spectrum k covers the samples from ``k * hop`` to ``k * hop + window``; nothing is padded, so 64000 samples give 124
    spectra (1 + (64000 - 1024) // 512).

    Args:
        audio: ``config.samples`` mono samples each.

    Raises:
        ValueError: windows of another length.
    """
    if audio.shape[-1] != config.samples:
        raise ValueError(f"expected windows of {config.samples} samples; got {audio.shape[-1]}")
    frames = np.lib.stride_tricks.sliding_window_view(audio, config.window, axis=-1)[..., :: config.hop, :]
    hann = signal.get_window("hann", config.window).astype(np.float32)
    spectrum = fft.rfft(frames.astype(np.float32) * hann, axis=-1)
    power = spectrum.real**2 + spectrum.imag**2
    mel = power @ mel_filters(config.sample_rate, config.window, config.bands).T
    decibels = 10.0 * np.log10(np.maximum(np.swapaxes(mel, -1, -2), 1e-10))
    floor = decibels.max(axis=(-2, -1), keepdims=True) - config.range_db
    return np.maximum(decibels, floor).astype(np.float32)
