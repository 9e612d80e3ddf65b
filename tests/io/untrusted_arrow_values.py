"""Made-up values for the payloads in ``untrusted_payloads.tar.xz`` (folder ``arrow``), and the script that wrote them.

Each payload is ``pyarrow.serialize(value).to_buffer()`` by the pyarrow in its name; run this file with that version
(Python 3.6 to 3.9) and an output folder to write them anew.
"""

import collections

import numpy as np


def wave(*shape):
    return np.sin(np.arange(np.prod(shape, dtype=int)) * 0.7).reshape(shape)


def clip(words, frames):
    return {
        "words": [["hello", 0.5, 0.9], ["wörld", 1.0, 1.25], ["", 1.3, 1.4]][:words],
        "skeletons_3d": wave(frames, 10, 3).astype(np.float32),
        "audio_feat": wave(8, frames).astype(np.float16),
        "audio_raw": wave(20 * frames).astype(np.float32),
        "start_frame_no": 3,
        "end_frame_no": 3 + frames,
        "start_time": 0.2,
        "end_time": 0.2 + frames / 15,
    }


def values(buffer):
    """Values by name; ``buffer`` is what makes bytes a buffer (``pyarrow.py_buffer``, or nothing to compare with)."""
    numbers = [np.arange(3, dtype=letter) for letter in "bBhHiIqQefd"]
    return {
        "ted": {"vid": "abcDEF_-123", "clips": [clip(3, 4), clip(0, 2)]},
        "atoms": [
            *(None, True, False, 0, -5, 2**62, 2**80, -(2**70), 1.5, float("inf"), b"\x00\xff", "téxt", "", b""),
            *([], (), {}, [[]], [None, [None]], (1, (2,)), {"a": None, 1: [2], (1, "b"): {}}, {1, 2}, [1] * 9 + [None]),
        ],
        "arrays": [
            *numbers,
            np.asfortranarray(wave(2, 3)),
            wave(2, 3, 4)[:, ::2],
            np.array(5.0),
            np.empty((0, 3)),
            np.array([True, False]),
            np.array(["ab", "c"]),
            np.array([1, "a", None], dtype=object),
            *(np.float32(2.5), np.float16(1.5), np.float64(3), np.int8(4), np.bool_(True)),
        ],
        "collections": [
            collections.OrderedDict([("b", 1), ("a", [2])]),
            collections.deque([1, 2]),
            collections.Counter("aab"),
        ],
        "buffers": [buffer(b"xyz"), 1, np.arange(2)],
        "buffer": buffer(b"q"),
        "none": None,
    }


if __name__ == "__main__":
    import sys
    from pathlib import Path

    import pyarrow

    for name, value in values(pyarrow.py_buffer).items():
        if name != "collections" or pyarrow.__version__ != "0.11.1":  # that one had no way to write them
            data = pyarrow.serialize(value).to_buffer().to_pybytes()
            (Path(sys.argv[1]) / f"{pyarrow.__version__}-{name}").write_bytes(data)
