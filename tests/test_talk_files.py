import json

import jax
import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.generation.talk.request import truth_from_json
from a2g_jax.io.audio import read_audio
from a2g_jax.io.bvh import read_bvh
from a2g_jax.io.files import read_json
from a2g_jax.io.npz import read_motion_npz
from a2g_jax.io.textgrid import read_words
from a2g_jax.talker.recordings import resample_motion, talk
from a2g_jax.talker.speech import plan_from_json
from a2g_jax.talker.views.upper_body import UPPER_BODY_JOINTS

#: What one recording of three motions consists of.
FILES = {
    "speech.wav", "speech.TextGrid", "speech.json", "index.html",
    *(f"{kind}_{number:02d}.{suffix}" for number in range(3)
      for kind, suffix in (("motion", "bvh"), ("motion", "npz"), ("truth", "json"))),
}  # fmt: skip
ARGUMENTS = ["--seconds", "6", "--samples", "3", "--seed", "5", "--speaker", "chiara", "--emotion", "happiness"]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    out = tmp_path_factory.mktemp("talk")
    assert main(["talk", "--out", str(out), *ARGUMENTS, "--sample-rate", "22050", "--fingers"]) == 0
    return out


@pytest.fixture(scope="module")
def recording():
    return talk(6.0, 5, speaker="chiara", emotion="happiness", sample_rate=22050, fingers=True)


def test_all_files_are_there(written):
    assert {path.name for path in written.iterdir()} == FILES


def test_speech_is_that_of_the_recording(written, recording):
    audio = read_audio(written / "speech.wav", 22050)
    assert len(audio) == len(recording.audio) == 6 * 22050
    np.testing.assert_allclose(audio, recording.audio, atol=2 / 32768)
    assert [word.text for word in read_words(written / "speech.TextGrid")] == [word.text for word in recording.words]
    for read, made in zip(read_words(written / "speech.TextGrid"), recording.words, strict=True):
        assert (read.start, read.end) == pytest.approx((made.start, made.end))
    plan = plan_from_json(read_json(written / "speech.json")["plan"])
    assert plan == plan_from_json(recording.annotations["speech"])
    assert len(read_words(written / "speech.TextGrid", "syllables")) == len(plan.syllables)
    assert len(read_words(written / "speech.TextGrid", "phones")) == sum(len(s.phones) for s in plan.syllables)


def test_bvh_and_npz_hold_the_same_motion(written):
    for number in range(3):
        one = read_bvh(written / f"motion_{number:02d}.bvh")
        other = read_motion_npz(written / f"motion_{number:02d}.npz")
        # A BVH lists joints depth first.
        order = [one.skeleton.index(name) for name in other.skeleton.names]
        assert sorted(order) == list(range(52))
        assert one.fps == pytest.approx(other.fps)
        np.testing.assert_allclose(one.positions()[:, order], other.positions(), atol=1e-4)


def test_truth_is_that_of_the_motion(written, recording):
    truth = read_json(written / "truth_00.json")
    assert truth["key"] is None
    assert truth["gestures"] == json.loads(json.dumps(recording.annotations["gestures"]))
    for number in (1, 2):
        stored = read_json(written / f"truth_{number:02d}.json")
        key = jax.random.fold_in(jax.random.key(stored["key"]["seed"]), stored["key"]["fold"])
        motion, drawn = resample_motion(recording, key)
        assert truth_from_json(stored["gestures"]) == drawn
        np.testing.assert_array_equal(read_motion_npz(written / f"motion_{number:02d}.npz").rotations, motion.rotations)
        assert stored["frames"] == motion.frames
        assert stored["style"]["two_handed"] >= 0


def test_same_arguments_same_bytes_and_only_own_files_are_replaced(written, tmp_path):
    (tmp_path / "motion_07.bvh").write_text("of an earlier run")
    (tmp_path / "truth_101.json").write_text("of an earlier run")
    (tmp_path / "motion_mine.bvh").write_text("mine")
    (tmp_path / "notes.txt").write_text("mine")
    arguments = ["talk", "--out", str(tmp_path), *ARGUMENTS, "--sample-rate", "22050", "--fingers"]
    assert main([*arguments, "--formats", "wav,textgrid,json,bvh,html"]) == 0
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {name for name in FILES if not name.endswith("npz")} | {"motion_mine.bvh", "notes.txt"}
    for name in names - {"motion_mine.bvh", "notes.txt"}:
        assert (tmp_path / name).read_bytes() == (written / name).read_bytes(), name


def test_view_of_an_upper_body(tmp_path):
    out = str(tmp_path)
    assert main(["talk", "--out", out, "--seconds", "4", "--samples", "2", "--view", "beat", "--formats", "npz"]) == 0
    motion = read_motion_npz(tmp_path / "motion_01.npz")
    assert motion.skeleton.names == UPPER_BODY_JOINTS
    assert (motion.fps, motion.frames) == (15.0, 60)


def test_a_recording_of_a_corpus(tmp_path, capsys):
    corpus = str(tmp_path / "corpus")
    assert main(["prepare", "talker", "--out", corpus, "--minutes", "0.2", "--seed", "3", "--workers", "1"]) == 0
    out = tmp_path / "talk"
    arguments = ["talk", "--out", str(out), "--corpus", corpus, "--samples", "2"]
    assert main([*arguments, "--formats", "npz,json,wav"]) == 0
    speech = read_json(out / "speech.json")
    assert speech["recording"] == "0000"
    stored = read_json(tmp_path / "corpus" / "annotations" / "00000.json")
    assert read_json(out / "truth_00.json")["gestures"] == stored["gestures"]
    assert read_motion_npz(out / "motion_00.npz").frames == read_motion_npz(out / "motion_01.npz").frames == 360
    capsys.readouterr()
    for extra, message in (
        (["--recording", "nobody"], "no recording 'nobody'"),
        (["--speaker", "ada"], "--speaker cannot be chosen"),
        (["--view", "beat"], "no fingers"),
    ):
        assert main([*arguments, *extra]) == 2
        assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--speaker", "nobody"], "no speaker 'nobody'"),
        (["--emotion", "hunger"], "no emotion 'hunger'"),
        (["--formats", "wav,mp4"], "no format 'mp4'"),
        (["--formats", ","], "no format in ','"),
        (["--recording", "0000"], "--corpus"),
        (["--corpus", "nowhere"], "not a corpus"),
        (["--seconds", "600", "--samples", "1000"], "too large"),
    ],
)
def test_errors_are_one_line_and_leave_nothing(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    if "600" in arguments:  # as long, without the computing
        monkeypatch.setattr("a2g_jax.generation.formats._PAGE_LIMIT", 1000)
        arguments = ["--seconds", "4"]
    try:
        status = main(["talk", "--out", str(tmp_path / "out"), *arguments])
    except SystemExit as stop:
        status = stop.code
    assert status == 2
    error = capsys.readouterr().err.strip().splitlines()
    assert message in error[-1]
    assert len([line for line in error if line.startswith("a2g:")]) == 1
    assert not (tmp_path / "out").exists()


def test_a_file_in_the_way_is_named(tmp_path, capsys):
    (tmp_path / "out").write_text("mine")
    assert main(["talk", "--out", str(tmp_path / "out"), "--seconds", "2", "--samples", "1"]) == 2
    assert "is a file" in capsys.readouterr().err
    assert (tmp_path / "out").read_text() == "mine"
