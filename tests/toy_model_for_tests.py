"""The smallest model that tests train."""

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
