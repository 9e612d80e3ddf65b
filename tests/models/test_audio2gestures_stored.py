"""Motion-specific codes of training clips in place of the mapping net's, at the rate of a code with long steps."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from audio2gestures_for_tests import BANDS, CONFIG, DATA, MAPPING, make_params

from a2g_jax.data.batch import Batch
from a2g_jax.models.audio2gestures.codec import Codec
from a2g_jax.models.audio2gestures.model import build, draw_codes
from a2g_jax.models.audio2gestures.sampling import Audio2GesturesSampling
from a2g_jax.models.base import Condition
from a2g_jax.training.state import joint_loss
from tests.arrays_for_tests import on_device

SIZE, STEPS = 8, 4
STORED = replace(
    CONFIG,
    **{name: 0.0 for name in MAPPING if name.endswith("_weight")},
    sampled_rotation_weight=0.0,
    sampled_speed_weight=0.0,
    specific_frames=SIZE,
    specific_jitter=3,
    smoothing=1,
    stored_codes=True,
    clip_frames=STEPS * SIZE,
    relative_losses=True,
)
MODEL = build(STORED, DATA)
#: Every value of a step of a training clip is its number.
NUMBERED = {
    "specific_code": jnp.broadcast_to(
        (10.0 * jnp.arange(6)[:, None] + jnp.arange(STEPS)[None])[..., None], (6, STEPS, STORED.code_channels)
    ).astype(jnp.float16)
}


@pytest.fixture(scope="module")
def params():
    return make_params(model=MODEL)


def clips(count=3, frames=STEPS * SIZE, dtype=np.float32):
    rng = np.random.default_rng(1)
    pose = np.cumsum(rng.normal(scale=0.1, size=(count, frames, *DATA.pose_statistics.mean.shape)), axis=1) + 1.0
    return Batch(on_device(rng.normal(size=(count, frames, BANDS)), dtype), on_device(pose, dtype))


def drawn(params, sampling, key, start=0, frames=256):
    """The specific code of a window in the steps of which it consists."""
    codec = Codec(STORED, DATA)

    @jax.jit
    def draw(params, key, start):
        shared = codec.encode_audio(params, jnp.zeros((1, frames, BANDS)))
        return draw_codes(codec, sampling, params, NUMBERED, key, shared, start)[1]

    code = draw(params, key, jnp.int32(start))
    # Between the centres of two equal steps nothing is interpolated.
    return np.asarray(code)[0, SIZE // 2 :: SIZE, 0]


@pytest.mark.parametrize("redraw", [0, 1, 64])
def test_codes_are_those_of_training_clips_from_beginning_to_end(params, redraw):
    code = drawn(params, Audio2GesturesSampling(redraw_frames=redraw), jax.random.key(0))
    middle = np.round((code[1:-1] - code[1:-1] % 10) / 10)
    assert len(code) == 32
    assert set(middle) <= set(range(6))
    firsts = code[::STEPS] // 10
    followed = np.diff(firsts) % 6 == 1
    # One clip of the split after another; with redrawing after every clip, or after every two.
    if redraw == 0:
        assert followed.all()
    else:
        assert not followed.all()
    if redraw == 64:
        assert followed[::2].all()


def test_windows_and_keys(params):
    sampling = Audio2GesturesSampling(redraw_frames=1)
    whole = drawn(params, sampling, jax.random.key(0), -128, 512)
    np.testing.assert_array_equal(drawn(params, sampling, jax.random.key(0), 0, 256)[1:-1], whole[17:47])
    assert (drawn(params, sampling, jax.random.key(1), -128, 512) != whole).any()


def test_scale_of_the_noise_is_that_of_the_code_about_its_mean(params):
    first = drawn(params, Audio2GesturesSampling(redraw_frames=1), jax.random.key(0))
    calm = drawn(params, Audio2GesturesSampling(redraw_frames=1, noise_scale=0.5), jax.random.key(0))
    mean = float(np.mean(np.asarray(NUMBERED["specific_code"], np.float32)))
    np.testing.assert_allclose(calm, mean + 0.5 * (first - mean), rtol=1e-3, atol=0.05)


def test_windows_give_the_motion_of_one_pass(params):
    audio = np.random.default_rng(8).normal(size=(512, BANDS)).astype(np.float32)
    summary = {"specific_code": on_device(np.random.default_rng(3).normal(size=(5, STEPS, 4)), jnp.float16)}

    @jax.jit
    def sample(audio, key, start):
        return MODEL.sample(params, summary, key, MODEL.condition(params, {}, Condition(audio)), start)

    key = jax.random.key(0)
    whole = np.asarray(sample(audio, key, jnp.int32(0)))
    window = np.asarray(sample(audio[128:], key, jnp.int32(128)))
    np.testing.assert_allclose(window[MODEL.halo :], whole[128 + MODEL.halo :], atol=2e-5)
    assert np.abs(np.asarray(sample(audio, jax.random.key(1), jnp.int32(0))) - whole).mean() > 0.01
    assert np.abs(np.asarray(sample(audio[::-1], key, jnp.int32(0))) - whole).mean() > 1e-3


def test_the_summary_holds_the_code_of_every_clip(params):
    batch = clips()
    summary = jax.jit(MODEL.summarise)(params, jax.random.key(0), batch)
    code = jax.jit(Codec(STORED, DATA).encode_motion)(params, batch.pose)[1].mean
    assert summary["specific_code"].dtype == jnp.float16
    np.testing.assert_allclose(summary["specific_code"], code, atol=2e-2, rtol=1e-2)


def test_codes_of_other_clips_serve_the_losses_on_random_codes(params):
    def terms(config):
        loss = jax.jit(joint_loss(build(config, DATA).stages[0]))
        return loss(params, jax.random.key(0), clips(), jnp.int32(9))[1]

    assert "mapping_net" not in params
    assert "bicycle" not in terms(STORED)
    found = terms(replace(STORED, bicycle_weight=0.1, relaxed_weight=1.0))
    assert found["bicycle"] > 0
    assert found["relaxed"] > 0
    assert found["diversity"] < 0
