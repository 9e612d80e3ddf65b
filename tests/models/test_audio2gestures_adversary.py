"""The adversarial stage of Audio2Gestures."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from audio2gestures_for_tests import BANDS, CONFIG, DATA, MAPPING, make_params

from a2g_jax.data.batch import Batch
from a2g_jax.models.audio2gestures.codec import Codec
from a2g_jax.models.audio2gestures.model import build
from a2g_jax.models.judged_motion import judged_motion
from tests.arrays_for_tests import on_device

SIZE = 8
PLAIN = replace(
    CONFIG,
    **{name: 0.0 for name in MAPPING if name.endswith("_weight")},
    sampled_rotation_weight=0.0,
    sampled_speed_weight=0.0,
    specific_frames=SIZE,
    stored_codes=True,
    clip_frames=4 * SIZE,
    relative_losses=True,
)
GAME = replace(PLAIN, adversarial_steps=3, discriminator_channels=(6, 8))
CODEC = Codec(GAME, DATA)
MODEL = build(GAME, DATA)
STAGE = MODEL.stages[-1]


def clips(count=3, frames=4 * SIZE, dtype=np.float32):
    rng = np.random.default_rng(1)
    pose = np.cumsum(rng.normal(scale=0.1, size=(count, frames, *DATA.pose_statistics.mean.shape)), axis=1) + 1.0
    return Batch(on_device(rng.normal(size=(count, frames, BANDS)), dtype), on_device(pose, dtype))


def params_of(dtype=np.float32):
    return make_params(dtype, MODEL)


@pytest.fixture(scope="module")
def params():
    return params_of()


def test_stages_and_what_they_train():
    assert [stage.name for stage in MODEL.stages] == ["main", "adversarial"]
    assert STAGE.steps == 3
    assert [update.trains for update in STAGE.updates] == [("discriminator",), ("decoder",)]
    # Without the stage there is no discriminator.
    assert "discriminator" in jax.eval_shape(MODEL.init, jax.random.key(0))
    assert "discriminator" not in jax.eval_shape(build(PLAIN, DATA).init, jax.random.key(0))


@pytest.mark.parametrize("changes", [{"stored_codes": False}, {"stored_codes": False, "mapping": False}])
def test_codes_may_be_drawn_in_any_way(changes):
    model = build(replace(GAME, **changes), DATA)
    params = make_params(model=model)
    for update in model.stages[-1].updates:
        assert np.isfinite(jax.jit(update.loss)(params, jax.random.key(0), clips(), jnp.int32(0))[0])


@pytest.mark.parametrize("side", [0, 1])
def test_gradient_is_the_numerical_one(side, x64):
    """Of both players, for their own parameters."""
    params, batch = jax.device_get(params_of(np.float64)), clips(dtype=np.float64)
    update = STAGE.updates[side]
    name = update.trains[0]

    def loss(part):
        return update.loss({**params, name: part}, jax.random.key(0), batch, jnp.int32(0))[0]

    value, gradient = jax.jit(loss), jax.device_get(jax.jit(jax.grad(loss))(params[name]))
    random = np.random.default_rng(5)
    way = jax.tree.map(lambda leaf: random.normal(size=leaf.shape), params[name])
    ahead, behind = (value(jax.tree.map(lambda p, w, s=sign: p + s * 1e-7 * w, params[name], way)) for sign in (1, -1))
    inner = sum(jax.tree.leaves(jax.tree.map(lambda g, w: np.sum(g * w), gradient, way)))
    assert abs(inner) > 1e-4
    np.testing.assert_allclose(inner, (ahead - behind) / 2e-7, rtol=1e-3)


def test_terms(params):
    batch, key = clips(), jax.random.key(1)
    loss, terms = jax.jit(STAGE.updates[1].loss)(params, key, batch, jnp.int32(0))
    assert set(terms) == {"adversarial", "matching", "position", "speed", "rotation"}
    expected = GAME.adversarial_weight * terms["adversarial"] + GAME.matching_weight * terms["matching"]
    expected += sum(getattr(GAME, f"{name}_weight") * terms[name] for name in ("position", "speed", "rotation"))
    np.testing.assert_allclose(loss, expected, rtol=1e-5)
    side, terms = jax.jit(STAGE.updates[0].loss)(params, key, batch, jnp.int32(0))
    assert side == terms["discriminator"] > 0


def test_the_discriminator_takes_the_motion_and_not_the_length_of_raw_vectors():
    pose = clips().pose
    first = judged_motion(CODEC.data, pose)
    np.testing.assert_allclose(judged_motion(CODEC.data, 2.0 * pose), first, atol=1e-4)
    still = judged_motion(CODEC.data, jnp.broadcast_to(pose[:, :1], pose.shape))
    places = DATA.space.rows * 3
    np.testing.assert_allclose(still[..., places : 2 * places], 0.0, atol=1e-5)
    assert np.abs(np.asarray(first[..., places : 2 * places])).max() > 0.1
