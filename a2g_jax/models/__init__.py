"""The models, by the names the command line knows them by."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from a2g_jax.errors import InputError
from a2g_jax.geometry.pose_space import WIDTHS
from a2g_jax.models import audio2gestures, emotion_classifier, motion_autoencoder, speech2gesture, stylized_flow
from a2g_jax.models.base import Data, Model


class Entry(NamedTuple):
    """How to make a model."""

    config_class: type
    presets: Mapping[str, Any]
    build: Callable[[Any, Data], Model]
    poses: tuple[str, ...] = ("6d",)
    """Representations of poses that it takes."""


MODELS: dict[str, Entry] = {
    "audio2gestures": Entry(
        audio2gestures.Audio2GesturesConfig,
        audio2gestures.PRESETS,
        audio2gestures.build,
        tuple(WIDTHS),
    ),
    "speech2gesture": Entry(
        speech2gesture.Speech2GestureConfig, speech2gesture.PRESETS, speech2gesture.build, tuple(WIDTHS)
    ),
    "stylized_flow": Entry(stylized_flow.StylizedFlowConfig, stylized_flow.PRESETS, stylized_flow.build, tuple(WIDTHS)),
    "motion_autoencoder": Entry(
        motion_autoencoder.MotionAutoencoderConfig, motion_autoencoder.PRESETS, motion_autoencoder.build, tuple(WIDTHS)
    ),
    "emotion_classifier": Entry(
        emotion_classifier.EmotionClassifierConfig, emotion_classifier.PRESETS, emotion_classifier.build, tuple(WIDTHS)
    ),
}


def find_model(name: str) -> Entry:
    """The model of that name.

    Raises:
        InputError: there is none.
    """
    if name not in MODELS:
        raise InputError(f"no model {name!r}; there are: {', '.join(MODELS)}.")
    return MODELS[name]
