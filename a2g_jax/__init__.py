"""Speech audio to many different, natural co-speech gestures, in JAX."""

from importlib import import_module
from typing import Any

__version__ = "0.2.0"

# Imported on first use: the command line must not wait for JAX before it prints its help. `__init__.pyi` has the same
# names for editors and type checkers.
_EXPORTS = {
    "Corpus": "a2g_jax.data.corpus",
    "Delivery": "a2g_jax.generation.delivery",
    "EmotionSpace": "a2g_jax.generation.emotion_gesture.emotion_space",
    "Figure": "a2g_jax.viz.player.figure",
    "FlowSpace": "a2g_jax.generation.stylized_flow.latent_space",
    "Generator": "a2g_jax.generation.generator",
    "InputError": "a2g_jax.errors",
    "LatentSpace": "a2g_jax.generation.audio2gestures.latent_space",
    "Motion": "a2g_jax.geometry.motion",
    "PoseSpace": "a2g_jax.geometry.pose_space",
    "Programs": "a2g_jax.generation.programs.loaded",
    "Recording": "a2g_jax.recording",
    "Run": "a2g_jax.training.run_config",
    "RunConfig": "a2g_jax.training.run_config",
    "Skeleton": "a2g_jax.geometry.skeleton",
    "Stream": "a2g_jax.generation.live.stream",
    "Style": "a2g_jax.generation.stylized_flow.style",
    "check_motion": "a2g_jax.metrics.body.check",
    "control_rows": "a2g_jax.generation.controls",
    "demo_run": "a2g_jax.training.run",
    "evaluate": "a2g_jax.evaluation.evaluate",
    "export": "a2g_jax.generation.export",
    "export_programs": "a2g_jax.generation.programs.writing",
    "find_model": "a2g_jax.models.registry",
    "find_rig": "a2g_jax.geometry.retarget.rig",
    "inspect": "a2g_jax.inspection.inspect",
    "keep_compilations": "a2g_jax.compilations",
    "load_run": "a2g_jax.training.run",
    "log_mel": "a2g_jax.features.mel",
    "match_rigs": "a2g_jax.geometry.retarget.match",
    "motion_likelihood": "a2g_jax.inspection.likelihood",
    "open_run": "a2g_jax.training.run",
    "rank_samples": "a2g_jax.generation.ranking",
    "read_audio": "a2g_jax.io.audio",
    "read_bvh": "a2g_jax.io.bvh_reader",
    "read_character": "a2g_jax.io.character",
    "read_motion_npz": "a2g_jax.io.npz",
    "resample_motion": "a2g_jax.talker.recordings",
    "retarget": "a2g_jax.geometry.retarget.transfer",
    "show_page": "a2g_jax.viz.player.inline",
    "talk": "a2g_jax.talker.recordings",
    "train": "a2g_jax.training.loop",
    "unusual_speech": "a2g_jax.generation.unusual_speech",
    "write_audio": "a2g_jax.io.audio",
    "write_bvh": "a2g_jax.io.bvh_writer",
    "write_motion_npz": "a2g_jax.io.npz",
    "write_page": "a2g_jax.viz.player.page",
}

__all__ = ["__version__", *_EXPORTS]


def __getattr__(name: str) -> Any:
    if name not in _EXPORTS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_EXPORTS[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
