"""Beat alignment in its two published forms. It has no zero: report it with its null (:func:`with_null`)."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import ndimage, signal

Times = Float[np.ndarray, " _"]

#: Tolerance of the beat alignment from motion to audio in a report, seconds, at any frame rate.
SIGMA = 1.0 / 6.0
#: Tolerances of BEAT and HA2G, seconds.
BEAT_SIGMA, WIDE_SIGMA = 0.1, 0.3
#: The flow paper and AI Choreographer count in frames; :func:`frames_to_seconds` converts them.
FLOW_SIGMA_FRAMES, CHOREOGRAPHER_SIGMA_FRAMES = 5.0, 3.0
#: Standard deviation of the Gaussian over the speed in a report, seconds, at any frame rate.
SMOOTHING = 1.0 / 15.0


def frames_to_seconds(frames: float, fps: float) -> float:
    """Seconds of a tolerance in frames, as in the papers' code: at the frame rate of the motion that is scored."""
    return frames / fps


def motion_beats(positions: Float[np.ndarray, "T J D"], fps: float, smoothing: float = 0.0) -> Times:
    """Times (s) at which the summed speed of all joints has a local minimum (Li et al. 2021, "AI Choreographer").

    Args:
        smoothing: standard deviation in seconds of a Gaussian over the speed; the authors' code has 5 frames at 60 fps.
    """
    speed = np.linalg.norm(np.diff(positions, axis=0), axis=-1).sum(axis=-1) * fps
    if smoothing > 0:
        speed = ndimage.gaussian_filter1d(speed, smoothing * fps)
    # Speed k is between frames k and k + 1.
    return (signal.find_peaks(-speed)[0] + 0.5) / fps


def audio_onsets(audio: Float[np.ndarray, " N"], sample_rate: int) -> Times:
    """Times of the onsets that librosa detects at the audio's own rate, seconds.

    Public code that passes 16 kHz audio without its rate makes librosa assume 22.05 kHz: a click at 57.0 s counts as
    one at 41.3 s.
    """
    import librosa  # here, since it takes seconds

    return np.asarray(librosa.onset.onset_detect(y=np.asarray(audio), sr=sample_rate, units="time"), np.float64)


def beat_alignment(of: Times, to: Times, sigma: float) -> float:
    """Mean over beats of ``exp(-d^2 / (2 sigma^2))``, d the distance to the nearest of the others; 0 where one is
    empty.

    The flow paper and AI Choreographer average over motion beats (``of`` motion ``to`` audio); HA2G and BEAT over audio
    onsets (``of`` audio ``to`` motion).

    Args:
        sigma: tolerance in seconds; the papers' are :data:`BEAT_SIGMA`, :data:`WIDE_SIGMA`, and
            :data:`FLOW_SIGMA_FRAMES` and :data:`CHOREOGRAPHER_SIGMA_FRAMES` by :func:`frames_to_seconds`.
    """
    if len(of) == 0 or len(to) == 0:
        return 0.0
    distance = np.abs(of[:, None] - to[None]).min(axis=1)
    return float(np.mean(np.exp(-(distance**2) / (2.0 * sigma**2))))


class WithNull(NamedTuple):
    """A score with its null: the same for motion shifted relative to the audio."""

    value: float
    null_mean: float
    null_std: float

    @property
    def z(self) -> float:
        """Standard deviations of the null above its mean."""
        return (self.value - self.null_mean) / max(self.null_std, 1e-9)


def with_null(
    score: Callable[[Times, Times], float],
    motion: Times,
    audio: Times,
    seconds: float,
    shifts: Float[np.ndarray, " k"] | None = None,
) -> WithNull:
    """A score of (motion beats, audio onsets), and its null over circular shifts of the motion beats.

    Args:
        score: a function such as ``lambda m, a: beat_alignment(m, a, 5 / 30)``.
        seconds: length of the recording.
        shifts: seconds; by default 34 from 1 to 5 s in either direction.
    """
    if shifts is None:
        shifts = np.concatenate([np.linspace(-5.0, -1.0, 17), np.linspace(1.0, 5.0, 17)])
    null = [score(np.sort((motion + shift) % seconds), audio) for shift in shifts]
    return WithNull(score(motion, audio), float(np.mean(null)), float(np.std(null)))


def mel_onsets(log_mel: Float[np.ndarray, "T bands"], fps: float) -> Times:
    """Times (s) of onsets in log-mel rows: peaks, prominent by half a standard deviation, of the mean rise over bands.

    For corpora without a waveform; the resolution is one row.
    """
    rise = np.maximum(np.diff(np.asarray(log_mel, np.float64), axis=0, prepend=log_mel[:1]), 0.0).mean(axis=1)
    peaks, _ = signal.find_peaks(rise, prominence=max(0.5 * float(rise.std()), 1e-9))
    return peaks / fps
