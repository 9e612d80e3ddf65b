"""The training loop: it learns, resumes exactly, guards against NaN, and its runs can be read back."""

import dataclasses
import json
import os
import shutil
import signal
import subprocess
import sys
import textwrap
import time

import jax
import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.geometry.kinematics import joint_positions
from a2g_jax.geometry.rotation import matrix_from_6d
from a2g_jax.training import loop
from a2g_jax.training import validation as evaluation
from a2g_jax.training.checkpoint import Checkpoints
from a2g_jax.training.loop import Interrupted, TrainingError, train
from a2g_jax.training.run import load_run, save_run
from a2g_jax.training.stages import stage_spans
from a2g_jax.training.state import init_state


def equal_trees(first, second) -> bool:
    return all(jax.tree.leaves(jax.tree.map(lambda a, b: np.array_equal(a, b), first, second)))


def lines(folder, split):
    rows = [json.loads(line) for line in (folder / "metrics.jsonl").read_text().splitlines()]
    return [row for row in rows if row["split"] == split]


def test_training_lowers_the_loss_and_writes_the_run(toy_run, toy_run_config):
    losses = [row["loss"] for row in lines(toy_run, "train")]
    assert losses[-1] < 0.9 * losses[0]
    assert len(lines(toy_run, "validation")) == 2
    run = load_run(toy_run)
    assert run.steps == 30
    assert run.config.model_config == toy_run_config().model_config
    assert set(run.summary) == {"specific_mean", "specific_std"}
    assert len(run.summary["specific_mean"]) > 20


@pytest.mark.smoke
def test_resuming_equals_not_having_stopped(tmp_path, toy_corpus, toy_run, toy_run_config):
    # Interrupted between two checkpoints.
    half = tmp_path / "half"
    first = toy_run_config()
    stop_after(first, toy_corpus, half, 17)
    resumed = train(first, toy_corpus, half, resume=True, progress=False)
    assert equal_trees(load_run(toy_run).params, resumed.params)
    # What a training returns is what it writes.
    assert equal_trees(load_run(half).params, resumed.params)
    assert (half / "metrics.jsonl").read_text() == (toy_run / "metrics.jsonl").read_text()


def test_a_restored_state_is_bound_to_no_device(toy_run, toy_run_config):
    """As a new one, so that a run that resumes finds its programs in the compilation cache."""
    config = toy_run_config()
    model = config.build()
    new = init_state(model, stage_spans(model, config.train_config), seed=0)
    restored = Checkpoints(toy_run / "checkpoints", 1).restore(new)
    assert int(restored.step) == 30
    assert not any(leaf.committed for state in (new, restored) for leaf in jax.tree.leaves(state))


def stop_after(config, corpus, out, step):
    """Send this process SIGINT during a step, as a user would."""
    original = loop.MetricsLog.tick

    def tick(self, done):
        original(self, done)
        if done == step:
            os.kill(os.getpid(), signal.SIGINT)

    loop.MetricsLog.tick = tick
    try:
        with pytest.raises(Interrupted, match="resume with --resume"):
            train(config, corpus, out, resume=False, progress=False)
    finally:
        loop.MetricsLog.tick = original


def test_data_from_disk_gives_the_same_parameters(tmp_path, toy_corpus, toy_run, toy_run_config):
    config = toy_run_config(device_megabytes=0.0)
    from_disk = train(config, toy_corpus, tmp_path / "run", resume=False, progress=False)
    for a, b in zip(jax.tree.leaves(load_run(toy_run).params), jax.tree.leaves(from_disk.params), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)


def test_nan_stops_and_keeps_the_last_good_checkpoint(tmp_path, toy_corpus, toy_run_config):
    config = toy_run_config(
        steps=40, learning_rate=1e25, clip_norm=0.0, checkpoint_every=1, log_every=2, warmup_steps=4
    )
    with pytest.raises(TrainingError, match="not finite; the checkpoint of step [0-9]+ is good; try a lower"):
        train(config, toy_corpus, tmp_path / "run", resume=False, progress=False)
    for leaf in jax.tree.leaves(load_run(tmp_path / "run").params):
        assert np.all(np.isfinite(leaf))


def test_validation_counts_every_clip_once(toy_corpus, toy_run, toy_run_config):
    """18 clips are a full batch and a small one; their mean is that of single clips."""
    config = toy_run_config()
    figures = evaluation.Validator(loop.training_model(config), toy_corpus, config)(load_run(toy_run).params)
    starts = evaluation.tiled_starts(toy_corpus, "validation", 16)
    assert len(starts) == 18
    body = toy_corpus.skeleton
    joints = jax.jit(lambda pose: joint_positions(matrix_from_6d(pose), body.offsets, body.parents))
    mean, single = joints(np.tile(toy_corpus.statistics["pose"].mean, (16, 1, 1))), []
    for start in starts:
        places = joints(np.asarray(toy_corpus.pose[start : start + 16]))
        single.append(100 * np.linalg.norm(places - mean, axis=-1).mean())
    assert figures["mean_pose_cm"] == pytest.approx(np.mean(single), rel=1e-4)


@pytest.mark.slow
def test_a_run_that_never_got_to_a_checkpoint_can_be_started_again(tmp_path, toy_corpus, toy_run_config):
    out = tmp_path / "run"
    with pytest.raises(TrainingError):
        train(
            toy_run_config(steps=40, learning_rate=1e30, clip_norm=0.0, warmup_steps=0, log_every=1),
            toy_corpus,
            out,
            resume=False,
            progress=False,
        )
    train(toy_run_config(steps=5), toy_corpus, out, resume=False, progress=False)
    assert load_run(out).steps == 5


def test_folders_that_cannot_be_used(tmp_path, toy_corpus, toy_run, toy_run_config):
    config = toy_run_config()
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.txt").write_text("mine")
    with pytest.raises(InputError, match="not empty and holds no run"):
        train(config, toy_corpus, tmp_path / "other", resume=False, progress=False)
    with pytest.raises(InputError, match="holds a run already"):
        train(config, toy_corpus, toy_run, resume=False, progress=False)
    changed = toy_run_config(steps=39, learning_rate=0.01)
    with pytest.raises(InputError, match="learning_rate: 0.003, now 0.01"):
        train(changed, toy_corpus, toy_run, resume=True, progress=False)


def test_clips_longer_than_recordings(tmp_path, toy_corpus, toy_run_config):
    config = toy_run_config()
    config = dataclasses.replace(config, model_config=dataclasses.replace(config.model_config, clip_frames=1000))
    with pytest.raises(InputError, match="longest train recording has 300 frames, a clip has 1000"):
        train(config, toy_corpus, tmp_path / "run", resume=False, progress=False)
    assert not (tmp_path / "run").exists()


def test_a_damaged_checkpoint_is_refused_by_name(tmp_path, toy_corpus, toy_run, toy_run_config):
    folder = shutil.copytree(toy_run, tmp_path / "run")
    for file in (folder / "checkpoints" / "30").rglob("*"):
        if file.is_file():
            file.write_bytes(b"\x80\x04nothing to see here")
    with pytest.raises(InputError, match="checkpoints/30: cannot be resumed from"):
        train(toy_run_config(), toy_corpus, folder, resume=True, progress=False)


def test_damaged_runs(tmp_path, toy_run):
    folder = shutil.copytree(toy_run, tmp_path / "run")
    run = load_run(folder)
    weights = (folder / "weights.safetensors").read_bytes()
    for broken in (weights[: len(weights) // 2], b"", b"\x80\x04pickle", weights[:8] + b"x" * 100):
        (folder / "weights.safetensors").write_bytes(broken)
        with pytest.raises(InputError, match="weights.safetensors"):
            load_run(folder)
    params = {**run.params, "decoder": {"Dense_0": run.params["decoder"]["Dense_0"]}}
    save_run(folder, dataclasses.replace(run, params=params))
    with pytest.raises(InputError, match="expected .* got nothing"):
        load_run(folder)
    (folder / "run.json").write_text("{}")
    with pytest.raises(InputError, match=r"run\.json"):
        load_run(folder)
    with pytest.raises(InputError, match="is not a run"):
        load_run(tmp_path)


_SCRIPT = """
import sys
sys.path.insert(0, {tests!r})
import jax
jax.config.update("jax_numpy_rank_promotion", "raise")
from pathlib import Path
from a2g_jax.data.corpus import Corpus
from a2g_jax.config import from_json
from a2g_jax.models import find_model
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.training.loop import train
from a2g_jax.training.run import RunConfig
import json
settings = json.loads(Path({settings!r}).read_text())
corpus = Corpus.open({corpus!r})
model = from_json(find_model("audio2gestures").config, settings["model"], "model")
config = RunConfig.of("audio2gestures", "tiny", model, from_json(TrainConfig, settings["training"], "training"), corpus)
train(config, corpus, {out!r}, resume=True, progress=False)
"""


@pytest.mark.slow
def test_killed_at_any_moment_training_ends_the_same(tmp_path, toy_corpus, toy_run_config):
    """SIGKILL at random moments, also during saves: the final parameters are equal bit for bit."""
    config = toy_run_config(steps=400, checkpoint_every=7, log_every=7)
    settings = tmp_path / "settings.json"
    settings.write_text(
        json.dumps(
            {
                "model": dataclasses.asdict(config.model_config),
                "training": dataclasses.asdict(config.train_config),
            }
        )
    )

    def start(out):
        values = {"settings": str(settings), "corpus": str(toy_corpus.path), "out": str(out)}
        code = textwrap.dedent(_SCRIPT).format(tests=os.path.dirname(__file__), **values)  # noqa: PTH120
        return subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE)

    process = start(tmp_path / "whole")
    assert process.wait() == 0, process.stderr.read().decode()
    rng = np.random.default_rng(0)
    kills = 0
    for _ in range(20):
        process = start(tmp_path / "killed")
        # Wait until it trains, then a random time.
        checkpoints = tmp_path / "killed" / "checkpoints"
        before = (
            max((path.stat().st_mtime for path in checkpoints.glob("*")), default=0.0) if checkpoints.exists() else 0
        )
        while process.poll() is None and not (
            checkpoints.exists() and any(path.stat().st_mtime > before for path in checkpoints.glob("*"))
        ):
            time.sleep(0.01)
        time.sleep(rng.uniform(0.0, 0.4))
        if process.poll() is not None:
            assert process.returncode == 0, process.stderr.read().decode()
            break
        process.send_signal(signal.SIGKILL)
        process.wait()
        kills += 1
    else:
        assert start(tmp_path / "killed").wait() == 0
    assert kills >= 1
    assert equal_trees(load_run(tmp_path / "whole").params, load_run(tmp_path / "killed").params)


@pytest.mark.slow
def test_a_checkpoint_of_version_0_1_resumes(tmp_path, toy_corpus, toy_run_config):
    """It held the state of one optimiser under another name."""
    from orbax.checkpoint import v1 as ocp

    whole = train(toy_run_config(), toy_corpus, tmp_path / "whole", resume=False, progress=False)
    old = tmp_path / "old"
    stop_after(toy_run_config(), toy_corpus, old, 17)
    (kept,) = (path for path in (old / "checkpoints").iterdir() if path.name == "17")
    tree = dict(ocp.load(kept))
    (tree["optimiser"],) = tree.pop("optimisers").values()
    shutil.rmtree(old / "checkpoints")
    ocp.save(kept, tree)
    about = json.loads((old / "run.json").read_text())
    for name in ("weights_sha256", "log", "checksum"):  # that version knew no hashes
        del about[name]
    (old / "run.json").write_text(json.dumps(about))
    resumed = train(toy_run_config(), toy_corpus, old, resume=True, progress=False)
    assert equal_trees(whole.params, resumed.params)
