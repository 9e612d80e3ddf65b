"""Live generation: any chunking gives the same motion, in bounded memory, with nothing compiled on the way."""

import dataclasses

import jax
import numpy as np
import pytest
from flows_for_tests import MEL, clip, run_of

from a2g_jax.errors import InputError
from a2g_jax.features.dynamics import Dynamics
from a2g_jax.generation.engine import Engine
from a2g_jax.generation.live.poses import PoseProgram, Poses
from a2g_jax.generation.live.stream import Stream, stream_offline
from a2g_jax.models.base import Condition
from a2g_jax.models.registry import find_model
from a2g_jax.training.run import Run

RATE = 48000


def speech(seconds, seed=0, rate=RATE):
    """Bursts of noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(seconds * rate)) / rate
    loud = np.maximum(np.sin(2 * np.pi * 2.3 * time), 0.0)
    return (0.2 * loud * rng.standard_normal(len(time))).astype(np.float32)


def windowed_run(config):
    """An untrained run of a model that generates in windows, not frame by frame."""
    model = config.build()
    params = jax.device_get(jax.jit(model.init)(jax.random.key(0)))
    rng = np.random.default_rng(0)
    shape = (5, config.model_config.code_channels)
    summary = {
        "specific_mean": rng.normal(size=shape).astype(np.float32),
        "specific_std": np.ones(shape, np.float32),
    }
    return Run(config, params, summary, 0)


@pytest.fixture(scope="module", params=["frame by frame", "windows"])
def stream(request, toy_run_config):
    """A stream that is compiled; tests take others of it."""
    run = run_of("6d") if request.param == "frame by frame" else windowed_run(toy_run_config())
    made = Stream(run, RATE)
    made.warm_up()
    return made


def joined(parts):
    return np.concatenate([one.rotations for one in parts]), np.concatenate([one.root for one in parts])


@pytest.mark.parametrize("times", [5, pytest.param(50, marks=pytest.mark.slow)])
def test_any_chunking_gives_the_same_motion(stream, times):
    rng = np.random.default_rng(1)
    audio = speech(0.4)
    whole = stream.restarted(3)
    rotations, root = joined([whole.push(audio), whole.finish()])
    assert np.ptp(rotations, axis=0).max() > 1e-3
    for _ in range(times):
        one = stream.restarted(3)
        cuts = np.sort(rng.integers(0, len(audio), rng.integers(0, 20)))
        parts = [one.push(piece) for piece in np.split(audio, cuts)]
        again = joined([*parts, one.finish()])
        np.testing.assert_array_equal(again[0], rotations)
        np.testing.assert_array_equal(again[1], root)


def test_one_push_is_the_offline_motion(stream):
    audio = speech(0.7)
    own = stream.restarted(2)
    rotations, root = joined([own.push(audio[:1000]), own.push(audio[1000:]), own.finish()])
    offline = stream_offline(stream.run, audio, RATE, 2)
    np.testing.assert_array_equal(offline.rotations, rotations)
    np.testing.assert_array_equal(offline.root, root)
    other = stream.restarted(4)
    assert np.abs(joined([other.push(audio), other.finish()])[0] - rotations).max() > 1e-4


@pytest.mark.parametrize("count", [0, 100, 801, 12345, 48000])
def test_as_many_frames_as_the_speech_is_long(stream, count):
    one = stream.restarted(0)
    frames = one.push(speech(2.0)[:count]).frames + one.finish().frames
    assert frames == round(count / RATE * stream.fps)


def test_frames_arrive_within_the_stated_latency(stream):
    """Frame k is there once the samples of its time plus the latency are."""
    one = stream.restarted(0)
    size, frames = RATE // 100, 0
    for number in range(1, 300):
        frames += one.push(speech(0.01, number)).frames
        ready = number * size / RATE - stream.latency.total
        assert frames >= np.floor(ready * stream.fps)
    assert frames > 0


def held(value, found=None):
    """Bytes of all arrays, and the number of all items, of an object's state."""
    found = found if found is not None else {}
    if isinstance(value, np.ndarray | jax.Array):
        found[id(value)] = value.nbytes
        if isinstance(value, np.ndarray) and value.base is not None:
            found[id(value.base)] = getattr(value.base, "nbytes", 0)
    elif isinstance(value, dict):
        [held(one, found) for one in value.values()]
    elif isinstance(value, str | bytes | int | float | Run) or value is None:
        found[id(value), type(value)] = 1
    elif hasattr(value, "__iter__"):
        [held(one, found) for one in value]
    elif hasattr(value, "__dict__"):
        held(vars(value), found)
    return found


def test_memory_is_bounded(stream):
    one = stream.restarted(0)
    sizes = []
    for number in range(60):
        one.push(speech(0.1, number))
        sizes.append(sum(held([one._features, one._poses._kept, one._poses._state, one._feet]).values()))
    assert max(sizes[30:]) <= max(sizes[:30]) + 5_000
    assert max(sizes) < 20_000_000


def test_poses_after_ten_hours_are_as_those_of_the_first_second(stream):
    """The number of the frame is exact in the compiled program, and noise is drawn for it."""
    program = stream._program
    window = np.random.default_rng(0).normal(size=(program.rows, stream.run.config.mel.width)).astype(np.float32)
    key, state = program.begin(3)
    late = 36000 * 30 // program.hop * program.hop
    spread = []
    for frame in (0, late, late + program.hop, 20 * late):
        poses, _ = program.advance(key, state, window, frame)
        assert np.isfinite(poses).all()
        spread.append(poses)
    for other in spread[1:]:
        assert 1e-6 < np.abs(other - spread[0]).max() < 5.0
    assert np.abs(spread[1] - spread[2]).max() > 1e-6


COMPILED = []
jax.monitoring.register_event_duration_secs_listener(
    lambda name, seconds, **_: COMPILED.append(name) if "compile" in name else None
)


def test_nothing_is_compiled_after_the_warm_up(toy_run_config):
    run = windowed_run(toy_run_config())
    one = Stream(run, 44100)
    COMPILED.clear()
    one.warm_up()
    assert COMPILED
    COMPILED.clear()
    for number in range(30):
        one.push(speech(0.1 + 0.01 * number, number, 44100))
    one.finish()
    other = one.restarted(7)
    other.push(speech(1.0, 1, 44100))
    assert not COMPILED


def test_the_poses_are_those_of_the_whole_motion(stream):
    """Same features, same key: what streaming changes is the features, the root and the legs alone."""
    run = stream.run
    features = clip("6d", 90)[1] if run.config.mel == MEL else None
    if features is None:
        rng = np.random.default_rng(0)
        features = rng.normal(-20.0, 10.0, (90, run.config.mel.width)).astype(np.float32)
    (whole,) = Engine(run, 128).rows(Condition(features), 1, seed=5)
    quiet = np.full(features.shape[1], features.min(), np.float32)
    poses = Poses(stream._program, quiet, 5)
    found = [poses.push(row) for row in np.concatenate([features, np.repeat(quiet[None], 200, axis=0)])]
    rows = np.concatenate([one for one in found if one is not None])[: len(features)]
    np.testing.assert_allclose(rows, whole, atol=2e-4)


def test_a_shorter_lookahead_is_a_shorter_latency():
    run = run_of("6d")
    assert PoseProgram(run, 3, 0).lookahead == 0
    assert PoseProgram(run, 3, 1000).lookahead == PoseProgram(run, 3).lookahead == 2
    near, far = Stream(run, RATE, lookahead=0.0).latency, Stream(run, RATE).latency
    assert Stream(run, RATE, hop=1.0).latency.hop > far.hop
    assert near.total == pytest.approx(far.total - 2 / 30)


def test_bad_samples_are_one_line_and_change_nothing(stream):
    audio = speech(0.5)
    one, other = stream.restarted(0), stream.restarted(0)
    bad = audio.copy()
    bad[7] = np.nan
    parts = [one.push(audio[:9000])]
    for samples, message in ((bad, "sample 7 is NaN"), (np.stack([audio, audio]), "2 channels"), ("x", "numbers")):
        with pytest.raises(InputError, match=message) as caught:
            one.push(samples)
        assert "\n" not in str(caught.value)
    parts += [one.push(audio[9000:]), one.finish()]
    np.testing.assert_array_equal(joined(parts)[0], joined([other.push(audio), other.finish()])[0])
    for call in (lambda: one.push(audio), one.finish):
        with pytest.raises(InputError, match="finished"):
            call()


def test_integers_are_scaled(stream):
    audio = (speech(0.5) * 20000).astype(np.int16)
    one, other = stream.restarted(0), stream.restarted(0)
    same = joined([one.push(audio), one.finish()])[0], joined([other.push(audio / 32768), other.finish()])[0]
    np.testing.assert_array_equal(*same)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"sample_rate": 4000}, "sample_rate: expected"),
        ({"sample_rate": 44100.5}, "sample_rate: expected"),
        ({"sample_rate": float("nan")}, "sample_rate: expected"),
        ({"seed": -1}, "seed: expected"),
        ({"lookahead": -1.0}, "lookahead: expected"),
        ({"lookahead": float("nan")}, "lookahead: expected"),
        ({"hop": 0.0}, "hop: expected"),
        ({"temprature": 1.0}, "no sampling setting 'temprature'"),
        ({"temperature": -1.0}, "temperature: expected"),
    ],
)
def test_bad_settings(settings, message):
    with pytest.raises(InputError, match=message):
        Stream(run_of("6d"), **settings)


def test_runs_that_cannot_be_generated_live():
    with pytest.raises(InputError, match="no skeleton"):
        Stream(run_of("directions"))
    run = run_of("6d")
    rows, width = run.config.space.shape
    gains = Dynamics(
        *[np.zeros((rows, width))] * 3, *[np.zeros(rows)] * 2, *[np.zeros((6, rows, 2))] * 2, *[np.zeros(2)] * 2
    )
    with pytest.raises(InputError, match="gains that need the whole motion"):
        Stream(dataclasses.replace(run, dynamics=gains))
    classifier = find_model("emotion_classifier")
    config = dataclasses.replace(
        run.config, model="emotion_classifier", model_config=classifier.presets["tiny"], sampling=None,
        corpus={**run.config.corpus, "emotions": ["a", "b"]},
    )  # fmt: skip
    with pytest.raises(InputError, match="generates no motion"):
        Stream(dataclasses.replace(run, config=config))


def test_requests_hold_over_the_stream():
    """A curve of a control is that of the frames' times, however long the stream is."""
    run = run_of("6d", ("height",))
    audio = speech(1.0)
    low, high = (stream_offline(run, audio, RATE, controls=(text,)).rotations for text in ("height=0.1", "height=0.9"))
    later = stream_offline(run, audio, RATE, controls=("height=0.1@0,0.1@0.6,0.9@0.7",)).rotations
    assert np.abs(low - high).max() > 1e-4
    np.testing.assert_allclose(later[:9], low[:9], atol=1e-5)
    assert np.abs(later[22:] - low[22:]).max() > 1e-4
