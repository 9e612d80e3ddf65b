"""Agreement of motion with speech: peaks of wrist speed and peaks of speech energy, with a null."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import ndimage, signal

from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import BODY_JOINTS

_WRISTS = tuple(BODY_JOINTS.index(name) for name in ("L_Wrist", "R_Wrist"))


def speech_envelope(
    audio: Float[np.ndarray, " N"], sample_rate: int, fps: float, frames: int, smoothing: float = 0.05
) -> Float[np.ndarray, " T"]:
    """Speech energy in dB at the motion's frame times, smoothed over about a syllable.

    Args:
        smoothing: standard deviation of the Gaussian window, seconds.
    """
    power = _smooth(np.square(audio, dtype=np.float64), smoothing * sample_rate)
    samples = np.minimum(np.rint(np.arange(frames) * sample_rate / fps).astype(int), len(audio) - 1)
    decibels = 10 * np.log10(power[samples] + 1e-12)
    return np.maximum(decibels, decibels.max() - 50)


def _smooth(values: Float[np.ndarray, " N"], deviation: float) -> Float[np.ndarray, " N"]:
    """Non-negative values smoothed by a Gaussian, zero outside; by FFT, since the window has thousands of samples."""
    radius = round(4.0 * deviation)
    window = np.exp(-0.5 * np.square(np.arange(-radius, radius + 1) / deviation))
    return np.maximum(signal.oaconvolve(values, window / window.sum(), mode="full")[radius : radius + len(values)], 0.0)


def energy_peaks(envelope: Float[np.ndarray, " T"], fps: float, prominence: float = 3.0) -> Float[np.ndarray, " P"]:
    """Times of loud syllables, seconds: peaks with a prominence in dB that are among the louder half."""
    peaks, _ = signal.find_peaks(envelope, prominence=prominence)
    if len(peaks) == 0:
        return np.zeros(0)
    return peaks[envelope[peaks] >= np.median(envelope[peaks])] / fps


def wrist_speed(motion: Motion, smoothing: float = 0.05) -> Float[np.ndarray, " T"]:
    """Speed of the faster wrist, or of the fastest joint, in m/s, smoothed by a Gaussian of that width in seconds."""
    body = find_body_joints(motion.skeleton)
    positions = motion.positions()
    if body is not None:
        positions = positions[:, [body[joint] for joint in _WRISTS]]
    velocity = np.gradient(ndimage.gaussian_filter1d(positions, smoothing * motion.fps, axis=0), axis=0) * motion.fps
    return np.linalg.norm(velocity, axis=-1).max(axis=-1)


def speed_peaks(speed: Float[np.ndarray, " T"], fps: float) -> Float[np.ndarray, " P"]:
    """Times of strokes, seconds: peaks of speed with a prominence of a quarter of its 95th percentile."""
    peaks, _ = signal.find_peaks(speed, prominence=max(0.25 * float(np.percentile(speed, 95)), 1e-3))
    return peaks / fps


def agreement(
    motion_times: Float[np.ndarray, " M"], speech_times: Float[np.ndarray, " S"], sigma: float = 0.1, lead: float = 0.0
) -> float:
    """Mean over motion peaks of ``exp(-d^2 / 2 sigma^2)``, d the distance to the nearest speech peak, seconds.

    The beat alignment of Li et al. 2021 ("AI Choreographer") with speech peaks instead of music beats; report
    it with its null, :func:`agreement_with_null`.

    Args:
        lead: seconds by which a motion peak is expected before its speech peak.
    """
    if len(motion_times) == 0 or len(speech_times) == 0:
        return 0.0
    distance = np.abs(motion_times[:, None] + lead - speech_times[None]).min(axis=1)
    return float(np.mean(np.exp(-(distance**2) / (2 * sigma**2))))


class Agreement(NamedTuple):
    """A beat alignment with its null: the same motion shifted relative to the speech."""

    value: float
    null_mean: float
    null_std: float
    null_max: float

    @property
    def z(self) -> float:
        """Standard deviations of the null above its mean."""
        return (self.value - self.null_mean) / max(self.null_std, 1e-9)


def agreement_with_null(
    motion: Motion,
    audio: Float[np.ndarray, " N"],
    sample_rate: int,
    *,
    sigma: float = 0.1,
    lead: float = 0.1,
    shifts: Float[np.ndarray, " K"] | None = None,
) -> Agreement:
    """Agreement of speed peaks with energy peaks, and of the motion shifted circularly by 1 to 5 s in either direction.

    Args:
        lead: seconds from a stroke's fastest moment to its syllable's peak.
        shifts: seconds; by default 34 from -5 to -1 and 1 to 5.
    """
    envelope = speech_envelope(audio, sample_rate, motion.fps, motion.frames)
    return shifted_agreement(motion, energy_peaks(envelope, motion.fps), sigma=sigma, lead=lead, shifts=shifts)


def shifted_agreement(
    motion: Motion,
    speech: Float[np.ndarray, " S"],
    *,
    sigma: float = 0.1,
    lead: float = 0.1,
    shifts: Float[np.ndarray, " K"] | None = None,
) -> Agreement:
    """:func:`agreement_with_null` for peaks of energy that have been found before.

    Args:
        speech: times from :func:`energy_peaks`, seconds.
    """
    if shifts is None:
        shifts = np.concatenate([np.linspace(-5, -1, 17), np.linspace(1, 5, 17)])
    moves = speed_peaks(wrist_speed(motion), motion.fps)
    scores = [agreement((moves + shift) % motion.seconds, speech, sigma, lead) for shift in shifts]
    return Agreement(
        agreement(moves, speech, sigma, lead), float(np.mean(scores)), float(np.std(scores)), float(np.max(scores))
    )
