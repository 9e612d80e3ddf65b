"""Generation of any length, chunk by chunk: each chunk begins with the last poses of the one before.

Chunks lie at the absolute frames that are multiples of their stride, and their randomness is a function of the key and
the chunk's number, so that windows of any size give the same motion.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from a2g_jax.models.base import Params, Summary
from a2g_jax.models.emotion_gesture.mining import emotion_probabilities
from a2g_jax.models.emotion_gesture.networks import AudioFeatures, Networks
from a2g_jax.models.emotion_gesture.sampling import AUDIO, SAMPLE, EmotionGestureSampling

#: Share of the training clips, those with the calmest pose, whose pose a motion without a seed clip may begin with.
_CALM = 10
#: Number of the random stream of first poses; chunks have the numbers from 0 on.
_FIRST = 2**32 - 1


class Given(NamedTuple):
    """Conditioning of T frames, and of the ``stride - 1`` frames after them that the last chunk also has."""

    audio: Float[Array, "T bands"]
    before: Float[Array, "T bands"]
    """The audio of the frame ``seed_frames`` before each."""
    emotion: Float[Array, "T E"]
    """Weights of the emotions; NaN for those of the audio."""
    requested: Float[Array, "T E"] | None = None
    """The same by a control, in place of ``emotion`` and sampled whatever the settings are; None without a control."""


class State(NamedTuple):
    """State between windows."""

    seed: Float[Array, "M C"]
    """The poses before the next chunk."""
    chunk: Float[Array, "S C"]
    """The chunk before the next one, of which the first frames may be part of a window."""


def start(networks: Networks, summary: Summary, key: Key[Array, ""], seed_poses: Float[Array, "M R D"] | None) -> State:
    """The state before frame 0: after the seed poses, or in the calmest pose of one of the calm training clips."""
    config = networks.config
    if seed_poses is None:
        poses, speeds = jnp.asarray(summary["rest_pose"], jnp.float32), jnp.asarray(summary["rest_speed"])
        calm = max(1, len(poses) // _CALM)
        chosen = jnp.argsort(speeds)[jax.random.randint(jax.random.fold_in(key, jnp.uint32(_FIRST)), (), 0, calm)]
        seed_poses = jnp.broadcast_to(poses[chosen][None], (config.seed_frames, *poses.shape[1:]))
    seed = networks.flat(seed_poses[None])[0]
    return State(seed, jnp.zeros((config.stride, networks.values), seed.dtype))


def proceed(
    networks: Networks,
    params: Params,
    sampling: EmotionGestureSampling,
    key: Key[Array, ""],
    given: Given,
    first: Int[Array, ""],
    state: State,
) -> tuple[Float[Array, "T C"], State]:
    """Poses of the frames from ``first`` on, and the state after them."""
    stride = networks.config.stride
    frames = len(given.audio) - (stride - 1)
    offset = (-first) % stride
    count = -(-frames // stride)
    starts = offset + stride * jnp.arange(count)
    encoded = jax.vmap(lambda row: _encode(networks, params, given, row))(starts)

    def one(state: State, inputs: tuple[Array, AudioFeatures]) -> tuple[State, Float[Array, "S C"]]:
        row, features = inputs
        own = jax.random.fold_in(key, ((first + row) // stride).astype(jnp.uint32))
        controlled = given.requested is not None
        weights = _cut(given.emotion if given.requested is None else given.requested, row, stride)
        new = _chunk(networks, params, sampling, own, features, weights, state.seed, controlled)
        after = State(jnp.concatenate([state.seed, new])[-len(state.seed) :], new)
        # The last chunk may begin after the window; it is then the next window's.
        return jax.tree.map(lambda a, b: jnp.where(row < frames, a, b), after, state), new

    after, chunks = jax.lax.scan(one, state, (starts, encoded))
    poses = jnp.concatenate([state.chunk[None], chunks]).reshape(-1, networks.values)
    return jax.lax.dynamic_slice_in_dim(poses, stride - offset, frames), after


def _encode(networks: Networks, params: Params, given: Given, row: Int[Array, ""]) -> AudioFeatures:
    config = networks.config
    audio = jnp.concatenate([_cut(given.before, row, config.seed_frames), _cut(given.audio, row, config.stride)])
    return networks.encode_audio(params, audio[None])


def _cut(array: Float[Array, "T C"], row: Int[Array, ""], frames: int) -> Float[Array, "N C"]:
    return jax.lax.dynamic_slice_in_dim(array, row, frames)


def _chunk(
    networks: Networks,
    params: Params,
    sampling: EmotionGestureSampling,
    key: Key[Array, ""],
    features: AudioFeatures,
    weights: Float[Array, "S E"],
    seed: Float[Array, "M C"],
    controlled: bool,
) -> Float[Array, "S C"]:
    """The poses of a chunk after its initial ones.

    Args:
        controlled: whether the weights are a control's.
    """
    config, space = networks.config, networks.data.space
    weights = jnp.concatenate([jnp.broadcast_to(weights[:1], (config.seed_frames, weights.shape[1])), weights])[None]
    labels = jnp.where(jnp.isnan(weights), 1.0 / networks.classes, weights)
    samples = networks.samples_emotions and (controlled or sampling.emotion != AUDIO)
    if samples and features.emotion is not None and features.logits is not None:
        if sampling.emotion == SAMPLE:
            found = emotion_probabilities(features.logits, config.clip_frames)
            weights = jnp.where(jnp.isnan(weights), found, weights)
        sampled = sample_emotion(networks, params, key, sampling.temperature, jnp.nan_to_num(weights[0]))
        of_audio = jnp.isnan(weights).any(axis=-1, keepdims=True)
        features = features._replace(emotion=jnp.where(of_audio, features.emotion, sampled[None]))
    new = networks.decode(params, features, seed[None], labels)[0, config.seed_frames :]
    if sampling.seam_frames > 0:
        new = new + seam(seed, new, sampling.seam_frames)
    return networks.flat(space.valid(networks.pose(new[None])))[0]


def sample_emotion(
    networks: Networks,
    params: Params,
    key: Key[Array, ""],
    temperature: float | Float[Array, ""],
    weights: Float[Array, "N E"],
) -> Float[Array, "N D"]:
    """Emotion features of one random latent: those of each emotion, mixed by its weight at each frame."""
    classes = networks.classes
    latent = temperature * jax.random.normal(key, (networks.config.vae_latent,))
    latents = jnp.broadcast_to(latent[None], (classes, len(latent)))
    each = networks.decode_emotion(params, latents, jnp.eye(classes))
    return jnp.einsum("ne,end->nd", weights, each)


def seam(seed: Float[Array, "M C"], new: Float[Array, "S C"], frames: int) -> Float[Array, "S C"]:
    """What joins a chunk to the poses before it without a step of place or speed: it fades out over some frames.

    With it the speed changes evenly from that of the last poses to the chunk's own: its first pose is one step of their
    mean after the last one before it. A decoder's output may jump there, or stop for a frame, even where it
    agrees with the initial poses.

    Args:
        seed: the poses before the chunk.
        new: the chunk's own.
        frames: how many, 1 or more.
    """
    before, after = seed[-1:] - seed[-2:-1], new[1:2] - new[:1]
    gap = seed[-1:] + 0.5 * (before + after) - new[:1]
    # Hermite's cubic from the gap, and the speed that is missing, to zero and rest.
    place = jnp.minimum(jnp.arange(len(new))[:, None] / frames, 1.0)
    rest = jnp.square(1.0 - place)
    return rest * (1.0 + 2.0 * place) * gap + rest * place * frames * 0.5 * (before - after)
