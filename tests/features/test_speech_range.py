"""What of a speech lies outside the training speech of a run, and that usual speech does not."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from a2g_jax import demo_run, open_run, unusual_speech
from a2g_jax.cli.speech import warn_of_range
from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig, log_mel
from a2g_jax.features.speech_figures import window_pitch, window_spectra
from a2g_jax.features.speech_range import range_from_json, range_of_speech
from a2g_jax.talker.demo_speech import demo_speech
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from a2g_jax.training.run_config import Source
from a2g_jax.training.speech_range import corpus_speech_range, read_speech_range, write_speech_range

RATE, MEL = 16000, MelConfig()
TIME = np.arange(10 * RATE) / RATE
SHIPPED = ("demo", "demo-flow", "demo-emotion")


@pytest.fixture(scope="module")
def runs():
    return {name: open_run(name) for name in SHIPPED}


@pytest.fixture
def short(monkeypatch):
    """Two windows are enough for a range."""
    monkeypatch.setattr("a2g_jax.features.speech_range.LEAST_WINDOWS", 2)


def figures(found):
    return {one.figure for one in found}


def child(audio):
    """Speech as of a much smaller speaker: everything 10 semitones higher."""
    return signal.resample_poly(audio, 9, 16)


def melody():
    rng, wave = np.random.default_rng(1), np.zeros(len(TIME))
    for start in np.arange(0, 10, 0.5):
        hertz, after = 220 * 2 ** (rng.integers(0, 13) / 12), TIME - start
        decay = np.exp(-3 * np.maximum(after, 0)) * (after >= 0)
        wave += sum(decay * np.sin(2 * np.pi * hertz * k * TIME) / k for k in range(1, 6))
    return 0.1 * wave


@pytest.mark.parametrize("name", SHIPPED)
def test_usual_speech_is_not_objected_to(runs, name):
    assert unusual_speech(runs[name], demo_speech().audio) == ()
    for seed, speaker in enumerate(SPEAKERS):
        speech = talk(8.0, 5000 + seed, speaker=speaker, room=seed % 2 == 1).audio
        assert unusual_speech(runs[name], speech) == ()


@pytest.mark.parametrize("name", SHIPPED)
@pytest.mark.parametrize(
    ("audio", "expected"),
    [
        (0.3 * np.sin(2 * np.pi * 440 * TIME), {"pitch", "level", "rate", "spectrum"}),
        (melody(), {"level", "spectrum"}),
        (0.1 * np.random.default_rng(0).normal(size=len(TIME)), {"level", "rate", "change"}),
        (child(demo_speech().audio), {"pitch"}),
    ],
    ids=["tone", "melody", "noise", "child"],
)
def test_other_sound_is_named(runs, name, audio, expected):
    assert figures(unusual_speech(runs[name], audio)) >= expected


def test_one_line_says_what_and_by_how_much(runs, capsys):
    warn_of_range(runs["demo"], "demo", child(demo_speech().audio), "kid.wav")
    warn_of_range(runs["demo"], "demo", demo_speech().audio, "usual.wav")
    text = capsys.readouterr()
    (line,) = (text.out + text.err).splitlines()
    assert line.startswith("note: kid.wav: differs from the speech that demo was trained on: pitch 4")
    assert "(training speech: 78 to 347)" in line


def test_other_rates_and_short_speech(runs):
    speech = demo_speech().audio
    louder = signal.resample_poly(speech, 3, 1).astype(np.float32)
    assert unusual_speech(runs["demo"], louder, 48000) == ()
    assert unusual_speech(runs["demo"], np.zeros(RATE, np.float32)) == ()
    assert unusual_speech(runs["demo"], np.zeros(8 * RATE, np.float32)) == ()


def test_runs_without_a_range_object_to_nothing():
    run = demo_run()
    assert unusual_speech(replace(run, config=replace(run.config, speech_range=None)), TIME) == ()


@pytest.mark.parametrize("hertz", [90.0, 180.0, 320.0, 480.0])
def test_pitch_of_a_glottal_wave(hertz):
    pulses = signal.lfilter([1], [1, -0.95], np.sin(np.pi * hertz * TIME) ** 40)
    assert window_pitch(pulses, RATE) == pytest.approx(hertz, rel=0.03)


def test_pitch_does_not_depend_on_the_pieces(monkeypatch):
    speech = demo_speech().audio
    whole = window_pitch(speech, RATE)
    monkeypatch.setattr("a2g_jax.features.speech_figures._PIECE", 100)
    np.testing.assert_array_equal(window_pitch(speech, RATE), whole)


def test_rate_counts_bursts_and_level_their_depth():
    voice = signal.lfilter([1], [1, -0.9], np.random.default_rng(0).normal(size=len(TIME)))
    slow = voice * (0.02 + (np.sin(2 * np.pi * 2 * TIME) > 0))
    found = window_spectra(log_mel(slow, MEL, 30.0, 300), MEL, 30.0).figures
    assert found["rate"] == pytest.approx(2.0 / 0.55, rel=0.25)  # a second that is no pause
    assert np.all(found["level"] > 8)


def test_training_measures_its_corpus(short, toy_corpus, toy_run_config, tmp_path):
    found = corpus_speech_range(toy_corpus, toy_run_config())
    rows = [toy_corpus.audio[one.start : one.stop] for one in toy_corpus.segments("train")]
    assert found.windows == sum(len(window_spectra(one, MEL, 30.0).profiles) for one in rows)
    assert "pitch" not in found.ranges  # it stores no waveforms
    write_speech_range(tmp_path, found)
    read = read_speech_range(tmp_path, MEL)
    for name, pair in found.ranges.items():
        assert read.ranges[name] == pytest.approx(pair, abs=1e-3)
    write_speech_range(tmp_path, None)
    assert read_speech_range(tmp_path, MEL) is None


def test_a_run_that_started_from_another_keeps_its_range(short, toy_corpus, toy_run_config, runs):
    source = Source("demo", 0, "", "")
    own = corpus_speech_range(toy_corpus, toy_run_config())
    both = corpus_speech_range(toy_corpus, replace(toy_run_config(), source=source))
    before = runs["demo"].config.speech_range
    for name in own.ranges:
        low, high = both.ranges[name]
        assert low <= min(own.ranges[name][0], before.ranges[name][0])
        assert high >= max(own.ranges[name][1], before.ranges[name][1])
    assert both.outside(demo_speech().audio, MEL, 30.0) == ()


def test_too_little_speech_has_no_range():
    assert range_of_speech([log_mel(talk(6.0, 1).audio, MEL, 30.0, 180)], [], MEL, 30.0) is None
    assert range_of_speech([], [], MEL, 30.0) is None


@pytest.mark.parametrize(
    "damage",
    [lambda v: v.pop("mean"), lambda v: v["ranges"].pop("spectrum"), lambda v: v["mean"].pop(), lambda v: v.clear()],
)
def test_a_damaged_file_is_named(runs, damage):
    values = json.loads(json.dumps(runs["demo"].config.speech_range.to_json()))
    damage(values)
    with pytest.raises(InputError, match=r"speech.json: is damaged"):
        range_from_json(values, 64, "speech.json")


def test_a_changed_file_is_refused(runs, tmp_path):
    write_speech_range(tmp_path, runs["demo"].config.speech_range)
    path = tmp_path / "speech.json"
    path.write_text(path.read_text().replace('"windows": 1140', '"windows": 1141'))
    with pytest.raises(InputError, match="differs from its checksum"):
        read_speech_range(tmp_path, MEL)
