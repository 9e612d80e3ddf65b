"""Whether a training may use a run folder: an empty one, one that it resumes, and nothing else."""

import json
from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.io.temporary import owner
from a2g_jax.training.checkpoint import Checkpoints
from a2g_jax.training.run import RunConfig, run_to_json
from a2g_jax.training.run_file import RUN_FILE, WEIGHTS_FILE, read_description
from a2g_jax.training.run_hashes import WEIGHTS_HASH, Written, check_log, written_before

#: The lock of a run that is being trained.
LOCK = ".lock"
#: Settings that may change on resuming, because the computation of a step does not depend on them.
_FREE = frozenset({"checkpoint_every", "validate_every", "log_every", "keep_checkpoints", "tensorboard"})
#: Settings that :func:`a2g_jax.training.extension.extended` compares.
_LENGTH = frozenset({"steps", "stage_steps"})


def check_folder(out: Path, config: RunConfig, checkpoints: Checkpoints, resume: bool, on_demand: bool) -> Written:
    """Refuse a folder that cannot be used; what it holds if it is resumed."""
    if not (out / RUN_FILE).exists():
        # Killed processes leave their lock and temporary files.
        if any(path.name != LOCK and owner(path.name) is None for path in out.iterdir()):
            raise InputError(f"{out}: is not empty and holds no run; choose another folder.")
        return Written()
    if not checkpoints.steps() and not (out / WEIGHTS_FILE).exists():
        return Written()  # stopped before its first checkpoint: nothing is lost by starting again
    if not resume:
        raise InputError(f"{out}: holds a run already; continue it with --resume, or choose another folder.")
    values = read_description(out)
    if not isinstance(values.get("corpus"), dict):
        raise InputError(f"{out / RUN_FILE}: is damaged (corpus); restore it or choose another folder.")
    now = json.loads(json.dumps(run_to_json(config, 0)))
    changed = [
        f"{key.replace('_', ' ')}: {values.get(key)}, now {now.get(key)}"
        for key in ("model", "fps", "feature_network")
        if values.get(key) != now.get(key)
    ]
    if _without_name(values.get("from")) != _without_name(now.get("from")):
        changed.append(f"from: {values.get('from')}, now {now.get('from')}")
    # Without a checkpoint there is nothing to extend.
    length = _LENGTH if checkpoints.steps() else frozenset()
    free_settings = _FREE | length | (frozenset() if on_demand else {"part_steps"})
    for part, free in (("model_config", frozenset()), ("train_config", free_settings), ("mel", frozenset())):
        before: dict[str, Any] = values[part] if isinstance(values.get(part), dict) else {}
        changed += [
            f"{name}: {before.get(name)}, now {value}"
            for name, value in now[part].items()
            if name not in free and before.get(name, value) != value
        ]
    if values["corpus"].get("fingerprint") != config.corpus["fingerprint"]:
        changed.append("the corpus")
    if changed:
        raise InputError(f"{out}: was trained with other settings ({'; '.join(changed)}); resume with the same ones.")
    if wrong := check_log(out):
        raise InputError(f"{wrong}; restore it, or remove it to continue without its lines.")
    if WEIGHTS_HASH not in values:
        checkpoints.adopt()
    return written_before(out)


def _without_name(source: Any) -> Any:
    """What a run records of its source without the name or path, which may change; the hash of the weights does not."""
    if not isinstance(source, dict):
        return source
    # Runs of earlier versions record neither.
    return {"share": 1.0, "dynamics": False} | {key: value for key, value in source.items() if key != "run"}
