"""Motion and audio as 16-bit numbers in base64, for a page without other files."""

import base64
import struct

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError

_FULL = 65535
_FINEST = 1e-5
#: Peaks below the first number are played at the second.
_QUIET, _QUIET_TO = 0.01, 0.1


def encode_positions(points: Float[np.ndarray, "T P 3"], label: str) -> dict:
    """Quantise positions to 16 bits over the range of each axis.

    Returns:
        ``low`` and ``step`` (one number per axis, metres) and ``data``: base64 of little-endian unsigned 16-bit numbers
        ``q`` in the order of ``points``, with ``position = low + step * q``. The error is half a step: 0.03 mm for a
        speaker on a spot of 4 m, and never more than 0.5 mm.
    """
    if points.shape[0] == 0:
        raise InputError(f"figure {label!r}: the motion has no frames; give it at least one.")
    if not np.isfinite(points).all():
        frame = int(np.argwhere(~np.isfinite(points))[0, 0])
        raise InputError(f"figure {label!r}, frame {frame}: a position is not a finite number; fix the motion first.")
    flat = points.reshape(-1, 3).astype(np.float64)
    low, high = flat.min(axis=0), flat.max(axis=0)
    step = np.maximum((high - low) / _FULL, _FINEST)
    if step.max() > 0.001:
        raise InputError(
            f"figure {label!r}: positions span {float((high - low).max()):.0f} m; the page holds 65 m; check that the"
            " motion is in metres."
        )
    numbers = np.round((flat - low) / step).clip(0, _FULL).astype("<u2")
    return {"low": low.tolist(), "step": step.tolist(), "data": base64.b64encode(numbers.tobytes()).decode("ascii")}


def decode_positions(encoded: dict, points: int) -> Float[np.ndarray, "T P 3"]:
    """Positions in metres from what :func:`encode_positions` returned."""
    numbers = np.frombuffer(base64.b64decode(encoded["data"]), "<u2").reshape(-1, points, 3)
    return np.asarray(encoded["low"]) + np.asarray(encoded["step"]) * numbers


def playback_gain(audio: Float[np.ndarray, " N"]) -> float:
    """The factor of samples on a page: 1, but less for samples beyond full scale, which would be clipped, and more for
    those so quiet that 16 bits would hardly hold them."""
    peak = float(np.abs(audio).max(initial=0.0))
    if peak > 1.0:
        return 1.0 / peak
    return _QUIET_TO / peak if 0.0 < peak < _QUIET else 1.0


def playback_note(audio: Float[np.ndarray, " N"]) -> str:
    """A sentence on that factor for the reader of the page; empty for 1."""
    gain = playback_gain(audio)
    if gain == 1.0 or not np.isfinite(gain):
        return ""
    peak = float(np.abs(audio).max())
    return f"Audio played {20 * np.log10(gain):+.1f} dB: its peak is {peak:.2g} of full scale."


def encode_audio(audio: Float[np.ndarray, " N"], sample_rate: int) -> str:
    """A mono 16-bit PCM WAV file in base64, scaled by :func:`playback_gain`."""
    if sample_rate <= 0:
        raise InputError(f"audio: the sample rate is {sample_rate}; give samples per second.")
    if not np.isfinite(audio).all():
        sample = int(np.argwhere(~np.isfinite(audio))[0, 0])
        raise InputError(f"audio, sample {sample}: not a finite number; fix the audio first.")
    audio = audio * np.float32(playback_gain(audio))
    samples = np.round(np.clip(audio, -1.0, 1.0) * 32767.0).astype("<i2").tobytes()
    form = struct.pack("<4sIHHIIHH", b"fmt ", 16, 1, 1, sample_rate, 2 * sample_rate, 2, 16)
    data = struct.pack("<4sI", b"data", len(samples)) + samples
    riff = struct.pack("<4sI4s", b"RIFF", 4 + len(form) + len(data), b"WAVE")
    return base64.b64encode(riff + form + data).decode("ascii")
