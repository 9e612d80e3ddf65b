"""STFT, SSIM and LPIPS as metrics; the functions are :mod:`a2g_jax.features.similarity`'s, which train models too."""

from a2g_jax.features.similarity import STFT_EPSILON as STFT_EPSILON
from a2g_jax.features.similarity import STFT_HOP as STFT_HOP
from a2g_jax.features.similarity import STFT_WINDOW as STFT_WINDOW
from a2g_jax.features.similarity import lpips as lpips
from a2g_jax.features.similarity import ssim as ssim
from a2g_jax.features.similarity import stft_distance as stft_distance
from a2g_jax.features.similarity import stft_magnitudes as stft_magnitudes
