"""Several devices train as one does, and what cannot be divided among them is refused."""

import dataclasses

import jax
import numpy as np
import pytest

from a2g_jax.data.batch import clip_shape
from a2g_jax.data.on_demand import Part
from a2g_jax.errors import InputError
from a2g_jax.models import find_model
from a2g_jax.training.devices import Devices, find_devices
from a2g_jax.training.processes import find_place
from a2g_jax.training.run import RunConfig
from a2g_jax.training.stages import stage_spans
from a2g_jax.training.state import init_state
from a2g_jax.training.steps import Steps
from tests.training.scaled_training import FAMILIES


def weights_after(corpus, devices, steps, **changes):
    """Losses and parameters of a small autoencoder after a few steps on the devices of the suite."""
    entry = find_model("motion_autoencoder")
    model = dataclasses.replace(entry.presets["tiny"], **FAMILIES["motion_autoencoder"])
    settings = dataclasses.replace(entry.training_preset("tiny"), batch_size=4, **changes)
    config = RunConfig.of("motion_autoencoder", "tiny", model, settings, corpus)
    built = config.build()
    shape = clip_shape(built.batch_fields, built.clip_frames, corpus.fps, corpus.mel.sample_rate)
    (span,) = stage_spans(built, settings)
    part = Part({name: corpus.array(name) for name in shape.arrays}, corpus.segments("train"))
    shared = find_devices(devices, 4)
    step = Steps(config, shape, shared).of(span, part)
    state, losses = shared.first_copies(init_state(built, (span,), 0)), []
    for _ in range(steps):
        state, metrics = step(state)
        losses.append(float(metrics["loss"]))
    return losses, jax.device_get(state.params)


@pytest.mark.parametrize(
    "megabytes", [2000.0, pytest.param(0.0, marks=pytest.mark.slow)], ids=["on devices", "from disk"]
)
def test_two_devices_train_as_one(toy_corpus, megabytes):
    """The suite has two virtual devices (tests/conftest.py)."""
    one, two = (weights_after(toy_corpus, number, 4, device_megabytes=megabytes) for number in (1, 2))
    assert len(set(one[0])) == 4
    np.testing.assert_allclose(two[0], one[0], rtol=1e-5)
    for a, b in zip(jax.tree.leaves(one[1]), jax.tree.leaves(two[1]), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)


def test_each_device_has_its_own_clips():
    devices = find_devices("all", 6)
    assert devices.count == 2
    clips = devices.shard({"audio": np.arange(12.0, dtype=np.float32).reshape(6, 2)}, 6)["audio"]
    assert [shard.data.shape for shard in clips.addressable_shards] == [(3, 2), (3, 2)]
    np.testing.assert_array_equal(devices.rows(6), np.arange(6))
    np.testing.assert_array_equal(clips, np.arange(12.0).reshape(6, 2))
    copies = devices.first_copies({"key": jax.random.key(3), "mean": np.ones(3, np.float32)})
    assert len(copies["mean"].addressable_shards) == 2
    np.testing.assert_array_equal(jax.random.key_data(copies["key"]), jax.random.key_data(jax.random.key(3)))


def test_one_device_changes_nothing():
    devices, clips = find_devices(None, 3), {"audio": np.ones((3, 2))}
    assert devices.count == 1
    assert devices.jit_options() == {}
    assert devices.shard(clips, 3)["audio"] is clips["audio"]
    assert Devices(jax.devices()[:1]).first_copies(clips) is clips


@pytest.mark.parametrize(
    ("request_", "batch", "message"),
    [
        (
            2,
            5,
            r"--batch-size 5: cannot be divided among 2 devices; choose a multiple of 2, such as 6, or --devices 1\.",
        ),
        ("all", 7, "cannot be divided among 2 devices"),
        (3, 6, r"--devices 3: there are 2 \(CPU\)"),
    ],
)
def test_what_cannot_be_divided(request_, batch, message):
    with pytest.raises(InputError, match=message):
        find_devices(request_, batch)


ALL = {"JAX_COORDINATOR_ADDRESS": "host:1234", "JAX_NUM_PROCESSES": "4", "JAX_PROCESS_ID": "2"}


@pytest.mark.parametrize(
    ("environment", "place"),
    [
        ({}, None),
        ({"JAX_NUM_PROCESSES": "1"}, None),
        ({**ALL, "JAX_NUM_PROCESSES": "1", "JAX_PROCESS_ID": "0"}, None),
        (ALL, ("host:1234", 4, 2)),
        ({"SLURM_STEP_NUM_TASKS": "1", "SLURM_PROCID": "0"}, None),
        ({"SLURM_STEP_NUM_TASKS": "8", "SLURM_PROCID": "3"}, (None, None, None)),
        ({"SLURM_STEP_NUM_TASKS": "8", "SLURM_PROCID": "3", "JAX_NUM_PROCESSES": "1"}, None),
    ],
)
def test_the_place_among_processes(environment, place):
    assert find_place(environment) == place


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"JAX_PROCESS_ID": ""}, "JAX_COORDINATOR_ADDRESS and JAX_NUM_PROCESSES in .*: JAX_PROCESS_ID is missing"),
        ({"JAX_PROCESS_ID": "4"}, "JAX_PROCESS_ID: expected 0 to 3 for JAX_NUM_PROCESSES=4; got 4"),
        ({"JAX_NUM_PROCESSES": "four"}, "JAX_NUM_PROCESSES: expected a whole number; got 'four'"),
        ({"JAX_COORDINATOR_ADDRESS": "host"}, "JAX_COORDINATOR_ADDRESS: expected HOST:PORT of process 0; got 'host'"),
    ],
)
def test_variables_that_do_not_fit(changes, message):
    with pytest.raises(InputError, match=message):
        find_place({**ALL, **changes})
