"""Checkpoints of a training run, with Orbax: atomic, the latest few."""

import os
import shutil
from pathlib import Path
from typing import Any

from orbax.checkpoint import v1 as ocp

from a2g_jax.errors import InputError
from a2g_jax.training.state import TrainState


class Checkpoints:
    """The checkpoints folder of a run: a checkpoint is complete under its step's number, or absent."""

    def __init__(self, folder: str | os.PathLike[str], keep: int) -> None:
        self.folder = Path(folder).absolute()
        self.keep = max(1, keep)

    def steps(self) -> list[int]:
        """Steps of the checkpoints, oldest first."""
        if not self.folder.is_dir():
            return []
        return sorted(int(path.name) for path in self.folder.iterdir() if path.is_dir() and path.name.isdigit())

    def save(self, state: TrainState, best: int | None = None) -> None:
        """Save the state under its step, then remove all but the latest few and the best.

        Args:
            best: the step of the best checkpoint, if that is kept.
        """
        step = int(state.step)
        path = self.folder / str(step)
        if path.exists():
            return
        self.folder.mkdir(parents=True, exist_ok=True)
        ocp.save(path, state._asdict())
        for old in self.steps()[: -self.keep]:
            if old != best:
                shutil.rmtree(self.folder / str(old))

    def restore(self, like: TrainState, step: int | None = None) -> TrainState | None:
        """The latest state, or None if there is none.

        Args:
            like: a state of the run's shapes, such as that of step 0.
            step: of another checkpoint.

        Raises:
            InputError: the checkpoint is damaged or of another model.
        """
        steps = self.steps()
        if not steps:
            return None
        path = self.folder / str(steps[-1] if step is None else step)
        try:
            tree = _load(path, like)
        except InputError:
            raise
        except Exception as error:
            first = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise InputError(
                f"{path}: cannot be resumed from ({first[:200]}); remove this folder to resume from the one before it,"
                " or start again without --resume."
            ) from error
        return TrainState(**tree)


def _load(path: Path, like: TrainState) -> dict[str, Any]:
    """The arrays of a checkpoint; those of version 0.1 had the state of one optimiser under another name."""
    old = "optimisers" not in _names(path)
    if old and len(like.optimisers) > 1:
        raise InputError(f"{path}: is of version 0.1, which had one optimiser; start again without --resume.")
    if not old:
        return dict(ocp.load(path, like._asdict()))
    (name, optimiser), *_ = like.optimisers.items()
    before = {key: value for key, value in like._asdict().items() if key != "optimisers"}
    tree = dict(ocp.load(path, {**before, "optimiser": optimiser}))
    tree["optimisers"] = {name: tree.pop("optimiser")}
    return tree


def _names(path: Path) -> set[str]:
    """Top-level names of the arrays in a checkpoint."""
    metadata: Any = ocp.metadata(path).metadata
    return set(metadata)


def sweep_unfinished(folder: Path) -> None:
    """Remove the unfinished folders of a killed save."""
    if folder.is_dir():
        for path in folder.iterdir():
            if path.is_dir() and not path.name.isdigit():
                shutil.rmtree(path, ignore_errors=True)
