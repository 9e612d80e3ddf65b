"""Motion-specific codes of training clips, drawn at random or by requested properties of the clips.

A request gives every part of a stored clip, about four seconds, a weight ``exp(-(q - r)^2 / 2 s^2)`` with q the
quantile of its property among all parts and r the requested one; weights of several controls multiply. The clip of a
part is drawn by the largest of ``log weight + Gumbel noise``, with one noise for a whole period: a clip stays as long
as it has what is requested, and the code changes no more often than the request needs.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.features.hand_properties import PROPERTIES, hand_properties
from a2g_jax.geometry.joint_names import named_joints
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from a2g_jax.models.audio2gestures.sampling import Audio2GesturesSampling
from a2g_jax.models.base import Data, Summary
from a2g_jax.models.control_curves import parse_gains
from a2g_jax.models.control_requests import ranks, requested_values

#: Standard deviation s of a request, in quantiles.
WIDTH = 0.05
#: Parts of clips that a request leaves to choose from, at least: several narrow requests together are widened, since
#: samples would be alike if they all drew the one clip that has everything.
CHOICE = 24.0
#: Log-weight of clips of another category than the requested one.
OTHER = -30.0
#: Frames for which a request holds, so that motion is not cut into pieces shorter than a stroke; a divisor of 128.
HOLD = 64
#: Length of the parts of a clip whose properties are stored, seconds: long enough to hold several strokes.
PART_SECONDS = 4.0
#: The control by the corpus's labels, and the summary's arrays of all controls.
EMOTION, VALUES, LABELS = "emotion", "clip_properties", "clip_emotion"


class Request(NamedTuple):
    """What controls request of every hold of :data:`HOLD` frames."""

    weights: Float[Array, "H N P"] | None
    """Log-weights of the parts of stored clips; None for the same of all."""
    shift: Float[Array, "H C"] | None = None
    """What is added to the codes; None for nothing."""


def control_names(config: Audio2GesturesConfig, data: Data) -> tuple[str, ...]:
    """Controls of a run with stored codes: none for poses without wrists, no emotion without several of them."""
    if not config.stored_codes or not data.space.has_rotations:
        return ()
    if {"L_Wrist", "R_Wrist"} - set(named_joints(data.space.body.names)):
        return ()
    return (*PROPERTIES, EMOTION) if len(emotion_names(data)) > 1 else PROPERTIES


def emotion_names(data: Data) -> tuple[str, ...]:
    """Emotions that can be requested: those of the corpus, without the empty one of recordings that have no label."""
    return tuple(name for name in data.emotions if name)


def clip_parts(config: Audio2GesturesConfig, data: Data) -> int:
    """Number of equal parts of a clip, of whole steps, nearest to :data:`PART_SECONDS`."""
    steps = config.clip_frames // config.specific_frames
    most = max(1, round(config.clip_frames / data.fps / PART_SECONDS))
    return max(parts for parts in range(1, most + 1) if steps % parts == 0)


def clip_properties(config: Audio2GesturesConfig, data: Data, names: tuple[str, ...], batch: Batch) -> Summary:
    """What is stored of every clip for its controls: properties of its parts (B, P, K), and the number of its emotion
    (B,), -1 for a clip that has none."""
    if not names:
        return {}
    joints = named_joints(data.space.skeleton.names)
    rotations = data.space.rotations(batch.pose)
    assert rotations is not None  # names are of runs on rotations
    places = data.space.joint_positions(rotations)
    wrists = jnp.array([joints["L_Wrist"], joints["R_Wrist"]])
    clips, parts = len(places), clip_parts(config, data)
    pieces = places.reshape(clips * parts, -1, *places.shape[2:])
    found = jax.vmap(lambda piece: hand_properties(piece[:, wrists], piece[:, 0], data.fps))(pieces)
    summary: Summary = {VALUES: found.reshape(clips, parts, -1).astype(jnp.float16)}
    if batch.emotion is not None:
        known = emotion_names(data)
        numbers = [known.index(name) if name else -1 for name in data.emotions]
        summary[LABELS] = jnp.array(numbers, jnp.int8)[batch.emotion]
    return summary


def request(
    names: tuple[str, ...], sampling: Audio2GesturesSampling, summary: Summary, controls: Float[Array, "T K"]
) -> Request:
    """Weights of the stored clips, and the shift of their codes, for requested controls; as in :func:`log_weights`."""
    return Request(log_weights(names, sampling, summary, controls), emotion_shift(names, sampling, summary, controls))


def emotion_shift(
    names: tuple[str, ...], sampling: Audio2GesturesSampling, summary: Summary, controls: Float[Array, "T K"]
) -> Float[Array, "H C"] | None:
    """What the gain g of the emotion adds to codes, ``(g - 1) (mean of the emotion's codes - mean of all)``, for each
    hold of :data:`HOLD` frames; zero where the emotion is free, None without a gain.

    Clips of an emotion differ from others less once they are drawn for other speech: more is requested than they have,
    as with the gains of the other controls.
    """
    gain = parse_gains(sampling.control_gains, names)[names.index(EMOTION)] if EMOTION in names else 1.0
    if gain == 1.0:
        return None
    codes = jnp.mean(jnp.asarray(summary["specific_code"]).astype(jnp.float32), axis=1)
    labels, label = jnp.asarray(summary[LABELS]).astype(int), controls.reshape(-1, HOLD, len(names))[:, HOLD // 2, -1]
    number = jnp.nan_to_num(label).astype(int)
    own = (labels[None] == number[:, None]).astype(codes.dtype)
    means = own @ codes / jnp.maximum(own.sum(axis=1, keepdims=True), 1.0)
    shift = (gain - 1.0) * (means - jnp.mean(codes, axis=0)[None])
    return jnp.where(jnp.isnan(label)[:, None] | (own.sum(axis=1, keepdims=True) == 0), 0.0, shift)


def log_weights(
    names: tuple[str, ...], sampling: Audio2GesturesSampling, summary: Summary, controls: Float[Array, "T K"]
) -> Float[Array, "H N P"]:
    """Log-weight of every part of the stored clips for each hold of :data:`HOLD` frames.

    Args:
        controls: quantiles, and numbers of emotions; NaN for a free control.
    """
    requested_rows = controls.reshape(-1, HOLD, len(names))[:, HOLD // 2]
    count, gains = len(PROPERTIES), parse_gains(sampling.control_gains, names)[: len(PROPERTIES)]
    stored = jnp.asarray(summary[VALUES]).astype(jnp.float32)
    training = stored.reshape(-1, count)
    values = requested_values(requested_rows[:, :count], training, gains)
    total = jnp.zeros((len(requested_rows), len(training)))
    for column in range(count):
        clips, requested = (ranks(those[:, column], training[:, column]) for those in (training, values))
        far = -0.5 * jnp.square((clips[None] - requested[:, None]) / WIDTH)
        total += jnp.where(jnp.isnan(requested_rows[:, column])[:, None], 0.0, far)
    others = jnp.zeros_like(total)
    if EMOTION in names:
        label = requested_rows[:, count, None]
        same = jnp.repeat(jnp.asarray(summary[LABELS]), stored.shape[1])[None] == label
        others = jnp.where(same | jnp.isnan(label), 0.0, OTHER)
    total = jax.vmap(widened)(total, others) + others
    return total.reshape(len(requested_rows), *stored.shape[:2])


def widened(weights: Float[Array, " M"], others: Float[Array, " M"]) -> Float[Array, " M"]:
    """Log-weights times the largest factor up to 1 with which at least :data:`CHOICE` parts count, or half of all.

    The number that count is ``(sum w)^2 / sum w^2``.

    Args:
        weights: of the requested properties.
        others: of the category, which is not widened.
    """

    def number(factor: Float[Array, ""]) -> Float[Array, ""]:
        shares = jax.nn.softmax(factor * weights + others)
        return 1.0 / jnp.sum(jnp.square(shares))

    least = jnp.minimum(CHOICE, 0.5 * number(jnp.float32(0.0)))

    def halve(_: Any, bounds: tuple[Array, Array]) -> tuple[Array, Array]:
        low, high = bounds
        middle = 0.5 * (low + high)
        enough = number(middle) >= least
        return jnp.where(enough, middle, low), jnp.where(enough, high, middle)

    low, _ = jax.lax.fori_loop(0, 16, halve, (jnp.float32(0.0), jnp.float32(1.0)))
    return weights * jnp.where(number(jnp.float32(1.0)) >= least, 1.0, low)


def stored_steps(
    key: Key[Array, ""],
    codes: Float[Array, "N L C"],
    sampling: Audio2GesturesSampling,
    first: Int[Array, ""],
    count: int,
    size: int,
    weights: Float[Array, "H N P"] | None = None,
    shift: Float[Array, "H C"] | None = None,
) -> Float[Array, "count C"]:
    """Steps of the specific code from training clips, each taken from its beginning to its end.

    Args:
        codes: of training clips.
        first: number of the first step in the whole audio; may be negative, where the first step is repeated.
        count: steps.
        size: frames of a step.
        weights: log-weights of the clips, of :func:`log_weights`; None for the same of all, as those of free controls.
        shift: what is added to the steps of each hold, of :func:`emotion_shift`; None for nothing.
    """
    clips, length, _ = codes.shape
    number = jnp.maximum(first + jnp.arange(count), 0)
    # Without redrawing, one clip is followed by the next one of the training split.
    period = max(1, -(-sampling.redraw_frames // (size * length))) * length if sampling.redraw_frames else 2**20
    draw = lambda n: jax.random.randint(jax.random.fold_in(key, n.astype(jnp.uint32)), (), 0, clips)  # noqa: E731
    later = (number % period) // length
    hold = (number - first) * size // HOLD
    if weights is None:
        clip = jax.vmap(draw)(number // period) + later
    else:
        noise = jax.vmap(lambda n: _noise(jax.random.fold_in(key, n.astype(jnp.uint32)), clips, draw(n)))
        part = (number % length) * weights.shape[2] // length
        clip = jax.vmap(_best)(noise(number // period), weights[hold, :, part], later) + later
    steps = codes[clip % clips, number % length].astype(jnp.float32)
    mean = jnp.mean(codes.astype(jnp.float32), axis=(0, 1))
    scaled = mean[None] + sampling.noise_scale * (steps - mean[None])
    return scaled if shift is None else scaled + shift[hold]


def _noise(key: Key[Array, ""], clips: int, drawn: Int[Array, ""]) -> Float[Array, " N"]:
    """Gumbel noise of every clip whose largest value is that of the clip drawn without a request.

    The largest of independent values is equally likely everywhere, whatever the others are: exchanging it with the
    value of a clip that is drawn uniformly changes no probability.
    """
    noise = jax.random.gumbel(jax.random.fold_in(key, 1), (clips,))
    top = jnp.argmax(noise)
    largest, other = noise[top], noise[drawn]
    return noise.at[top].set(other).at[drawn].set(largest)


def _best(noise: Float[Array, " N"], weights: Float[Array, " N"], later: Int[Array, ""]) -> Any:
    """The drawn first clip of a period, of which the clip ``later`` after it is weighted."""
    return jnp.argmax(noise + jnp.roll(weights, -later))
