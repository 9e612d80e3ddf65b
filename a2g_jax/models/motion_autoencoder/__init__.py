"""The convolutional motion autoencoder whose features FID, LPIPS and the gesture perceptual loss look at."""

from a2g_jax.models.motion_autoencoder.config import PRESETS as PRESETS
from a2g_jax.models.motion_autoencoder.config import MotionAutoencoderConfig as MotionAutoencoderConfig
from a2g_jax.models.motion_autoencoder.model import build as build
from a2g_jax.models.motion_autoencoder.model import encode as encode
