"""Stylized flow (ECCV 2022) and its baseline MoGlow: an autoregressive normalising flow of poses."""

from dataclasses import replace

from a2g_jax.models.entry import Entry
from a2g_jax.models.fine_tuning import FineTuning
from a2g_jax.models.stylized_flow.config import PRESETS, TRAINING_PRESETS, StylizedFlowConfig
from a2g_jax.models.stylized_flow.sampling import SAMPLING_PRESETS, StylizedFlowSampling

#: The encoder of the audio stays, and steps are few, since the flow soon overfits to a minute of speech. Constant
#: channels have no density, and the others keep theirs.
_FINE_TUNING = FineTuning(
    replace(
        TRAINING_PRESETS["tiny"],
        steps=100,
        learning_rate=3e-4,
        warmup_steps=20,
        checkpoint_every=25,
        validate_every=25,
        patience=3,
    ),
    frozen=("audio_encoder",),
    audio_statistics="run",
    keep_constant=True,
)

ENTRY = Entry(
    config=StylizedFlowConfig,
    presets=PRESETS,
    build="a2g_jax.models.stylized_flow.model:build",
    sampling=StylizedFlowSampling,
    sampling_presets=SAMPLING_PRESETS,
    training=TRAINING_PRESETS,
    fine_tuning=_FINE_TUNING,
)
