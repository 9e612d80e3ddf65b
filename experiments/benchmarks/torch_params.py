"""Our Flax parameters in PyTorch modules whose parts have the same names, and their gradients as such a tree."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn


def _as_ours(value: Tensor) -> np.ndarray:
    array = value.detach().cpu().numpy()
    if array.ndim == 1:
        return array
    return array[:, :, 0].T if array.shape[2] == 1 else array.transpose(2, 1, 0)


def load_params(module: nn.Module, params: Mapping[str, Any]) -> None:
    """Copy a tree of our Flax parameters into a module whose parts have the same names.

    Raises:
        ValueError: a parameter is missing on either side, or has another shape.
    """
    own = dict(module.named_parameters(recurse=False))
    parts = {name: part for name, part in module.named_children() if any(True for _ in part.parameters())}
    if {*own, *parts} != set(params):
        raise ValueError(f"Expected the parameters {sorted({*own, *parts})}; got {sorted(params)}.")
    for name, value in own.items():
        array = np.array(params[name])
        if array.ndim == 2:
            array = array[None]
        if array.ndim == 3:
            array = array.transpose(2, 1, 0)
        if array.shape != tuple(value.shape):
            raise ValueError(f"Expected {name} of shape {tuple(value.shape)}; got {array.shape}.")
        with torch.no_grad():
            value.copy_(torch.from_numpy(np.ascontiguousarray(array)))
    for name, part in parts.items():
        load_params(part, params[name])


def gradients(module: nn.Module) -> dict[str, Any]:
    """Gradients of all parameters as a tree shaped like our Flax parameters; zeros where there is none."""
    tree: dict[str, Any] = {}
    for path, value in module.named_parameters():
        *folders, name = path.split(".")
        place = tree
        for folder in folders:
            place = place.setdefault(folder, {})
        place[name] = _as_ours(value.grad if value.grad is not None else torch.zeros_like(value))
    return tree
