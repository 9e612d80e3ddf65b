"""Rows that several tables share, and how they are trained.

Rows of the paper have its parts at the size of the preset ``tiny``, with what small trainings need to leave the mean
pose: poses as z-scores, the weight of the reconstruction that belongs to them, scaled products in the prompter (as
printed its sigmoids begin saturated), a position encoding and the audio in the decoder's queries, the last initial pose
added to the output, a discriminator of patches, and features that are trained first. What else ``tiny`` has, above all
emotions exchanged between clips, is its own row.
"""

from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from typing import Any

from a2g_jax.models import find_model
from experiments.tables.setting import Variant

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
    *("query_audio", "hold_seed", "smoothing", "discriminator", "mismatched", "mining_steps"),
)
#: The paper's method at the size of ``tiny``, as changes of that preset; seams as the paper leaves them.
BASE: dict[str, Any] = {
    field.name: getattr(_ENTRY.config(), field.name) for field in fields(_ENTRY.config) if field.name not in _KEPT
} | {"seam_frames": 0, "discriminator_hidden": (256, 64, 16)}

#: Stages of training besides the main one and the emotion-conditioned VAE, and the steps of the main one in the preset.
_STAGES = [field.name for field in fields(_ENTRY.config) if field.name.endswith("_steps") and field.name != "vae_steps"]
PRESET_STEPS = _ENTRY.training_preset("tiny").steps

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


def scaled(variants: Mapping[str, Variant], steps: int) -> dict[str, Variant]:
    """Rows whose further stages have the same share of a row's steps as of the preset's.

    The VAE is small and keeps its steps, up to the row's.
    """
    return {name: _scaled(variant, steps) if variant.model == MODEL else variant for name, variant in variants.items()}


def _scaled(variant: Variant, steps: int) -> Variant:
    own = {name: variant.changes.get(name, getattr(TINY, name)) for name in (*_STAGES, "vae_steps")}
    main = round(steps * variant.steps)
    found = {
        name: min(own[name], main) if name == "vae_steps" else round(own[name] * main / PRESET_STEPS) for name in own
    }
    return replace(variant, changes={**variant.changes, **found})


#: The full method of the paper; its chunk length is that of the preset.
FULL = paper(vae_steps=TINY.vae_steps)
