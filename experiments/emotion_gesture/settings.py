"""Rows that several tables share, and how they are trained.

Rows of the paper have its parts at the size of the preset ``tiny``, with what small trainings need: poses as z-scores,
the weight of the reconstruction that belongs to them, scaled products in the prompter (as printed its sigmoids begin
saturated) and a position encoding of the decoder's queries (without one, zeros are the same query at every frame). What
else ``tiny`` has is its own row.
"""

from dataclasses import asdict, fields
from typing import Any

from a2g_jax.models import find_model
from experiments.tables.runs import Variant

MODEL = "emotion_gesture"
_ENTRY = find_model(MODEL)
TINY = _ENTRY.presets["tiny"]

#: Fields of ``tiny`` in all rows: sizes, and what small trainings need.
_KEPT = (
    *("channels", "heads", "hidden", "layers", "dropout", "audio_blocks", "audio_channels", "audio_stem"),
    *("emotion_hidden", "emotion_pool", "word_width", "word_layers", "word_buckets", "word_vectors"),
    *("discriminator_channels", "discriminator_layers", "discriminator_hidden"),
    *("clip_frames", "seed_frames", "transition_frames", "vae_latent", "vae_channels", "vae_kl_weight"),
    *("normalise_pose", "scaled_scores", "query_positions", "reconstruction_weight", "adversarial_weight"),
    *("smooth_weight", "beat_weight", "emotion_weight", "vae_steps"),
)
#: The paper's method at the size of ``tiny``, as changes of that preset; seams as the paper leaves them.
BASE: dict[str, Any] = {
    field.name: getattr(_ENTRY.config(), field.name) for field in fields(_ENTRY.config) if field.name not in _KEPT
} | {"seam_frames": 0, "discriminator_hidden": (256, 64, 16)}

#: Training settings of the preset; the table has its own steps and seeds.
TRAINING = {
    name: value
    for name, value in asdict(_ENTRY.training_preset("tiny")).items()
    if name not in ("steps", "seed", "validate_every", "checkpoint_every", "keep_checkpoints", "tensorboard")
}

#: The emotion of the audio, with sampled features.
SAMPLED = {"emotion": "sample"}


def ours(trained_as: str = "", generation: dict[str, Any] | None = None, **changes: Any) -> Variant:
    """The preset ``tiny`` with changes."""
    return Variant(changes, model=MODEL, training=TRAINING, generation=generation, trained_as=trained_as)


def paper(**changes: Any) -> Variant:
    """The paper's method with changes, without the emotion-conditioned VAE unless given its steps."""
    return ours(**{**BASE, "vae_steps": 0, **changes})


#: The full method of the paper; its chunk length is that of the preset.
FULL = paper(vae_steps=TINY.vae_steps)
