"""Checkpoints of a training run, with Orbax: atomic, the latest few."""

import errno
import logging
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import jax
import numpy as np
from orbax.checkpoint import v1 as ocp

from a2g_jax.errors import InputError
from a2g_jax.io.files import disk_full, unwritable
from a2g_jax.training.checkpoint_files import check_files, list_path, write_list
from a2g_jax.training.processes import is_first, of_first, together
from a2g_jax.training.state import TrainState

#: Beginnings of the names of folders that are being written and removed.
_SAVING, _REMOVED = "saving-", "removed-"
#: After a failed save: seconds without new files after which Orbax's threads count as stopped, and the longest wait.
_QUIET, _STOPPING = 0.5, 10.0


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

        Of several processes, which have a folder in common, all are to call it.

        Args:
            best: the step of the best checkpoint, if that is kept.
        """
        step = int(state.step)
        path = self.folder / str(step)
        first = is_first()
        (exists,) = of_first([path.exists()])
        if exists:
            return
        saving = self.folder / f"{_SAVING}{step}"
        try:
            if first:
                self.folder.mkdir(parents=True, exist_ok=True)
                _check_space(self.folder, state)
                shutil.rmtree(saving, ignore_errors=True)
            together(f"before checkpoint {step}")
            with _quiet():
                ocp.save(saving, state._asdict())
            if not first:
                return
            # A checkpoint gets its name last, when all that belongs to it is on the disk.
            write_list(saving, path)
            saving.rename(path)
        except Exception as error:
            _sweep_failed(self.folder)
            if not disk_full(error):
                raise
            last = max(self.steps(), default=None)
            kept = "there is no earlier one" if last is None else f"that of step {last} is complete"
            remedy = f"{kept}; free some space, then resume with --resume"
            raise unwritable(path, error, remedy) from error
        for old in self.steps()[: -self.keep]:
            if old != best:
                self._remove(old)

    def _remove(self, step: int) -> None:
        path = self.folder / str(step)
        hidden = self.folder / f"{_REMOVED}{step}"  # a part of one never has its name
        path.rename(hidden)
        list_path(path).unlink(missing_ok=True)
        shutil.rmtree(hidden, ignore_errors=True)

    def adopt(self) -> None:
        """Add lists of files to the checkpoints of version 0.1.0, which have none."""
        for step in self.steps():
            path = self.folder / str(step)
            if not list_path(path).exists():
                write_list(path, path)

    def restore(self, like: TrainState, step: int | None = None) -> TrainState | None:
        """The latest state, or None if there is none.

        Args:
            like: a state of the run's shapes, such as that of step 0.
            step: of another checkpoint.

        Raises:
            InputError: a file of the checkpoint is changed, missing or added, or it is of another model.
        """
        steps = self.steps()
        if not steps:
            return None
        path = self.folder / str(steps[-1] if step is None else step)
        check_files(path)
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
        return jax.tree.map(_placed, TrainState(**tree), like)


def _placed(array: jax.Array, like: jax.Array) -> jax.Array:
    """An array of a checkpoint, bound to a device only if the array in whose place it comes is.

    Orbax binds all to one. JAX compiles other programs for bound arrays, so a run that resumes would compile anew what
    it has in the compilation cache.
    """
    if like.committed:
        return array
    if jax.dtypes.issubdtype(array.dtype, jax.dtypes.prng_key):
        data = _placed(jax.random.key_data(array), jax.random.key_data(like))
        return jax.random.wrap_key_data(data, impl=jax.random.key_impl(like))
    return jax.device_put(np.asarray(array))


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
    """Remove what a killed or failed save left; nobody else may save there meanwhile."""
    for path in _unfinished(folder):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def _unfinished(folder: Path) -> list[Path]:
    """Folders without the name of a checkpoint, and lists of files without a checkpoint."""
    if not folder.is_dir():
        return []
    return [
        path
        for path in folder.iterdir()
        if (not path.name.isdigit() if path.is_dir() else path.suffix == ".json" and not path.with_suffix("").is_dir())
    ]


def _sweep_failed(folder: Path) -> None:
    """Remove what a failed save left. Orbax raises its first error while other threads still write their files."""
    began = written = time.monotonic()
    while (now := time.monotonic()) < min(written + _QUIET, began + _STOPPING):
        if _unfinished(folder):
            written = now
            sweep_unfinished(folder)
        time.sleep(_QUIET / 20)


def _check_space(folder: Path, state: TrainState) -> None:
    """Raise the error of a full disk where the state surely does not fit; libraries write pages about theirs."""
    size = sum(array.nbytes for array in jax.tree.leaves(state._replace(key=jax.random.key_data(state.key))))
    # Compression saves little of random numbers.
    if shutil.disk_usage(folder).free < 0.8 * size:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder))


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence what Orbax logs about errors, which are raised as well."""
    logger = logging.getLogger("absl")
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(before)
