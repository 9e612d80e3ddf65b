"""Flow layers: inverses, log-determinants against autodiff, densities, and sampling frame by frame."""

from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads
from scipy import integrate, stats

from a2g_jax.nn.flow.actnorm import actnorm, actnorm_inverse, actnorm_log_det, fit_actnorm, init_actnorm
from a2g_jax.nn.flow.coupling import Shape, coupling, init_coupling
from a2g_jax.nn.flow.glow import (
    first_states,
    fit_glow,
    glow,
    glow_inverse,
    glow_inverse_step,
    init_glow,
    prepare,
    project,
)
from a2g_jax.nn.flow.invertible import (
    FIXED,
    init_invertible,
    inverse_weight,
    invertible,
    invertible_log_det,
    weight,
)
from a2g_jax.nn.flow.priors import log_prob, spread
from tests.arrays_for_tests import on_device

KEY = jax.random.key(0)
CELLS = ("gru", "lstm")


def shape_of(cell="gru", channels=5, hidden=6, exact=False):
    return Shape(channels, history=7, condition=4, hidden=hidden, layers=2, cell=cell, exact=exact)


#: One program each for parameters, latents and motions of a shape; compiled operation by operation, they take longer.
INIT, FIT = jax.jit(init_glow, static_argnums=(1, 2)), jax.jit(fit_glow, static_argnums=1)
GLOW, INVERSE = jax.jit(glow, static_argnums=1), jax.jit(glow_inverse, static_argnums=1)


@cache
def initial(shape, steps):
    """Parameters of a flow before training, in single precision on the host."""
    with jax.enable_x64(False):
        return jax.device_get(INIT(KEY, shape, steps))


def clips(shape, count=2, frames=9, seed=1):
    random = np.random.default_rng(seed)
    sizes = (shape.channels, shape.history, shape.condition)
    return tuple(on_device(random.normal(size=(count, frames, size)), jnp.float32) for size in sizes)


def trained(params, scale=0.3, seed=2):
    """Weights as far from their start as training takes them; what is fixed stays."""
    random = np.random.default_rng(seed)

    def moved(path, leaf):
        fixed = any(getattr(part, "key", None) in FIXED for part in path)
        leaf = np.asarray(leaf)
        return on_device(leaf if fixed else leaf + (scale * random.normal(size=leaf.shape)).astype(leaf.dtype))

    return jax.tree_util.tree_map_with_path(moved, params)


@pytest.fixture
def double():
    with jax.enable_x64(True):
        yield


def as_double(tree):
    return jax.tree.map(lambda a: on_device(np.asarray(a, np.float64)), tree)


class TestActnorm:
    def test_fitted_it_standardises(self):
        x = 3.0 + 5.0 * jax.random.normal(KEY, (4, 50, 3))
        y = actnorm(fit_actnorm(x), x)
        np.testing.assert_allclose(y.mean(axis=(0, 1)), 0, atol=1e-5)
        np.testing.assert_allclose(y.std(axis=(0, 1)), 1, atol=1e-5)
        np.testing.assert_allclose(actnorm_inverse(fit_actnorm(x), y), x, atol=1e-4)

    def test_is_the_identity_before(self):
        x = jax.random.normal(KEY, (4, 3))
        np.testing.assert_array_equal(actnorm(init_actnorm(3), x), x)

    def test_log_determinant(self):
        params = trained(init_actnorm(4))
        jacobian = np.asarray(jax.jit(jax.jacfwd(partial(actnorm, params)))(jnp.arange(4.0)))
        np.testing.assert_allclose(actnorm_log_det(params), np.linalg.slogdet(jacobian)[1], rtol=1e-5)


class TestInvertible:
    def test_starts_as_a_rotation(self):
        w = np.asarray(jax.jit(lambda key: weight(init_invertible(key, 6)))(KEY))
        np.testing.assert_allclose(w @ w.T, np.eye(6), atol=1e-5)

    @pytest.mark.parametrize("channels", [1, 2, 7])
    def test_inverse_and_log_determinant(self, channels):
        params = trained(jax.jit(init_invertible, static_argnums=1)(KEY, channels))
        found = jax.jit(lambda p: (weight(p), inverse_weight(p), invertible_log_det(p)))(params)
        matrix, inverse, log_det = map(np.asarray, found)
        np.testing.assert_allclose(inverse, np.linalg.inv(matrix), rtol=1e-3, atol=1e-4)
        np.testing.assert_allclose(log_det, np.linalg.slogdet(matrix)[1], rtol=1e-4, atol=1e-5)

    def test_what_is_fixed_has_no_gradient(self):
        gradient = jax.jit(jax.grad(lambda p: invertible(p, jnp.ones((2, 5))).sum()))(
            jax.jit(init_invertible, static_argnums=1)(KEY, 5)
        )
        for name, values in gradient.items():
            assert np.any(values != 0) == (name not in FIXED), name


class TestCoupling:
    @pytest.mark.parametrize("cell", CELLS)
    def test_at_first_scales_by_the_same_amount(self, cell):
        shape = shape_of(cell)
        x, history, condition = clips(shape)
        found = jax.jit(lambda key: coupling(init_coupling(key, shape), shape, x, history, condition))(KEY)
        x, y, log_det = map(np.asarray, (x, *found))
        np.testing.assert_array_equal(y[..., :2], x[..., :2])
        np.testing.assert_allclose(y[..., 2:], 0.880798 * x[..., 2:], rtol=1e-5)
        np.testing.assert_allclose(log_det, 3 * np.log(0.880798), rtol=1e-4)

    def test_exact_is_the_identity_at_first(self):
        shape = shape_of(exact=True)
        x, history, condition = clips(shape)
        found = jax.jit(lambda key: coupling(init_coupling(key, shape), shape, x, history, condition))(KEY)
        x, y, log_det = map(np.asarray, (x, *found))
        np.testing.assert_allclose(y, x, atol=1e-6)
        np.testing.assert_allclose(log_det, 0, atol=1e-6)


class TestGlow:
    @pytest.mark.parametrize("cell", CELLS)
    @pytest.mark.parametrize("state", ["at first", "fitted", "trained"])
    def test_sixteen_steps_invert_in_single(self, cell, state):
        shape = shape_of(cell, channels=9)
        x, history, condition = clips(shape, frames=20)
        params = self.params(shape, 16, state, x, history, condition)
        z, _ = GLOW(params, shape, x, history, condition)
        back = INVERSE(params, shape, z, history, condition)
        np.testing.assert_allclose(back, x, atol=1e-4)

    @pytest.mark.parametrize("state", ["at first", "trained"])
    def test_sixteen_steps_invert_in_double(self, double, state):
        shape = shape_of(channels=9)
        x, history, condition = as_double(clips(shape, frames=20))
        params = as_double(self.params(shape, 16, state, x, history, condition))
        z, _ = GLOW(params, shape, x, history, condition)
        back = INVERSE(params, shape, z, history, condition)
        np.testing.assert_allclose(back, x, atol=1e-10)

    @pytest.mark.parametrize("cell", CELLS)
    def test_log_determinant_is_that_of_the_jacobian(self, double, cell):
        shape = shape_of(cell, channels=4)
        x, history, condition = as_double(clips(shape, count=1, frames=5))
        params = trained(as_double(initial(shape, 3)))
        _, log_det = GLOW(params, shape, x, history, condition)
        # jacrev: the recurrent layers have no forward-mode derivative.
        latents = lambda v: glow(params, shape, v.reshape(x.shape), history, condition)[0].ravel()  # noqa: E731
        jacobian = np.asarray(jax.jit(jax.jacrev(latents))(x.ravel()))
        np.testing.assert_allclose(np.sum(log_det), np.linalg.slogdet(jacobian)[1], rtol=1e-8)

    def test_later_frames_do_not_reach_back(self):
        shape = shape_of()
        x, history, condition = clips(shape)
        params = trained(initial(shape, 2))
        later = np.asarray(x) + (np.arange(x.shape[1]) >= 5).astype(np.float32)[None, :, None]
        z, log_det = map(np.asarray, GLOW(params, shape, x, history, condition))
        other, other_log_det = map(np.asarray, GLOW(params, shape, later, history, condition))
        np.testing.assert_array_equal(other[:, :5], z[:, :5])
        np.testing.assert_array_equal(other_log_det[:, :5], log_det[:, :5])

    @pytest.mark.parametrize("cell", CELLS)
    def test_frame_by_frame_is_the_same(self, cell):
        shape = shape_of(cell)
        z, history, condition = clips(shape)
        params = trained(initial(shape, 4))
        expected = INVERSE(params, shape, z, history, condition)

        @jax.jit
        def frame_by_frame(params, z, history, condition):
            prepared = prepare(params)

            def step(states, frame):
                x, states = glow_inverse_step(prepared, shape, *frame, states)
                return states, x

            frames = (z, history, project(prepared, condition))
            frames = jax.tree.map(lambda a: jnp.swapaxes(a, 0, 1), frames)
            return jnp.swapaxes(jax.lax.scan(step, first_states(prepared, shape, len(z)), frames)[1], 0, 1)

        np.testing.assert_allclose(frame_by_frame(params, z, history, condition), expected, atol=2e-5)

    def test_fitted_latents_are_standardised_by_every_actnorm(self):
        shape = shape_of(exact=True)
        x, history, condition = clips(shape, count=8, frames=40)
        x = 4.0 * np.asarray(x) + 2.0
        params = FIT(initial(shape, 3), shape, x, history, condition)
        z, _ = GLOW(params, shape, x, history, condition)
        # Rotations of standardised channels: their overall mean square is one.
        np.testing.assert_allclose(np.mean(np.square(z)), 1.0, atol=0.02)

    @pytest.mark.parametrize("freedom", [0.0, 5.0])
    def test_gradient_of_the_likelihood(self, double, freedom):
        shape = shape_of(channels=3, hidden=3)
        x, history, condition = as_double(clips(shape, count=1, frames=3))
        params = trained(as_double(initial(shape, 2)), 0.1)
        free = {name: params[name] for name in ("actnorm", "coupling")}

        @jax.jit
        def loss(free, x):
            z, log_det = glow({**params, **free}, shape, x, history, condition)
            return -jnp.mean(log_prob(z, freedom) + log_det)

        check_grads(loss, (free, x), order=1, modes=["rev"], eps=1e-6, atol=1e-6, rtol=1e-6)

    @staticmethod
    def params(shape, steps, state, x, history, condition):
        params = initial(shape, steps)
        if state == "fitted":
            return FIT(params, shape, x, history, condition)
        return trained(params, 0.1) if state == "trained" else params


class TestPriors:
    def test_student_is_scipys(self):
        z = np.random.default_rng(0).normal(size=(6, 4))
        expected = stats.multivariate_t(np.zeros(4), np.eye(4), df=7).logpdf(z)
        np.testing.assert_allclose(log_prob(on_device(z), 7.0), expected, rtol=1e-4)

    def test_normal_is_scipys(self):
        z = np.random.default_rng(0).normal(size=(6, 4))
        expected = stats.multivariate_normal(np.zeros(4)).logpdf(z)
        np.testing.assert_allclose(log_prob(on_device(z)), expected, rtol=1e-4)

    def test_draws_of_student_have_its_radius(self):
        normal = on_device(np.random.default_rng(0).normal(size=(20000, 3)), jnp.float32)
        z = jax.jit(spread, static_argnums=2)(normal, jax.random.key(1), 5.0)
        # |z|^2 / C is F-distributed.
        assert stats.kstest(np.sum(np.square(np.asarray(z)), axis=-1) / 3, stats.f(3, 5).cdf).pvalue > 0.01

    @pytest.mark.parametrize("freedom", [0.0, pytest.param(50.0, marks=pytest.mark.slow)])
    def test_the_density_of_a_flow_integrates_to_one(self, double, freedom):
        shape = shape_of(channels=2)
        _, history, condition = as_double(clips(shape, count=1, frames=1))
        params = trained(as_double(initial(shape, 3)))
        grid = np.linspace(-40, 40, 601)
        points = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 1, 2)
        repeat = lambda a: np.broadcast_to(a, (len(points), *a.shape[1:]))  # noqa: E731
        z, log_det = GLOW(params, shape, points, repeat(history), repeat(condition))
        density = np.exp(np.asarray(log_prob(z, freedom) + log_det)).reshape(601, 601)
        mass = integrate.trapezoid(integrate.trapezoid(density, grid), grid)
        np.testing.assert_allclose(mass, 1.0, atol=2e-3)


def test_the_gradient_that_computes_steps_again_is_the_same():
    shape = shape_of("lstm")
    params, data = trained(init_glow(KEY, shape, 2)), clips(shape)

    def gradient(recompute):
        def loss(params, x):
            z, log_det = glow(params, shape, x, *data[1:], recompute)
            return (
                jnp.sum(jnp.square(z))
                - jnp.sum(log_det)
                + jnp.sum(glow_inverse(params, shape, x, *data[1:], recompute))
            )

        return jax.jit(jax.grad(loss, (0, 1)))

    plain, again = gradient(False)(params, data[0]), gradient(True)(params, data[0])
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-4), plain, again)
    assert "remat" in str(jax.make_jaxpr(gradient(True))(params, data[0]))
