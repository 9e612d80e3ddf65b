"""The generated speech of ``a2g demo``."""

from typing import Any

from a2g_jax.recording import Recording
from a2g_jax.talker.recordings import talk

#: Arguments of :func:`~a2g_jax.talker.recordings.talk`; no training corpus uses this seed.
DEMO_SPEECH: dict[str, Any] = {"seconds": 20.0, "seed": 20211011, "speaker": "chiara", "emotion": "neutral"}


def demo_speech() -> Recording:
    """The generated recording that ``a2g demo`` makes motions for."""
    return talk(**DEMO_SPEECH)
