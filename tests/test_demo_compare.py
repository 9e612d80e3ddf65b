"""``a2g demo --compare``: every system and the true talker on one page, each as it is alone."""

import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.errors import InputError
from a2g_jax.generation import comparison
from a2g_jax.generation.generator import Generator
from a2g_jax.io.npz import read_motion_npz
from a2g_jax.talker.demo_speech import demo_recording
from a2g_jax.talker.recordings import talk
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
    assert files == {"checks.json", "index.html", "talker_00.npz", *(f"{name}_00.npz" for name in SHIPPED)}
    own = comparison.Speech("speech.wav", lambda _: talk(2.0, 5).audio)
    comparison.compare(comparison.systems(), own, out, samples=1, seed=0, formats=("npz", "html"))
    assert "talker_00.npz" not in {path.name for path in out.iterdir()}
    assert [figure["label"] for figure in page_data(out)["figures"]] == list(SHIPPED)
    assert "no true talker" in (out / "index.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_runs_of_ones_own_are_compared_too(tmp_path, toy_run, capsys):
    shutil.copytree(toy_run, tmp_path / "mine")
    found = comparison.systems([str(tmp_path / "mine"), "demo"])
    assert list(found) == [*SHIPPED, "mine"]
    toys = dict.fromkeys(("one", "two-three"), found["mine"])
    speech = comparison.Speech("speech.wav", lambda _: talk(2.0, 5).audio)
    # Reports and motions of earlier calls would belong to other motions.
    (tmp_path / "out").mkdir()
    for stale in ("style.json", "sample_03.bvh"):
        (tmp_path / "out" / stale).write_text("", encoding="utf-8")
    compared = comparison.compare(toys, speech, tmp_path / "out", samples=2, seed=0, formats=("npz", "html"))
    assert compared.written == {"npz": 4, "html": 1}
    checks = json.loads((tmp_path / "out" / "checks.json").read_text(encoding="utf-8"))
    assert {name: len(each["samples"]) for name, each in checks["systems"].items()} == {"one": 2, "two-three": 2}
    assert {line.partition(": checked")[0] for line in compared.lines if "checked" in line} == set(toys)
    assert not {"style.json", "sample_03.bvh"} & {path.name for path in (tmp_path / "out").iterdir()}
    names = [figure["label"] for figure in page_data(tmp_path / "out")["figures"]]
    assert names == ["one 0", "one 1", "two-three 0", "two-three 1"]
    assert (tmp_path / "out" / "two-three_01.npz").is_file()
    comparison.compare({"one": found["mine"]}, speech, tmp_path / "out", samples=1, seed=0, formats=("npz",))
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"checks.json", "one_00.npz"}
    other = tmp_path / "other" / "mine"
    shutil.copytree(tmp_path / "mine", other)
    twice = ["demo", "--compare", str(tmp_path / "mine"), str(other), "--out", str(tmp_path / "x")]
    assert main(twice) == 2
    assert "name 'mine'" in capsys.readouterr().err


def test_compare_refuses_training_and_what_is_no_run(tmp_path, capsys):
    assert main(["demo", "--compare", "--train", "--out", str(tmp_path / "x")]) == 2
    assert "--compare RUN" in capsys.readouterr().err
    assert main(["demo", "--compare", str(tmp_path), "--out", str(tmp_path / "x")]) == 2
    assert "not a run" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


def test_requests_go_to_the_systems_that_have_the_control(monkeypatch, tmp_path, capsys):
    """The flow has no handedness, EmotionGesture emotions alone; their motions stay as they are, as reported."""
    taken = {}

    class Still(Generator):
        def __init__(self, run, like=None):
            taken[run.config.model] = getattr(run.config.sampling_settings, "controls", None)
            self.run = run

        def stream(self, audio, samples, seed=0, **given):
            yield from [demo_recording()[0].motion] * samples

    monkeypatch.setattr(comparison, "Generator", Still)
    flags = ["--samples", "1", "--formats", "npz", "--out", str(tmp_path / "out")]
    requests = ["--control", "handedness=0.9", "--control", "height=0.8"]
    assert main(["demo", "--compare", *requests, *flags]) == 0
    assert taken == {
        "audio2gestures": ("handedness=0.9", "height=0.8"),
        "stylized_flow": ("height=0.8",),
        "emotion_gesture": (),
    }
    printed = capsys.readouterr().out
    assert "demo-flow: has no control for handedness=0.9\n" in printed
    assert "demo-emotion: has no control for handedness=0.9, height=0.8" in printed
    assert "demo: checked: " in printed
    assert main(["demo", "--compare", "--control", "tail=0.9", *flags]) == 2
    assert f"none of {', '.join(SHIPPED)} has a control 'tail'" in capsys.readouterr().err
    assert main(["demo", "--compare", "--control", "emotion=envy", *flags]) == 2
    assert "demo: --control 'emotion=envy'" in capsys.readouterr().err


@pytest.mark.parametrize(("strict", "worst"), [(True, 3.0), (False, np.nan)])
def test_a_refused_motion_leaves_the_earlier_files(monkeypatch, tmp_path, strict, worst):
    """With --strict outside the bounds; without it, one that holds NaN: named by its system."""
    run = open_run("demo")
    motion = demo_recording()[0].motion
    root = motion.root.copy()
    root[len(root) // 2 :] += worst
    bad = replace(motion, root=root)
    monkeypatch.setattr(Generator, "stream", lambda self, audio, samples, seed=0, **given: iter([bad] * samples))
    (tmp_path / "mine_00.npz").write_text("earlier", encoding="utf-8")
    speech = comparison.Speech("speech.wav", lambda _: talk(2.0, 5).audio)
    with pytest.raises(InputError, match="^mine: sample 0: a body cannot do it"):
        comparison.compare({"mine": run}, speech, tmp_path, samples=1, seed=0, formats=("npz",), strict=strict)
    assert [path.name for path in tmp_path.iterdir()] == ["mine_00.npz"]
    assert (tmp_path / "mine_00.npz").read_text(encoding="utf-8") == "earlier"
