"""Classifiers of a clip's emotion by its motion or its audio, for EmotionGesture's emotion accuracy."""

from a2g_jax.models.emotion_classifier.config import PRESETS, EmotionClassifierConfig
from a2g_jax.models.entry import Entry

ENTRY = Entry(
    config=EmotionClassifierConfig,
    presets=PRESETS,
    build="a2g_jax.models.emotion_classifier.model:build",
    needs_emotions=True,
)
