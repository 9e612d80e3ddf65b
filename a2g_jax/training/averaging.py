"""Weights between those of a run and those that were trained from it (Wortsman et al., CVPR 2022, WiSE-FT).

The weights of the run were trained on many people, those that were trained from it on a minute of one person, which
they overfit. A mean of both lies between.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import jax
import numpy as np
from flax.traverse_util import flatten_dict, unflatten_dict

from a2g_jax.errors import InputError
from a2g_jax.io.files import atomic_path
from a2g_jax.models.base import Params, Stage
from a2g_jax.training.run_config import Source

#: Weights that a training started from, of the networks that it changes; a resumed training needs them, too.
START_FILE = "start.safetensors"


def weight_average(
    source: Source | None, stages: Sequence[Stage], start: Params | None, folder: Path, begun: bool
) -> Callable[[Params], Params]:
    """A function from trained parameters to those of the run, ``start + share * (trained - start)``.

    Args:
        source: its ``share`` is that of the trained weights; with 1, or without a source, they are the run's.
        stages: of the model as it is trained; networks that no update trains stay as they are, bit for bit.
        start: parameters that the training starts from.
        folder: of the run, where ``start`` is kept for resuming.
        begun: whether training resumes, and ``start`` is not what it started from.

    Raises:
        InputError: a resumed run whose first parameters are missing or damaged.
    """
    if source is None or source.share == 1.0:
        return lambda trained: trained
    path = folder / START_FILE
    if begun:
        first = _read(path)
    else:
        assert start is not None
        updates = [update for stage in stages for update in stage.updates]
        names = {name for update in updates for name in update.trains or start}
        first = jax.device_get({name: start[name] for name in sorted(names)})
        _write(path, first)

    def average(trained: Params) -> Params:
        ours = {name: trained[name] for name in first}
        mixed = jax.tree.map(lambda old, new: old + np.float32(source.share) * (new - old), first, ours)
        return {**trained, **mixed}

    return average


def _write(path: Path, params: Params) -> None:
    from safetensors.numpy import save

    arrays = {name: np.ascontiguousarray(value) for name, value in flatten_dict(params, sep="/").items()}
    with atomic_path(path) as temporary:
        temporary.write_bytes(save(arrays))


def _read(path: Path) -> Params:
    from safetensors import SafetensorError
    from safetensors.numpy import load

    try:
        return unflatten_dict(load(path.read_bytes()), sep="/")
    except (OSError, SafetensorError) as error:
        raise InputError(f"{path}: cannot be read ({error}); restore it, or train anew in another folder.") from None
