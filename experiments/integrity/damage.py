"""Changed bits, blocks of zeros and cuts at random places of files, and whether each is named before it is used."""

import shutil
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_integrity import verify_corpus
from a2g_jax.errors import InputError
from a2g_jax.io.files import read_json, write_json
from a2g_jax.training.checkpoint import Checkpoints
from a2g_jax.training.fine_tuning import training_model
from a2g_jax.training.run import load_run
from a2g_jax.training.run_hashes import check_log
from a2g_jax.training.stages import stage_spans
from a2g_jax.training.state import init_state
from experiments.integrity.commands import Inputs

KINDS = ("bit", "zeros", "cut")
NAMED, UNNAMED, SILENT, CRASH = "named", "refused without the file's name", "used silently", "crash"


def campaign(inputs: Inputs, cache: Path, number: int, seed: int) -> dict[str, dict[str, dict[str, int]]]:
    """Outcomes by subject and kind of damage; what was done before is not repeated."""
    found: dict[str, dict[str, dict[str, int]]] = {}
    for subject, (folder, use) in _subjects(inputs).items():
        place = cache / f"damage {subject} {seed}.json"
        rows: list[list[str]] = read_json(place) if place.is_file() else []
        work = cache / f"damaged {subject}"
        if len(rows) < number:
            shutil.rmtree(work, ignore_errors=True)
            shutil.copytree(folder, work)
            use(work)  # as it is, it can be used
        for count in range(len(rows), number):
            rows.append(_one(work, use, np.random.default_rng([seed, count])))
            if count % 20 == 19 or count == number - 1:
                use(work)
                write_json(place, rows)
        found[subject] = {kind: dict(Counter(row[1] for row in rows[:number] if row[0] == kind)) for kind in KINDS}
    return found


def _one(work: Path, use: Callable[[Path], None], rng: np.random.Generator) -> list[str]:
    """Kind of damage, outcome, file and message."""
    files = sorted(path for path in work.rglob("*") if path.is_file() and path.stat().st_size)
    sizes = np.array([path.stat().st_size for path in files], float)
    # Half of the places are uniform over bytes, half over files.
    chosen = rng.choice(len(files), p=None if rng.random() < 0.5 else sizes / sizes.sum())
    path, kind = files[chosen], str(rng.choice(KINDS))
    data, at = path.read_bytes(), int(rng.integers(sizes[chosen]))
    if kind == "bit":
        changed = data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :]
    elif kind == "zeros":
        size = int(rng.integers(1, 4097))
        changed = data[:at] + bytes(len(data[at : at + size])) + data[at + size :]
    else:
        changed = data[:at]
    name = path.relative_to(work).as_posix()
    if changed == data:  # zeros on zeros
        return _one(work, use, rng)
    path.write_bytes(changed)
    try:
        use(work)
        outcome, message = SILENT, ""
    except InputError as error:
        message = str(error)
        outcome = NAMED if path.name in message and "\n" not in message else UNNAMED
    except Exception as error:  # noqa: BLE001 - counted
        outcome, message = CRASH, repr(error)[:200]
    path.write_bytes(data)
    return [kind, outcome, name, message]


def _subjects(inputs: Inputs) -> dict[str, tuple[Path, Callable[[Path], None]]]:
    """The folder of each subject, and how it is used."""
    config = load_run(inputs.run).config
    model = training_model(config)
    state: Any = init_state(model, stage_spans(model, config.train_config), 0)

    def use_corpus(folder: Path) -> None:
        verify_corpus(Corpus.open(folder))

    def use_run(folder: Path) -> None:
        load_run(folder)
        if wrong := check_log(folder):
            raise InputError(wrong)

    def use_checkpoint(folder: Path) -> None:
        if Checkpoints(folder, 1).restore(state) is None:
            raise InputError(f"{folder}: holds no checkpoint.")

    return {
        "corpora": (inputs.corpus, use_corpus),
        "runs": (_alone(inputs, "run", ("run.json", "weights.safetensors", "metrics.jsonl")), use_run),
        "checkpoints": (_alone(inputs, "checkpoints", _latest(inputs)), use_checkpoint),
    }


def _latest(inputs: Inputs) -> tuple[str, ...]:
    step = Checkpoints(inputs.run / "checkpoints", 1).steps()[-1]
    return f"checkpoints/{step}", f"checkpoints/{step}.json"


def _alone(inputs: Inputs, name: str, parts: tuple[str, ...]) -> Path:
    """A folder with these parts of the run."""
    folder = inputs.folder / f"only {name}"
    if not folder.is_dir():
        folder.mkdir()
        for part in parts:
            source, target = inputs.run / part, folder / Path(part).name
            shutil.copytree(source, target) if source.is_dir() else shutil.copy(source, target)
    return folder
