"""Settings of a training from a file, several seeds by one command, and runs that are extended."""

import hashlib
import json
import re
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest

from a2g_jax.cli import main
from a2g_jax.cli.settings_file import read_settings, settings_text
from a2g_jax.errors import InputError
from a2g_jax.models import find_model
from a2g_jax.models.base import Model, Stage, Update
from a2g_jax.models.registry import MODELS
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training import extension
from a2g_jax.training.loop import train
from a2g_jax.training.run import load_run
from a2g_jax.training.stages import stage_spans


def fails(capsys, *arguments):
    capsys.readouterr()
    assert main([str(argument) for argument in arguments]) == 2
    return capsys.readouterr().err


def written(folder, text):
    path = folder / "settings.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", MODELS)
def test_printed_settings_are_read_again(tmp_path, name):
    entry = find_model(name)
    for preset, model in entry.presets.items():
        training = entry.training_preset(preset)
        file = read_settings(str(written(tmp_path, settings_text(model, training))))
        assert file.applied("model", model) == model
        assert file.applied("training", training) == training
        assert file.applied("training", TrainConfig()) == training


def test_flags_override_the_file(tmp_path, capsys):
    path = written(
        tmp_path, "[training]\nsteps = 7\nlearning-rate = 1\nfrozen = ['decoder']\n[model]\nclip_frames = 32\n"
    )
    assert main(["train", "audio2gestures", "--config", str(path), "--settings", "--toml", "--steps", "9"]) == 0
    shown = capsys.readouterr().out
    for line in ("steps = 9", "learning_rate = 1.0", 'frozen = ["decoder"]', "clip_frames = 32"):
        assert f"\n{line}\n" in shown


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[training]\nsteps = 7\n\nlearning_rat = 1\n",
            r"settings.toml, line 4: \[training\] has no setting 'learning_rat'",
        ),
        ("[model]\nsteps = 7\n", r"settings.toml, line 2: \[model\] has no setting 'steps'"),
        ("training.stps = 7\n", r"settings.toml, line 1: \[training\] has no setting 'stps'"),
        ("[training]\nsteps = 'many'\n", r"settings.toml, line 2: steps: expected int; got 'many'"),
        ("[training]\nsteps = true\n", r"settings.toml, line 2: steps: expected int; got True"),
        ("[training]\nsteps = -1\n", r"settings.toml, line 2: --steps: expected 1 or more; got -1"),
        ("[trainig]\nsteps = 7\n", r"settings.toml: has 'trainig'; expected the tables \[model\] and \[training\]"),
        ("steps = 7\n", "settings.toml: has 'steps'; expected the tables"),
        ("[training]\nsteps = \n", r"settings.toml: is no TOML \(.*line 2"),
    ],
)
def test_errors_of_the_file(tmp_path, capsys, text, message):
    error = fails(capsys, "train", "audio2gestures", "--settings", "--config", written(tmp_path, text))
    assert re.search(message, error)
    assert len(error.splitlines()) == 1


def test_a_file_that_is_not_there(tmp_path, capsys):
    assert "there.toml" in fails(capsys, "train", "audio2gestures", "--settings", "--config", tmp_path / "there.toml")


def test_a_file_may_begin_with_a_mark(tmp_path):
    assert read_settings(str(written(tmp_path, "\ufeff[training]\nsteps = 7\n"))).values == {"training": {"steps": 7}}


@pytest.mark.parametrize("text", ["", "0,0", "0,a", "-1"])
def test_seeds_that_are_none(text, capsys):
    with pytest.raises(SystemExit):
        main(["train", "audio2gestures", f"--seeds={text}", "--settings"])
    assert "--seeds" in capsys.readouterr().err


def test_seeds_and_seed_exclude_each_other(capsys):
    assert "leave one of them out" in fails(
        capsys, "train", "audio2gestures", "--seeds", "0,1", "--seed", "3", "--settings"
    )


def model_of(schedule, stages=1):
    def optimiser(config):
        return optax.sgd(schedule(config))

    def loss(params, key, batch, step):
        return jnp.sum(params["w"] ** 2), {}

    parts = [
        Stage((Update(loss, optimiser=optimiser),), name=f"stage{n}", steps=None if n == 0 else 4)
        for n in range(stages)
    ]
    fields = dict.fromkeys(Model._fields) | {"name": "made up", "stages": tuple(parts)}
    return Model(**{**fields, "init": lambda key: {"w": jax.random.normal(key, (2,))}})


def before(monkeypatch, **settings):
    monkeypatch.setattr(extension, "_stored", lambda out: TrainConfig(**settings))


def test_a_single_stage_is_extended(monkeypatch, tmp_path):
    before(monkeypatch, steps=10)
    config, line = extension.extended(TrainConfig(steps=15), model_of(lambda config: 0.1), tmp_path)
    assert config == TrainConfig(steps=15)
    assert line.endswith("extended from 10 to 15 steps.")


def test_the_last_of_several_stages_is_extended(monkeypatch, tmp_path):
    before(monkeypatch, steps=10)
    model = model_of(lambda config: 0.1, stages=2)
    config, line = extension.extended(TrainConfig(steps=15), model, tmp_path)
    assert [(span.first, span.stop) for span in stage_spans(model, config)] == [(0, 10), (10, 19)]
    assert "in its last stage, stage1, from 14 to 19 steps." in line
    # Again, and resumed without a number.
    before(monkeypatch, steps=15, stage_steps=(10, 9))
    config, line = extension.extended(TrainConfig(steps=16), model, tmp_path)
    assert stage_spans(model, config)[-1].stop == 20
    assert extension.extended(TrainConfig(steps=15), model, tmp_path) == (
        replace(config, steps=15, stage_steps=(10, 9)),
        "",
    )


def test_a_schedule_that_depends_on_the_length_is_mentioned(monkeypatch, tmp_path):
    before(monkeypatch, steps=10)
    model = model_of(lambda config: optax.cosine_decay_schedule(0.1, config.steps))
    assert (
        "its learning rate depends on the number of steps"
        in extension.extended(TrainConfig(steps=15), model, tmp_path)[1]
    )


def test_a_run_is_not_shortened(monkeypatch, tmp_path):
    before(monkeypatch, steps=10)
    with pytest.raises(InputError, match="--steps 9: .* was trained for 10; name more to extend it"):
        extension.extended(TrainConfig(steps=9), model_of(lambda config: 0.1), tmp_path)


@pytest.mark.slow
def test_an_extended_run_is_one_that_was_as_long_from_the_beginning(tmp_path, toy_corpus, toy_run_config, capsys):
    settings = {"schedule": "constant", "warmup_steps": 2, "checkpoint_every": 4}
    whole = train(toy_run_config(steps=11, **settings), toy_corpus, tmp_path / "whole", resume=False, progress=False)
    out = tmp_path / "extended"
    train(toy_run_config(steps=6, **settings), toy_corpus, out, resume=False, progress=False)
    run = train(toy_run_config(steps=11, **settings), toy_corpus, out, resume=True, progress=False)
    assert "extended from 6 to 11 steps.\n" in capsys.readouterr().err
    assert run.steps == whole.steps == 11
    for a, b in zip(jax.tree.leaves(whole.params), jax.tree.leaves(run.params), strict=True):
        np.testing.assert_array_equal(a, b)


SMALL = "[model]\nencoder_channels = [8, 8, 8, 16, 4]\ndecoder_channels = [4, 8]\nclip_frames = 16\n"


@pytest.mark.slow
def test_a_run_for_each_seed_with_settings_from_a_file(tmp_path, toy_corpus, capsys):
    path = written(tmp_path, f"{SMALL}[training]\nsteps = 3\nbatch_size = 4\nwarmup_steps = 1\n")
    command = ["train", "motion_autoencoder", "--corpus", str(toy_corpus.path), "--out", str(tmp_path / "run")]
    command += ["--config", str(path), "--seeds", "0,2"]
    assert main(command) == 0
    runs = [load_run(tmp_path / f"run_seed{seed}") for seed in (0, 2)]
    assert [run.config.train_config.seed for run in runs] == [0, 2]
    assert not np.array_equal(*(jax.tree.leaves(run.params)[0] for run in runs))
    about = json.loads((tmp_path / "run_seed2" / "run.json").read_text())["settings_file"]
    assert about["name"] == "settings.toml"
    assert about["text"] == path.read_text()
    assert about["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert "run_seed0: holds a run already; continue all with --resume" in fails(capsys, *command)
    # What is there is kept, what is missing is trained, and longer training needs no file.
    weights = (tmp_path / "run_seed0" / "weights.safetensors").read_bytes()
    assert main([*command[:-1], "0,2,3", "--resume"]) == 0
    assert (tmp_path / "run_seed0" / "weights.safetensors").read_bytes() == weights
    assert (tmp_path / "run_seed3" / "weights.safetensors").is_file()
    plain = [text for text in command if text not in ("--config", str(path))]
    assert main([*plain, "--resume", "--steps", "5"]) == 0
    assert load_run(tmp_path / "run_seed2").steps == 5
    assert load_run(tmp_path / "run_seed2").config.settings_file == about
