"""EmotionGesture (Qi et al. 2024): gestures from speech with mined or chosen emotion, continuing given poses."""

from a2g_jax.models.emotion_gesture.config import PRESETS, TRAINING_PRESETS, EmotionGestureConfig
from a2g_jax.models.emotion_gesture.sampling import SAMPLING_PRESETS, EmotionGestureSampling
from a2g_jax.models.entry import Entry

ENTRY = Entry(
    config=EmotionGestureConfig,
    presets=PRESETS,
    build="a2g_jax.models.emotion_gesture.model:build",
    sampling=EmotionGestureSampling,
    sampling_presets=SAMPLING_PRESETS,
    training=TRAINING_PRESETS,
    needs_emotions=True,
)
