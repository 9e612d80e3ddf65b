"""Stylized flow (ECCV 2022) and its baseline MoGlow: an autoregressive normalising flow of poses."""

from a2g_jax.models.entry import Entry
from a2g_jax.models.stylized_flow.config import PRESETS, TRAINING_PRESETS, StylizedFlowConfig
from a2g_jax.models.stylized_flow.sampling import SAMPLING_PRESETS, StylizedFlowSampling

ENTRY = Entry(
    config=StylizedFlowConfig,
    presets=PRESETS,
    build="a2g_jax.models.stylized_flow.model:build",
    sampling=StylizedFlowSampling,
    sampling_presets=SAMPLING_PRESETS,
    training=TRAINING_PRESETS,
)
