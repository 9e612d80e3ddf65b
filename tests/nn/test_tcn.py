"""The temporal convolutional network: its reach, its residuals, its dropout."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.nn.tcn import TCN, ResidualBlock, receptive_halo


def filled(module, *inputs, value=0.1):
    """Variables all of one value: making random ones takes seconds to compile."""
    shapes = jax.eval_shape(lambda key: module.init(key, *inputs), jax.random.key(0))
    return jax.tree.map(lambda leaf: jnp.full(leaf.shape, value, leaf.dtype), shapes)


@pytest.mark.parametrize(("blocks", "kernel_size"), [(1, 3), (3, 3), (2, 5)])
def test_receptive_halo_is_exactly_the_reach(blocks, kernel_size):
    halo = receptive_halo(blocks, kernel_size)
    frames, centre = 2 * halo + 7, halo + 3
    module = TCN((4,) * blocks, kernel_size)

    # Positive weights and inputs keep every ReLU open, so that no dependence is hidden.
    x = jnp.ones((1, frames, 3))
    variables = filled(module, x)
    apply = jax.jit(module.apply)
    change = apply(variables, x.at[:, centre].add(1.0)) - apply(variables, x)
    touched = np.flatnonzero(np.abs(change).max(axis=(0, 2)) > 0)
    np.testing.assert_array_equal(touched, np.arange(centre - halo, centre + halo + 1))


def test_halo_of_the_papers_network():
    assert receptive_halo(5, 3) == 62


def test_a_block_without_weights_passes_positive_input_on():
    x = jnp.arange(72.0).reshape(2, 9, 4)
    block = ResidualBlock(4, 3, 2, 0.0)
    variables = filled(block, x, True, value=0.0)
    np.testing.assert_array_equal(block.apply(variables, x, True), x)


def test_widths_change_through_a_1x1_convolution():
    module = TCN((6, 6, 5))
    result, variables = jax.eval_shape(
        lambda key, x: module.init_with_output(key, x), jax.random.key(0), jnp.ones((2, 9, 4))
    )
    assert result.shape == (2, 9, 5)
    blocks = variables["params"]
    assert ["Dense_0" in blocks[f"ResidualBlock_{n}"] for n in range(3)] == [True, False, True]


def test_dropout_needs_a_key_and_changes_the_result():
    x = jnp.ones((1, 9, 4))
    module = TCN((8,), dropout=0.5)
    variables = filled(module, x)
    dropped = jax.jit(lambda key: module.apply(variables, x, deterministic=False, rngs={"dropout": key}))
    quiet = jax.jit(module.apply)(variables, x)
    first, again, second = (dropped(jax.random.key(n)) for n in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - second).max() > 0
    assert np.abs(first - quiet).max() > 0
