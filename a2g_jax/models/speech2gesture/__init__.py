"""Speech2Gesture (Ginosar et al. 2019), the deterministic baseline of Audio2Gestures' tables, with and without GAN."""

from a2g_jax.models.entry import Entry
from a2g_jax.models.speech2gesture.config import PRESETS, Speech2GestureConfig

ENTRY = Entry(config=Speech2GestureConfig, presets=PRESETS, build="a2g_jax.models.speech2gesture.model:build")
