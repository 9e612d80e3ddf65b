"""Noise as a function of a key and the absolute frame, independent of the window."""

from typing import TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from a2g_jax.nn.blocks import BLOCK

Tree = TypeVar("Tree")


def frame_normal(
    key: Key[Array, ""], start: Int[Array, ""], frames: int, channels: int
) -> Float[Array, "frames channels"]:
    """Standard normal noise for frames ``start`` to ``start + frames``.

    The same frame gets the same values in every window, because each block of 128 frames has a key of its own.

    Args:
        start: may be negative.
        frames: any number.
    """
    # One block more than the frames fill, since a window may begin within one.
    blocks = -(-frames // BLOCK) + 1
    numbers = start // BLOCK + jnp.arange(blocks)
    # Block numbers may be negative (context before the first frame); as unsigned they are still distinct.
    keys = jax.vmap(lambda n: jax.random.fold_in(key, n.astype(jnp.uint32)))(numbers)
    noise = jax.vmap(lambda k: jax.random.normal(k, (BLOCK, channels)))(keys)
    return jax.lax.dynamic_slice_in_dim(noise.reshape(blocks * BLOCK, channels), start % BLOCK, frames)


def blended_draws(key: Key[Array, ""], table: Tree, start: Int[Array, ""], frames: int, period: int) -> Tree:
    """Rows drawn at random from a table, one for every ``period`` frames, blended in between with constant variance.

    Between rows a and b it is ``m + (a - m) cos(t) + (b - m) sin(t)``, with m the mean of the table and t from 0 to
    pi / 2: a frame varies as much as the rows do. A linear blend of independent rows halves the variance half-way.

    Args:
        table: a pytree of arrays (N, C); the same row is taken from each.
        period: frames between draws; 0 for a single draw.

    Returns:
        The pytree with arrays (frames, C).
    """
    rows = jax.tree.leaves(table)[0].shape[0]

    def draw(number):
        return jax.random.randint(jax.random.fold_in(key, number.astype(jnp.uint32)), (), 0, rows)

    if period == 0:
        row = draw(jnp.zeros((), jnp.int32))
        return jax.tree.map(lambda a: jnp.broadcast_to(a[row][None], (frames, a.shape[1])), table)
    time = (start + jnp.arange(frames)) / period
    first = jnp.floor(time).astype(jnp.int32)
    angle = (0.5 * jnp.pi * (time - first))[:, None]
    low, high = jax.vmap(draw)(first), jax.vmap(draw)(first + 1)

    def blended(a):
        mean = jnp.mean(a, axis=0, keepdims=True)
        return mean + (a[low] - mean) * jnp.cos(angle) + (a[high] - mean) * jnp.sin(angle)

    return jax.tree.map(blended, table)
