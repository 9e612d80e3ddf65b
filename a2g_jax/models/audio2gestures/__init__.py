"""Audio2Gestures: a conditional VAE with a shared and a motion-specific code (Li et al., ICCV 2021, and extension)."""

from a2g_jax.models.audio2gestures.config import PRESETS, Audio2GesturesConfig
from a2g_jax.models.audio2gestures.sampling import SAMPLING_PRESETS, Audio2GesturesSampling
from a2g_jax.models.entry import Entry
from a2g_jax.models.train_config import TRAIN_PRESETS

ENTRY = Entry(
    config=Audio2GesturesConfig,
    presets=PRESETS,
    build="a2g_jax.models.audio2gestures.model:build",
    sampling=Audio2GesturesSampling,
    sampling_presets=SAMPLING_PRESETS,
    training=TRAIN_PRESETS,
)
