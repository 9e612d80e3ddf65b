"""The authors' reductions and command, next to the papers'."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from audio2gestures_for_tests import DATA

from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import BODY_JOINTS
from a2g_jax.models.audio2gestures.config import PRESETS
from a2g_jax.models.audio2gestures.networks import Gaussian
from a2g_jax.models.audio2gestures.objective import weights
from a2g_jax.models.audio2gestures.reductions import make_reductions, smplx_weights
from a2g_jax.talker.skeleton import TALKER_SKELETON

BODY = PoseSpace(TALKER_SKELETON)
AUTHORS = make_reductions("authors", BODY, 0.02, 0.0)
RNG = np.random.default_rng(0)
FIRST, SECOND = (jnp.asarray(RNG.normal(scale=0.3, size=(2, 4, 22, 3)), jnp.float32) for _ in range(2))


def in_55_joints(values):
    """The average of the authors' 55 joints: 15 of each hand at the wrist, eyes and jaw at the head."""
    values = np.asarray(values)
    wrists, head = (BODY_JOINTS.index(name) for name in ("L_Wrist", "Head"))
    right = BODY_JOINTS.index("R_Wrist")
    riders = [values[:, :, [joint]].repeat(count, 2) for joint, count in ((wrists, 15), (right, 15), (head, 3))]
    return np.concatenate([values, *riders], axis=2)


def test_positions_and_speeds_are_means_over_coordinates_of_55_joints():
    first, second = in_55_joints(FIRST), in_55_joints(SECOND)
    assert first.shape[2] == 55
    assert AUTHORS.position(FIRST, SECOND) == pytest.approx(np.abs(first - second).mean(), rel=1e-5)
    steps = np.abs(np.diff(first, axis=1) - np.diff(second, axis=1))
    assert AUTHORS.speed(FIRST, SECOND) == pytest.approx(steps.mean(), rel=1e-5)


def test_joints_that_never_turn_count_as_right():
    paper = make_reductions("paper", BODY, 0.02, 0.0)
    turns = jnp.asarray(np.linalg.qr(RNG.normal(size=(2, 4, 22, 3, 3)))[0], jnp.float32)
    still = jnp.broadcast_to(jnp.eye(3), turns.shape)
    assert AUTHORS.rotation(turns, still) == pytest.approx(float(paper.rotation(turns, still)) * 22 / 55)


def test_relaxed_loss_averages_what_is_above_the_threshold():
    first, second = in_55_joints(FIRST), in_55_joints(SECOND)
    distance = np.abs(first - second)
    assert AUTHORS.relaxed(FIRST, SECOND) == pytest.approx(distance[distance > 0.02].mean(), rel=1e-5)
    assert AUTHORS.relaxed(FIRST, FIRST) == 0.0
    assert np.isfinite(jax.grad(AUTHORS.relaxed)(FIRST, FIRST)).all()


def test_kl_sums_over_time_and_averages_over_channels():
    mean = jnp.asarray(RNG.normal(size=(2, 8, 5)), jnp.float32)
    expected = 0.5 * np.square(mean).sum(axis=1).mean()
    assert AUTHORS.kl(Gaussian(mean, jnp.zeros_like(mean))) == pytest.approx(expected, rel=1e-5)


def test_a_body_without_wrists_and_head_is_averaged_evenly():
    np.testing.assert_array_equal(smplx_weights(DATA.space), np.ones(DATA.space.rows))


def test_the_authors_command():
    """Weights and schedule of the command in their documentation, with the KL ramp that falls back every 100,000."""
    at = weights(PRESETS["authors"])
    first = at(jnp.int32(0))
    assert float(first["kl_shared"]) == pytest.approx(1e-3 * 1e-4)
    assert float(at(jnp.int32(50_000))["kl_specific"]) == pytest.approx(0.5e-3)
    assert float(at(jnp.int32(150_000))["kl_specific"]) == pytest.approx(0.5e-3)
    assert float(at(jnp.int32(250_000))["diversity"]) == pytest.approx(0.05)
    expected = {"rotation": 1, "position": 1, "speed": 1, "relaxed": 1, "sampled_rotation": 1, "sampled_speed": 5}
    expected |= {"alignment": 0.1, "bicycle": 0.1, "bicycle_shared": 0.1}
    for name, value in expected.items():
        assert float(first[name]) == pytest.approx(value), name
    assert (PRESETS["authors"].clip_frames, PRESETS["authors"].diversity_reference) == (64, "transfer")
