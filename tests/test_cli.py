"""The command contract: exit status, one line for an error, and the files that come out."""

import json
import subprocess
import sys
import wave

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.cli import main
from a2g_jax.compilations import drop_unfinished
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import read_bvh, write_bvh
from a2g_jax.io.npz import read_motion_npz
from a2g_jax.talker.recordings import talk

SMALL = ["--audio-channels", "8,8", "--motion-channels", "8,8", "--decoder-channels", "8,8", "--clip-frames", "16"]


def fails(capsys, *arguments: str) -> str:
    """Run a command that must fail; its one line of standard error."""
    try:
        status = main(list(arguments))
    except SystemExit as stop:
        status = stop.code
    error = [line for line in capsys.readouterr().err.splitlines() if line.startswith("a2g: ")]
    assert status == 2
    assert len(error) == 1
    return error[0]


def test_help_is_quick_and_complete():
    shown = subprocess.run([sys.executable, "-m", "a2g_jax.cli", "--help"], capture_output=True, text=True, check=True)
    for command in ("demo", "prepare", "train", "generate"):
        assert command in shown.stdout
    modules = subprocess.run(
        [sys.executable, "-c", "import a2g_jax.cli, sys; a2g_jax.cli.make_parser(); print('jax' in sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert modules.stdout.strip() == "False"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "required"),
        (["dance"], "invalid choice"),
        (["generate", "demo"], "--audio"),
        (["generate", "demo", "--audio", "x.wav", "--out", "o", "--samples", "0"], "from 1 to 1000; got '0'"),
        (["demo", "--seed", "five"], "expected a whole number from 0 to 2147483647; got 'five'"),
        (["demo", "--nonsense"], "unknown argument --nonsense"),
        (["prepare", "talker", "--out", "c", "--minutes", "-3"], "above 0"),
        (["prepare", "folder", "--out", "c"], "name the folder"),
        (["prepare", "talker", "somewhere", "--out", "c"], "takes no source"),
        (["train", "audio2gestures", "--out", "r"], "--corpus is needed"),
        (["train", "audio2gestures", "--corpus", "c", "--out", "r"], "is not a corpus"),
        (["train", "audio2gestures", "--corpus", "c", "--out", "r", "--preset", "huge"], "no preset 'huge'"),
        (["train", "audio2gestures", "--corpus", "c", "--out", "r", "--colour", "red"], "no setting --colour"),
        (["train", "audio2gestures", "--corpus", "c", "--out", "r", "--steps", "many"], "--steps: expected a whole"),
        (["train", "audio2gestures", "--corpus", "c", "--out", "r", "--kernel-size", "2"], "an odd number; got 2"),
        (["train", "audio2gestures", "--corpus", "c", "--out", "r", "--log-every", "0"], "expected 1 or more; got 0"),
        (["train", "audio2gestures", "--corpus", "c", "--out", "r", "--schedule", "wild"], "'cosine' or 'noam'"),
        (["train", "audio2gestures", "--settings", "--audio-channels", ""], "expected numbers above 0"),
        (["train", "audio2gestures", "--settings", "--learning-rate", "nan"], "expected a number above 0"),
        (["prepare", "folder", ".", "--minutes", "3", "--out", "c"], "--minutes is for"),
        (["prepare", "talker", "--out", "/proc/nothing/c", "--minutes", "1"], "cannot be made"),
        (["generate", "nowhere", "--audio", "x.wav", "--out", "o"], "is not a run"),
        (["demo", "--formats", "gif"], "no format 'gif'"),
    ],
)
def test_bad_usage(capsys, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert message in fails(capsys, *arguments)
    assert list(tmp_path.iterdir()) == []


def bad_audio(path, kind):
    """Write a file that is not speech."""
    tone = np.sin(np.arange(16000) / 20).astype(np.float32)
    if kind == "empty":
        path.write_bytes(b"")
    elif kind == "no samples":
        with wave.open(str(path), "wb") as file:
            file.setparams((1, 2, 16000, 0, "NONE", ""))
    elif kind == "silent":
        import soundfile

        soundfile.write(path, np.zeros(16000), 16000)
    elif kind == "NaN":
        import soundfile

        tone[700] = np.nan
        soundfile.write(path, tone, 16000, subtype="FLOAT")
    elif kind == "truncated":
        write_audio(path, tone, 16000)
        path.write_bytes(path.read_bytes()[:5000])
    elif kind == "text":
        path.write_text("this is not a recording\n" * 50)


@pytest.mark.parametrize("kind", ["missing", "empty", "no samples", "silent", "NaN", "truncated", "text"])
def test_bad_audio_is_refused_in_one_line(capsys, tmp_path, kind):
    path = tmp_path / "speech.wav"
    bad_audio(path, kind)
    error = fails(capsys, "demo", "--audio", str(path), "--out", str(tmp_path / "out"))
    assert "speech.wav" in error
    assert not (tmp_path / "out").exists()


def test_folders_that_cannot_be_written(capsys, tmp_path):
    write_audio(tmp_path / "speech.wav", talk(2.0, 5).audio, 16000)
    (tmp_path / "taken").write_text("a file")
    demo = ["demo", "--audio", str(tmp_path / "speech.wav"), "--out"]
    assert "is a file; name a folder" in fails(capsys, *demo, str(tmp_path / "taken"))
    assert "taken" in fails(capsys, *demo, str(tmp_path / "taken" / "below"))
    assert (tmp_path / "taken").read_text() == "a file"


def test_an_error_starts_its_own_line(tmp_path):
    """Also below a progress bar, where scripts look for it."""
    write_audio(tmp_path / "mine" / "a.wav", talk(2.0, 5).audio, 16000)
    (tmp_path / "mine" / "a.bvh").write_text("HIERARCHY\n")
    command = ["prepare", "folder", str(tmp_path / "mine"), "--out", str(tmp_path / "corpus")]
    shown = subprocess.run([sys.executable, "-m", "a2g_jax.cli", *command], capture_output=True, text=True)
    assert shown.returncode == 2
    last = shown.stderr.splitlines()[-1]
    assert last.startswith("a2g: ")
    assert "a.bvh" in last
    assert "Traceback" not in shown.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]


def test_debug_shows_the_traceback(tmp_path):
    for arguments in (["--debug", "demo"], ["demo", "--debug"]):
        with pytest.raises(Exception, match="no such file"):
            main([*arguments, "--audio", str(tmp_path / "speech.wav")])


def test_settings_are_listed(capsys):
    assert main(["train", "audio2gestures", "--preset", "paper", "--settings"]) == 0
    shown = capsys.readouterr().out
    assert "--relaxed-threshold 0.002" in shown
    assert "--batch-size 32" in shown


def test_from_recordings_to_motion(capsys, tmp_path):
    """prepare folder, train, generate; then the same again from another seed."""
    for seed in range(2):
        take = talk(8.0, seed)
        write_audio(tmp_path / "mine" / f"take{seed}.wav", take.audio, 16000)
        write_bvh(tmp_path / "mine" / f"take{seed}.bvh", take.motion)
    corpus, run, out = (str(tmp_path / name) for name in ("corpus", "run", "out"))
    assert main(["prepare", "folder", str(tmp_path / "mine"), "--out", corpus]) == 0
    assert "2 recordings, 0.3 minutes, 22 joints at 30 fps" in capsys.readouterr().out
    train = ["train", "audio2gestures", "--corpus", corpus, "--out", run, "--steps", "8", "--batch-size=2", *SMALL]
    assert main(train) == 0
    assert "holds a run already" in fails(capsys, *train)
    assert "other settings (batch_size: 2, now 3" in fails(capsys, *train, "--batch-size", "3", "--resume")
    write_audio(tmp_path / "speech.wav", talk(3.7, 5).audio, 16000)
    generate = ["generate", run, "--audio", str(tmp_path / "speech.wav"), "--samples", "2"]
    assert main([*generate, "--out", out]) == 0
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["index.html", "sample_00.bvh", "sample_00.npz", "sample_01.bvh", "sample_01.npz"]
    motion = read_motion_npz(tmp_path / "out" / "sample_00.npz")
    assert motion.frames == round(3.7 * 30)
    with np.load(tmp_path / "out" / "sample_00.npz", allow_pickle=False) as arrays:
        assert {"rotations", "root", "positions", "fps", "joint_names", "parents", "offsets"} <= set(arrays)
        assert arrays["rotations"].shape == (111, 22, 3, 3)
        order = [motion.skeleton.index(name) for name in read_bvh(tmp_path / "out" / "sample_00.bvh").skeleton.names]
        read = read_bvh(tmp_path / "out" / "sample_00.bvh").positions()
        np.testing.assert_allclose(read, arrays["positions"][:, order], atol=1e-4)
    assert main([*generate, "--out", str(tmp_path / "again"), "--formats", "npz", "--samples", "1"]) == 0
    again = read_motion_npz(tmp_path / "again" / "sample_00.npz")
    np.testing.assert_array_equal(again.rotations, motion.rotations)
    assert main([*generate, "--out", str(tmp_path / "other"), "--formats", "npz", "--seed", "1"]) == 0
    other = read_motion_npz(tmp_path / "other" / "sample_00.npz")
    assert np.abs(other.rotations - motion.rotations).max() > 1e-3
    assert json.loads((tmp_path / "run" / "run.json").read_text())["steps"] == 8


def test_any_rig_trains_as_it_is(capsys, tmp_path):
    """All joints of a rig that is no body, at a rate that is no whole number."""
    names = ("tail", "fin", "eye")
    skeleton = Skeleton(np.array([[0, 0, 0], [0, 0.2, 0], [0.1, 0, 0]], np.float32), names, (-1, 0, 1))
    angles = 0.3 * np.sin(np.arange(240)[:, None, None] / 7 + np.arange(9).reshape(1, 3, 3))
    rotations = Rotation.from_rotvec(angles.reshape(-1, 3)).as_matrix().reshape(240, 3, 3, 3).astype(np.float32)
    motion = Motion(rotations, np.zeros((240, 3), np.float32), skeleton, 30.0)
    write_audio(tmp_path / "mine" / "fish.wav", talk(8.0, 2).audio, 16000)
    write_bvh(tmp_path / "mine" / "fish.bvh", motion)
    corpus, run, out = (str(tmp_path / name) for name in ("corpus", "run", "out"))
    assert (
        main(["prepare", "folder", str(tmp_path / "mine"), "--out", corpus, "--fps", "23.976", "--joints", "all"]) == 0
    )
    shown = capsys.readouterr()
    assert "3 joints at 23.976 fps" in shown.out
    assert "3 joints at 23.976 fps" in shown.out
    train = ["train", "audio2gestures", "--corpus", corpus, "--out", run, "--steps", "4", "--batch-size", "2", *SMALL]
    assert main(train) == 0
    assert main(["generate", run, "--audio", str(tmp_path / "mine" / "fish.wav"), "--samples", "1", "--out", out]) == 0
    assert read_motion_npz(tmp_path / "out" / "sample_00.npz").frames == round(8.0 * 23.976)


def test_output_that_nobody_reads_to_the_end_is_no_error(tmp_path):
    """As where the output goes into ``head``."""
    script = f"{sys.executable} -m a2g_jax.cli prepare --list | (exec 0<&-; sleep 0.1)"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.stderr == ""


def test_programs_without_a_note_of_their_last_use_are_dropped(tmp_path):
    """With one of them in the folder JAX keeps no further program."""
    for name in ("whole-cache", "whole-atime", "killed-cache", "other.txt"):
        (tmp_path / name).write_bytes(b"1")
    drop_unfinished(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other.txt", "whole-atime", "whole-cache"]
    drop_unfinished(tmp_path / "not there")
