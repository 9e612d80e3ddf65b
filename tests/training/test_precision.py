"""Mixed precision: large products in bfloat16, everything else in float32, in loops, branches and gradients as well."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.models.base import Stage, Update
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.nn.conv import conv1d
from a2g_jax.training.precision import half_products
from a2g_jax.training.stages import StageSpan
from a2g_jax.training.state import TrainState, advance, optimiser_name, optimiser_of
from tests.training.test_processes import begin, end, losses, settings_of


def network(weights, x):
    """A convolution, a loop with a product in it, a branch, rematerialisation, and 3 x 3 matrices one after another."""
    h = jnp.tanh(conv1d(x, weights["conv"], 1))

    def step(carry, row):
        return jnp.tanh(row + carry @ weights["loop"]), carry.sum()

    h, sums = jax.lax.scan(step, h[:, 0], h.swapaxes(0, 1))
    h = jax.lax.cond(h.sum() > 1e9, lambda a: a, lambda a: a @ weights["branch"], h)
    h = jax.checkpoint(lambda a: jax.nn.relu(a @ weights["again"]))(h)
    turns = jax.lax.scan(lambda a, b: (a @ b, None), jnp.eye(3), weights["turns"])[0]
    return h.sum() + sums.mean() + 10 * turns.sum()


def inputs():
    keys = jax.random.split(jax.random.key(0), 6)
    shapes = {"conv": (3, 20, 32), "loop": (32, 32), "branch": (32, 32), "again": (32, 32), "turns": (5, 3, 3)}
    weights = {n: 0.2 * jax.random.normal(k, s) for (n, s), k in zip(shapes.items(), keys[:5], strict=True)}
    return weights, jax.random.normal(keys[5], (4, 10, 20))


def operands(program, found):
    """Types of the operands of all products by their numbers of terms."""
    for equation in program.eqns:
        if equation.primitive.name in ("dot_general", "conv_general_dilated"):
            terms = equation.invars[0].aval.shape[-1]
            found.append((terms, equation.invars[0].aval.dtype.name, equation.outvars[0].aval.dtype.name))
        for part in jax.tree.leaves(list(equation.params.values()), is_leaf=lambda p: hasattr(p, "eqns")):
            inner = getattr(part, "jaxpr", part)
            if hasattr(inner, "eqns"):
                operands(inner, found)
    return found


def test_large_products_are_rounded_and_small_ones_are_not(monkeypatch):
    weights, x = inputs()
    gradient = jax.value_and_grad(network)
    exact, rounded = gradient(weights, x), jax.jit(half_products(gradient))(weights, x)
    # The program for a GPU is made, not run.
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    found = operands(jax.make_jaxpr(half_products(gradient))(weights, x).jaxpr, [])
    assert len(found) == len(operands(jax.make_jaxpr(gradient)(weights, x).jaxpr, []))
    assert {kinds for terms, *kinds in map(tuple, found) for kinds in [tuple(kinds)] if terms == 3} == {
        ("float32",) * 2
    }
    assert ("bfloat16", "float32") in {kinds for terms, *rest in found for kinds in [tuple(rest)] if terms >= 16}
    np.testing.assert_allclose(rounded[0], exact[0], rtol=1e-2)
    for name in weights:
        assert rounded[1][name].dtype == jnp.float32
        scale = np.abs(exact[1][name]).max()
        difference = np.abs(rounded[1][name] - exact[1][name]).max()
        assert difference < 0.05 * scale
        assert difference > 0 or name == "turns"


def state_after(precision, steps=3):
    """Losses and state of a small network after some steps."""
    weights, x = inputs()

    def loss(params, key, batch, step):
        value = network(params, batch.audio) ** 2 * 1e-3
        return value, {"value": value}

    update = Update(loss)
    config = TrainConfig(precision=precision, learning_rate=1e-2)
    span = StageSpan(Stage((update,)), 0, config)
    optimisers = {optimiser_name(span.stage, update): optimiser_of(update, config).init(weights)}
    state = TrainState(weights, optimisers, jnp.zeros((), jnp.int32), jax.random.key(1), jnp.array(True))
    values = []
    for _ in range(steps):
        state, metrics = jax.jit(lambda s: advance(span, s, Batch(x, x), s.key))(state)
        values.append(float(metrics["loss"]))
    return values, state


def test_losses_agree_and_the_state_stays_in_float32():
    exact, rounded = state_after("float32"), state_after("bf16")
    np.testing.assert_allclose(rounded[0], exact[0], rtol=0.03)
    assert rounded[0] != exact[0]
    kinds = {leaf.dtype for leaf in jax.tree.leaves((rounded[1].params, rounded[1].optimisers))}
    assert kinds <= {jnp.dtype("float32"), jnp.dtype("int32")}


def test_other_precisions_are_refused():
    with pytest.raises(InputError, match="--precision: expected 'float32' or 'bf16'; got 'fp8'"):
        dataclasses.replace(TrainConfig(), precision="fp8")


@pytest.mark.slow
@pytest.mark.parametrize("family", ["audio2gestures", "speech2gesture", "stylized_flow", "emotion_gesture"])
def test_trainings_agree(tmp_path, toy_corpus, family):
    for precision in ("float32", "bf16"):
        end(begin(tmp_path / precision, toy_corpus, settings_of(family, precision=precision)))
    np.testing.assert_allclose(losses(tmp_path / "bf16"), losses(tmp_path / "float32"), rtol=0.05)
