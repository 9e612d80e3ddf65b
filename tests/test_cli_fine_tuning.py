"""``a2g prepare --for`` and ``a2g train --from``: any rig at any rate, and what is refused."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.data.corpus import Corpus
from a2g_jax.geometry.motion import resample
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import load_run


@pytest.fixture(scope="module")
def source(tmp_path_factory, toy_run):
    """A run of its own, as a test moves it."""
    return shutil.copytree(toy_run, tmp_path_factory.mktemp("source") / "run")


@pytest.fixture(scope="module")
def takes(tmp_path_factory):
    """Takes of two people, one of them at another rate and with longer bones."""
    folder = tmp_path_factory.mktemp("takes")
    for name, speaker, fps, scale in (("one", "ada", 30.0, 1.0), ("two", "bruno", 60.0, 1.2)):
        take = talk(8.0, 3, speaker=speaker)
        motion = resample(take.motion, fps)
        write_bvh(folder / f"{name}.bvh", replace(motion, skeleton=motion.skeleton.scaled(scale)))
        write_audio(folder / f"{name}.wav", take.audio, take.sample_rate)
    return folder


@pytest.mark.slow
def test_two_people_are_prepared_for_a_run_and_tuned_together(tmp_path, source, takes, capsys):
    assert main(["prepare", "folder", str(takes), "--out", str(tmp_path / "c"), "--for", str(source)]) == 0
    corpus, theirs = Corpus.open(tmp_path / "c"), load_run(source).config
    assert corpus.fps == theirs.fps
    assert corpus.mel == theirs.mel
    np.testing.assert_allclose(corpus.skeleton.offsets, theirs.skeleton.offsets, atol=1e-5)
    command = ["train", "audio2gestures", "--from", str(source), "--corpus", str(tmp_path / "c")]
    command += ["--out", str(tmp_path / "tuned"), "--steps", "3", "--batch-size", "2"]
    assert main(command) == 0
    assert "trained for 3 steps" in capsys.readouterr().out
    about = json.loads((tmp_path / "tuned" / "run.json").read_text())
    assert about["from"]["run"] == str(source)
    # Its description is enough to resume: the source may be gone, and --from is not needed.
    again = ["train", "audio2gestures", "--corpus", str(tmp_path / "c"), "--out", str(tmp_path / "tuned"), "--resume"]
    source.rename(tmp_path / "elsewhere")
    try:
        assert main(again) == 0
    finally:
        (tmp_path / "elsewhere").rename(source)


def test_what_does_not_fit_names_the_remedy(tmp_path, source, takes, capsys):
    def refused(*arguments):
        assert main(list(arguments)) == 2
        return capsys.readouterr().err

    out = ["--out", str(tmp_path / "out")]
    assert main(["prepare", "folder", str(takes), "--out", str(tmp_path / "c"), "--fps", "20"]) == 0
    capsys.readouterr()
    corpus = ["--corpus", str(tmp_path / "c")]
    error = refused("train", "audio2gestures", "--from", str(source), *corpus, *out)
    assert f"a2g prepare folder {takes} --out CORPUS --for {source}" in error
    assert "20 frames a second in place of 30" in error
    assert "is a run of audio2gestures" in refused("train", "stylized_flow", "--from", str(source), *corpus, *out)
    assert "--preset" in refused("train", "audio2gestures", "--from", "demo", "--preset", "tiny", *corpus, *out)
    assert "not a run" in refused("train", "audio2gestures", "--from", str(tmp_path), *corpus, *out)
    assert "decided by --for" in refused("prepare", "folder", str(takes), *out, "--for", "demo", "--fps", "20")
    assert "--for is for recordings" in refused("prepare", "talker", *out, "--for", "demo")
    assert not (tmp_path / "out").exists()


def test_settings_of_a_fine_tuning_are_listed(capsys):
    assert main(["train", "audio2gestures", "--from", "demo", "--settings"]) == 0
    listed = capsys.readouterr().out
    assert "--patience 4" in listed
    assert "--adversarial-weight 0.2" in listed
    assert "--decoder-channels 64,64,64,96,96" in listed
