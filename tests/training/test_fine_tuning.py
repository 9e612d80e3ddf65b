"""Training that starts from a run: what is kept, adapted and refused; early stopping; exact resuming."""

import dataclasses
import json
import os
import shutil
import signal

import jax
import numpy as np
import pytest

from a2g_jax.data.splits import Segment
from a2g_jax.errors import InputError, Interrupted
from a2g_jax.features.statistics import Statistics
from a2g_jax.generation.generator import Generator
from a2g_jax.inspection.runs import check_run
from a2g_jax.models import find_model
from a2g_jax.training import early_stopping, loop
from a2g_jax.training import start as starting
from a2g_jax.training.checkpoint import Checkpoints
from a2g_jax.training.dynamics import corpus_dynamics
from a2g_jax.training.fine_tuning import (
    adapted_statistics,
    check_fits,
    start_from,
    training_model,
    tuned_config,
    with_validation,
    without_frozen,
    without_measured,
)
from a2g_jax.training.folder import check_folder
from a2g_jax.training.loop import train
from a2g_jax.training.run import Run, load_run, open_run, save_run
from a2g_jax.training.run_file import WEIGHTS_FILE

NETWORKS = ("audio_encoder", "decoder", "mapping_net", "motion_encoder")
FROZEN = ("audio_encoder", "motion_encoder")


def equal_trees(first, second) -> bool:
    return all(jax.tree.leaves(jax.tree.map(lambda a, b: np.array_equal(a, b), first, second)))


@pytest.fixture(scope="module")
def source(toy_run):
    """A run to start from."""
    return toy_run


@pytest.fixture(scope="module")
def tuned(source, toy_corpus):
    """A function of training settings: the description of a run that starts from the source, and its weights."""

    def make(**changes):
        start = start_from(source, load_run(source))
        settings = {"steps": 20, "batch_size": 2, "checkpoint_every": 5, "validate_every": 5, "log_every": 5}
        training = dataclasses.replace(find_model("audio2gestures").fine_tuning.training, **{**settings, **changes})
        return tuned_config(start, start.run.config.model_config, training, toy_corpus), start.run.params

    return make


@pytest.fixture(scope="module")
def tuned_run(tmp_path_factory, tuned, toy_corpus):
    """A run of five steps in which both encoders are frozen, and its folder."""
    config, params = tuned(steps=5, learning_rate=1e-3, frozen=FROZEN)
    folder = tmp_path_factory.mktemp("tuned") / "run"
    return train(config, toy_corpus, folder, resume=False, progress=False, start=params), folder


def test_a_tuned_run_starts_from_the_weights_and_records_the_source(source, tuned_run, toy_corpus):
    (run, folder), params = tuned_run, load_run(source).params
    # Adam moves a weight by little more than the learning rate in each step.
    for ours, theirs in zip(jax.tree.leaves(run.params), jax.tree.leaves(params), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=0.01)
    again = load_run(folder).config
    assert again.source == run.config.source
    assert again.source is not None
    assert again.source.run == str(source)
    assert again.source.steps == 30
    assert len(again.source.weights) == 64
    assert again.source.corpus == toy_corpus.fingerprint
    # Codes of clips of several tilings, not of one.
    assert len(run.summary["specific_mean"]) > 2 * len(load_run(source).summary["specific_mean"])


@pytest.mark.slow
def test_resuming_a_tuned_run_is_exact(tmp_path, tuned, toy_corpus, monkeypatch):
    config, params = tuned(patience=2, learning_rate=1e-3)
    whole = train(config, toy_corpus, tmp_path / "whole", resume=False, progress=False, start=params)
    half = tmp_path / "half"
    original = loop.MetricsLog.tick

    def tick(log, done):
        original(log, done)
        if done == 12:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(loop.MetricsLog, "tick", tick)
    with pytest.raises(Interrupted):
        train(config, toy_corpus, half, resume=False, progress=False, start=params)
    assert load_run(half).dynamics is None
    monkeypatch.undo()
    resumed = train(config, toy_corpus, half, resume=True, progress=False, start=params)
    assert equal_trees(whole.params, resumed.params)
    assert whole.steps == resumed.steps
    # Gains are measured when training has ended, and stored with the weights.
    assert whole.dynamics is not None
    for found in (resumed, load_run(half)):
        assert equal_trees(whole.dynamics.arrays(), found.dynamics.arrays())
    assert (half / WEIGHTS_FILE).read_bytes() == (tmp_path / "whole" / WEIGHTS_FILE).read_bytes()
    assert (half / "metrics.jsonl").read_text() == (tmp_path / "whole" / "metrics.jsonl").read_text()
    # The source is part of what must stay.
    plain = dataclasses.replace(config, source=None)
    with pytest.raises(InputError, match="other settings"):
        train(plain, toy_corpus, half, resume=True, progress=False)


@pytest.mark.slow
def test_early_stopping_keeps_the_best_weights(tmp_path, tuned, toy_corpus, monkeypatch):
    losses = iter([3.0, 2.0, 2.5, float("nan"), 2.2, 1.0, 1.0])
    monkeypatch.setattr(loop.Validator, "__call__", lambda *_: {"loss": next(losses)})
    config, params = tuned(patience=3, steps=100, keep_checkpoints=1, learning_rate=1e-3)
    out = tmp_path / "run"
    run = train(config, toy_corpus, out, resume=False, progress=False, start=params)
    assert run.steps == 10
    metrics = early_stopping.read_metrics(out / "metrics.jsonl")
    assert [row["step"] for row in metrics if row["split"] == "validation"] == [5, 10, 15, 20, 25]
    assert load_run(out).steps == 10
    assert Checkpoints(out / "checkpoints", 1).steps() == [10, 25]
    stored = json.loads((out / "run.json").read_text())
    assert stored["steps"] == 10
    # It is finished, and no finding calls it unfinished.
    assert not [found for found in check_run(run, metrics) if found.code == "unfinished"]
    again = train(config, toy_corpus, out, resume=True, progress=False, start=params)
    assert equal_trees(run.params, again.params)


def test_validations_are_those_of_the_last_stage():
    rows = [
        {"step": 10, "split": "validation", "loss": 0.1},
        {"step": 20, "split": "validation", "loss": 2.0},
        {"step": 30, "split": "train", "loss": 0.0},
        {"step": 30, "split": "validation", "loss": None},
        {"step": 40, "split": "validation", "loss": 1.0},
    ]
    found = early_stopping.validations(rows, first=10, done=30)
    assert (found.best, found.loss, found.since) == (20, 2.0, 1)
    assert early_stopping.validations(rows, first=10, done=40).best == 40


def test_statistics_are_of_the_new_recordings_and_constants_stay(source, toy_corpus):
    start = start_from(source, load_run(source))
    old = {"pose": Statistics(np.zeros((1, 3), np.float32), np.array([[0.01, 0.05, 0.3]], np.float32))}
    new = {"pose": Statistics(np.ones((1, 3), np.float32), np.array([[0.4, 0.01, 0.2]], np.float32))}
    for group in (old, new):
        group["audio"] = group["root"] = Statistics(np.zeros(1, np.float32), np.ones(1, np.float32))
    plain = adapted_statistics(old, new, start.source)["pose"]
    np.testing.assert_array_equal(plain.std, new["pose"].std)
    kept = adapted_statistics(old, new, dataclasses.replace(start.source, keep_constant=True))["pose"]
    np.testing.assert_allclose(kept.std, [[0.01, 0.02, 0.2]])
    np.testing.assert_array_equal(kept.mean, new["pose"].mean)
    same = adapted_statistics(old, new, dataclasses.replace(start.source, pose_statistics="run"))["pose"]
    np.testing.assert_array_equal(same.mean, old["pose"].mean)


def test_what_does_not_fit_is_refused_with_the_command(source, toy_corpus):
    run = load_run(source)
    taller = dataclasses.replace(toy_corpus.space, body=toy_corpus.skeleton.scaled(1.1))
    about = {"reader": "folder", "source": "TAKES"}
    for changes, what in ((({"fps": 60.0}), "60 frames a second"), ({"space": taller}, "another body")):
        other = dataclasses.replace(toy_corpus, recipe=about, **changes)
        with pytest.raises(InputError, match=f"{what}.*a2g prepare folder TAKES --out CORPUS --for demo"):
            check_fits("demo", run.config, other)
    start = start_from(source, run)
    wide = dataclasses.replace(run.config.model_config, code_channels=6)
    with pytest.raises(InputError, match="--code-channels: changes the networks"):
        tuned_config(start, wide, run.config.train_config, toy_corpus)


def test_frozen_networks_do_not_move(source, tuned_run):
    run, params = tuned_run[0], load_run(source).params
    for name in NETWORKS:
        assert equal_trees(run.params[name], params[name]) == (name in FROZEN), name
    model = run.config.build()
    with pytest.raises(InputError, match="no network 'encoder'; there are: audio_encoder"):
        without_frozen(model, ("encoder",))
    with pytest.raises(InputError, match="nothing to train"):
        without_frozen(model, NETWORKS)


def test_networks_that_a_model_keeps_in_fine_tuning_stay(tuned):
    config, _ = tuned(steps=1)
    assert config.source is not None
    source = dataclasses.replace(config.source, frozen=("audio_encoder", "a_network_of_other_presets"))
    (stage,) = training_model(dataclasses.replace(config, source=source)).stages
    assert stage.updates[0].trains == tuple(name for name in NETWORKS if name != "audio_encoder")


def test_stages_and_initialisation_of_the_source():
    entry = find_model("audio2gestures")
    assert entry.fine_tuning.stages == ("adversarial",)
    for name in ("audio2gestures", "stylized_flow", "speech2gesture"):
        tuning = find_model(name).fine_tuning
        assert tuning.training.patience > 0
        assert 0 < tuning.training.steps <= 1000
    assert find_model("stylized_flow").fine_tuning.keep_constant


@pytest.mark.parametrize(("frames", "held"), [(20, 0), (60, 44), (400, 320)])
def test_validation_is_held_out_where_the_split_is_too_short(toy_corpus, frames, held):
    short = dataclasses.replace(
        toy_corpus, splits={"train": [Segment(0, 0, frames)], "validation": [Segment(0, frames, frames + 9)]}
    )
    corpus, note = with_validation(short, 16)
    if not held:
        assert corpus is short
        assert "without early stopping" in note
        return
    assert corpus.splits["train"] == [Segment(0, 0, held)]
    assert corpus.splits["validation"] == [Segment(0, held, frames)]
    assert "held out" in note
    assert with_validation(toy_corpus, 16) == (toy_corpus, "")


@pytest.mark.slow
def test_two_people_together(tmp_path, source, tuned, toy_corpus):
    """Recordings of several people are one corpus; each gives validation clips of its own."""
    two = dataclasses.replace(toy_corpus, splits={"train": [Segment(0, 0, 300), Segment(1, 0, 200)], "validation": []})
    corpus, _ = with_validation(two, 16)
    assert [segment.recording for segment in corpus.splits["validation"]] == [0, 1]
    config, params = tuned(steps=2)
    assert train(config, two, tmp_path / "run", resume=False, progress=False, start=params).steps == 2
    assert training_model(config).stages[0].warm_start is None


def test_resuming_needs_only_the_run_itself(tmp_path, source, toy_corpus, monkeypatch):
    """Not the run that it started from; that one may be moved, and another one is refused by its weights."""
    moved = tmp_path / "start"
    shutil.copytree(source, moved)
    begun = start_from(moved, load_run(moved))
    settings = dataclasses.replace(begun.run.config.train_config, steps=9)
    config = tuned_config(begun, begun.run.config.model_config, settings, toy_corpus)
    shifted = Statistics(config.statistics["audio"].mean + 1, config.statistics["audio"].std)
    config = dataclasses.replace(config, statistics={**config.statistics, "audio": shifted})
    out = tmp_path / "run"
    save_run(out, Run(config, begun.run.params, begun.run.summary, 3))
    trained = []

    def record(config, corpus, folder, **given) -> Run:
        trained.append((config, given))
        return begun.run

    monkeypatch.setattr(starting, "train", record)

    def resumed(name=None):
        about = ("audio2gestures", "tiny", config.model_config, settings, toy_corpus.path, out, True)
        starting.run_training(*about, source=name)
        return trained[-1]

    # Without a checkpoint training starts again, which needs the source.
    assert resumed()[0].source == begun.source
    (out / "checkpoints" / "3").mkdir(parents=True)
    shutil.rmtree(moved)
    for name in (None, str(source)):
        found, given = resumed(name)
        assert found.source == begun.source
        np.testing.assert_array_equal(found.statistics["audio"].mean, shifted.mean)
        assert given["resume"]
        assert equal_trees(given["start"], begun.run.params)
    with pytest.raises(InputError, match="started from other weights than those of demo; resume without --from"):
        resumed("demo")


def test_the_path_of_a_source_is_no_setting(tmp_path, tuned):
    config, params = tuned(steps=1)
    save_run(tmp_path, Run(config, params, {}, 0))
    check = lambda source: check_folder(  # noqa: E731
        tmp_path, dataclasses.replace(config, source=source), Checkpoints(tmp_path / "checkpoints", 1), True, False
    )
    check(dataclasses.replace(config.source, run="elsewhere"))
    with pytest.raises(InputError, match="other settings"):
        check(dataclasses.replace(config.source, weights="0" * 64))


@pytest.mark.parametrize("name", ["demo", "demo-flow"])
def test_gains_of_controls_are_not_those_of_the_source(name, source, toy_corpus):
    """They were measured on other weights; other sampling settings stay."""
    sampling = open_run(name).config.sampling
    assert sampling.control_gains
    assert without_measured(sampling) == dataclasses.replace(sampling, control_gains=())
    run = load_run(source)
    other = dataclasses.replace(run.config.sampling, control_gains=("energy=2",), noise_scale=0.7)
    start = start_from(source, dataclasses.replace(run, config=dataclasses.replace(run.config, sampling=other)))
    config = tuned_config(start, run.config.model_config, run.config.train_config, toy_corpus)
    assert config.sampling == dataclasses.replace(other, control_gains=())


def test_no_gains_without_a_source_or_recordings(tuned, toy_run_config, toy_corpus):
    config, params = tuned()
    model = training_model(config)
    assert corpus_dynamics(model, toy_run_config(), params, {}, toy_corpus) is None
    assert config.source is not None
    other = dataclasses.replace(config, source=dataclasses.replace(config.source, dynamics=False))
    assert corpus_dynamics(model, other, params, {}, toy_corpus) is None
    short = dataclasses.replace(toy_corpus, splits={"train": [Segment(0, 0, 40)]})
    assert corpus_dynamics(model, config, params, {}, short) is None


def test_motion_of_a_tuned_run_has_the_dynamics_of_the_recordings(tuned_run, toy_corpus):
    """Amplitude of motion for the speech of the recordings; that of the toy run is far from theirs."""
    run, _ = tuned_run
    segment = toy_corpus.segments("train")[0]
    audio, pose = (np.asarray(toy_corpus.array(name)[segment.start : segment.stop]) for name in ("audio", "pose"))
    spread = {}
    for name, one in (("plain", dataclasses.replace(run, dynamics=None)), ("tuned", run)):
        (rows,) = Generator(one).rows(np.asarray(audio, np.float32), 1)
        spread[name] = abs(float(np.log(rows.std(axis=0).mean() / pose.std(axis=0).mean())))
    assert spread["tuned"] < 0.7 * spread["plain"]
