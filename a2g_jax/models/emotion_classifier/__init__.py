"""Classifiers that tell a clip's emotion from its motion or from its audio, for EmotionGesture's emotion accuracy."""

from a2g_jax.models.emotion_classifier.config import PRESETS as PRESETS
from a2g_jax.models.emotion_classifier.config import EmotionClassifierConfig as EmotionClassifierConfig
from a2g_jax.models.emotion_classifier.model import build as build
from a2g_jax.models.emotion_classifier.model import classify as classify
