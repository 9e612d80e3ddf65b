"""Quality of a voice: spectral slope and breath."""

import numpy as np
from jaxtyping import Float
from scipy import fft
from scipy.ndimage import uniform_filter1d
from scipy.signal import istft, stft

_SLOPE_FROM, _SLOPE_TO = 500.0, 8000.0  # Hz: the slope is level outside
_WINDOW = 512
_SMOOTHING = 9  # bins: harmonics merge, formants stay
_BREATH_FROM = 1500.0  # Hz: aspiration is weaker below


def tilted(audio: Float[np.ndarray, " N"], sample_rate: int, db_per_octave: float) -> Float[np.ndarray, " N"]:
    """The audio with its spectrum's slope changed between 500 Hz and 8 kHz; positive is brighter."""
    size = fft.next_fast_len(len(audio), real=True)
    octaves = np.log2(np.clip(fft.rfftfreq(size, 1.0 / sample_rate), _SLOPE_FROM, _SLOPE_TO) / _SLOPE_FROM)
    gain = 10.0 ** (db_per_octave * octaves / 20.0)
    return fft.irfft(fft.rfft(audio, size) * gain, size)[: len(audio)].astype(np.float32)


def breath(
    audio: Float[np.ndarray, " N"], sample_rate: int, level_db: float, rng: np.random.Generator
) -> Float[np.ndarray, " N"]:
    """Aspiration: noise with the formants of the speech at the same moment, ``level_db`` relative to the speech."""
    frequency, _, spectrum = stft(audio, sample_rate, nperseg=_WINDOW)
    envelope = uniform_filter1d(np.abs(spectrum), _SMOOTHING, axis=0, mode="nearest")
    envelope *= np.clip(frequency / _BREATH_FROM, 0.2, 2.0)[:, None]
    noise = rng.standard_normal((2, *spectrum.shape))
    _, breath = istft(envelope * (noise[0] + 1j * noise[1]), sample_rate, nperseg=_WINDOW)
    breath = np.pad(breath, (0, max(0, len(audio) - len(breath))))[: len(audio)]
    power = float(np.mean(np.square(audio)) / max(float(np.mean(np.square(breath))), 1e-20))
    return (breath * np.sqrt(power) * 10.0 ** (level_db / 20.0)).astype(np.float32)


def breathing(amplitude: Float[np.ndarray, " N"], sample_rate: int, rng: np.random.Generator) -> np.ndarray:
    """Noise of breathing in: a band around 1.5 kHz, times ``amplitude`` (root mean square)."""
    size = fft.next_fast_len(len(amplitude), real=True)
    frequency = np.maximum(fft.rfftfreq(size, 1.0 / sample_rate), 1.0)
    band = np.exp(-0.5 * (np.log2(frequency / 1500.0) / 1.2) ** 2)
    noise = fft.irfft(fft.rfft(rng.standard_normal(size)) * band, size)[: len(amplitude)]
    return (noise / np.sqrt(np.mean(np.square(noise))) * amplitude).astype(np.float32)
