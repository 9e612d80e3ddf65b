"""Speech2Gesture: one motion for an audio, by regression and a GAN (Ginosar et al., CVPR 2019); a baseline."""

from a2g_jax.models.speech2gesture.config import PRESETS as PRESETS
from a2g_jax.models.speech2gesture.config import Speech2GestureConfig as Speech2GestureConfig
from a2g_jax.models.speech2gesture.model import build as build
