"""Shapes of parameters are those of the networks of a description, and are traced once for each."""

import dataclasses

import jax
import pytest
from flax.traverse_util import flatten_dict

from a2g_jax.models.base import finished
from a2g_jax.training import shapes
from a2g_jax.training.run import open_run
from a2g_jax.training.shapes import parameter_shapes


@pytest.mark.parametrize("name", ["demo", "demo-flow"])
def test_shapes_are_those_of_the_weights(name):
    run = open_run(name)
    found = {path: array.shape for path, array in flatten_dict(run.params, sep="/").items()}
    assert parameter_shapes(run.config) == found


def test_each_description_has_its_own(toy_run_config, monkeypatch):
    config = toy_run_config()
    wider = dataclasses.replace(config, model_config=dataclasses.replace(config.model_config, code_channels=6))
    first, second = parameter_shapes(config), parameter_shapes(wider)
    model = wider.build()
    params = finished(model, jax.jit(model.init)(jax.random.key(0)))
    assert second == {path: array.shape for path, array in flatten_dict(params, sep="/").items()} != first
    # Descriptions that are equal, though not the same objects, are not traced again; what a caller changes is its own.
    monkeypatch.setattr(shapes, "_traced", lambda config: pytest.fail("traced again"))
    again = parameter_shapes(toy_run_config())
    assert again == first
    again.clear()
    assert parameter_shapes(toy_run_config(steps=7)) == first
    others = dataclasses.replace(config, corpus={**config.corpus, "speakers": ["first of two", "second of two"]})
    with pytest.raises(pytest.fail.Exception, match="traced again"):
        parameter_shapes(others)


def test_settings_that_cannot_be_written_are_traced(toy_run_config, monkeypatch):
    """Those of another package may be any objects."""
    config = toy_run_config()
    expected = parameter_shapes(config)

    def refuse(_):
        raise TypeError("no pickle")

    monkeypatch.setattr(shapes.pickle, "dumps", refuse)
    assert parameter_shapes(config) == expected
