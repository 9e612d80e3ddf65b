"""Nothing damaged in a run is used, and a run can be loaded at every moment of its saving."""

import contextlib
import dataclasses
import json
import os
import shutil
from pathlib import Path

import jax
import numpy as np
import pytest
from integrity_for_tests import PACKAGE, changes

from a2g_jax.errors import InputError
from a2g_jax.io.sealed import seal_file
from a2g_jax.training import run_hashes
from a2g_jax.training.run import load_run, save_run
from a2g_jax.training.run_file import SHIPPED


@pytest.fixture
def run_folder(tmp_path):
    return shutil.copytree(PACKAGE / "demo_features", tmp_path / "run")


def test_changed_bits_and_cuts_of_a_run_are_named(run_folder):
    before, rng = load_run(run_folder), np.random.default_rng(0)
    for name in ("run.json", "weights.safetensors"):
        data = (run_folder / name).read_bytes()
        for changed in changes(data, rng, 6):
            (run_folder / name).write_bytes(changed)
            if changed == data:
                continue
            with pytest.raises(InputError, match=name) as caught:
                load_run(run_folder)
            assert "\n" not in str(caught.value)
        (run_folder / name).write_bytes(data)
    # Weights of another run of the same shapes.
    save_run(run_folder, dataclasses.replace(before, params=jax.tree.map(lambda x: 2 * x, before.params)))
    shutil.copy(PACKAGE / "demo_features" / "weights.safetensors", run_folder)
    with pytest.raises(InputError, match=r"weights\.safetensors: differs from its hash in run\.json"):
        load_run(run_folder)


@pytest.mark.parametrize("name", ["demo", "demo_flow", "demo_features"])
def test_the_shipped_runs_have_hashes(name):
    about = json.loads((PACKAGE / name / "run.json").read_text())
    assert len(about["weights_sha256"]) == len(about["checksum"]) == 64
    load_run(PACKAGE / name)


def test_runs_of_version_0_1_are_read(run_folder):
    about = json.loads((run_folder / "run.json").read_text())
    for name in ("weights_sha256", "log", "checksum"):
        del about[name]
    (run_folder / "run.json").write_text(json.dumps(about))
    assert load_run(run_folder).steps == about["steps"]


def test_an_edited_description_is_refused_until_the_edit_is_accepted(run_folder):
    path = run_folder / "run.json"
    about = json.loads(path.read_text())
    about["steps"] += 1
    path.write_text(json.dumps(about, indent=2))
    with pytest.raises(InputError, match=r'run\.json: differs from its checksum.*"checksum": null'):
        load_run(run_folder)
    path.write_text(json.dumps({**about, "checksum": None}))
    assert load_run(run_folder).steps == about["steps"]
    seal_file(path)
    assert load_run(run_folder).steps == about["steps"]


class KilledError(Exception):
    """In place of a kill."""


def test_at_every_moment_of_saving_the_run_can_be_loaded(run_folder, monkeypatch):
    """Old weights with their number of steps, or new ones with theirs."""
    old = load_run(run_folder)
    new = dataclasses.replace(old, steps=old.steps + 7, params=jax.tree.map(lambda x: x + 1, old.params))
    key = next(iter(old.params))
    original, seen = os.replace, set()
    for moment in range(6):
        calls = 0

        def replace(source, target, moment=moment):
            nonlocal calls
            calls += 1
            if calls > moment:
                raise KilledError
            return original(source, target)

        with monkeypatch.context() as patch:
            patch.setattr(Path, "replace", replace)
            with contextlib.suppress(KilledError):
                save_run(run_folder, new)
        found = load_run(run_folder)
        first = jax.tree.leaves(found.params[key])[0]
        which = "new" if np.array_equal(first, jax.tree.leaves(new.params[key])[0]) else "old"
        assert found.steps == {"old": old.steps, "new": new.steps}[which]
        seen.add((moment, which))
        save_run(run_folder, old)
    assert {which for _, which in seen} == {"old", "new"}


def test_a_run_can_be_loaded_while_it_is_saved(run_folder, monkeypatch):
    """The reader has old weights and then the new description."""
    old = load_run(run_folder)
    new = dataclasses.replace(old, steps=old.steps + 7, params=jax.tree.map(lambda x: x + 1, old.params))
    original, times = run_hashes._bytes, 0

    def bytes_of(weights):
        nonlocal times
        data, times = original(weights), times + 1
        if times == 1:
            save_run(run_folder, new)
        return data

    monkeypatch.setattr(run_hashes, "_bytes", bytes_of)
    assert load_run(run_folder).steps == new.steps


@pytest.mark.parametrize(
    "change",
    [
        {"pose": "other\n"},
        {"corpus": "text"},
        {"model": "a" * 100_000},
        {"version": [0] * 10_000},
        {"fps": "a"},
        {"model_config": {"unknown": 1}},
        {"train_config": [1]},
    ],
)
def test_values_of_other_types_in_run_json_are_one_line_with_its_name(run_folder, change):
    values = json.loads((run_folder / "run.json").read_text())
    (run_folder / "run.json").write_text(json.dumps({**values, **change, "checksum": None}))
    with pytest.raises(InputError) as error:
        load_run(run_folder)
    assert str(run_folder) in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 2500 + len(str(run_folder))


@pytest.mark.parametrize("name", SHIPPED)
def test_shapes_of_the_weights_of_the_package_are_right(name):
    """They are not compared whenever one opens them, which takes a second."""
    load_run(PACKAGE / SHIPPED[name], check_shapes=True)
