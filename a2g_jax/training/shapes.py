"""Shapes of the parameters of a run, found once for each description: to trace an initialisation takes a second."""

import hashlib
import json
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from flax.traverse_util import flatten_dict

from a2g_jax.data.body_json import body_to_json
from a2g_jax.models.base import finished
from a2g_jax.training.run_config import RunConfig

Shapes = dict[str, tuple[int, ...]]


def parameter_shapes(config: RunConfig) -> Shapes:
    """Shape of each parameter of a finished run, by its path, such as ``decoder/Dense_0/kernel``."""
    try:
        digest = _digest(config)
    except TypeError:  # settings of another package may be any objects
        return _traced(config)
    return dict(_shapes(_Described(digest, config.entry.builder(), config)))


@dataclass(frozen=True)
class _Described:
    """A run that equals others of the same description."""

    digest: bytes
    builder: Any
    config: RunConfig = field(compare=False)


@lru_cache(maxsize=32)
def _shapes(described: _Described) -> Shapes:
    return _traced(described.config)


def _digest(config: RunConfig) -> bytes:
    """A hash of all that the networks are built from; features of a perceptual loss are no part of them."""
    data = config.data()
    settings = [None if one is None else asdict(one) for one in (config.model_config, config.sampling_settings)]
    corpus = [data.fps, data.audio_bands, data.emotions, data.speakers, data.sample_rate, data.spectra]
    body = [data.space.kind, body_to_json(data.space.body), config.perceptual is None]
    found = hashlib.sha256(json.dumps([config.model, settings, corpus, body]).encode())
    for array in data.pose_statistics.mean, data.pose_statistics.std:
        found.update(repr(np.shape(array)).encode() + np.asarray(array, np.float32).tobytes())
    return found.digest()


def _traced(config: RunConfig) -> Shapes:
    import jax

    model = config.build()
    arrays = jax.eval_shape(lambda key: finished(model, model.init(key)), jax.random.key(0))
    return {path: tuple(array.shape) for path, array in flatten_dict(arrays, sep="/").items()}
