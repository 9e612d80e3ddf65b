"""Audio2Gestures: a conditional VAE with a shared and a motion-specific code (Li et al., ICCV 2021, and extension)."""

from a2g_jax.models.audio2gestures.config import PRESETS as PRESETS
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig as Audio2GesturesConfig
from a2g_jax.models.audio2gestures.model import build as build
