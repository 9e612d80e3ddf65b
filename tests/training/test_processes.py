"""Eight virtual devices and two real processes over loopback: they show that training is right, not that it is fast."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file

from tests.training.scaled_training import FAMILIES, settings_of

pytestmark = pytest.mark.slow

SCRIPT = Path(__file__).with_name("scaled_training.py")
LOST = "another process of the training has ended, so this one does too"


def begin(out, corpus, settings, devices=1, process=None, resume=False):
    """A training in a process of its own.

    Args:
        devices: virtual ones of the process.
        process: address, count and number among several.
    """
    values = {**settings, "corpus": str(corpus.path), "out": str(out), "resume": resume}
    values["devices"] = "all" if process is None else None
    file = out.with_name(f"{out.name}_{'0' if process is None else process[2]}.json")
    file.write_text(json.dumps(values))
    flags = os.environ["XLA_FLAGS"].split()
    flags = [flag for flag in flags if "device_count" not in flag]
    flags.append(f"--xla_force_host_platform_device_count={devices}")
    environment = {**os.environ, "XLA_FLAGS": " ".join(flags), "PYTHONPATH": str(Path(__file__).parents[2])}
    if process is not None:
        names = "JAX_COORDINATOR_ADDRESS", "JAX_NUM_PROCESSES", "JAX_PROCESS_ID"
        environment |= dict(zip(names, map(str, process), strict=True))
    command = [sys.executable, str(SCRIPT), str(file)]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def begin_two(out, corpus, settings, resume=False, other=None):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    both = settings, other or settings
    return [begin(out, corpus, both[k], process=(address, 2, k), resume=resume) for k in range(2)]


def end(*processes, status=0):
    """Standard errors of processes that end."""
    outputs = [process.communicate(timeout=3000)[1] for process in processes]
    assert [process.returncode for process in processes] == [status] * len(processes), "\n".join(outputs)
    return outputs


def losses(folder):
    rows = [json.loads(line) for line in (folder / "metrics.jsonl").read_text().splitlines()]
    return np.array([row["loss"] for row in rows])


def weights(folder):
    return load_file(folder / "weights.safetensors")


def assert_close(first, second, rtol=1e-4, atol=1e-4):
    """The same losses, step by step, and the same weights but for rounding."""
    np.testing.assert_allclose(losses(second), losses(first), rtol=rtol)
    one, other = weights(first), weights(second)
    assert one.keys() == other.keys()
    for name in one:
        np.testing.assert_allclose(other[name], one[name], atol=atol, err_msg=name)


@pytest.fixture(scope="module")
def emotional_corpus(tmp_path_factory):
    """Three generated minutes with emotions, which some models need."""
    from a2g_jax.data.generated import TalkerOptions
    from a2g_jax.data.prepare import prepare_talker

    options = TalkerOptions(minutes=3.0, emotions=("happiness", "sadness"))
    return prepare_talker(tmp_path_factory.mktemp("emotional") / "corpus", options, workers=1)


@pytest.mark.parametrize("family", FAMILIES)
def test_eight_devices_train_as_one(tmp_path, emotional_corpus, family):
    settings = settings_of(family)
    end(begin(tmp_path / "one", emotional_corpus, settings))
    end(begin(tmp_path / "eight", emotional_corpus, settings, devices=8))
    tolerance = ADVERSARIAL_TOLERANCE if family == "speech2gesture" else TOLERANCE
    np.testing.assert_allclose(losses(tmp_path / "eight"), losses(tmp_path / "one"), rtol=tolerance)


#: Relative difference of losses over the steps of these tests.
TOLERANCE = 1e-4
#: The same of a discriminator and a generator from their first step: the first steps of Adam are signs of gradients,
#: which near zero are signs of their rounding.
ADVERSARIAL_TOLERANCE = 1e-3


def back_to(folder, target, step):
    """A copy of a run whose later checkpoints are gone."""
    shutil.copytree(folder, target)
    for path in (target / "checkpoints").iterdir():
        if path.is_dir() and int(path.name) > step:
            shutil.rmtree(path)
            path.with_suffix(".json").unlink()
    return target


@pytest.mark.parametrize("megabytes", [2000.0, 0.0], ids=["on devices", "from disk"])
def test_two_processes_train_as_one_and_resume_each_others_checkpoints(tmp_path, toy_corpus, megabytes):
    settings = settings_of("motion_autoencoder", device_megabytes=megabytes)
    end(begin(tmp_path / "one", toy_corpus, settings))
    end(*begin_two(tmp_path / "two", toy_corpus, settings))
    assert_close(tmp_path / "one", tmp_path / "two")
    end(begin(back_to(tmp_path / "two", tmp_path / "two on one", 4), toy_corpus, settings, resume=True))
    end(*begin_two(back_to(tmp_path / "one", tmp_path / "one on two", 4), toy_corpus, settings, resume=True))
    assert_close(tmp_path / "one", tmp_path / "two on one")
    assert_close(tmp_path / "one", tmp_path / "one on two")


def wait_for_checkpoint(out, processes):
    for _ in range(3000):
        if (out / "checkpoints").is_dir() and any(path.name.isdigit() for path in (out / "checkpoints").iterdir()):
            return
        assert all(process.poll() is None for process in processes), processes[0].communicate()[1]
        time.sleep(0.1)
    raise AssertionError("no checkpoint")


LONG = {"steps": 120, "checkpoint_every": 10, "validate_every": 120}


@pytest.fixture(scope="module")
def uninterrupted(toy_corpus, tmp_path_factory):
    folder = tmp_path_factory.mktemp("uninterrupted") / "run"
    end(*begin_two(folder, toy_corpus, settings_of("motion_autoencoder", **LONG)))
    return folder


@pytest.mark.parametrize("killed", [0, 1])
def test_a_killed_process_ends_the_others_with_one_line_and_the_run_resumes(
    tmp_path, toy_corpus, uninterrupted, killed
):
    settings, out = settings_of("motion_autoencoder", **LONG), tmp_path / "run"
    processes = begin_two(out, toy_corpus, settings)
    wait_for_checkpoint(out, processes)
    processes[killed].send_signal(signal.SIGKILL)
    (output,) = end(processes[1 - killed], status=2)
    processes[killed].communicate()
    lines = [line for line in output.splitlines() if line.strip() and not line.startswith("training:")]
    assert LOST in lines[-1]
    end(*begin_two(out, toy_corpus, settings, resume=True))
    assert (out / "metrics.jsonl").read_text() == (uninterrupted / "metrics.jsonl").read_text()
    assert (out / "weights.safetensors").read_bytes() == (uninterrupted / "weights.safetensors").read_bytes()


def test_a_signal_to_one_process_stops_both(tmp_path, toy_corpus, uninterrupted):
    settings, out = settings_of("motion_autoencoder", **LONG), tmp_path / "run"
    processes = begin_two(out, toy_corpus, settings)
    wait_for_checkpoint(out, processes)
    processes[1].send_signal(signal.SIGTERM)
    outputs = end(*processes, status=130)
    stopped = [output.partition("stopped after step ")[2].split()[0] for output in outputs]
    assert stopped[0] == stopped[1]
    assert (out / "checkpoints" / stopped[0]).is_dir()
    end(*begin_two(out, toy_corpus, settings, resume=True))
    assert (out / "weights.safetensors").read_bytes() == (uninterrupted / "weights.safetensors").read_bytes()


def test_processes_with_different_settings_are_refused(tmp_path, toy_corpus):
    one, other = (settings_of("motion_autoencoder", learning_rate=rate) for rate in (1e-3, 2e-3))
    outputs = end(*begin_two(tmp_path / "run", toy_corpus, one, other=other), status=2)
    assert "process 1: has other settings or another corpus than process 0" in outputs[1]
    assert LOST in outputs[0]
