"""Every loss against a plain NumPy formula, and its gradient against differences, at hard points too."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.rotation import matrix_from_6d
from a2g_jax.models.audio2gestures import losses
from a2g_jax.models.audio2gestures.networks import Gaussian

SHAPE = (2, 4, 3)
WEIGHTS = np.array([1.0, 0.0, 3.0])


@pytest.fixture(autouse=True)
def _double(x64):
    """All of these in double precision, for differences that mean something."""


def positions(seed):
    return np.random.default_rng(seed).normal(scale=0.3, size=(*SHAPE, 3))


def rotations(seed):
    count = int(np.prod(SHAPE))
    return Rotation.random(count, rng=np.random.default_rng(seed)).as_matrix().reshape(*SHAPE, 3, 3)


def codes(seed):
    return np.random.default_rng(seed).normal(size=(2, 4, 5))


def l1(a, b):
    return np.abs(a - b).sum(axis=-1)


def on_arrays(function):
    return lambda *arrays: function(*map(jnp.asarray, arrays))


def assert_gradient(function, *arrays, seed=0, atol=1e-7):
    """The directional derivative by central differences equals the gradient's."""
    random = np.random.default_rng(seed)
    arrays = [jnp.asarray(array) for array in arrays]
    gradient = jax.jit(jax.grad(function, tuple(range(len(arrays)))))(*arrays)
    value = jax.jit(function)
    for _ in range(3):
        directions = [random.normal(size=array.shape) for array in arrays]
        step = 1e-6
        ahead, behind = (
            value(*(array + sign * step * way for array, way in zip(arrays, directions, strict=True)))
            for sign in (1, -1)
        )
        inner = sum(np.sum(np.asarray(g) * way) for g, way in zip(gradient, directions, strict=True))
        np.testing.assert_allclose(inner, (ahead - behind) / (2 * step), atol=atol)


class TestValues:
    def test_rotation(self):
        first, second = rotations(0), rotations(1)
        between = Rotation.from_matrix(np.swapaxes(first, -1, -2).reshape(-1, 3, 3) @ second.reshape(-1, 3, 3))
        angle = between.magnitude().reshape(SHAPE)
        assert on_arrays(losses.rotation_loss)(first, second) == pytest.approx(angle.mean(), abs=1e-12)
        weighted = on_arrays(losses.rotation_loss)(first, second, WEIGHTS)
        assert weighted == pytest.approx((angle[..., 0] + 3 * angle[..., 2]).mean() / 4, abs=1e-12)
        assert on_arrays(losses.rotation_loss)(first, first) == pytest.approx(0, abs=1e-12)

    def test_position(self):
        first, second = positions(0), positions(1)
        distance = l1(first, second)
        assert on_arrays(losses.position_loss)(first, second) == pytest.approx(distance.mean())
        weighted = on_arrays(losses.position_loss)(first, second, WEIGHTS)
        assert weighted == pytest.approx((distance[..., 0] + 3 * distance[..., 2]).mean() / 4)

    def test_equal_joint_weights_are_none(self):
        first, second = positions(0), positions(1)
        for loss in (losses.position_loss, losses.speed_loss):
            assert on_arrays(loss)(first, second, np.full(3, 7.0)) == pytest.approx(on_arrays(loss)(first, second))

    def test_speed(self):
        first, second = positions(0), positions(1)
        distance = l1(first[:, 1:] - first[:, :-1], second[:, 1:] - second[:, :-1])
        assert on_arrays(losses.speed_loss)(first, second) == pytest.approx(distance.mean())
        assert on_arrays(losses.speed_loss)(first, first + 5.0) == pytest.approx(0, abs=1e-12)
        weighted = on_arrays(losses.speed_loss)(first, second, WEIGHTS)
        assert weighted == pytest.approx((distance[..., 0] + 3 * distance[..., 2]).mean() / 4)

    def test_alignment_and_bicycle(self):
        first, second = codes(0), codes(1)
        for loss in (losses.alignment_loss, losses.bicycle_loss):
            assert on_arrays(loss)(first, second) == pytest.approx(np.abs(first - second).mean())

    def test_kl(self):
        mean, log_variance = codes(0), codes(1)
        expected = 0.5 * (np.exp(log_variance) + mean**2 - 1 - log_variance).sum(axis=-1).mean()
        result = losses.kl_loss(Gaussian(jnp.asarray(mean), jnp.asarray(log_variance)))
        assert result == pytest.approx(expected)
        assert result > 0

    def test_kl_by_sampling(self):
        """The closed form is the expectation of the log ratio of the two densities."""
        mean, log_variance = 0.7, -0.4
        noise = np.random.default_rng(0).normal(size=200_000)
        x = mean + np.exp(log_variance / 2) * noise
        ratio = (-0.5 * noise**2 - log_variance / 2) - (-0.5 * x**2)
        result = losses.kl_loss(Gaussian(jnp.full((1, 1, 1), mean), jnp.full((1, 1, 1), log_variance)))
        assert result == pytest.approx(ratio.mean(), abs=0.01)

    def test_kl_is_zero_at_the_standard_normal(self):
        assert losses.kl_loss(Gaussian(jnp.zeros((2, 4, 5)), jnp.zeros((2, 4, 5)))) == 0

    def test_kl_does_not_depend_on_the_length(self):
        mean = codes(0)[:, :1]
        short = losses.kl_loss(Gaussian(jnp.asarray(mean), jnp.zeros_like(mean)))
        long = losses.kl_loss(Gaussian(jnp.asarray(np.repeat(mean, 9, axis=1)), jnp.zeros((2, 9, 5))))
        assert short == pytest.approx(float(long))

    @pytest.mark.parametrize("threshold", [0.0, 0.4, 100.0])
    def test_relaxed(self, threshold):
        first, second = positions(0), positions(1)
        beyond = np.maximum(l1(first, second) - threshold, 0)
        result = losses.relaxed_loss(jnp.asarray(first), jnp.asarray(second), threshold)
        assert result == pytest.approx(beyond.mean())
        weighted = losses.relaxed_loss(jnp.asarray(first), jnp.asarray(second), threshold, jnp.asarray(WEIGHTS))
        assert weighted == pytest.approx((beyond[..., 0] + 3 * beyond[..., 2]).mean() / 4)

    def test_free_nats_are_a_floor_for_each_channel(self):
        mean = np.zeros((2, 4, 5))
        mean[..., 0], mean[..., 1] = 2.0, 0.1
        code = Gaussian(jnp.asarray(mean), jnp.zeros((2, 4, 5)))
        assert losses.kl_loss(code, 0.5) == pytest.approx(2.0 + 4 * 0.5)
        gradient = jax.grad(lambda m: losses.kl_loss(code._replace(mean=m), 0.5))(code.mean)
        assert np.abs(gradient[..., 0]).min() > 0
        np.testing.assert_array_equal(gradient[..., 1:], 0.0)

    def test_spread(self):
        code = codes(0)
        expected = np.maximum(1 - np.sqrt(code.var(axis=(0, 1)) + 1e-4), 0).mean()
        assert on_arrays(losses.spread_loss)(code) == pytest.approx(expected)
        assert on_arrays(losses.spread_loss)(np.full((2, 4, 5), 3.0)) == pytest.approx(0.99)
        assert on_arrays(losses.spread_loss)(10 * code) == 0


class TestGradients:
    @pytest.mark.parametrize("weights", [None, WEIGHTS])
    def test_rotation(self, weights):
        weights = None if weights is None else jnp.asarray(weights)
        assert_gradient(lambda a, b: losses.rotation_loss(a, b, weights), rotations(0), rotations(1))

    def test_rotation_through_gram_schmidt(self):
        six = np.random.default_rng(0).normal(size=(*SHAPE, 6))
        target = jnp.asarray(rotations(1))
        assert_gradient(lambda a: losses.rotation_loss(matrix_from_6d(a), target), six)

    @pytest.mark.parametrize("half_turn", [False, True])
    def test_rotation_at_zero_and_half_a_turn(self, half_turn):
        """A kink with equal slopes on both sides: the difference across it is zero, and so is the gradient."""
        first = np.broadcast_to(np.eye(3), (*SHAPE, 3, 3)) if half_turn else rotations(0)
        second = first @ np.diag([1.0, -1.0, -1.0]) if half_turn else first
        assert_gradient(losses.rotation_loss, first, second, atol=1e-5)
        for gradient in jax.grad(losses.rotation_loss, (0, 1))(jnp.asarray(first), jnp.asarray(second)):
            assert np.linalg.norm(gradient) < 1.5

    def test_rotation_of_parallel_vectors_is_finite(self):
        six = np.random.default_rng(0).normal(size=(*SHAPE, 6))
        six[0, :, 0, 3:] = -2 * six[0, :, 0, :3]
        six[1, :, 1] = 0
        gradient = jax.grad(lambda a: losses.rotation_loss(matrix_from_6d(a), jnp.asarray(rotations(1))))(
            jnp.asarray(six)
        )
        assert np.isfinite(gradient).all()
        assert (np.abs(gradient).sum(axis=-1)[1, :, 0] > 0).all()

    @pytest.mark.parametrize("loss", [losses.position_loss, losses.speed_loss])
    def test_positions(self, loss):
        assert_gradient(loss, positions(0), positions(1))
        assert_gradient(lambda a, b: loss(a, b, jnp.asarray(WEIGHTS)), positions(0), positions(1))

    def test_a_joint_of_weight_zero_gets_no_gradient(self):
        gradient = jax.grad(losses.position_loss)(
            jnp.asarray(positions(0)), jnp.asarray(positions(1)), jnp.asarray(WEIGHTS)
        )
        assert (np.abs(gradient).sum(axis=(0, 1, 3)) > 0).tolist() == [True, False, True]

    @pytest.mark.parametrize("loss", [losses.position_loss, losses.speed_loss])
    def test_equal_positions_are_finite(self, loss):
        same = jnp.asarray(positions(0))
        for gradient in jax.grad(loss, (0, 1))(same, same):
            assert np.isfinite(gradient).all()

    @pytest.mark.parametrize("loss", [losses.alignment_loss, losses.bicycle_loss])
    def test_codes(self, loss):
        assert_gradient(loss, codes(0), codes(1))

    def test_kl(self):
        assert_gradient(lambda m, v: losses.kl_loss(Gaussian(m, v)), codes(0), codes(1))
        zero = jnp.zeros((2, 4, 5))
        for gradient in jax.grad(lambda m, v: losses.kl_loss(Gaussian(m, v)), (0, 1))(zero, zero):
            np.testing.assert_array_equal(gradient, zero)

    def test_spread(self):
        assert_gradient(losses.spread_loss, 0.5 * codes(0))
        constant = jax.grad(losses.spread_loss)(jnp.ones((2, 4, 5)))
        assert np.isfinite(constant).all()

    def test_relaxed(self):
        first, second = positions(0), positions(1)
        for threshold in (0.0, 0.4):
            assert_gradient(lambda a, b, rho=threshold: losses.relaxed_loss(a, b, rho), first, second)

    def test_relaxed_with_nothing_above_the_threshold(self):
        gradient = jax.grad(losses.relaxed_loss)(jnp.asarray(positions(0)), jnp.asarray(positions(1)), 100.0)
        np.testing.assert_array_equal(gradient, np.zeros((*SHAPE, 3)))

    def test_relaxed_with_everything_above_is_the_position_loss(self):
        first, second = jnp.asarray(positions(0)), jnp.asarray(positions(1) + 10)
        np.testing.assert_allclose(
            jax.grad(losses.relaxed_loss)(first, second, 0.002), jax.grad(losses.position_loss)(first, second)
        )
