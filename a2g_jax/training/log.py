"""The output of a training run: a progress bar, metrics.jsonl, and TensorBoard on request."""

import hashlib
import json
import math
import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.io.files import atomic_path, unwritable
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.run_file import LOG_FILE

_REMEDY = "free some space, then resume with --resume"


class MetricsLog:
    """Writes ``metrics.jsonl`` in a run folder; use as a context manager.

    One JSON object a line: ``step``, ``split`` ("train" or "validation") and the terms. Time is not among them, so that
    a resumed run's file equals an uninterrupted one's.
    """

    def __init__(self, folder: Path, done: int, settings: TrainConfig, progress: bool, total: int) -> None:
        self.path = folder / LOG_FILE
        self._drop_after(done)
        self._size, self._digest = 0, hashlib.sha256()
        self.settings = settings
        self.tensorboard: Any = None
        if settings.tensorboard:
            try:
                from tensorboardX import SummaryWriter
            except ImportError:
                raise InputError(
                    "--tensorboard needs the extra of that name: pip install 'a2g_jax[tensorboard]'."
                ) from None
            self.tensorboard = SummaryWriter(str(folder / "tensorboard"), purge_step=done + 1)
        from tqdm import tqdm

        # A terminal gets a moving bar, a log file an occasional line.
        every = 0.5 if sys.stderr.isatty() else 30.0
        self.bar = tqdm(
            total=total,
            initial=done,
            unit="step",
            desc="training",
            mininterval=every,
            disable=not progress,
            dynamic_ncols=sys.stderr.isatty(),
            file=sys.stderr,
        )

    def __enter__(self) -> "MetricsLog":
        try:
            self._count(self.path.read_bytes() if self.path.exists() else b"")
            self.file = self.path.open("ab", buffering=0)
        except OSError as error:
            raise unwritable(self.path, error) from None
        return self

    @property
    def written(self) -> dict[str, Any]:
        """Length and SHA-256 of the file."""
        return {"bytes": self._size, "sha256": self._digest.hexdigest()}

    def _count(self, data: bytes) -> None:
        self._size += len(data)
        self._digest.update(data)

    def __exit__(self, *_: object) -> None:
        self.file.close()
        self.bar.close()
        if self.tensorboard is not None:
            self.tensorboard.close()

    def tick(self, step: int) -> None:
        """Advance the progress bar to a step."""
        self.bar.update(step - self.bar.n)

    def write(self, step: int, values: dict[str, float]) -> None:
        """Write the terms of a training step."""
        names = [name for name in ("loss", "position", "relaxed", "gradient_norm") if name in values]
        self.bar.set_postfix({name: f"{values[name]:.4g}" for name in names}, refresh=False)
        self.tick(step)
        self._line(step, "train", values)

    def write_validation(self, step: int, values: dict[str, float]) -> None:
        """Write the mean terms over the validation split, unless there are none."""
        if values:
            self._line(step, "validation", values)

    def _line(self, step: int, split: str, values: dict[str, float]) -> None:
        # JSON has no NaN.
        plain = {name: value if math.isfinite(value) else None for name, value in values.items()}
        line = (json.dumps({"step": step, "split": split, **plain}) + "\n").encode()
        try:
            rest = line
            while rest:  # a disk that is almost full takes a part
                rest = rest[self.file.write(rest) :]
        except OSError as error:
            with suppress(OSError):
                os.ftruncate(self.file.fileno(), self._size)
            raise unwritable(self.path, error, _REMEDY) from error
        self._count(line)
        if self.tensorboard is not None:
            for name, value in values.items():
                self.tensorboard.add_scalar(f"{split}/{name}", value, step)

    def _drop_after(self, done: int) -> None:
        """Remove lines of steps that will be repeated, and a line truncated by a kill."""
        if not self.path.exists():
            return
        kept = []
        for line in self.path.read_text(encoding="utf-8").splitlines():
            try:
                if json.loads(line)["step"] <= done:
                    kept.append(line)
            except (ValueError, KeyError):
                continue
        with atomic_path(self.path) as temporary:
            temporary.write_text("".join(line + "\n" for line in kept), encoding="utf-8")


class NoLog:
    """The log of a process that writes none, beside the one that does."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / LOG_FILE
        self.written: dict[str, Any] = {}

    def __enter__(self) -> "NoLog":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def tick(self, step: int) -> None:
        """Nothing."""

    def write(self, step: int, values: dict[str, float]) -> None:
        """Nothing."""

    def write_validation(self, step: int, values: dict[str, float]) -> None:
        """Nothing."""
