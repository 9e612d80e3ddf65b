"""``a2g demo --compare``: every system and the true talker on one page, each as it is alone."""

import json
import re

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.generation import comparison
from a2g_jax.generation.generator import Generator
from a2g_jax.io.npz import read_motion_npz
from a2g_jax.talker.demo_speech import demo_recording
from a2g_jax.talker.recordings import talk
from a2g_jax.training.loop import train
from a2g_jax.training.run import open_run
from a2g_jax.training.run_file import SHIPPED


def page_data(folder):
    text = (folder / "index.html").read_text(encoding="utf-8")
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)
    assert found is not None
    return json.loads(found.group(1))


@pytest.mark.slow
def test_compare_shows_every_system_and_the_talker(tmp_path):
    out = tmp_path / "comparison"
    assert main(["demo", "--compare", "--samples", "1", "--seed", "3", "--formats", "npz,html", "--out", str(out)]) == 0
    data = page_data(out)
    assert [figure["label"] for figure in data["figures"]] == ["talker", *SHIPPED]
    assert data["words"]
    assert data["figures"][0]["tracks"]
    recording, _ = demo_recording()
    truth = read_motion_npz(out / "talker_00.npz")
    assert np.abs(truth.positions() - recording.motion.positions()).max() < 1e-3
    # A system moves as it does alone.
    alone = Generator(open_run("demo")).generate(recording.audio, 1, seed=3)[0]
    assert np.abs(read_motion_npz(out / "demo_00.npz").positions() - alone.positions()).max() < 1e-3
    # One's own speech has no talker, and the talker of the other speech is gone.
    files = {path.name for path in out.iterdir()}
    assert files == {"index.html", "talker_00.npz", *(f"{name}_00.npz" for name in SHIPPED)}
    own = comparison.Speech("speech.wav", lambda _: talk(2.0, 5).audio)
    comparison.compare(comparison.systems(), own, out, samples=1, seed=0, formats=("npz", "html"))
    assert "talker_00.npz" not in {path.name for path in out.iterdir()}
    assert [figure["label"] for figure in page_data(out)["figures"]] == list(SHIPPED)
    assert "no true talker" in (out / "index.html").read_text(encoding="utf-8")


def test_runs_of_ones_own_are_compared_too(tmp_path, toy_run_config, toy_corpus, capsys):
    train(toy_run_config(steps=2), toy_corpus, tmp_path / "mine", resume=False, progress=False)
    found = comparison.systems([str(tmp_path / "mine"), "demo"])
    assert list(found) == [*SHIPPED, "mine"]
    toys = dict.fromkeys(("one", "two-three"), found["mine"])
    speech = comparison.Speech("speech.wav", lambda _: talk(2.0, 5).audio)
    counts = comparison.compare(toys, speech, tmp_path / "out", samples=2, seed=0, formats=("npz", "html"))
    assert counts == {"npz": 4, "html": 1}
    names = [figure["label"] for figure in page_data(tmp_path / "out")["figures"]]
    assert names == ["one 0", "one 1", "two-three 0", "two-three 1"]
    assert (tmp_path / "out" / "two-three_01.npz").is_file()
    other = tmp_path / "other" / "mine"
    train(toy_run_config(steps=2), toy_corpus, other, resume=False, progress=False)
    twice = ["demo", "--compare", str(tmp_path / "mine"), str(other), "--out", str(tmp_path / "x")]
    assert main(twice) == 2
    assert "name 'mine'" in capsys.readouterr().err


def test_compare_refuses_training_and_what_is_no_run(tmp_path, capsys):
    assert main(["demo", "--compare", "--train", "--out", str(tmp_path / "x")]) == 2
    assert "--compare RUN" in capsys.readouterr().err
    assert main(["demo", "--compare", str(tmp_path), "--out", str(tmp_path / "x")]) == 2
    assert "not a run" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()
