"""Audio2Gestures: a conditional VAE with a shared and a motion-specific code (Li et al., ICCV 2021, and extension)."""

from dataclasses import replace

from a2g_jax.models.audio2gestures.config import PRESETS, Audio2GesturesConfig
from a2g_jax.models.audio2gestures.sampling import SAMPLING_PRESETS, Audio2GesturesSampling
from a2g_jax.models.entry import Entry
from a2g_jax.models.train_config import TRAIN_PRESETS

#: Settings of training by preset: the authors' command in addition to the common ones, and long clips.
_TRAINING = {
    **TRAIN_PRESETS,
    "authors": replace(TRAIN_PRESETS["paper"], batch_size=32),
    "tiny": replace(TRAIN_PRESETS["tiny"], batch_size=4),
}

ENTRY = Entry(
    config=Audio2GesturesConfig,
    presets=PRESETS,
    build="a2g_jax.models.audio2gestures.model:build",
    sampling=Audio2GesturesSampling,
    sampling_presets=SAMPLING_PRESETS,
    training=_TRAINING,
)
