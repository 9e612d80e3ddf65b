"""Weights between those that a training started from and the trained ones."""

import dataclasses

import jax
import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.models.base import Stage, Update
from a2g_jax.training.averaging import START_FILE, weight_average
from a2g_jax.training.run_config import Source

SOURCE = Source("demo", 5, "0" * 64, "corpus", share=0.25)
START = {"decoder": {"kernel": np.float32([0.1, 2.0])}, "encoder": {"kernel": np.float32([0.3])}}
TRAINED = {"decoder": {"kernel": np.float32([0.5, -2.0])}, "encoder": {"kernel": np.float32([0.3])}}


STAGES = (Stage((Update(lambda *inputs: inputs, ("decoder",)),)),)


def test_trained_networks_are_averaged_and_others_stay(tmp_path):
    average = weight_average(SOURCE, STAGES, START, tmp_path, begun=False)
    found = average(TRAINED)
    np.testing.assert_allclose(found["decoder"]["kernel"], [0.2, 1.0], rtol=1e-6)
    assert found["encoder"] is TRAINED["encoder"]
    resumed = weight_average(SOURCE, STAGES, None, tmp_path, begun=True)(TRAINED)
    assert all(jax.tree.leaves(jax.tree.map(np.array_equal, found, resumed)))


def test_a_share_of_one_is_the_trained_weights(tmp_path):
    for source in (None, dataclasses.replace(SOURCE, share=1.0)):
        assert weight_average(source, STAGES, START, tmp_path, begun=False)(TRAINED) is TRAINED
    assert list(tmp_path.iterdir()) == []


def test_a_resumed_run_without_its_first_weights_is_refused(tmp_path):
    with pytest.raises(InputError, match=f"{START_FILE}: cannot be read .*; restore it, or train anew"):
        weight_average(SOURCE, STAGES, START, tmp_path, begun=True)
    (tmp_path / START_FILE).write_bytes(b"broken")
    with pytest.raises(InputError, match="cannot be read"):
        weight_average(SOURCE, STAGES, START, tmp_path, begun=True)
