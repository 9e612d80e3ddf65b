"""Stylized flow (ECCV 2022) and its baseline MoGlow: an autoregressive normalising flow of poses."""

from a2g_jax.models.stylized_flow.config import PRESETS as PRESETS
from a2g_jax.models.stylized_flow.config import StylizedFlowConfig as StylizedFlowConfig
from a2g_jax.models.stylized_flow.model import build as build
