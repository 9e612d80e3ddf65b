"""A model of another package trains in two stages, resumes after SIGKILL, generates and is evaluated."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.data.batch import Batch
from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.generation.conditions import corpus_condition
from a2g_jax.generation.generator import Generator
from a2g_jax.io.audio import write_audio
from a2g_jax.models.base import Data
from a2g_jax.models.registry import find_model, find_trained_model
from a2g_jax.training.run import load_run
from a2g_jax.training.stages import stage_spans
from a2g_jax.training.state import advance, init_state

PACKAGE = Path(__file__).parent / "toy_package"
MODEL = "toy_gestures:ENTRY"


@pytest.fixture(autouse=True)
def package(monkeypatch):
    """The package is importable, here and in subprocesses."""
    monkeypatch.syspath_prepend(str(PACKAGE))


@pytest.fixture(scope="module")
def toy_run(toy_corpus, tmp_path_factory):
    """A trained run."""
    sys.path.insert(0, str(PACKAGE))
    folder = tmp_path_factory.mktemp("toy_model") / "run"
    assert main(["train", MODEL, "--corpus", str(toy_corpus.path), "--out", str(folder)]) == 0
    sys.path.remove(str(PACKAGE))
    return folder


def arrays(folder: Path) -> dict[str, np.ndarray]:
    """Weights of a run."""
    return {"/".join(path): value for path, value in flattened(load_run(folder).params)}


def flattened(tree, path=()):
    """Leaves of nested dictionaries with their paths."""
    for name, value in tree.items():
        yield from flattened(value, (*path, name)) if isinstance(value, dict) else [((*path, name), value)]


def test_both_stages_are_trained_and_the_second_leaves_the_first_alone(toy_run):
    lines = [json.loads(line) for line in (toy_run / "metrics.jsonl").read_text().splitlines()]
    train = [line for line in lines if line["split"] == "train"]
    assert [line["step"] for line in train] == list(range(1, 21))
    assert {"gradient_norm_discriminator", "gradient_norm_generator", "fooled"} <= set(train[11])
    assert [line["stage_step"] for line in train[12:]] == list(range(8)), "the second stage counts its own steps"
    # The checkpoint of step 15 lies within the second stage: only its part differs from the end.
    run = load_run(toy_run)
    assert run.steps == 20
    from orbax.checkpoint import v1 as ocp

    before = ocp.load(toy_run.absolute() / "checkpoints" / "15")["params"]
    for (path, now), (_, then) in zip(flattened(run.params), flattened(before), strict=True):
        assert np.array_equal(now, then) == (path[0] != "spread"), path


@pytest.mark.slow
def test_resuming_after_sigkill_equals_not_having_stopped(toy_corpus, tmp_path):
    """Killed once in each stage."""
    folder, whole = tmp_path / "killed", tmp_path / "whole"
    settings = ["--steps", "60", "--spread-steps", "60", "--checkpoint-every", "3", "--keep-checkpoints", "99"]
    train = ["train", MODEL, "--corpus", str(toy_corpus.path), *settings, "--out"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(PACKAGE), str(Path(__file__).parents[2])])}
    for wanted in (9, 69):
        process = subprocess.Popen(
            [sys.executable, "-m", "a2g_jax.cli", *train, str(folder), "--resume"],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        end = time.monotonic() + 400
        while not (folder / "checkpoints" / str(wanted)).is_dir() and process.poll() is None:
            assert time.monotonic() < end
            time.sleep(0.005)
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL, "it was killed before it had finished"
    assert main([*train, str(folder), "--resume"]) == 0
    assert main([*train, str(whole)]) == 0
    ours, theirs = arrays(folder), arrays(whole)
    assert all(np.array_equal(ours[name], theirs[name]) for name in theirs)
    assert (folder / "metrics.jsonl").read_text() == (whole / "metrics.jsonl").read_text()


def test_it_generates_from_labels_words_and_seed_poses(toy_run, toy_corpus):
    run = load_run(toy_run)
    generator = Generator(run, window=128)
    corpus = Corpus.open(toy_corpus.path)
    features = np.asarray(corpus.audio[:60])
    given = corpus_condition(run.config, generator.engine.model.condition_fields, corpus, 0, 60)
    assert set(given) == {"emotion", "words"}
    draw = lambda **more: np.stack(list(generator.rows(features, 2, 0, **more)))  # noqa: E731
    plain, conditioned = draw(), draw(**given)
    assert plain.shape == (2, 60, *corpus.space.shape)
    assert not np.allclose(plain[0], plain[1])
    assert not np.allclose(plain, conditioned)
    seeded = draw(seed_poses=np.asarray(corpus.pose[50:60]))
    assert np.abs(seeded[:, 0] - corpus.pose[59]).mean() < np.abs(plain[:, 0] - corpus.pose[59]).mean()
    with pytest.raises(InputError, match="takes no latents"):
        draw(latents=(features, features))
    with pytest.raises(InputError, match="words: expected a row for each of 60 frames; got 59"):
        draw(words=given["words"][:59])
    with pytest.raises(InputError, match="needs 2 or more"):
        draw(seed_poses=np.asarray(corpus.pose[:1]))


def test_changed_sampling_settings_survive_a_resume(toy_run, toy_corpus, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(toy_run, folder)
    values = json.loads((folder / "run.json").read_text())
    values["sampling"]["amplitude"] = 0.25
    values["checksum"] = None  # accepts the edit
    (folder / "run.json").write_text(json.dumps(values))
    assert main(["train", MODEL, "--corpus", str(toy_corpus.path), "--out", str(folder), "--resume"]) == 0
    assert json.loads((folder / "run.json").read_text())["sampling"] == {"amplitude": 0.25}


def test_impossible_stages_are_named(toy_corpus):
    entry = find_model(MODEL)
    data = Data(toy_corpus.space, 30.0, toy_corpus.mel.width, toy_corpus.statistics["pose"], ("a", "b"))
    model = entry.builder()(entry.presets["tiny"], data, entry.sampling())
    (judge, player), second = model.stages[0].updates, model.stages[1]
    cases = {
        "trains nobody; the parameters are": (second._replace(updates=(player._replace(trains=("nobody",)),)),),
        "expected updates of different names": (second._replace(updates=(judge, judge)),),
        "expected stages of different names": (second, second),
        "a number of steps for all stages but one": (model.stages[0], second._replace(steps=None)),
    }
    for message, stages in cases.items():
        with pytest.raises(InputError, match=message):
            stage_spans(model._replace(stages=stages), entry.training["tiny"])


def test_the_commands_take_it(toy_run, toy_corpus, tmp_path, capsys):
    speech = tmp_path / "speech.wav"
    write_audio(speech, np.sin(np.arange(16000) / 20.0).astype(np.float32) * 0.1, 16000)
    out = tmp_path / "out"
    arguments = ["generate", str(toy_run), "--audio", str(speech), "--out", str(out), "--samples", "2"]
    assert main([*arguments, "--formats", "npz", "--amplitude", "0.5"]) == 0
    assert sorted(path.name for path in out.iterdir()) == ["checks.json", "sample_00.npz", "sample_01.npz"]
    capsys.readouterr()
    assert main(["generate", str(toy_run), "--settings"]) == 0
    assert "--amplitude 1.0" in capsys.readouterr().out
    assert main([*arguments, "--temperature", "2"]) == 2
    assert "there is no flag --temperature" in capsys.readouterr().err
    report = tmp_path / "report"
    assert (
        main(["evaluate", str(toy_run), "--corpus", str(toy_corpus.path), "--out", str(report), "--samples", "1"]) == 0
    )
    rows = [row["name"] for row in json.loads((report / "report.json").read_text())["rows"]]
    assert str(toy_run) in rows


def test_a_run_folder_imports_no_code_that_nobody_allowed(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="A2G_MODELS=os:system"):
        find_trained_model("os:system", "run.json")
    monkeypatch.setenv("A2G_MODELS", "json:dumps")
    with pytest.raises(InputError, match="expected an a2g_jax.models.entry.Entry"):
        find_trained_model("json:dumps", "run.json")


def test_an_entry_point_names_it(tmp_path, monkeypatch):
    info = tmp_path / "toy_gestures-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: toy-gestures\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[a2g_jax.models]\ntoy = toy_gestures:ENTRY\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert find_model("toy").presets["tiny"].clip_frames == 16


def test_the_gan_clips_each_player_alone(toy_corpus):
    """With the discriminator's loss a million times as large, the generator's step is the same."""

    entry = find_model(MODEL)
    data = Data(toy_corpus.space, 30.0, toy_corpus.mel.width, toy_corpus.statistics["pose"], ("a", "b"))
    model = entry.builder()(entry.presets["tiny"], data, entry.sampling())
    first, second = model.stages[0].updates

    def louder(*given):
        loss, terms = first.loss(*given)
        return 1e6 * loss, terms

    loud = model._replace(stages=(replace_updates(model.stages[0], (first._replace(loss=louder), second)),))
    settings = replace(entry.training["tiny"], clip_norm=1e-3)
    batch = Batch(
        np.ones((2, 16, data.audio_bands), np.float32),
        np.asarray(toy_corpus.pose[:32]).reshape(2, 16, *toy_corpus.space.shape),
        emotion=np.array([0, 1]),
        words=np.zeros((2, 16), np.int32),
    )
    results = []
    for one in (model._replace(stages=model.stages[:1]), loud):
        span = stage_spans(one, settings)[0]
        state = init_state(one, (span,), 0)
        results.append(jax.jit(lambda s, span=span: advance(span, s, batch, jax.random.key(0))[0])(state).params)
    gentle, strong = results
    np.testing.assert_allclose(gentle["generator"]["out"], strong["generator"]["out"], atol=1e-6)
    before = init_state(model, stage_spans(model, settings), 0).params
    assert np.abs(gentle["generator"]["out"] - before["generator"]["out"]).max() > 1e-4


def replace_updates(stage, updates):
    """The stage with other updates."""
    return stage._replace(updates=updates)
