"""Speech audio to many different, natural co-speech gestures, in JAX."""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

# Imported on first use: the command line must not wait for JAX before it prints its help.
_EXPORTS = {
    "Corpus": "a2g_jax.data.corpus",
    "Figure": "a2g_jax.viz.player",
    "Generator": "a2g_jax.generation.engine",
    "Motion": "a2g_jax.geometry.motion",
    "Recording": "a2g_jax.data.recording",
    "Skeleton": "a2g_jax.geometry.skeleton",
    "demo_run": "a2g_jax.training.run",
    "load_run": "a2g_jax.training.run",
    "read_audio": "a2g_jax.io.audio",
    "read_bvh": "a2g_jax.io.bvh",
    "resample_motion": "a2g_jax.talker.recordings",
    "talk": "a2g_jax.talker.recordings",
    "train": "a2g_jax.training.loop",
    "write_bvh": "a2g_jax.io.bvh",
    "write_page": "a2g_jax.viz.player",
}

__all__ = ["__version__", *_EXPORTS]


def __getattr__(name: str) -> Any:
    if name not in _EXPORTS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_EXPORTS[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_EXPORTS])
