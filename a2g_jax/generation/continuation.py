"""Clips continued from their own first poses, as the flow paper's protocols score them (Sec. 4.1).

Of a clip the first poses are given (12 frames on TED, 5 on Trinity) and those up to its lookahead are made. Models that
take no first poses hear the same clip, and their frames at the same place are taken.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.generation.engine import valid_rows
from a2g_jax.models.stylized_flow.model import draw_latents
from a2g_jax.models.stylized_flow.networks import FlowNetworks
from a2g_jax.nn.noise import BLOCK
from a2g_jax.training.run import Run

#: Clips worked on at once.
_CHUNK = 16


def continue_clips(
    run: Run,
    audio: Float[np.ndarray, "N T bands"],
    pose: Float[np.ndarray, "N T R D"],
    first: int,
    last: int,
    samples: int,
    seed: int = 0,
) -> Float[np.ndarray, "N samples frames R D"]:
    """Frames ``first`` to ``last`` of clips, so many times each.

    Sample k of clip n depends on the clip, the run, the seed, n and k alone.

    Args:
        audio: features as a corpus holds them, not normalised.
        pose: of which a flow is given the ``history_frames`` before ``first``; other models none.
        first: number of the first frame that is made; for a flow, at least its history.
        last: one behind the last; for a flow, at most T less its lookahead.

    Raises:
        ValueError: a flow whose history or lookahead leave the clip.
    """
    config = run.config
    heard = np.asarray(config.statistics["audio"].normalise(audio), np.float32)
    draw = _flow(run, first, last, audio.shape[1]) if config.model == "stylized_flow" else _other(run, first, last)
    key = jax.random.key(seed)
    clip_keys = jax.vmap(lambda clip: jax.random.fold_in(key, clip))(jnp.arange(len(audio)))
    keys = jax.vmap(lambda one: jax.vmap(lambda k: jax.random.fold_in(one, k))(jnp.arange(samples)))(clip_keys)
    params, summary = jax.device_put(run.params), jax.device_put(run.summary)
    made = []
    for start in range(0, len(audio), _CHUNK):
        # The last chunk is filled up, so that one compiled program serves all.
        rows = np.minimum(np.arange(start, start + _CHUNK), len(audio) - 1)
        poses = draw(params, summary, keys[rows], heard[rows], pose[rows])
        made.append(np.asarray(poses)[: len(audio) - start])
    return np.concatenate(made)


def _flow(run: Run, first: int, last: int, frames: int) -> Any:
    """Of a flow: the frames one after another, all clips and samples side by side."""
    config, networks = run.config, FlowNetworks(run.config.model_config, run.config.data())
    model = config.build()
    history, lookahead = config.model_config.history_frames, config.model_config.lookahead_frames
    if first < history or last > frames - lookahead:
        raise ValueError(
            f"expected frames from {history} to {frames - lookahead} of clips of {frames}; got {first} to {last}"
        )
    assert model.condition is not None
    condition = model.condition

    @jax.jit
    def draw(params, summary, keys, audio, pose):
        del summary

        def one_clip(keys, audio, pose):
            heard = jax.tree.map(lambda array: array[first:last], condition(params, audio))
            seeds = networks.flat(pose[None, first - history : first])[0]
            z = jax.vmap(
                lambda key: draw_latents(config.model_config, key, jnp.int32(0), last - first, networks.channels)
            )(keys)
            carried = networks.start(params, len(keys), seeds)
            flat, _ = networks.proceed(params, jnp.swapaxes(z, 0, 1), heard, carried)
            return valid_rows(networks.pose(jnp.swapaxes(flat, 0, 1)), config.representation)

        return jax.vmap(one_clip)(keys, audio, pose)

    return draw


def _other(run: Run, first: int, last: int) -> Any:
    """Of a model without first poses: the frames of a motion for the whole clip."""
    config = run.config
    model = config.build()
    assert model.condition is not None
    assert model.sample is not None
    condition, sample = model.condition, model.sample

    @jax.jit
    def draw(params, summary, keys, audio, pose):
        del pose
        # Noise is drawn in blocks; behind a clip lies what is quietest in it.
        padded = jnp.pad(audio, ((0, 0), (0, -audio.shape[1] % BLOCK), (0, 0)), mode="minimum")

        def one_clip(keys, audio):
            heard = condition(params, audio)
            return jax.vmap(lambda key: sample(params, summary, key, heard, jnp.int32(0))[first:last])(keys)

        return valid_rows(jax.vmap(one_clip)(keys, padded), config.representation)

    return draw
