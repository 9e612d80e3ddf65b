"""A training in a process of its own, for tests of several devices and processes."""

import json
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

#: Small settings of each family, at which a step is milliseconds and every kind of layer and update takes part.
FAMILIES: dict[str, dict[str, Any]] = {
    "audio2gestures": {
        "audio_channels": (8, 8),
        "motion_channels": (8, 8),
        "decoder_channels": (8, 8),
        "head_channels": 8,
        "code_channels": 4,
        "clip_frames": 32,
        "discriminator_channels": (8,),
        "adversarial_steps": 3,
    },
    "speech2gesture": {
        "audio_channels": (4, 4, 4, 4, 8, 8, 8, 8),
        "channels": 8,
        "discriminator_channels": (4, 8, 8),
        "clip_frames": 32,
    },
    "stylized_flow": {
        "flow_steps": 2,
        "hidden": 8,
        "clip_frames": 90,
        "audio_channels": 4,
        "style_channels": 4,
    },
    "emotion_gesture": {
        "channels": 8,
        "heads": 2,
        "hidden": 16,
        "layers": 1,
        "audio_channels": (4, 4, 8),
        "emotion_hidden": (8,),
        "word_width": 8,
        "word_buckets": 32,
        "discriminator_channels": 4,
        "mining_steps": 3,
        "vae_steps": 3,
        "sampled_steps": 3,
        "continued_chunks": 1,
    },
    "motion_autoencoder": {"encoder_channels": (8, 8, 8, 16, 4), "decoder_channels": (4, 8), "clip_frames": 16},
    "emotion_classifier": {"channels": (16, 16), "hidden": 8, "width": 16, "layers": 2, "heads": 2, "clip_frames": 20},
}


def settings_of(family: str, **training: Any) -> dict[str, Any]:
    """Settings of a training of one family: a JSON object for :func:`main`."""
    from a2g_jax.models import find_model

    entry = find_model(family)
    model = replace(entry.presets["tiny"], **FAMILIES[family])
    common = {
        "steps": 6,
        "batch_size": 16,
        "log_every": 1,
        "checkpoint_every": 4,
        "validate_every": 4,
        "warmup_steps": 2,
    }
    settings = replace(entry.training_preset("tiny"), **{**common, **training})
    return {"name": family, "model": asdict(model), "training": asdict(settings)}


def main(path: str) -> None:
    """Train with the settings in a file: ``name``, ``model``, ``training``, ``corpus``, ``out`` and ``devices``."""
    from a2g_jax.config import from_json
    from a2g_jax.models import find_model
    from a2g_jax.models.train_config import TrainConfig
    from a2g_jax.training.processes import joined_processes
    from a2g_jax.training.start import run_training

    values = json.loads(Path(path).read_text(encoding="utf-8"))
    model = from_json(find_model(values["name"]).config, values["model"], "model")
    training = from_json(TrainConfig, values["training"], "training")
    more = {"devices": values["devices"]} if values.get("devices") else {}
    about = values["name"], "tiny", model, training, values["corpus"], values["out"], values.get("resume", False)
    with joined_processes():
        run_training(*about, **more)


if __name__ == "__main__":
    from a2g_jax.errors import A2GError, Interrupted

    try:
        main(sys.argv[1])
    except A2GError as error:  # as the command line does
        print(f"a2g: {error}", file=sys.stderr)
        sys.exit(130 if isinstance(error, Interrupted) else 2)
