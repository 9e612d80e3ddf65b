"""Requested controls of a speech, frame by frame."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.models.base import Controls
from a2g_jax.models.control_curves import INCLUDED, Curve, check_ends, parse_curves
from a2g_jax.training.run_config import Run

Rows = Float[np.ndarray, "T K"]


def control_rows(run: Run, lines: Sequence[str], frames: int) -> Rows:
    """The ``controls`` of a condition from lines such as ``energy=0.2@0,0.9@10``: a row a frame, NaN where free.

    Columns are those of :func:`controls_of` the run.

    Raises:
        InputError: a run without controls, a line that does not fit it, or one with a second past the end.
    """
    controls = controls_of(run)
    check_ends(lines, frames, run.config.fps)
    return sampled(parse_curves(lines, controls.names, controls.categories), 0, frames, run.config.fps)


def stored_rows(run: Run, controls: Controls | None, frames: int) -> Rows | None:
    """The ``controls`` of a condition from the run's sampling settings; None where the model needs none.

    Args:
        controls: of the run's model.

    Raises:
        InputError: a run that stores too little for them.
    """
    lines = getattr(run.config.sampling_settings, "controls", ())
    if controls is None or (controls.free and not lines):
        return None
    check_stored(run, controls)
    return sampled(parse_curves(lines, controls.names, controls.categories), 0, frames, run.config.fps)


def controls_of(run: Run) -> Controls:
    """The controls of a run: their names, and those of categories.

    Raises:
        InputError: the run has none.
    """
    controls = run.config.build().controls
    if controls is None:
        included = " or ".join(f"{name!r} ({', '.join(names)})" for name, names in INCLUDED.items())
        raise InputError(f"the run of {run.config.model} has no controls; use {included}.")
    check_stored(run, controls)
    return controls


def sampled(curves: Sequence[Curve], start: int, frames: int, fps: float) -> Rows:
    """Requested values of the frames from ``start``, which may lie before the first."""
    seconds = (start + np.arange(frames)) / fps
    columns = [_held(curve, seconds) if curve.jumps else _linear(curve, seconds) for curve in curves]
    return np.stack(columns, axis=-1).astype(np.float32)


def check_stored(run: Run, controls: Controls) -> None:
    """Refuse a run that stores too little for its controls.

    Raises:
        InputError: it does; weights of an earlier version.
    """
    if missing := [name for name in controls.stored if name not in run.summary]:
        raise InputError(
            f"--control: an earlier version wrote the weights of this run, without {', '.join(missing)}; write them"
            f" again with 'a2g train {run.config.model} --resume --out RUN --corpus CORPUS', with the run's checkpoints"
            " and the corpus that it was trained on, or use 'demo'."
        )


def check_rows(rows: Rows, controls: Controls) -> None:
    """Refuse values that no line could have.

    Raises:
        InputError: another number of columns, a quantile outside of 0 to 1, or a category that does not exist.
    """
    if rows.ndim != 2 or rows.shape[1] != len(controls.names):
        names = ", ".join(controls.names)
        raise InputError(f"controls: expected a column for each of {names}; got the shape {rows.shape}.")
    for column, name in zip(np.asarray(rows).T, controls.names, strict=True):
        requested = column[~np.isnan(column)]
        words = controls.categories.get(name)
        if words is None and not np.all((requested >= 0) & (requested <= 1)):
            raise InputError(f"controls: {name} holds values outside of 0 to 1; expected quantiles, NaN where free.")
        if words is not None and not np.all(np.isin(requested, np.arange(len(words)))):
            raise InputError(f"controls: {name} holds other values than 0 to {len(words) - 1}, for {', '.join(words)}.")


def _linear(curve: Curve, seconds: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    return np.interp(seconds, curve.seconds, curve.values)


def _held(curve: Curve, seconds: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T"]:
    """The last value that begins no later than each second."""
    index = np.searchsorted(curve.seconds, seconds, side="right") - 1
    values: Float[np.ndarray, " T"] = np.asarray(curve.values)[np.maximum(index, 0)]
    return values
