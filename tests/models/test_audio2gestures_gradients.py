"""Audio2Gestures: the gradient of the whole loss."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from audio2gestures_for_tests import MODEL, TERMS, make_batch, make_params

from a2g_jax.training.state import joint_loss


@pytest.fixture(scope="module")
def double():
    """A function in double precision: params to the gradient of any weighting of the terms, and the terms.

    Parameters and gradients are on the host, where changing them compiles nothing.
    """
    with jax.enable_x64(True):
        batch, params = make_batch(np.float64), jax.device_get(make_params(np.float64))

    def mixed(params, weights):
        total, terms = joint_loss(MODEL.stages[0])(params, jax.random.key(0), batch, jnp.int32(7))
        return sum(weights[name] * terms[name] for name in TERMS) + weights["total"] * total

    function = jax.jit(jax.value_and_grad(mixed))
    return lambda params, weights: jax.device_get(function(params, weights)), params


def unit(*names):
    return {name: np.float64(name in names) for name in (*TERMS, "total")}


class TestGradient:
    def test_every_parameter_gets_one(self, double, x64):
        function, params = double
        gradient = function(params, unit("total"))[1]
        for path, leaf in jax.tree_util.tree_leaves_with_path(gradient):
            assert np.isfinite(leaf).all(), path
            assert np.abs(leaf).max() > 0, path

    # With codes under stop_gradient (the statistics of the noise, the target of the bicycle loss) differences and
    # gradient disagree on purpose: each network is checked on the terms that reach it without them.
    @pytest.mark.parametrize(
        ("network", "terms"),
        [
            ("decoder", ("total",)),
            ("audio_encoder", ("total",)),
            ("mapping_net", tuple(name for name in TERMS if name != "bicycle")),
            ("motion_encoder", ("rotation", "position", "speed", "alignment", "kl_shared")),
        ],
    )
    def test_is_the_numerical_one(self, double, x64, network, terms):
        function, params = double
        weights = unit(*terms)
        gradient = function(params, weights)[1][network]
        random = np.random.default_rng(5)
        way = jax.tree.map(lambda leaf: random.normal(size=leaf.shape), params[network])
        step = 1e-6
        ahead, behind = (
            function(
                params | {network: jax.tree.map(lambda p, w, s=sign: p + s * step * w, params[network], way)}, weights
            )[0]
            for sign in (1, -1)
        )
        expected = (ahead - behind) / (2 * step)
        inner = sum(jax.tree.leaves(jax.tree.map(lambda g, w: np.sum(np.asarray(g) * w), gradient, way)))
        assert abs(expected) > 1e-3
        np.testing.assert_allclose(inner, expected, rtol=1e-5)

    def test_bicycle_does_not_move_its_own_target(self, double, x64):
        """Its gradient is that of the re-encoded motion: a bias at the mapping net's end also shifts the target."""
        function, params = double
        name = "GaussianHead_0"
        gradient = function(params, unit("bicycle"))[1]["mapping_net"][name]["Dense_1"]["bias"]
        step = 1e-6
        differences = []
        for channel in range(4):
            ends = []
            for sign in (1, -1):
                moved = jax.tree.map(lambda x: x, params)
                bias = moved["mapping_net"][name]["Dense_1"]["bias"]
                moved["mapping_net"][name]["Dense_1"]["bias"] = bias + sign * step * np.eye(len(bias))[channel]
                ends.append(function(moved, unit("bicycle"))[0])
            differences.append((ends[0] - ends[1]) / (2 * step))
        assert np.abs(np.asarray(gradient) - np.asarray(differences)).max() > 1e-2
