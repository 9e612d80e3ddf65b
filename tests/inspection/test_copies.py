"""Equal audio and equal motion are found wherever they are, and nothing else is."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings_for_tests import RATE, clean

from a2g_jax.geometry.motion import resample
from a2g_jax.inspection.copies import audio_fingerprint, check_copies, find_copies, motion_fingerprint
from a2g_jax.talker.recordings import resample_motion

#: Recordings that are compared.
COUNT = 5


@pytest.fixture(scope="module")
def audio_prints():
    return [audio_fingerprint(clean(number).audio, RATE) for number in range(COUNT)]


@pytest.fixture(scope="module")
def motion_prints():
    return [motion_fingerprint(clean(number).motion) for number in range(COUNT)]


def test_different_recordings_have_nothing_in_common(audio_prints, motion_prints):
    assert find_copies(audio_prints) == []
    assert find_copies(motion_prints) == []
    others = [motion_fingerprint(resample_motion(clean(0), key)[0]) for key in range(3)]
    assert find_copies([*motion_prints, *others]) == []


@settings(max_examples=8, deadline=None)
@given(st.floats(0, 9), st.floats(0.05, 3), st.integers(0, 7))
def test_audio_cut_anywhere_at_any_level(start, gain, number):
    audio = clean(number).audio[round(start * RATE) :] * np.float32(gain)
    made = [audio_fingerprint(clean(other).audio, RATE) for other in (0, 3)] if number not in (0, 3) else []
    (copy,) = find_copies([*made, audio_fingerprint(clean(number).audio, RATE), audio_fingerprint(audio, RATE)])
    assert copy.shift == pytest.approx(-start, abs=0.03)
    assert copy.seconds > 0.7 * (20 - start)


def test_a_stretch_with_noise_in_another_recording(audio_prints):
    noise = np.random.default_rng(0).normal(size=10 * RATE) * 0.002
    audio = clean(1).audio.copy()
    audio[5 * RATE : 15 * RATE] = clean(2).audio[2 * RATE : 12 * RATE] + noise
    copies = {(copy.first, copy.second): copy for copy in find_copies([*audio_prints, audio_fingerprint(audio, RATE)])}
    assert set(copies) == {(1, COUNT), (2, COUNT)}
    assert copies[2, COUNT].shift == pytest.approx(3.0, abs=0.03)


@pytest.mark.parametrize("change", ["cut", "rate", "noise"])
def test_the_same_motion(change, motion_prints):
    motion = clean(4).motion
    rng = np.random.default_rng(1)
    other = {
        "cut": lambda: motion.clip(101, 420),
        "rate": lambda: resample(motion, 25.0),
        "noise": lambda: replace(
            motion, rotations=np.asarray(motion.rotations) + rng.normal(size=(600, 22, 3, 3)).astype(np.float32) * 1e-4
        ),
    }[change]()
    (copy,) = find_copies([*motion_prints, motion_fingerprint(other)])
    assert (copy.first, copy.second) == (4, COUNT)
    assert copy.shift == pytest.approx(-101 / 30 if change == "cut" else 0.0, abs=0.11)


def test_leak_or_duplicate(audio_prints):
    prints, names = [audio_prints[0], audio_prints[1], audio_prints[0]], ["a", "b", "c"]
    train, test = frozenset({"train"}), frozenset({"test"})
    assert [x.code for x in check_copies("audio", prints, names)] == ["duplicate"]
    assert [x.code for x in check_copies("audio", prints, names, [train, train, train])] == ["duplicate"]
    (leak,) = check_copies("audio", prints, names, [train, test, test])
    assert leak.code == "leak"
    assert leak.place.recording == "c"
    assert "same audio as a" in leak.message
    # Recordings cut in time have all parts of both, and the copy lies in other ones.
    both = frozenset({"train", "test"})
    assert [x.code for x in check_copies("audio", prints, names, [both, train, both])] == ["leak"]


def test_nothing_to_compare(audio_prints):
    empty = audio_fingerprint(np.zeros(400, np.float32), RATE)
    assert len(empty.words) == 0
    assert find_copies([]) == find_copies([audio_prints[0]]) == find_copies([empty, empty]) == []
    silent = audio_fingerprint(np.zeros(10 * RATE, np.float32), RATE)
    assert find_copies([silent, silent]) == []
    still = clean(0).motion
    still = replace(still, rotations=np.repeat(np.asarray(still.rotations)[:1], 600, axis=0))
    assert find_copies([motion_fingerprint(still), motion_fingerprint(still)]) == []


def test_the_same_room_is_not_the_same_speech():
    """Equal noise in the pauses, a hum say, is no copy."""
    hum = (np.random.default_rng(3).normal(size=20 * RATE) * 2e-3).astype(np.float32)
    apart = [np.where(np.arange(20 * RATE) // RATE % 4 < 2, clean(number).audio, np.float32(0)) for number in (0, 3)]
    assert find_copies([audio_fingerprint(audio + hum, RATE) for audio in apart]) == []
