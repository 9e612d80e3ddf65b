"""EmotionGesture in generation: chunks, windows, seed poses, seams and emotions."""

from dataclasses import replace
from functools import cache

import jax
import numpy as np
import pytest
from emotion_gesture_for_tests import CONFIG, EMOTIONS, JOINTS, make_data, make_params

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig
from a2g_jax.features.statistics import Statistics
from a2g_jax.generation.controls import control_rows
from a2g_jax.generation.engine import Engine
from a2g_jax.models.base import Condition
from a2g_jax.models.emotion_gesture.chunks import seam
from a2g_jax.models.emotion_gesture.model import build
from a2g_jax.models.emotion_gesture.sampling import EmotionGestureSampling
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.run import Run, RunConfig

FRAMES = 300
#: Seams are left as generated, and chunks are not a divisor of the windows.
CHUNKS = replace(CONFIG, clip_frames=13)
PLAIN = EmotionGestureSampling()
#: A named emotion, and several over time.
NAMED = EmotionGestureSampling("anger")
OVER_TIME = EmotionGestureSampling("neutral@0,anger@12.5,happiness@15")
#: Labels in place of emotion features.
LABELS = replace(CHUNKS, branches="label")


def make_run(sampling=PLAIN, config=CHUNKS):
    """A run with drawn weights, and a summary of ten rest poses."""
    data = make_data()
    random = np.random.default_rng(1)
    params = jax.tree.map(np.asarray, make_params(build(config, data)))
    summary = {
        "rest_pose": random.normal(size=(10, JOINTS, 6)).astype(np.float16),
        "rest_speed": random.uniform(size=10).astype(np.float32),
    }
    bands = data.audio_bands
    statistics = {
        "audio": Statistics(np.zeros(bands, np.float32), np.ones(bands, np.float32)),
        "pose": data.pose_statistics,
        "root": Statistics(np.zeros(3, np.float32), np.ones(3, np.float32)),
    }
    described = RunConfig(
        "emotion_gesture",
        "tiny",
        config,
        TrainConfig(),
        15.0,
        MelConfig(bands=bands // data.spectra, stack=data.spectra),
        data.space,
        statistics,
        {"emotions": list(EMOTIONS), "speakers": [], "fingerprint": ""},
        sampling=sampling,
    )
    return Run(described, params, summary, 0)


@pytest.fixture(scope="module")
def audio():
    return np.random.default_rng(2).normal(size=(FRAMES, 12)).astype(np.float32)


@cache
def base_run(config):
    """A run that others differ from in sampling settings alone."""
    return make_run(config=config)


@cache
def engine(sampling, config, window):
    """The window loop; made once for all tests. Those of named emotions share the programs of labels."""
    run = base_run(config)
    like = engine(EmotionGestureSampling("label"), config, window) if sampling.names_emotions else None
    return Engine(replace(run, config=replace(run.config, sampling=sampling)), window, like)


def rows(audio, sampling=PLAIN, samples=1, config=CHUNKS, window=128, **given):
    """Motions by the window loop."""
    return np.stack(list(engine(sampling, config, window).rows(Condition(audio, **given), samples, 0)))


@cache
def chunk_programs():
    """The reconstruction of one clip, in which sampling settings have no part, and the poses that are valid."""
    config = make_run().config
    return jax.jit(config.build().reconstruct), jax.jit(config.space.valid)


def constant(emotion):
    """Weights of one emotion in all frames."""
    return np.tile(np.eye(3, dtype=np.float32)[EMOTIONS.index(emotion)], (FRAMES, 1))


@pytest.mark.parametrize(
    "sampling",
    [EmotionGestureSampling("sample"), OVER_TIME, pytest.param(PLAIN, marks=pytest.mark.slow)],
    ids=lambda s: s.emotion,
)
def test_windows_of_any_size_agree(audio, sampling):
    """Those of the audio's own emotion are also compared with a loop over chunks, below."""
    small, large = rows(audio, sampling, window=128), rows(audio, sampling, window=384)
    assert small.shape == (1, FRAMES, JOINTS, 6)
    # Rounding grows from chunk to chunk: each begins with the poses of the one before.
    np.testing.assert_allclose(small, large, atol=1e-3)


def continued(earlier, last, new, frames):
    """The chunk plus the cubic polynomial of least degree that has the values and slopes of both ends."""
    before, after = last - earlier, new[1] - new[0]
    gap, slope = last + (before + after) / 2 - new[0], (before - after) / 2
    # Coefficients of 1, t, t^2, t^3 from value and slope at 0 and at the last frame.
    end = float(frames)
    system = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [1, end, end**2, end**3], [0, 1, 2 * end, 3 * end**2]])
    cubic = np.linalg.solve(system, np.stack([gap, slope, 0 * gap, 0 * gap]).reshape(4, -1))
    rows = min(frames, len(new))
    powers = np.arange(rows)[:, None] ** np.arange(4)[None]
    joined = new.copy()
    joined[:rows] += (powers @ cubic).reshape(rows, *new.shape[1:])
    return joined


def test_a_seam_has_no_step_of_place_or_speed():
    """A chunk that jumps away from the poses before it; and one that continues them is left as it is."""
    time = np.arange(40)[:, None] / 15.0
    whole = np.concatenate([np.sin(3 * time), np.cos(2 * time)], axis=1).astype(np.float32)
    joining = jax.jit(seam, static_argnums=2)
    seed, jumped = whole[:10], whole[10:] + 0.5
    steps = lambda new: np.abs(np.diff(np.concatenate([seed, new]), 2, axis=0))  # noqa: E731
    assert steps(jumped)[8:10].max() > 0.4
    joined = jumped + np.asarray(joining(seed, jumped, 10))
    assert steps(joined).max() < 0.05
    np.testing.assert_allclose(joined[10:], jumped[10:], atol=1e-6)
    assert np.abs(joining(seed, whole[10:], 10)).max() < 0.08
    line = np.arange(12, dtype=np.float32)[:, None]
    np.testing.assert_allclose(joining(line[:4], line[4:], 5), 0.0, atol=1e-6)


@pytest.mark.parametrize("sampling", [EmotionGestureSampling(seam_frames=0), PLAIN], ids=lambda s: s.seam_frames)
def test_it_is_the_chunks_one_after_another(audio, sampling):
    """The window loop against a loop over chunks: each is a clip that begins with the last poses before it."""
    run, fading = make_run(sampling), sampling.seam_frames
    seeds = np.random.default_rng(4).normal(size=(9, JOINTS, 6)).astype(np.float32)
    ours = rows(audio, sampling, seed_poses=seeds)[0]
    first, chunk = CHUNKS.seed_frames, CHUNKS.stride
    silence = lambda frames: np.full((frames, audio.shape[1]), audio.min(), np.float32)  # noqa: E731
    padded = np.concatenate([silence(first), audio, silence(chunk)])
    statistics = run.config.statistics["pose"]
    last, made = seeds[-first:], []
    reconstruct, valid = chunk_programs()
    for start in range(0, FRAMES, chunk):
        poses = np.concatenate([last, np.zeros((chunk, JOINTS, 6), np.float32)])
        batch = Batch(padded[start : start + CHUNKS.clip_frames][None], poses[None])
        found = statistics.normalise(np.asarray(reconstruct(run.params, batch))[0])
        seed, new = statistics.normalise(last), found[first:].copy()
        if fading:
            new = continued(seed[-2], seed[-1], new, fading)
        new = np.asarray(valid(np.float32(statistics.denormalise(new))))
        last = np.concatenate([last, new])[-first:]
        made.append(new)
    np.testing.assert_allclose(ours, np.concatenate(made)[:FRAMES], atol=2e-4)


def test_samples_do_not_depend_on_their_number_and_differ_by_their_first_pose(audio):
    two, five = rows(audio[:40], samples=2), rows(audio[:40], samples=5)
    np.testing.assert_array_equal(two, five[:2])
    # A tenth of ten poses is one: without drawn emotions all motions are then the same.
    np.testing.assert_allclose(five[0], five[3], atol=1e-6)
    drawn = rows(audio[:40], NAMED, 2)
    assert np.abs(drawn[0] - drawn[1]).max() > 1e-3
    still = rows(audio[:40], replace(NAMED, temperature=0.0), 2)
    np.testing.assert_allclose(still[0], still[1], atol=1e-6)


def test_named_emotions_reach_the_motion_at_their_time(audio):
    neutral = rows(audio, EmotionGestureSampling("label"), emotion=constant("neutral"))[0]
    apart = np.abs(neutral - rows(audio, OVER_TIME)[0]).max(axis=(1, 2))
    change = round(12.5 * 15)
    assert apart[: change - CHUNKS.stride].max() < 1e-6
    assert apart[change + 10 :].min() > 1e-4


def test_named_emotions_share_their_programs(audio):
    """And nothing else does: neither other weights nor settings that are compiled."""
    first = engine(NAMED, CHUNKS, 128)
    named = lambda **changes: replace(first.run, config=first.run.config.with_sampling(**changes))  # noqa: E731
    shares = lambda run, window=128: Engine(run, window, first)._advance is first._advance  # noqa: E731
    (alone,) = Engine(make_run(OVER_TIME), 128).rows(Condition(audio), 1, 0)
    np.testing.assert_array_equal(rows(audio, OVER_TIME)[0], alone)
    assert shares(named(emotion=OVER_TIME.emotion))
    assert shares(named(emotion="label"))
    assert not shares(named(emotion="sample"))
    assert not shares(named(temperature=0.5))
    assert not shares(named(emotion="label"), 256)
    assert not shares(make_run(OVER_TIME))


def test_labels_of_the_caller_and_where_they_are_refused(audio):
    labels, anger = EmotionGestureSampling("label"), constant("anger")
    np.testing.assert_allclose(rows(audio, labels, emotion=anger), rows(audio, NAMED), atol=1e-6)
    # Without labels it is the emotion of the audio.
    np.testing.assert_allclose(rows(audio, labels), rows(audio), atol=1e-6)
    with pytest.raises(InputError, match="emotion_gesture: takes no emotion; it is conditioned on audio, seed_poses"):
        rows(audio, emotion=anger)
    with pytest.raises(InputError, match=r"second 30 is past the end of the speech, which lasts 20.00 s"):
        rows(audio, EmotionGestureSampling("neutral@0,anger@30"))


def test_the_ablation_with_labels_follows_them(audio):
    free, anger, happiness = (
        rows(audio, config=LABELS, emotion=weights) for weights in (None, constant("anger"), constant("happiness"))
    )
    assert np.abs(anger - happiness).max() > 1e-3
    assert np.abs(free - anger).max() > 1e-3
    np.testing.assert_allclose(rows(audio, NAMED, config=LABELS), anger, atol=1e-6)
    controls = control_rows(make_run(config=LABELS), ["emotion=anger"], FRAMES)
    np.testing.assert_array_equal(rows(audio, config=LABELS, controls=controls), anger)


def test_a_motion_without_seed_poses_begins_in_one_of_the_calm_poses(audio):
    summary = make_run().summary
    calm = int(np.argmin(summary["rest_speed"]))
    seeds = np.tile(summary["rest_pose"][calm].astype(np.float32), (CHUNKS.seed_frames, 1, 1))
    np.testing.assert_allclose(rows(audio[:40]), rows(audio[:40], seed_poses=seeds), atol=1e-6)
    with pytest.raises(InputError, match="the seed poses are 3 frames; the run needs 4 or more"):
        rows(audio[:40], seed_poses=seeds[:3])


def test_the_control_is_the_setting(audio):
    """Of equal seeds, as lines of the settings and as an array of the caller."""
    by_setting = rows(audio, OVER_TIME)
    line = f"emotion={OVER_TIME.emotion}"
    by_control = rows(audio, EmotionGestureSampling(controls=(line,)))
    np.testing.assert_allclose(by_control, by_setting, atol=1e-5)
    given = control_rows(make_run(), [line], FRAMES)
    np.testing.assert_array_equal(rows(audio, controls=given), by_control)
    assert np.abs(by_control - rows(audio)).max() > 1e-2


def test_where_the_control_is_free_the_emotion_is_the_speech_s(audio):
    free = rows(audio)
    given = np.full((FRAMES, 1), np.nan, np.float32)
    np.testing.assert_array_equal(rows(audio, controls=given), free)
    given[150:] = EMOTIONS.index("anger")
    found = rows(audio, controls=given)
    np.testing.assert_array_equal(found[:, :140], free[:, :140])
    assert np.abs(found - free)[:, 160:].max() > 1e-2
    assert np.isfinite(found).all()


def test_an_emotion_that_is_chosen_twice_is_refused(audio):
    with pytest.raises(InputError, match=r"--control 'emotion=anger' and --emotion 'neutral': both choose it"):
        EmotionGestureSampling(emotion="neutral", controls=("emotion=anger",))
    with pytest.raises(InputError, match=r"the run's controls are: emotion; 'demo' has rate\."):
        make_run(EmotionGestureSampling(controls=("rate=0.9",))).config.build()
    with pytest.raises(InputError, match="there is no 'angry' in the run; there are: anger, happiness, neutral"):
        make_run(EmotionGestureSampling(controls=("emotion=angry",))).config.build()
    controls = np.zeros((FRAMES, 1), np.float32)
    with pytest.raises(InputError, match="emotion and controls: both choose the emotion"):
        rows(audio, EmotionGestureSampling("label"), emotion=constant("neutral"), controls=controls)
