"""EmotionGesture through the commands: trained in stages, resumed, generated, evaluated."""

import json
import os
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
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_writer import prepare_recording, write_corpus
from a2g_jax.data.settings import Features
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.io.words import word_id
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import load_run

# The common loop has faster guards (tests/plugin); here the whole model is compiled for each stage.
pytestmark = pytest.mark.slow

SETTINGS = {
    "channels": 8,
    "heads": 2,
    "hidden": 8,
    "layers": 1,
    "audio-blocks": "1,1",
    "audio-channels": "4,4",
    "emotion-hidden": "4",
    "word-width": 4,
    "word-layers": 1,
    "word-buckets": 16,
    "clip-frames": 16,
    "seed-frames": 4,
    "transition-frames": 4,
    "discriminator-channels": 8,
    "discriminator-hidden": "4",
    "vae-latent": 3,
    "vae-channels": 4,
    "mining-steps": 2,
    "vae-steps": 4,
    "sampled-steps": 2,
    "steps": 6,
    "batch-size": 4,
    "warmup-steps": 0,
    "checkpoint-every": 2,
    "validate-every": 5,
    "log-every": 1,
    "keep-checkpoints": 99,
}


def flags(**changes):
    """The settings as command-line flags."""
    chosen = {**SETTINGS, **{name.replace("_", "-"): value for name, value in changes.items()}}
    return [part for name, value in chosen.items() for part in (f"--{name}", str(value))]


def train(corpus, out, *more, **changes):
    """Train by the command."""
    return ["train", "emotion_gesture", "--corpus", str(corpus), "--out", str(out), *flags(**changes), *more]


@pytest.fixture(scope="module")
def run(toy_corpus, tmp_path_factory):
    folder = tmp_path_factory.mktemp("emotion_gesture") / "run"
    assert main(train(toy_corpus.path, folder)) == 0
    return folder


@pytest.fixture(scope="module")
def speech(tmp_path_factory):
    folder = tmp_path_factory.mktemp("speech")
    write_audio(folder / "speech.wav", talk(3.0, 8).audio, 16000)
    write_bvh(folder / "start.bvh", talk(2.0, 4).motion)
    return folder


def leaves(tree, path=()):
    """Arrays of nested dictionaries by path."""
    for name, value in tree.items():
        yield from leaves(value, (*path, name)) if isinstance(value, dict) else [("/".join((*path, name)), value)]


def stored(run, step):
    """The state of training in a checkpoint."""
    from orbax.checkpoint import v1 as ocp

    return ocp.load(run.absolute() / "checkpoints" / str(step))


def test_the_stage_of_the_vae_leaves_everything_but_the_vae(run):
    states = [dict(leaves(stored(run, step)["params"])) for step in (8, 12, 14)]
    before, after, last = states
    assert {name.split("/")[0] for name in after if not np.array_equal(after[name], before[name])} == {"vae"}
    found = dict(leaves(load_run(run).params))
    for name, value in found.items():
        np.testing.assert_array_equal(value, last[name.replace("generator/", "average/")])
    assert not any(name.startswith("average/") for name in found)
    lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    main_lines = [line for line in lines if line["split"] == "train" and 2 < line["step"] <= 8]
    terms = {"reconstruction", "smooth", "adversarial", "discriminator", "emotion", "beat", "emotion_accuracy"}
    assert all(terms <= set(line) for line in main_lines)
    assert [line["step"] for line in lines if "vae_error" in line and line["split"] == "train"] == [9, 10, 11, 12]
    assert np.isfinite([value for line in lines for value in line.values() if isinstance(value, float)]).all()


def test_the_summary_holds_rest_poses(run, toy_corpus):
    summary = load_run(run).summary
    assert set(summary) == {"rest_pose", "rest_speed"}
    assert summary["rest_pose"].dtype == np.float16
    assert summary["rest_pose"].shape[1:] == toy_corpus.space.shape
    assert np.all(summary["rest_speed"] >= 0)
    # Each is a pose of the corpus.
    poses = np.asarray(toy_corpus.pose, np.float16)
    assert all(np.any(np.all(poses == pose, axis=(1, 2))) for pose in summary["rest_pose"][:5])


def test_it_generates_from_the_command_line(run, speech, tmp_path, capsys, toy_corpus):
    command = ["generate", str(run), "--audio", str(speech / "speech.wav"), "--samples", "2", "--formats", "npz"]
    emotion = load_run(run).config.corpus["emotions"][0]
    motions = {}
    for name, more in {
        "audio": [],
        "named": ["--emotion", emotion],
        "timeline": ["--emotion", f"{emotion}@0,{emotion}@1"],
        "sample": ["--emotion", "sample"],
        "seeded": ["--seed-clip", str(speech / "start.bvh")],
    }.items():
        out = tmp_path / name
        assert main([*command, "--out", str(out), *more]) == 0
        motions[name] = [np.load(out / f"sample_0{number}.npz")["rotations"] for number in (0, 1)]
        assert motions[name][0].shape == (90, 22, 3, 3)
        assert np.isfinite(motions[name][0]).all()
    assert np.abs(motions["named"][0] - motions["named"][1]).max() > 1e-5
    np.testing.assert_allclose(motions["named"][0], motions["timeline"][0], atol=1e-5)
    assert np.abs(motions["seeded"][0] - motions["audio"][0]).max() > 1e-3
    capsys.readouterr()
    for more, message in {
        ("--emotion", "angry"): "--emotion 'angry': the run has no emotion 'angry'; it has:",
        ("--emotion", f"{emotion}@0,{emotion}@9"): "second 9 is past the end of the speech, which lasts 3.00 s.",
        ("--temperature", "-1"): "--temperature: expected 0 or more; got -1.0.",
    }.items():
        assert main([*command, "--out", str(tmp_path / "bad"), *more]) == 2
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1
    assert not (tmp_path / "bad").exists()


def test_a_seed_clip_that_is_too_short(run, speech, tmp_path, capsys):
    motion = talk(2.0, 4).motion
    write_bvh(tmp_path / "blink.bvh", replace(motion, rotations=motion.rotations[:3], root=motion.root[:3]))
    command = ["generate", str(run), "--audio", str(speech / "speech.wav"), "--out", str(tmp_path / "out")]
    assert main([*command, "--seed-clip", str(tmp_path / "blink.bvh")]) == 2
    assert "blink.bvh: has 3 frames at the run's 30 fps; give a clip of 4 or more." in capsys.readouterr().err


def test_models_without_seed_poses_refuse_a_seed_clip(speech, tmp_path, capsys):
    command = ["generate", "demo", "--audio", str(speech / "speech.wav"), "--out", str(tmp_path / "out")]
    assert main([*command, "--seed-clip", str(speech / "start.bvh")]) == 2
    assert "--seed-clip: runs of audio2gestures take no seed poses." in capsys.readouterr().err


def test_a_corpus_without_words_trains_without_the_beat_alignment(tmp_path, capsys):
    folder, features = tmp_path / "corpus", Features()
    takes = (replace(talk(8.0, seed, name=f"take{seed}"), words=()) for seed in range(6))
    rows = (prepare_recording(take, features) for take in takes)
    write_corpus(folder, rows, features=features, recipe={"reader": "talker"})
    assert main(train(folder, tmp_path / "run")) == 2
    assert "none of its recordings has words" in capsys.readouterr().err
    assert main(train(folder, tmp_path / "run", beat_weight=0, steps=2, vae_steps=0)) == 0


def test_pretrained_word_vectors_are_where_training_begins(toy_corpus, tmp_path, capsys):
    words = Corpus.open(toy_corpus.path).vocabulary
    assert words == tuple(sorted(set(words)))
    path = tmp_path / "vectors.txt"
    path.write_text(f"{words[0]} 1 0 0 0\nunheard 0 0 0 9\n")
    # A learning rate so low that nothing moves.
    assert main(train(toy_corpus.path, tmp_path / "run", word_vectors=path, steps=1, learning_rate=1e-30)) == 0
    table = load_run(tmp_path / "run").params["generator"]["text"]["vectors"]
    np.testing.assert_allclose(table[word_id(words[0]) % 16], [1, 0, 0, 0], atol=1e-6)
    capsys.readouterr()
    path.write_text(f"{words[0]} 1 0 0\n")
    assert main(train(toy_corpus.path, tmp_path / "other", word_vectors=path)) == 2
    assert "vectors.txt, line 1: has a vector of 3 numbers; expected 4" in capsys.readouterr().err
    assert not (tmp_path / "other").exists()


def test_resuming_after_sigkill_in_each_stage_equals_not_having_stopped(toy_corpus, tmp_path):
    names = ("mining_steps", "steps", "vae_steps", "sampled_steps")
    settings = {**dict.fromkeys(names, 20), "checkpoint_every": 2}
    # An average that moves within the stage, and initial poses of generated chunks.
    settings |= {"average_decay": 0.9, "continued_chunks": 2}
    folder, whole = tmp_path / "killed", tmp_path / "whole"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    for wanted in (6, 26, 46, 66):
        process = subprocess.Popen(
            [sys.executable, "-m", "a2g_jax.cli", *train(toy_corpus.path, folder, "--resume", **settings)],
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        end = time.monotonic() + 800
        while not (folder / "checkpoints" / str(wanted)).is_dir() and process.poll() is None:
            assert time.monotonic() < end
            time.sleep(0.005)
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL, "it was killed before it had finished"
    last = stored(folder, 66)["params"]
    generator, average = dict(leaves(last["generator"])), dict(leaves(last["average"]))
    assert any(not np.array_equal(generator[name], average[name]) for name in generator), "it was averaging"
    assert main(train(toy_corpus.path, folder, "--resume", **settings)) == 0
    assert main(train(toy_corpus.path, whole, **settings)) == 0
    ours, theirs = dict(leaves(load_run(folder).params)), dict(leaves(load_run(whole).params))
    assert all(np.array_equal(ours[name], theirs[name]) for name in theirs)
    # Also the discriminator, the last weights beside their average, and the states of the optimisers.
    for name in ("params", "optimisers"):
        ours, theirs = (jax.tree.leaves(stored(path, 80)[name]) for path in (folder, whole))
        assert len(ours) == len(theirs)
        assert all(np.array_equal(one, other) for one, other in zip(ours, theirs, strict=True))


def test_it_is_evaluated(run, toy_corpus, tmp_path):
    out = tmp_path / "report"
    command = ["evaluate", str(run), "--corpus", str(toy_corpus.path), "--out", str(out), "--samples", "1"]
    assert main(command) == 0
    assert str(run) in [row["name"] for row in json.loads((out / "report.json").read_text())["rows"]]
