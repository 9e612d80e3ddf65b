"""Clips continued from their own first poses, as in the flow paper's evaluation protocols (Sec. 4.1).

The first poses of a clip are given (12 frames on TED, 5 on Trinity), and the following ones up to its lookahead are
generated. Models without seed poses generate the whole clip, from which the same frames are taken.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.generation.controls import stored_rows
from a2g_jax.models.base import Condition, Model
from a2g_jax.nn.blocks import BLOCK
from a2g_jax.training.run import Run

#: Clips of one call.
_CHUNK = 16


def continue_clips(
    run: Run,
    audio: Float[np.ndarray, "N T bands"],
    pose: Float[np.ndarray, "N T R D"],
    first: int,
    last: int,
    samples: int,
    seed: int = 0,
    emotion: Float[np.ndarray, "N T E"] | None = None,
) -> Float[np.ndarray, "N samples frames R D"]:
    """Frames ``first`` to ``last - 1`` of clips, ``samples`` times each.

    Sample k of clip n depends on the clip, the run, the seed, n and k alone. Controls of the sampling settings are
    requested from the first frame of every clip on.

    Args:
        audio: features as in a corpus, not normalised.
        pose: seed poses are the last ones before ``first``, for models that take seed poses.
        first: number of the first frame that is generated; at least the model's number of seed poses.
        last: number of the frame after the last one; for autoregressive models, at most T less their lookahead.
        emotion: weights of the run's emotions, for models that are conditioned on them.

    Raises:
        ValueError: seed poses or lookahead outside of the clip.
    """
    config, model = run.config, run.config.build()
    normalised = np.asarray(config.statistics["audio"].normalise(audio), np.float32)
    make = _autoregressive if model.begin is not None else _whole
    draw = jax.jit(make(run, model, first, last, audio.shape[1]))
    key = jax.random.key(seed)
    clip_keys = jax.vmap(lambda clip: jax.random.fold_in(key, clip))(jnp.arange(len(audio)))
    keys = jax.vmap(lambda one: jax.vmap(lambda k: jax.random.fold_in(one, k))(jnp.arange(samples)))(clip_keys)
    params, summary = jax.device_put(run.params), jax.device_put(run.summary)
    made = []
    for start in range(0, len(audio), _CHUNK):
        # The last chunk is filled up, so that one compiled program serves all.
        rows = np.minimum(np.arange(start, start + _CHUNK), len(audio) - 1)
        labels = None if emotion is None else emotion[rows]
        poses = draw(params, summary, keys[rows], normalised[rows], pose[rows], labels)
        made.append(np.asarray(poses)[: len(audio) - start])
        if run.dynamics is not None:
            made[-1] = np.stack([np.stack([run.finished(one) for one in clip]) for clip in made[-1]])
    return np.concatenate(made)


def _controls(run: Run, model: Model, frames: int) -> Any:
    """Requested controls of a clip's frames; None where the model needs none."""
    rows = stored_rows(run, model.controls, frames)
    return None if rows is None else jnp.asarray(rows)


def _autoregressive(run: Run, model: Model, first: int, last: int, frames: int) -> Any:
    """A function that draws the frames one after another, all clips and samples in parallel."""
    history, lookahead = model.seed_frames, model.lookahead
    if first < history or last > frames - lookahead:
        raise ValueError(
            f"expected frames from {history} to {frames - lookahead} of clips of {frames}; got {first} to {last}"
        )
    condition, begin, proceed, space = model.condition, model.begin, model.proceed, run.config.space
    controls = _controls(run, model, frames)
    assert condition is not None
    assert begin is not None
    assert proceed is not None

    def draw(params, summary, keys, audio, pose, emotion):
        def one_clip(keys, audio, pose, emotion):
            stop = last + model.overlap
            whole = condition(params, summary, Condition(audio, emotion=emotion, controls=controls))
            given = jax.tree.map(lambda array: array[first:stop], whole)
            # Without the summary, whose limits of poses are for generation of minutes.
            seeds = pose[first - history : first]

            def one(key):
                state = begin(params, {}, key, seeds)
                return proceed(params, {}, key, given, jnp.int32(0), state)[0]

            return space.valid(jax.vmap(one)(keys))

        return jax.vmap(one_clip)(keys, audio, pose, emotion)

    return draw


def _whole(run: Run, model: Model, first: int, last: int, frames: int) -> Any:
    """A function that draws motions of whole clips and takes the frames from them."""
    condition, sample, space = model.condition, model.sample, run.config.space
    controls = _controls(run, model, frames)
    if controls is not None:
        controls = jnp.pad(controls, ((0, -frames % BLOCK), (0, 0)), mode="edge")
    assert condition is not None
    assert sample is not None

    def draw(params, summary, keys, audio, pose, emotion):
        del pose
        # Noise is drawn in blocks; after a clip the audio is as quiet as its quietest frame.
        filled = ((0, 0), (0, -audio.shape[1] % BLOCK), (0, 0))
        padded = jnp.pad(audio, filled, mode="minimum")
        emotion = None if emotion is None else jnp.pad(emotion, filled, mode="edge")

        def one_clip(keys, audio, emotion):
            given = condition(params, summary, Condition(audio, emotion=emotion, controls=controls))
            return jax.vmap(lambda key: sample(params, summary, key, given, jnp.int32(0))[first:last])(keys)

        return space.valid(jax.vmap(one_clip)(keys, padded, emotion))

    return draw
