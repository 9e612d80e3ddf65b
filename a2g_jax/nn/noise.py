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
        start: a multiple of 128; may be negative.
        frames: any number.
    """
    blocks = -(-frames // BLOCK)
    numbers = start // BLOCK + jnp.arange(blocks)
    # Block numbers may be negative (context before the first frame); as unsigned they are still distinct.
    keys = jax.vmap(lambda n: jax.random.fold_in(key, n.astype(jnp.uint32)))(numbers)
    noise = jax.vmap(lambda k: jax.random.normal(k, (BLOCK, channels)))(keys)
    return noise.reshape(blocks * BLOCK, channels)[:frames]


def slow_normal(
    key: Key[Array, ""], start: Int[Array, ""], frames: int, channels: int, period: int
) -> Float[Array, "frames channels"]:
    """Standard normal noise that is redrawn every ``period`` frames, with smooth transitions between draws.

    Between draws a and b it is ``a cos(t) + b sin(t)``, t from 0 to pi / 2: every single frame is standard normal.

    Args:
        start: any absolute frame; the same frame gets the same values in every window.
        period: frames between draws; 1 for :func:`frame_normal`, whose ``start`` must be a multiple of 128.
    """
    if period == 1:
        return frame_normal(key, start, frames, channels)
    number, first = start // period, start % period
    count = -(-frames // period) + 2
    keys = jax.vmap(lambda n: jax.random.fold_in(key, n.astype(jnp.uint32)))(number + jnp.arange(count))
    draws = jax.vmap(lambda k: jax.random.normal(k, (channels,)))(keys)
    frame = first + jnp.arange(frames)
    index = frame // period
    angle = (0.5 * jnp.pi / period * (frame % period))[:, None]
    return draws[index] * jnp.cos(angle) + draws[index + 1] * jnp.sin(angle)


def blended_draws(key: Key[Array, ""], table: Tree, start: Int[Array, ""], frames: int, period: int) -> Tree:
    """Rows drawn at random from a table, one for every ``period`` frames, blended linearly in between.

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
    weight = (time - first)[:, None]
    low, high = jax.vmap(draw)(first), jax.vmap(draw)(first + 1)
    return jax.tree.map(lambda a: a[low] * (1 - weight) + a[high] * weight, table)
