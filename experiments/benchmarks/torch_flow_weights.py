"""Our parameters of the stylized flow in its PyTorch twin, and the twin's gradients in our shapes."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor

from experiments.benchmarks import torch_params
from experiments.benchmarks.torch_flow import Twin


def _places(twin: Twin, number: int) -> dict[str, Any]:
    """Place of each of our arrays of one step: a tensor and its columns; None where it is not transposed."""
    step = twin.steps[number]
    recurrent, kept = step.coupling.recurrent, step.coupling.kept
    invertible = step.invertible
    everything, as_is = slice(None), None
    layers: dict[str, Any] = {}
    for layer in range(twin.config.layers):
        weight = getattr(recurrent, f"weight_ih_l{layer}")
        layers[f"layer_{layer}"] = {
            "input_bias": (getattr(recurrent, f"bias_ih_l{layer}"), as_is),
            "state_kernel": (getattr(recurrent, f"weight_hh_l{layer}"), everything),
            "state_bias": (getattr(recurrent, f"bias_hh_l{layer}"), as_is),
        }
        if layer:
            layers[f"layer_{layer}"]["input_kernel"] = (weight, everything)
        else:
            border = kept + twin.context_width
            columns = {"kept": slice(kept), "history": slice(kept, border), "known": slice(border, None)}
            layers["layer_0"] |= {f"{name}_kernel": (weight, part) for name, part in columns.items()}
    return {
        "actnorm": {name: (getattr(step.actnorm, name), as_is) for name in ("bias", "log_scale")},
        "invertible": {
            name: (getattr(invertible, name), as_is) for name in ("permutation", "lower", "upper", "sign", "log_scale")
        },
        "coupling": {
            **layers,
            "out_kernel": (step.coupling.out.weight, everything),
            "out_bias": (step.coupling.out.bias, as_is),
        },
    }


def _of(place: tuple[Tensor, slice | None], tensor: Tensor) -> Tensor:
    """The view of a tensor, or of its gradient, that is one of our arrays."""
    columns = place[1]
    return tensor if columns is None else tensor[:, columns].T


def _walk(places: Mapping[str, Any], params: Mapping[str, Any] | None, act: Any, path: str = "") -> dict[str, Any]:
    """``act(place, array, path)`` for every array of a step, as a tree.

    Raises:
        ValueError: the arrays differ from those of the places.
    """
    if params is not None and set(params) != set(places):
        raise ValueError(f"Expected the parameters {sorted(places)} in {path or 'a step'}; got {sorted(params)}.")
    results: dict[str, Any] = {}
    for name, place in places.items():
        array, where = None if params is None else params[name], f"{path}/{name}"
        results[name] = _walk(place, array, act, where) if isinstance(place, dict) else act(place, array, where)
    return results


def load_params(twin: Twin, params: Mapping[str, Any]) -> None:
    """Copy a tree of our parameters into a twin.

    Raises:
        ValueError: a parameter is missing on either side, or has another shape.
    """
    expected = {"glow", "global_encoder"} if twin.global_encoder is not None else {"glow"}
    if set(params) != expected:
        raise ValueError(f"Expected the parameters {sorted(expected)}; got {sorted(params)}.")
    if twin.global_encoder is not None:
        torch_params.load_params(twin.global_encoder, params["global_encoder"])

    def copy(number: int, place: Any, array: Any, path: str) -> None:
        own, value = _of(place, place[0].detach()), np.asarray(array)
        if value.shape != (len(twin.steps), *own.shape):
            raise ValueError(f"Expected {path} of shape {(len(twin.steps), *own.shape)}; got {value.shape}.")
        own.copy_(torch.from_numpy(np.array(value[number])))

    for number in range(len(twin.steps)):
        _walk(_places(twin, number), params["glow"], lambda *found, number=number: copy(number, *found))


def gradients(twin: Twin) -> dict[str, Any]:
    """Gradients of all parameters as a tree shaped like ours; zeros where a parameter is not trained."""

    def gradient(place: Any, *_: Any) -> np.ndarray:
        tensor = place[0]
        own = torch.zeros_like(tensor) if tensor.grad is None else tensor.grad
        return _of(place, own).numpy()

    steps = [_walk(_places(twin, number), None, gradient) for number in range(len(twin.steps))]
    tree = {"glow": _stacked(steps)}
    if twin.global_encoder is not None:
        tree["global_encoder"] = torch_params.gradients(twin.global_encoder)
    return tree


def _stacked(trees: list[Any]) -> Any:
    if isinstance(trees[0], dict):
        return {name: _stacked([tree[name] for tree in trees]) for name in trees[0]}
    return np.stack(trees)
