"""Speech2Gesture: the gradients of the losses of both networks."""

import jax
import numpy as np
import pytest
from speech2gesture_for_tests import CONFIG, make_batch, make_data, make_params, terms_of

from a2g_jax.models.speech2gesture.model import build


@pytest.fixture(scope="module")
def sides():
    """Gradients of the total, and of any one term, in double precision.

    Parameters and gradients are on the host, where changing them compiles nothing.
    """
    with jax.enable_x64(True):
        model = build(CONFIG, make_data())
        params, batch = jax.device_get(make_params(model, np.float64)), make_batch(dtype=np.float64)
    names = ("rotation", "position", "speed", "adversarial", "discriminator")

    def mixed(params, weights):
        total, terms = terms_of(model, params, batch)
        return weights["total"] * total + sum(weights[name] * terms[name] for name in names)

    compiled = jax.jit(jax.value_and_grad(mixed))
    function = lambda params, weights: jax.device_get(compiled(params, weights))  # noqa: E731
    choose = lambda *chosen: {n: np.float64(n in chosen) for n in (*names, "total")}  # noqa: E731
    return function, params, choose


class TestBothNetworks:
    def test_the_discriminators_loss_does_not_move_the_translation_network(self, sides, x64):
        function, params, choose = sides
        gradient = function(params, choose("discriminator"))[1]
        assert max(np.abs(leaf).max() for leaf in jax.tree.leaves(gradient["generator"])) == 0
        for path, leaf in jax.tree_util.tree_leaves_with_path(gradient["discriminator"]):
            assert np.abs(leaf).max() > 0, path

    def test_the_translation_networks_losses_do_not_move_the_discriminator(self, sides, x64):
        function, params, choose = sides
        gradient = function(params, choose("rotation", "position", "speed", "adversarial"))[1]
        assert max(np.abs(leaf).max() for leaf in jax.tree.leaves(gradient["discriminator"])) == 0
        for path, leaf in jax.tree_util.tree_leaves_with_path(function(params, choose("adversarial"))[1]["generator"]):
            assert np.abs(leaf).max() > 0, path

    def test_one_gradient_of_the_total_is_both(self, sides, x64):
        function, params, choose = sides
        total = function(params, choose("total"))[1]
        judge = function(params, choose("discriminator"))[1]["discriminator"]
        jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, atol=1e-12), total["discriminator"], judge)
        parts = {n: function(params, choose(n))[1]["generator"] for n in ("rotation", "position", "speed")}
        fooled = function(params, choose("adversarial"))[1]["generator"]

        def check(whole, rotation, position, speed, fool):
            expected = rotation + position + CONFIG.speed_weight * speed + CONFIG.adversarial_weight * fool
            np.testing.assert_allclose(whole, expected, atol=1e-12)

        jax.tree.map(check, total["generator"], *parts.values(), fooled)

    @pytest.mark.parametrize(
        ("network", "terms"),
        [
            ("generator", ("rotation", "position", "speed", "adversarial")),
            ("discriminator", ("discriminator",)),
        ],
    )
    def test_is_the_numerical_one(self, sides, x64, network, terms):
        function, params, choose = sides
        gradient = function(params, choose(*terms))[1][network]
        random = np.random.default_rng(5)
        way = jax.tree.map(lambda leaf: random.normal(size=leaf.shape), params[network])
        step = 1e-7
        ahead, behind = (
            function(
                params | {network: jax.tree.map(lambda p, w, s=sign: p + s * step * w, params[network], way)},
                choose(*terms),
            )[0]
            for sign in (1, -1)
        )
        expected = (ahead - behind) / (2 * step)
        inner = sum(jax.tree.leaves(jax.tree.map(lambda g, w: np.sum(np.asarray(g) * w), gradient, way)))
        assert abs(expected) > 1e-3
        np.testing.assert_allclose(inner, expected, rtol=1e-4)
