"""``a2g demo --emotions``: one speech in every emotion of a run on one page; and emotions that are refused."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.errors import InputError
from a2g_jax.generation import comparison
from a2g_jax.generation.generator import Generator
from a2g_jax.io.audio import write_audio
from a2g_jax.io.npz import read_motion_npz
from a2g_jax.metrics.style import hand_style
from a2g_jax.talker.demo_speech import demo_recording
from a2g_jax.talker.emotions import VOICE_EMOTIONS
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import open_run

#: The order on the page.
EMOTIONS = ("neutral", *sorted(set(VOICE_EMOTIONS) - {"neutral"}))


def page_data(folder):
    text = (folder / "index.html").read_text(encoding="utf-8")
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)
    assert found is not None
    return json.loads(found.group(1))


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The folder of ``a2g demo --emotions``."""
    folder = tmp_path_factory.mktemp("demo") / "emotions"
    assert main(["demo", "--emotions", "--formats", "npz,html", "--out", str(folder)]) == 0
    return folder


@pytest.fixture
def speech(tmp_path):
    """Two seconds of speech in a file."""
    path = tmp_path / "speech.wav"
    write_audio(path, talk(2.0, 5).audio, 16000)
    return path


class Still(Generator):
    """A generator that returns two seconds of the talker's motion, for tests of everything else."""

    def __init__(self, run, like=None):
        self.run = run

    def stream(self, audio, samples, seed=0, **given):
        yield from [demo_recording()[0].motion.clip(0, 60)] * samples


def test_the_page_has_the_talker_and_a_figure_for_each_emotion(written):
    data = page_data(written)
    assert [figure["label"] for figure in data["figures"]] == ["talker", *EMOTIONS]
    assert {figure["note"] for figure in data["figures"][1:]} == {"emotion_gesture"}
    assert data["words"]
    assert "Eight emotions for the speech of the demo" in (written / "index.html").read_text(encoding="utf-8")
    files = {"checks.json", "index.html", "talker_00.npz", *(f"{emotion}_00.npz" for emotion in EMOTIONS)}
    assert {path.name for path in written.iterdir()} == files
    checks = json.loads((written / "checks.json").read_text(encoding="utf-8"))
    assert list(checks["systems"]) == list(EMOTIONS)


def test_emotions_differ_in_their_motion_and_are_those_of_generate(written):
    motions = {emotion: read_motion_npz(written / f"{emotion}_00.npz") for emotion in EMOTIONS}
    assert {motion.frames for motion in motions.values()} == {300}
    places = np.stack([motion.positions() for motion in motions.values()])
    apart = np.abs(places[:, None] - places[None]).mean(axis=(2, 3, 4))
    assert apart[~np.eye(len(places), dtype=bool)].min() > 0.005
    styles = {emotion: hand_style(motion.positions(), motion.fps) for emotion, motion in motions.items()}
    assert styles["anger"].speed > 1.3 * styles["sadness"].speed
    assert styles["anger"].height > styles["sadness"].height
    run = open_run("demo-emotion")
    surprised = Generator(replace(run, config=run.config.with_sampling(emotion="surprise")))
    alone = surprised.generate(demo_recording()[0].audio, 1, seed=0)[0]
    # Files hold what the check of the body left, which is every joint of a motion that is good at once, as this one.
    assert np.median(np.abs(alone.positions() - motions["surprise"].positions())) < 1e-4


def test_speech_of_ones_own_has_no_talker(monkeypatch, tmp_path, speech, capsys):
    monkeypatch.setattr(comparison, "Generator", Still)
    out = tmp_path / "out"
    flags = ["--audio", str(speech), "--samples", "2", "--formats", "npz,html", "--out", str(out)]
    assert main(["demo", "--emotions", "demo-emotion", *flags]) == 0
    labels = [f"{emotion} {number}" for emotion in EMOTIONS for number in range(2)]
    assert [figure["label"] for figure in page_data(out)["figures"]] == labels
    assert {path.stem for path in out.glob("*.npz")} == {f"{emotion}_0{n}" for emotion in EMOTIONS for n in range(2)}
    text = (out / "index.html").read_text(encoding="utf-8")
    assert "Eight emotions for speech.wav" in text
    assert "no true talker" in text
    # The files of all emotions go when another page takes the folder.
    assert main(["demo", "--compare", *flags[:3], "1", "--formats", "npz", "--out", str(out)]) == 0
    assert not list(out.glob("anger_*"))
    capsys.readouterr()


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (["--compare"], "--compare and --emotions exclude each other"),
        (["--train"], "--train and --emotions exclude each other"),
        (["--compare", "demo", "--train"], "--train and --compare and --emotions exclude each other"),
        (["--control", "energy=0.9"], "has a control 'energy'"),
        (["--audio", "nothing.wav"], "nothing.wav"),
    ],
    ids=["compare", "train", "all", "control", "audio"],
)
def test_flags_that_do_not_go_with_it(flags, message, tmp_path, capsys):
    assert main(["demo", "--emotions", *flags, "--out", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["demo", "demo-flow"])
def test_a_run_without_the_setting_is_refused(name, tmp_path, capsys):
    assert main(["demo", "--emotions", name, "--out", str(tmp_path / "out")]) == 2
    assert re.search(rf"{name}: a run of \w+ has no setting --emotion", capsys.readouterr().err)
    assert not (tmp_path / "out").exists()
    assert main(["demo", "--emotions", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert "not a run" in capsys.readouterr().err


def test_a_run_on_a_corpus_without_emotions_is_refused(monkeypatch):
    run = open_run("demo-emotion")
    bare = replace(run, config=replace(run.config, corpus=run.config.corpus | {"emotions": []}))
    monkeypatch.setattr(comparison, "open_run", lambda name: bare)
    with pytest.raises(InputError, match="has no setting --emotion"):
        comparison.emotions("bare")


@pytest.mark.parametrize(
    ("emotion", "message"),
    [
        ("envy", "the run has no emotion 'envy'; it has: anger, contempt,"),
        ("neutral:0.5,envy:0.5", "the run has no emotion 'envy'"),
        ("neutral@0,envy@1", "the run has no emotion 'envy'"),
        ("neutral@0,anger@60", "second 60 is past the end of the speech, which lasts 2.00 s"),
        ("neutral@0,anger@2", "second 2 is past the end of the speech"),
        ("neutral@1,anger@0.5", "in ascending order"),
        ("neutral:0,anger:0", "not a share above 0"),
        ("anger,anger", "anger is named twice"),
    ],
)
def test_emotions_that_generate_refuses(emotion, message, tmp_path, speech, capsys):
    out = tmp_path / "out"
    flags = ["--audio", str(speech), "--emotion", emotion, "--out", str(out)]
    assert main(["generate", "demo-emotion", *flags]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "--emotion" in error
    assert len(error.strip().splitlines()) == 1
    assert not list(out.glob("*")) if out.exists() else True
