"""Trainings with one description share a model and its steps, and so the programs that are compiled for them.

Each training builds its model anew: to JAX these are other functions, which it traces, and loads from the compilation
cache. That is most of the time of a short training.
"""

import hashlib
import json
from dataclasses import replace

import numpy as np

from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training import loop, steps
from a2g_jax.training.run import run_to_json


def share_programs(patch, fingerprint):
    """Make Audio2Gestures trainings on the corpus of a fingerprint share their programs.

    Args:
        patch: pytest's ``MonkeyPatch``, which also undoes it.
    """
    models, programs = {}, {}
    build, make = loop.training_model, steps.step_programs

    def shares(config):
        same = config.corpus.get("fingerprint") == fingerprint and config.perceptual is None
        return same and config.model == "audio2gestures"

    def training_model(config):
        if not shares(config):
            return build(config)
        key = _key(replace(config, train_config=TrainConfig(frozen=config.train_config.frozen)))
        return models[key] if key in models else models.setdefault(key, build(config))

    def step_programs(span, shape, crops, config, devices=None):
        if not shares(config) or devices is None or devices.count > 1:
            return make(span, shape, crops, config, devices)
        # The stage is a part itself: one of an equal model that is not shared has other functions.
        key = _key(config), span.stage, span.first, span.config, repr(shape), *(array.tobytes() for array in crops)
        if key not in programs:
            programs[key] = make(span, shape, crops, config, devices)
        return programs[key]

    patch.setattr(loop, "training_model", training_model)
    patch.setattr(steps, "step_programs", step_programs)


def _key(config):
    """A hash of a description and of the statistics, which belong to the weights."""
    described = run_to_json(replace(config, body_extremes=None), 0)
    found = hashlib.sha256(json.dumps(described, sort_keys=True).encode())
    for name, statistics in sorted(config.statistics.items()):
        for array in (statistics.mean, statistics.std):
            found.update(name.encode() + np.asarray(array).tobytes())
    return found.digest()
