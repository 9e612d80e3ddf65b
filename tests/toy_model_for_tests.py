"""The smallest model that tests train, and initial parameters of runs."""

import jax

#: Settings that make Audio2Gestures train in a second a hundred steps.
TOY_MODEL = {
    "audio_channels": (8, 8),
    "motion_channels": (8, 8),
    "decoder_channels": (8, 8),
    "head_channels": 8,
    "code_channels": 4,
    "clip_frames": 16,
    "specific_frames": 1,
    "specific_jitter": 0,
    "smoothing": 0,
    "stored_codes": False,
    "adversarial_steps": 0,
}


def initial(config, seed=0):
    """Initial parameters of a run's model on the host, by one program; operation by operation they take seconds."""
    return jax.device_get(jax.jit(config.build().init)(jax.random.key(seed)))
