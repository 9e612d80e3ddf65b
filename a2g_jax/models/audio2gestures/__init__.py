"""Audio2Gestures: a conditional VAE with a shared and a motion-specific code (Li et al., ICCV 2021, and extension)."""

from dataclasses import replace

from a2g_jax.models.audio2gestures.config import PRESETS, Audio2GesturesConfig
from a2g_jax.models.audio2gestures.sampling import SAMPLING_PRESETS, Audio2GesturesSampling
from a2g_jax.models.entry import Entry
from a2g_jax.models.fine_tuning import FineTuning
from a2g_jax.models.train_config import TRAIN_PRESETS, TrainConfig

#: Settings of training by preset: the authors' command in addition to the common ones, and long clips.
_TRAINING = {
    **TRAIN_PRESETS,
    "authors": replace(TRAIN_PRESETS["paper"], batch_size=32),
    "tiny": replace(TRAIN_PRESETS["tiny"], batch_size=4),
}

#: The decoder learns how the person moves in the game with the discriminator. Since it overfits a minute of motion, its
#: weights are averaged with those that it started from. Higher weights of the game calm the motion (4: hands
#: nearly stand still). The encoders stay, and so do the audio's z-scores.
_FINE_TUNING = FineTuning(
    TrainConfig(
        steps=300,
        batch_size=4,
        learning_rate=1e-3,
        augmentation=1.0,
        checkpoint_every=50,
        validate_every=50,
        patience=4,
    ),
    stages=("adversarial",),
    audio_statistics="run",
    share=0.6,
    dynamics=True,
)

ENTRY = Entry(
    config=Audio2GesturesConfig,
    presets=PRESETS,
    build="a2g_jax.models.audio2gestures.model:build",
    sampling=Audio2GesturesSampling,
    sampling_presets=SAMPLING_PRESETS,
    training=_TRAINING,
    fine_tuning=_FINE_TUNING,
)
