"""A convolutional autoencoder of motion, whose features FID, LPIPS and the gesture perceptual loss compare."""

from a2g_jax.models.entry import Entry
from a2g_jax.models.motion_autoencoder.config import PRESETS, MotionAutoencoderConfig

ENTRY = Entry(config=MotionAutoencoderConfig, presets=PRESETS, build="a2g_jax.models.motion_autoencoder.model:build")
