"""Named controls of Audio2Gestures: stored codes are drawn by the properties of their clips."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from audio2gestures_for_tests import CONFIG, MAPPING
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.features.hand_properties import PROPERTIES
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.models.audio2gestures.model import build
from a2g_jax.models.audio2gestures.sampling import SAMPLING_PRESETS, Audio2GesturesSampling
from a2g_jax.models.audio2gestures.stored import (
    EMOTION,
    HOLD,
    LABELS,
    VALUES,
    clip_parts,
    clip_properties,
    control_names,
    log_weights,
    request,
    stored_steps,
    widened,
)
from a2g_jax.models.base import Data
from a2g_jax.models.control_curves import INCLUDED
from a2g_jax.talker.skeleton import TALKER_SKELETON
from a2g_jax.training.run import demo_run, open_run

SIZE, STEPS, PARTS, CLIPS = 16, 8, 2, 60
STORED = replace(
    CONFIG,
    **{name: 0.0 for name in MAPPING if name.endswith("_weight")},
    sampled_rotation_weight=0.0,
    sampled_speed_weight=0.0,
    specific_frames=SIZE,
    stored_codes=True,
    clip_frames=STEPS * SIZE,
    relative_losses=True,
)
MEAN = np.tile(np.array([1, 0, 0, 0, 1, 0], np.float32), (22, 1))
DATA = Data(PoseSpace(TALKER_SKELETON), 16.0, 5, Statistics(MEAN, np.full_like(MEAN, 0.1)), ("calm", "glad"), ("ada",))
NAMES = (*PROPERTIES, EMOTION)
#: Every value of a step of a clip is its number; clips differ in their properties, parts a little.
CODES = jnp.broadcast_to(
    (100.0 * jnp.arange(CLIPS)[:, None] + jnp.arange(STEPS)[None])[..., None], (CLIPS, STEPS, 2)
).astype(jnp.float32)
VALUE = np.random.default_rng(0).normal(size=(CLIPS, 1, 5)) + 0.1 * np.random.default_rng(1).normal(
    size=(CLIPS, PARTS, 5)
)
SUMMARY = {VALUES: VALUE.astype(np.float16), LABELS: (np.arange(CLIPS) % 3 == 0).astype(np.int8)}
SAMPLING = Audio2GesturesSampling(redraw_frames=2 * SIZE * STEPS)


def rows(frames=4096, **values):
    """Controls of every frame: numbers, or arrays over time."""
    return jnp.stack([jnp.broadcast_to(jnp.float32(values.get(name, np.nan)), (frames,)) for name in NAMES], axis=-1)


@jax.jit
def drawn(key, controls, first=jnp.int32(0)):  # noqa: B008
    weights = log_weights(NAMES, SAMPLING, SUMMARY, controls)
    return stored_steps(key, CODES, SAMPLING, first, len(controls) // SIZE, SIZE, weights)[:, 0]


def places(steps):
    """Clip and step of a code."""
    number = np.round(np.asarray(steps)).astype(int)
    return number // 100, number % 100


def property_of(steps, name):
    """The property of the stored part of each step."""
    clip, step = places(steps)
    return np.asarray(SUMMARY[VALUES], np.float32)[clip, step * PARTS // STEPS, PROPERTIES.index(name)]


KEY = jax.random.key(3)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**31 - 1))
def test_free_controls_leave_every_code_as_it_is(seed):
    key = jax.random.key(seed)
    plain = stored_steps(key, CODES, SAMPLING, jnp.int32(0), 256, SIZE)[:, 0]
    np.testing.assert_array_equal(drawn(key, rows()), plain)


def test_a_free_stretch_keeps_its_codes_beside_a_requested_one():
    requested = jnp.where(jnp.arange(4096) < 2048, jnp.nan, 0.9)
    free, half = drawn(KEY, rows()), drawn(KEY, rows(height=requested))
    np.testing.assert_array_equal(half[:128], free[:128])
    assert (half[128:] != free[128:]).any()


@pytest.mark.parametrize("name", PROPERTIES)
def test_a_request_draws_clips_with_that_property(name):
    quantiles = np.quantile(np.asarray(SUMMARY[VALUES], np.float32)[..., PROPERTIES.index(name)], [0.1, 0.5, 0.9])
    for requested, value in zip((0.1, 0.5, 0.9), quantiles, strict=True):
        found = np.mean(
            [property_of(drawn(jax.random.key(seed), rows(**{name: requested})), name) for seed in range(4)]
        )
        np.testing.assert_allclose(found, value, atol=0.25)


def test_two_requests_count_both_and_an_emotion_as_well():
    steps = drawn(KEY, rows(height=0.75, energy=0.25, emotion=1.0))
    assert property_of(steps, "height").mean() > 0.2
    assert property_of(steps, "energy").mean() < -0.2
    assert np.all(np.asarray(SUMMARY[LABELS])[places(steps)[0]] == 1)
    assert np.all(np.asarray(SUMMARY[LABELS])[places(drawn(KEY, rows(emotion=0.0)))[0]] == 0)


def test_clips_are_drawn_in_proportion_to_their_weights():
    weights = jnp.log(jnp.arange(1.0, 6.0))[None, :, None] * jnp.ones((1, 1, 1))
    sampling = Audio2GesturesSampling(redraw_frames=1)
    codes = jnp.arange(5.0)[:, None, None]
    one = jax.jit(jax.vmap(lambda key: stored_steps(key, codes, sampling, jnp.int32(0), 1, SIZE, weights)[0, 0]))
    counts = np.bincount(np.asarray(one(jax.random.split(KEY, 6000))).astype(int), minlength=5)
    np.testing.assert_allclose(counts / 6000, np.arange(1, 6) / 15, atol=0.025)


def test_windows_draw_what_one_pass_draws():
    curve = rows(height=jnp.interp(jnp.arange(4096), jnp.array([0, 4095]), jnp.array([0.1, 0.9])))
    whole = drawn(KEY, curve)
    for start in (128, 1024):
        window = drawn(KEY, curve[start : start + 2048], start // SIZE)
        np.testing.assert_array_equal(window, whole[start // SIZE : start // SIZE + 128])


def test_a_constant_request_keeps_whole_parts_and_a_curve_follows_in_holds():
    def changes(steps):
        """Steps whose code does not follow the one before it in the same clip."""
        clip, step = places(steps)
        follows = (np.diff(clip) == 0) & (np.diff(step) == 1)
        return np.flatnonzero(~follows) + 1

    still = changes(drawn(KEY, rows(height=0.8)))
    # At the ends of parts alone: whether the clip still fits is decided anew there.
    assert np.all(still % (STEPS // PARTS) == 0)
    rising = changes(drawn(KEY, rows(height=jnp.linspace(0.0, 1.0, 4096))))
    assert np.all((rising % (HOLD // SIZE) == 0) | (rising % (STEPS // PARTS) == 0))


def test_gains_stretch_requests():
    plain = property_of(drawn(KEY, rows(height=0.7)), "height").mean()
    gains = replace(SAMPLING, control_gains=("height=2",))
    weights = log_weights(NAMES, gains, SUMMARY, rows(height=0.7))
    steps = stored_steps(KEY, CODES, gains, jnp.int32(0), 256, SIZE, weights)[:, 0]
    assert property_of(steps, "height").mean() > plain + 0.2


def test_the_gain_of_an_emotion_moves_codes_away_from_the_mean_of_all():
    """By as much again as the mean of its clips lies there; where it is free, codes stay."""
    summary = {**SUMMARY, "specific_code": np.asarray(CODES)}
    labels = jnp.where(jnp.arange(4096) < 2048, jnp.nan, 1.0)
    controls = rows(emotion=labels)
    codes = np.asarray(CODES).mean(axis=1)
    expected = codes[np.asarray(SUMMARY[LABELS]) == 1].mean(axis=0) - codes.mean(axis=0)
    for gain in (1.5, 3.0):
        sampling = replace(SAMPLING, control_gains=(f"{EMOTION}={gain}",))
        requested = request(NAMES, sampling, summary, controls)
        np.testing.assert_allclose(requested.shift[:32], 0.0)
        np.testing.assert_allclose(requested.shift[32:], np.tile((gain - 1.0) * expected, (32, 1)), rtol=1e-3)
        moved = stored_steps(KEY, CODES, sampling, jnp.int32(0), 256, SIZE, *requested)
        plain = stored_steps(KEY, CODES, sampling, jnp.int32(0), 256, SIZE, requested.weights)
        np.testing.assert_allclose(moved - plain, jnp.repeat(requested.shift, HOLD // SIZE, axis=0), atol=1e-2)
    assert request(NAMES, SAMPLING, summary, controls).shift is None


def test_included_runs_have_the_controls_that_messages_name():
    for name, names in INCLUDED.items():
        controls = open_run(name).config.build().controls
        assert set(controls.names) == set(names)


def test_gains_are_those_of_a_run_and_not_of_a_preset():
    """Another run of the preset responds otherwise."""
    assert not any(preset.control_gains for preset in SAMPLING_PRESETS.values())
    assert demo_run().config.sampling_settings.control_gains


def test_the_summary_holds_the_properties_of_every_part():
    pose = np.tile(MEAN, (3, STORED.clip_frames, 1, 1)).astype(np.float32)
    batch = Batch(jnp.zeros((3, STORED.clip_frames, 5)), jnp.asarray(pose), emotion=jnp.array([0, 1, 1]))
    found = clip_properties(STORED, DATA, NAMES, batch)
    assert clip_parts(STORED, DATA) == PARTS
    assert found[VALUES].shape == (3, PARTS, len(PROPERTIES))
    assert found[VALUES].dtype == jnp.float16
    np.testing.assert_array_equal(found[LABELS], [0, 1, 1])
    # A body that stands still in T-pose: no speed, hands at the same height in every part.
    np.testing.assert_array_equal(found[VALUES][..., PROPERTIES.index("energy")], 0)
    assert clip_properties(STORED, DATA, (), batch) == {}


def test_recordings_without_an_emotion_are_no_emotion():
    """An empty name is no category of requests, and its clips are drawn for none of the others."""
    data = DATA._replace(emotions=("", "calm", "glad"))
    controls = build(STORED, data).controls
    assert controls is not None
    assert controls.categories == {EMOTION: ("calm", "glad")}
    with pytest.raises(InputError, match="there is no ''.*there are: calm, glad"):
        build(STORED, data, Audio2GesturesSampling(controls=("emotion=@0",)))
    pose = jnp.asarray(np.tile(MEAN, (3, STORED.clip_frames, 1, 1)), jnp.float32)
    batch = Batch(jnp.zeros((3, STORED.clip_frames, 5)), pose, emotion=jnp.array([0, 1, 2]))
    np.testing.assert_array_equal(clip_properties(STORED, data, NAMES, batch)[LABELS], [-1, 0, 1])
    assert control_names(STORED, data._replace(emotions=("", "calm"))) == PROPERTIES


def test_which_runs_have_which_controls():
    assert control_names(STORED, DATA) == NAMES
    assert control_names(STORED, DATA._replace(emotions=("calm",))) == PROPERTIES
    assert control_names(replace(STORED, stored_codes=False), DATA) == ()
    assert build(STORED, DATA).condition_fields == ("audio", "controls")
    assert build(CONFIG, DATA).condition_fields == ("audio",)


@pytest.mark.parametrize(
    ("config", "controls", "named"),
    [
        (CONFIG, ("energy=0.5",), "trained without --stored-codes"),
        (STORED, ("energy=50",), "for the percentile 50 give 0.5"),
        (STORED, ("power=0.5",), "controls are: energy, height, radius, rate, handedness, emotion"),
        (STORED, ("emotion=joy",), "there are: calm, glad"),
        (STORED, ("emotion=0.5",), "there are: calm, glad"),
        (STORED, ("energy=glad",), "'glad' is not a number"),
        (STORED, ("emotion=calm@3,glad@2",), "ascending order"),
    ],
)
def test_wrong_requests_are_named(config, controls, named):
    with pytest.raises(InputError, match=named):
        build(config, DATA, Audio2GesturesSampling(controls=controls))


def test_several_narrow_requests_leave_a_choice_and_one_is_not_widened():
    rng = np.random.default_rng(0)
    one = jnp.asarray(-0.5 * np.square((rng.uniform(size=2000) - 0.5) / 0.05), jnp.float32)
    none = jnp.zeros(2000)
    np.testing.assert_array_equal(widened(one, none), one)
    corner = jnp.asarray(-0.5 * np.square((rng.uniform(size=(3, 2000)) - 1.0) / 0.05).sum(axis=0), jnp.float32)
    label = jnp.where(jnp.arange(2000) % 4 == 0, 0.0, -30.0)
    for others in (none, label):
        shares = jax.nn.softmax(widened(corner, others) + others)
        assert 24 <= 1 / jnp.sum(shares**2) < 26
        assert jnp.sum(jnp.where(others < 0, shares, 0)) < 1e-6
        assert 1 / jnp.sum(jax.nn.softmax(corner + others) ** 2) < 12
    np.testing.assert_array_equal(widened(none[:6], none[:6]), none[:6])
