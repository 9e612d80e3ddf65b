"""Speech in base64, for a page without other files."""

import base64
import io
import struct

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError

#: Speech longer than this, seconds, is MP3 on the page, where the sample rate is one of MP3's.
_LONG = 60.0
_MP3_RATES = (8000, 11025, 12000, 16000, 22050, 24000, 32000, 44100, 48000)
#: Compression level of MP3: about 60 kbit/s for speech at 16 kHz, where 1 is the smallest file.
_LEVEL = 0.5
#: Peaks below the first number are played at the second.
_QUIET, _QUIET_TO = 0.01, 0.1


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


def encode_audio(audio: Float[np.ndarray, " N"], sample_rate: int) -> dict:
    """Mono audio for the page, scaled by :func:`playback_gain`.

    Returns:
        ``type``: ``audio/wav``, 16-bit PCM, or ``audio/mpeg`` for long speech; ``samples``: their number; ``rate``:
        their sample rate; ``data``: the file in base64, empty without audio.
    """
    if sample_rate <= 0:
        raise InputError(f"audio: the sample rate is {sample_rate}; give samples per second.")
    if not np.isfinite(audio).all():
        sample = int(np.argwhere(~np.isfinite(audio))[0, 0])
        raise InputError(f"audio, sample {sample}: not a finite number; fix the audio first.")
    about = {"samples": audio.size, "rate": sample_rate}
    if not audio.size:
        return {"type": "audio/wav", **about, "data": ""}
    scaled = np.clip(audio * np.float32(playback_gain(audio)), -1.0, 1.0)
    if audio.size > _LONG * sample_rate and sample_rate in _MP3_RATES:
        kind, data = "audio/mpeg", _mp3(scaled, sample_rate)
    else:
        kind, data = "audio/wav", _wav(scaled, sample_rate)
    return {"type": kind, **about, "data": base64.b64encode(data).decode("ascii")}


def _wav(audio: Float[np.ndarray, " N"], sample_rate: int) -> bytes:
    samples = np.round(audio * 32767.0).astype("<i2").tobytes()
    form = struct.pack("<4sIHHIIHH", b"fmt ", 16, 1, 1, sample_rate, 2 * sample_rate, 2, 16)
    data = struct.pack("<4sI", b"data", len(samples)) + samples
    return struct.pack("<4sI4s", b"RIFF", 4 + len(form) + len(data), b"WAVE") + form + data


def _mp3(audio: Float[np.ndarray, " N"], sample_rate: int) -> bytes:
    import soundfile

    file = io.BytesIO()
    soundfile.write(file, audio, sample_rate, format="MP3", compression_level=_LEVEL, bitrate_mode="VARIABLE")
    return file.getvalue()
