"""The emotion classifiers as a record of pure functions."""

from typing import Any

import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Float, Int, Key

from a2g_jax.data.batch import Batch
from a2g_jax.errors import InputError
from a2g_jax.models.base import Classifier, Data, Model, Params, Stage, Summary, Update
from a2g_jax.models.emotion_classifier.config import EmotionClassifierConfig
from a2g_jax.models.emotion_classifier.networks import AttentionEncoder, ClipClassifier
from a2g_jax.models.entry import NO_SAMPLING, NoSampling
from a2g_jax.nn.tcn import receptive_halo


def classify(
    config: EmotionClassifierConfig, data: Data, params: Params, batch: Batch, dropout_key: Key[Array, ""] | None = None
) -> Float[Array, "B K"]:
    """Logits over ``data.emotions`` for every clip; with dropout only if a key is given."""
    network = _network(config, data)
    if config.input == "audio":
        values = batch.audio
    else:
        values = data.pose_statistics.normalise(batch.pose).reshape(*batch.pose.shape[:2], -1)
    rngs = None if dropout_key is None else {"dropout": dropout_key}
    logits: Any = network.apply({"params": params}, values, dropout_key is None, rngs=rngs)
    return logits


def _network(config: EmotionClassifierConfig, data: Data) -> ClipClassifier:
    attention = None
    if config.encoder == "attention":
        attention = AttentionEncoder(config.width, config.layers, config.heads, config.dropout)
    return ClipClassifier(
        config.channels, config.hidden, config.kernel_size, config.dropout, len(data.emotions), attention
    )


def build(config: EmotionClassifierConfig, data: Data, sampling: NoSampling = NO_SAMPLING) -> Model:
    """A classifier of a corpus's emotions; see :class:`a2g_jax.models.base.Model` for its parts.

    Raises:
        InputError: the corpus has fewer than two emotions.
    """
    del sampling
    if len(data.emotions) < 2:
        raise InputError(
            f"emotion_classifier: the corpus has {len(data.emotions)} emotion ({', '.join(data.emotions) or 'none'});"
            " prepare one with two or more."
        )
    width = data.audio_bands
    if config.input == "motion":
        rows = data.pose_statistics.mean.shape
        width = rows[0] * rows[1]

    def init(key: Key[Array, ""]) -> Params:
        params: Params = _network(config, data).init(key, jnp.zeros((1, 8, width)))["params"]
        return params

    def loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """Cross entropy, with the accuracy as a term."""
        del step
        return entropy(params, batch, key if config.dropout > 0 else None)

    def validation_loss(
        params: Params, key: Key[Array, ""], batch: Batch, step: Int[Array, ""]
    ) -> tuple[Float[Array, ""], dict[str, Array]]:
        """Cross entropy without dropout."""
        del key, step
        return entropy(params, batch, None)

    def entropy(params: Params, batch: Batch, dropout_key: Key[Array, ""] | None):
        if batch.emotion is None:
            raise ValueError("a batch for the emotion classifier needs emotions")
        logits = classify(config, data, params, batch, dropout_key)
        loss = jnp.mean(optax.softmax_cross_entropy_with_integer_labels(logits, batch.emotion))
        accuracy = jnp.mean((jnp.argmax(logits, axis=-1) == batch.emotion).astype(jnp.float32))
        return loss, {"accuracy": accuracy}

    def summarise(params: Params, key: Key[Array, ""], batch: Batch) -> Summary:
        """Predicted probability of each clip's own emotion."""
        del key
        probabilities = jax.nn.softmax(classify(config, data, params, batch))
        assert batch.emotion is not None
        return {"confidence": jnp.take_along_axis(probabilities, batch.emotion[:, None], axis=1)[:, 0]}

    halo = receptive_halo(len(config.channels), config.kernel_size)
    if config.encoder == "attention":
        halo = config.clip_frames
    return Model(
        "emotion_classifier",
        config,
        config.clip_frames,
        halo,
        init,
        (Stage((Update(loss),), validation_loss=validation_loss),),
        summarise,
        batch_fields=("audio", "pose", "emotion"),
        classifier=Classifier(lambda params, batch: classify(config, data, params, batch), config.input),
    )
