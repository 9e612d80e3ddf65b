"""WAV files assembled by hand, and speech-like sounds."""

import struct

import numpy as np

RATE = 16000


def tone(seconds=0.5, rate=RATE, level=0.5, hertz=440.0):
    return (level * np.sin(2 * np.pi * hertz * np.arange(round(seconds * rate)) / rate)).astype(np.float32)


def wav_bytes(samples, *, rate=RATE, channels=1, bits=16, form=1, riff=b"RIFF", size=None, long_size=None, before=b""):
    """A file with any sizes in its header.

    Args:
        riff: first four bytes; RF64 and BW64 have a chunk ``ds64`` with ``long_size``.
        size: of the data, as the header states it; the true one if None.
        before: chunks before the data.
    """
    body = samples.tobytes() if isinstance(samples, np.ndarray) else samples
    block = channels * bits // 8
    chunks = b"" if riff == b"RIFF" else b"ds64" + struct.pack("<IQQQI", 28, 0, _or(long_size, len(body)), 0, 0)
    chunks += b"fmt " + struct.pack("<IHHIIHH", 16, form, channels, rate, rate * block, block, bits) + before
    stated = _or(size, len(body)) if riff == b"RIFF" else 0xFFFFFFFF
    chunks += b"data" + struct.pack("<I", stated) + body
    whole = (4 + len(chunks)) & 0xFFFFFFFF if riff == b"RIFF" else 0xFFFFFFFF
    return riff + struct.pack("<I", whole) + b"WAVE" + chunks


def _or(value, other):
    return other if value is None else value
