"""Speech is distinguished from noise, tones, signals, music and drums."""

import numpy as np
import pytest
from scipy import signal

from a2g_jax.features.speech_likeness import why_no_speech
from a2g_jax.talker.demo_speech import demo_speech
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS

RATE = 16000
RANDOM = np.random.default_rng(3)


def time(seconds):
    return np.arange(round(seconds * RATE)) / RATE


def note(hertz, seconds, harmonics=6, decay=3.0):
    at = time(seconds)
    wave = sum(np.sin(2 * np.pi * k * hertz * at) / k**1.2 for k in range(1, harmonics + 1))
    return wave * np.minimum(at / 0.01, 1) * np.exp(-decay * at)


def noise(seconds, colour):
    spectrum = np.fft.rfft(RANDOM.normal(size=round(seconds * RATE)))
    hertz = np.fft.rfftfreq(round(seconds * RATE), 1 / RATE)
    return np.fft.irfft(spectrum * np.where(hertz > 20, np.maximum(hertz, 1) ** (-colour / 2), 0))


def drums(seconds):
    wave = np.zeros(round(seconds * RATE))
    for number, start in enumerate(range(0, len(wave) - 3000, 4000)):
        hit = RANDOM.normal(size=2500) * np.exp(-np.arange(2500) / (120 if number % 2 else 400))
        wave[start : start + 2500] += hit
    return wave


def notes(seconds, length, *steps):
    each = [
        sum(note(220 * 2 ** ((int(RANDOM.integers(0, 12)) + step) / 12), length) for step in steps)
        for _ in range(round(seconds / length))
    ]
    return np.concatenate(each)


NO_SPEECH = {
    "white noise": lambda s: noise(s, 0),
    "pink noise": lambda s: noise(s, 1),
    "brown noise": lambda s: noise(s, 2),
    "dither": lambda s: 3e-5 * noise(s, 0),
    "tone": lambda s: np.sin(2 * np.pi * 440 * time(s)),
    "low tone": lambda s: np.sin(2 * np.pi * 50 * time(s)),
    "hum": lambda s: sum(np.sin(2 * np.pi * 50 * k * time(s)) / k for k in (1, 3, 5)) + 0.02 * noise(s, 0),
    "beeps": lambda s: np.sin(2 * np.pi * 1000 * time(s)) * ((2 * time(s)) % 1 < 0.3),
    "modulated tone": lambda s: np.sin(2 * np.pi * 440 * time(s)) * (1 + np.sin(2 * np.pi * 4 * time(s))),
    "bursts of noise": lambda s: noise(s, 0) * ((4 * time(s)) % 1 < 0.4),
    "sweep": lambda s: signal.chirp(time(s), 100, s, 4000),
    "chords": lambda s: notes(s, 1.0, 0, 4, 7),
    "melody": lambda s: notes(s, 0.3, 0),
    "drums": drums,
    "band": lambda s: 0.3 * drums(s) + notes(s, 0.5, 0, 4, 7),
}


@pytest.mark.parametrize("name", NO_SPEECH)
@pytest.mark.parametrize("seconds", [4.0, 12.0])
def test_no_speech(name, seconds):
    sound = NO_SPEECH[name](seconds)
    assert why_no_speech((sound / np.abs(sound).max() * 0.3).astype(np.float32), RATE), name


@pytest.mark.parametrize("speaker", sorted(SPEAKERS))
def test_every_voice_is_speech(speaker):
    for number, emotion in enumerate(("neutral", "anger", "sadness", "surprise")):
        audio = talk(6.0, 11 + number, speaker=speaker, emotion=emotion, room=number % 2 == 1).audio
        assert why_no_speech(audio, RATE) == "", emotion


def test_speech_that_was_changed():
    speech = demo_speech().audio
    loud = np.sqrt(np.mean(speech**2))
    changed = {
        "as it is": speech,
        "quiet": 1e-4 * speech,
        "with an offset": speech + np.float32(0.3),
        "in noise": speech + 0.4 * loud * RANDOM.normal(size=len(speech)),
        "clipped": np.clip(speech, -0.1, 0.1),
        "after silence": np.concatenate([np.zeros(20 * RATE), speech]),
        "after noise": np.concatenate([0.5 * loud * RANDOM.normal(size=20 * RATE), speech]),
    }
    for name, audio in changed.items():
        assert why_no_speech(audio.astype(np.float32), RATE) == "", name
    assert why_no_speech(signal.resample_poly(speech, 1, 2).astype(np.float32), RATE // 2) == ""
    assert why_no_speech(signal.resample_poly(speech, 3, 1).astype(np.float32), 3 * RATE) == ""


def test_what_is_too_short_is_not_judged():
    for seconds in (0.0, 0.01, 1.0):
        assert why_no_speech(np.zeros(round(seconds * RATE), np.float32), RATE) == ""


def test_real_takes(shared):
    from a2g_jax.io.audio import read_audio

    for name in ("beat/2_scott_0_1_1.wav", "zeggs/067_Speech_2_x_1_0.wav", "speech/jfk.wav"):
        assert why_no_speech(read_audio(shared / name), RATE) == ""
