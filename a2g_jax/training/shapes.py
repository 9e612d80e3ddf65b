"""Shapes of the parameters of a run, found once for each description: to trace an initialisation takes a second."""

import pickle
from typing import Any

from flax.traverse_util import flatten_dict

from a2g_jax.models.base import finished
from a2g_jax.training.run_config import RunConfig

#: Descriptions whose shapes are kept; the oldest one leaves.
_MOST = 32
_FOUND: dict[Any, dict[str, tuple[int, ...]]] = {}


def parameter_shapes(config: RunConfig) -> dict[str, tuple[int, ...]]:
    """Shape of each parameter of a finished run, by its path, such as ``decoder/Dense_0/kernel``."""
    try:
        # All that a model is built from; features of a perceptual loss are a function and no part of the networks.
        built_from = (config.model_config, config.sampling_settings, config.data()._replace(perceptual=None))
        key = config.entry.builder(), config.perceptual is None, pickle.dumps(built_from)
    except (AttributeError, TypeError, pickle.PicklingError):  # settings of another package may be any objects
        return _traced(config)
    if key not in _FOUND:
        shapes = _traced(config)
        if len(_FOUND) >= _MOST:
            _FOUND.pop(next(iter(_FOUND)), None)
        _FOUND[key] = shapes
    return dict(_FOUND[key])


def _traced(config: RunConfig) -> dict[str, tuple[int, ...]]:
    import jax

    model = config.build()
    arrays = jax.eval_shape(lambda key: finished(model, model.init(key)), jax.random.key(0))
    return {path: tuple(array.shape) for path, array in flatten_dict(arrays, sep="/").items()}
