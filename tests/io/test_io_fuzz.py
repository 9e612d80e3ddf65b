"""Damaged files give a valid object or a one-line InputError: never another exception, never a hang."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.audio import audio_info, read_audio, write_audio
from a2g_jax.io.bvh import read_bvh, write_bvh
from a2g_jax.io.files import read_json, write_json
from a2g_jax.io.npz import read_motion_npz, write_motion_npz
from a2g_jax.io.textgrid import read_words, write_words
from a2g_jax.recording import Word

EXAMPLES = 40


def motion() -> Motion:
    skeleton = Skeleton(
        offsets=np.ones((3, 3), np.float32), names=("a", "b", "c"), parents=(-1, 0, 0), ends=((1, (0.0, 0.1, 0.0)),)
    )
    return Motion(np.tile(np.eye(3, dtype=np.float32), (4, 3, 1, 1)), np.ones((4, 3), np.float32), skeleton, 30.0)


def check_motion(result: Motion) -> None:
    assert result.frames > 0
    assert 0 < result.fps < math.inf
    assert np.isfinite(result.rotations).all()
    assert np.isfinite(result.root).all()
    assert np.isfinite(result.skeleton.offsets).all()


def check_audio(result: np.ndarray) -> None:
    assert result.dtype == np.float32
    assert len(result) > 0
    assert np.isfinite(result).all()


def check_words(result: tuple[Word, ...]) -> None:
    assert all(math.isfinite(word.start) and word.start < word.end and word.text for word in result)


def sound() -> np.ndarray:
    return np.sin(np.arange(2000) / 7).astype(np.float32) / 2


def write_grid(path: Path) -> None:
    write_words(path, [Word("one", 0.5, 1.0), Word('"two"', 1.5, 2.0)], 3.0, tiers={"phones": [Word("w", 0.5, 0.6)]})


KINDS: dict[str, tuple[Callable, Callable, Callable]] = {
    "a.bvh": (lambda path: write_bvh(path, motion()), read_bvh, check_motion),
    "a.npz": (lambda path: write_motion_npz(path, motion()), read_motion_npz, check_motion),
    "a.wav": (lambda path: write_audio(path, sound(), 22050), read_audio, check_audio),
    "float.wav": (lambda path: write_audio(path, sound(), 16000, "FLOAT"), read_audio, check_audio),
    "a.flac": (lambda path: write_audio(path, sound(), 16000), read_audio, check_audio),
    "a.ogg": (lambda path: write_audio(path, sound(), 16000, None), read_audio, check_audio),
    "info.wav": (lambda path: write_audio(path, sound(), 16000), audio_info, lambda info: None),
    "a.TextGrid": (write_grid, read_words, check_words),
    "a.json": (lambda path: write_json(path, {"a": [1, 2.5, None], "b": "text"}), read_json, lambda value: None),
}


@st.composite
def damage(draw) -> Callable[[bytes], bytes]:
    """One to four of: other bytes, a cut, a hole, a repeat, an insertion; headers are hit more often."""
    steps = draw(
        st.lists(
            st.tuples(
                st.sampled_from(["set", "cut", "hole", "repeat", "insert"]),
                st.floats(0, 1).map(lambda x: x**2),
                st.floats(0, 0.2),
                st.one_of(
                    st.binary(min_size=1, max_size=4),
                    st.sampled_from(
                        [b"\xff\xff\xff\xff", b"\0\0\0\0", b" ", b"\n", b"-", b"nan", b"1e999", b"{", b'"']
                    ),
                ),
            ),
            min_size=1,
            max_size=4,
        )
    )

    def apply(data: bytes) -> bytes:
        for step, where, length, new in steps:
            at = int(where * len(data))
            end = at + max(1, int(length * len(data)))
            match step:
                case "set":
                    data = data[:at] + new + data[at + len(new) :]
                case "cut":
                    data = data[: len(data) - at]
                case "hole":
                    data = data[:at] + data[end:]
                case "repeat":
                    data = data[:end] + data[at:]
                case "insert":
                    data = data[:at] + new + data[at:]
        return data

    return apply


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


@pytest.mark.parametrize("name", KINDS)
@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(change=damage())
def test_damaged_bytes(folder, name, change):
    write, read, check = KINDS[name]
    whole, broken = folder / f"whole-{name}", folder / name
    if not whole.exists():
        write(whole)
        check(read(whole))
    broken.write_bytes(change(whole.read_bytes()))
    attempt(read, check, broken)


def attempt(read, check, path):
    try:
        result = read(path)
    except InputError as error:
        message = str(error)
    else:
        check(result)
        return
    assert str(path) in message
    assert "\n" not in message
    assert len(message) < 600 + len(str(path))


BVH_WORDS = (
    *("HIERARCHY", "ROOT", "JOINT", "End Site", "OFFSET", "CHANNELS", "MOTION", "Frames: 1", "Frame Time: 0.1"),
    *("{", "}", "0", "1", "2", "3", "6", "-1.5", "1e3", "Xposition", "Yrotation", "Zrotation", "a", "b", "\n"),
)


@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(words=st.lists(st.sampled_from(BVH_WORDS), max_size=60), start=st.booleans())
def test_shuffled_bvh_words(folder, words, start):
    path = folder / "words.bvh"
    path.write_text(("HIERARCHY ROOT r { OFFSET 0 0 0 " if start else "x ") + " ".join(words))
    attempt(read_bvh, check_motion, path)


@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    data=st.binary(min_size=1, max_size=200), head=st.sampled_from([b"", b"RIFF", b"PK\x03\x04", b"HIERARCHY\n", b"{"])
)
def test_arbitrary_bytes(folder, data, head):
    for name, (_, read, check) in KINDS.items():
        path = folder / f"any-{name}"
        path.write_bytes(head + data)
        attempt(read, check, path)
