"""The command contract: exit status, one line for an error, and the files that come out."""

import json
import subprocess
import sys
import wave
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import a2g_jax
from a2g_jax.cli import main
from a2g_jax.cli.paths import existing_corpus, existing_file, existing_report, existing_run
from a2g_jax.compilations import drop_unfinished
from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.evaluation.report import read_report
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.audio import read_audio, write_audio
from a2g_jax.io.bvh import read_bvh, write_bvh
from a2g_jax.io.npz import read_motion_npz
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import load_run

SMALL = ["--audio-channels", "8,8", "--motion-channels", "8", "--decoder-channels", "8", "--clip-frames", "16"]
SMALL += ["--adversarial-steps", "0"]


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


COMMANDS = ("demo", "talk", "prepare", "train", "inspect", "evaluate", "retarget", "generate", "studio")

#: Arguments that are refused before JAX or NumPy is imported, and the message. The files that exist are empty.
REFUSED_EARLY = {
    "demo --nonsense": "unknown argument --nonsense",
    "demo --audio no.wav": "no.wav: there is no such file; check the path.",
    "demo --compare --order best": "--order: orders the samples of one run; leave it out with --compare.",
    "demo --order worst": "argument --order: invalid choice: 'worst'",
    "demo --formats gif": "no format 'gif'; there are: bvh, npz, html",
    "studio no": "no: there is no such run; name a run folder",
    "studio --port 99999": "argument --port: expected a whole number from 0 to 65535; got '99999'",
    "studio --hots x": "unknown argument --hots",
    "talk --out o --corpus no": "no: is not a corpus (no manifest.json in it); make one with 'a2g prepare'.",
    "talk --out o --formats ,": "no format in ','",
    "prepare folder no --out c": "no: there is no such folder; check the path.",
    "prepare no.py . --out c": "no.py: there is no such file; name a Python file that defines DATASET.",
    "train audio2gestures --corpus no --out r": "no: is not a corpus (no manifest.json in it);",
    "train speech2gesture --corpus corpus --features no --out r": "no: there is no such run; name a run folder",
    "train audio2gestures --from no --corpus corpus --out r": "no: there is no such run; name a run folder",
    "train stylized_flow --from demo --corpus corpus --out r": "demo: is a run of audio2gestures; train that model,",
    "train audio2gestures --from demo --preset tiny --corpus corpus --out r": "--preset: the settings are those of",
    "prepare folder . --out c --for no": "no: there is no such run; name a run folder",
    "demo --compare no": "no: there is no such run; name a run folder",
    "demo --compare --train": "--train and --compare exclude each other;",
    "inspect no.bvh": "no.bvh: there is no such file; check the path.",
    "inspect a.bvh --audio no.wav": "no.wav: there is no such file; check the path.",
    "inspect no --score a.bvh --audio a.wav": "no: there is no such run; name a run folder",
    "inspect demo-flow --score no.bvh --audio a.wav": "no.bvh: there is no such file; check the path.",
    "evaluate no --corpus corpus --out o": "no: there is no such run; name a run folder",
    "evaluate demo --corpus no --out o": "no: is not a corpus (no manifest.json in it);",
    "evaluate demo --corpus corpus --features no --out o": "no: there is no such run; name a run folder",
    "evaluate demo --corpus corpus --emotion-classifier demo --out o": "demo: there is no such run; name a run folder",
    "evaluate --compare no --out o": "no: is no report (no report.json in it);",
    "evaluate --corpus corpus --samples 0 --out o": "--samples: expected a whole number from 1 to 1000; got '0'",
    "evaluate --corpus corpus --seed -1 --out o": "--seed: expected a whole number from 0 to 2147483647; got '-1'",
    "label ted no --classifier run": "no: there is no such folder; check the path.",
    "label talker . --classifier run": "talker: generated recordings have emotions already; name a data set.",
    "label ted . --classifier no": "no: there is no such run; name a run folder",
    "retarget no.bvh --to body --out o.bvh": "no.bvh: there is no such file; check the path.",
    "retarget a.bvh --to legs --out o.bvh": "legs: there is no such file; check the path.",
    "retarget a.bvh --to body --out o.bvh --fps 0": "--fps: expected a number from 1 to 1000; got '0'",
    "generate no --audio a.wav --out o": "no: there is no such run; name a run folder, demo, demo-flow, demo-emotion.",
    "generate demo --audio no.wav --out o": "no.wav: there is no such file; check the path.",
    "generate demo --audio a.wav --out o --pin no.bvh@1": "no.bvh: there is no such file; check the path.",
    "generate demo --audio a.wav --out o --pin-blend 1": "--pin-blend is for --pin; name a clip and a second.",
    "generate demo-flow --audio a.wav --out o --style no.bvh": "no.bvh: there is no such file; check the path.",
    "generate demo-flow --audio a.wav --out o --seed-clip no.bvh": "no.bvh: there is no such file;",
}

EARLY = """
import contextlib, io, json, sys
from a2g_jax.cli import main
from a2g_jax.cli.paths import existing_corpus, existing_file, existing_report, existing_run
found = []
for line in json.load(sys.stdin):
    out, error = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        try:
            status = main(line.split())
        except SystemExit as stop:
            status = stop.code
    heavy = [name for name in ("jax", "numpy", "jaxtyping", "librosa", "scipy", "tqdm") if name in sys.modules]
    found.append([status, out.getvalue(), error.getvalue(), heavy])
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def early(tmp_path_factory):
    """Status, both outputs and the heavy modules imported so far, by command line; all run in one process."""
    folder = tmp_path_factory.mktemp("early")
    (folder / "corpus").mkdir()
    for name in ("corpus/manifest.json", "a.wav", "a.bvh"):
        (folder / name).touch()
    lines = ["--help", *(f"{command} --help" for command in COMMANDS), *REFUSED_EARLY]
    shown = subprocess.run(
        [sys.executable, "-c", EARLY], input=json.dumps(lines), capture_output=True, text=True, check=True, cwd=folder
    )
    assert sorted(path.name for path in folder.iterdir()) == ["a.bvh", "a.wav", "corpus"]
    return dict(zip(lines, json.loads(shown.stdout), strict=True))


def test_help_is_complete_and_imports_nothing_heavy(early):
    status, out, error, heavy = early["--help"]
    assert (status, error, heavy) == (0, "", [])
    for command in COMMANDS:
        assert command in out
        status, out_of_command, error, heavy = early[f"{command} --help"]
        assert (status, error, heavy) == (0, "", [])
        assert out_of_command.startswith(f"usage: a2g {command}")


@pytest.mark.parametrize("line", REFUSED_EARLY)
def test_mistakes_are_refused_before_anything_heavy_is_imported(early, line):
    status, out, error, heavy = early[line]
    assert (status, out, heavy) == (2, "", [])
    assert len(error.splitlines()) == 1
    assert error.startswith("a2g: ")
    assert REFUSED_EARLY[line] in error


def test_early_messages_are_those_of_the_library(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for early_check, library in (
        (existing_file, read_audio),
        (existing_file, read_bvh),
        (existing_run, load_run),
        (existing_corpus, Corpus.open),
        (existing_report, lambda path: read_report(Path(path))),
    ):
        messages = []
        for check in (early_check, library):
            with pytest.raises(InputError) as caught:
                check("./nowhere")
            messages.append(str(caught.value))
        assert messages[0] == messages[1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "required"),
        (["dance"], "invalid choice"),
        (["generate", "demo"], "--audio"),
        (["generate", "demo", "--audio", "x.wav", "--out", "o", "--samples", "0"], "from 1 to 1000; got '0'"),
        (["demo", "--seed", "five"], "expected a whole number from 0 to 2147483647; got 'five'"),
        (["prepare", "talker", "--out", "c", "--minutes", "-3"], "above 0"),
        (["prepare", "folder", "--out", "c"], "name the folder"),
        (["prepare", "talker", "somewhere", "--out", "c"], "takes no source"),
        (["train", "audio2gestures", "--out", "r"], "--corpus is needed"),
        (["train", "audio2gestures", "--settings", "--preset", "huge"], "no preset 'huge'"),
        (["train", "audio2gestures", "--settings", "--colour", "red"], "there is no flag --colour"),
        (["train", "audio2gestures", "--settings", "--steps", "many"], "--steps: expected a whole"),
        (["train", "audio2gestures", "--settings", "--kernel-size", "2"], "an odd number; got 2"),
        (["train", "audio2gestures", "--settings", "--log-every", "0"], "expected 1 or more; got 0"),
        (["train", "audio2gestures", "--settings", "--schedule", "wild"], "'cosine' or 'noam'"),
        (["train", "audio2gestures", "--settings", "--audio-channels", ""], "expected numbers above 0"),
        (["train", "audio2gestures", "--settings", "--learning-rate", "nan"], "expected a number above 0"),
        (["prepare", "folder", ".", "--minutes", "3", "--out", "c"], "--minutes is for"),
        (["prepare", "talker", "--out", "/proc/nothing/c", "--minutes", "1"], "cannot be written"),
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
    # The settings of the run count where no flag is given.
    capsys.readouterr()
    assert main([*train[: train.index("--steps")], "--resume"]) == 0
    assert "trained for 8 steps" in capsys.readouterr().out
    write_audio(tmp_path / "speech.wav", talk(3.7, 5).audio, 16000)
    generate = ["generate", run, "--audio", str(tmp_path / "speech.wav"), "--samples", "2"]
    assert main([*generate, "--out", out]) == 0
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["checks.json", "index.html", "sample_00.bvh", "sample_00.npz", "sample_01.bvh", "sample_01.npz"]
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
    assert not (tmp_path / "run" / "speech.json").exists()  # too little speech to have a range


@pytest.mark.slow
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


def test_settings_are_explained(capsys):
    assert main(["train", "stylized_flow", "--settings"]) == 0
    shown = capsys.readouterr().out
    assert "--predictor true\n    Whether the first layer subtracts a linear extrapolation" in shown
    assert "--steps 4000\n    Training steps" in shown
    assert main(["generate", "demo-flow", "--settings"]) == 0
    assert "--temperature 0.94\n    Scale of the latents" in capsys.readouterr().out


@pytest.mark.parametrize("damage", [{"model_config": None}, {"sampling": [1]}, {"model": "os:system"}])
def test_a_damaged_description_of_a_run_is_named(capsys, tmp_path, damage):
    values = json.loads((Path(a2g_jax.__file__).parent / "demo" / "run.json").read_text(encoding="utf-8"))
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run.json").write_text(json.dumps({**values, "checksum": None, **damage}))
    assert str(tmp_path / "run" / "run.json") in fails(capsys, "generate", str(tmp_path / "run"), "--settings")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("generate demo --audio a.wav --ot x", "there is no flag --ot; did you mean --out?"),
        ("generate demo --audio a.wav --noise-scal 2", "did you mean --noise-scale?"),
        ("generate demo --audio a.wav --xyzzy 2", "there is no flag --xyzzy. Settings of the model"),
        ("inspect demo --jsn", "unknown argument --jsn; did you mean --json?"),
        ("generate dmo --audio a.wav --out x", "dmo: there is no such run; name a run folder, demo"),
    ],
)
def test_what_is_mistyped_has_a_suggestion(words, message, capsys):
    assert main(words.split()) == 2
    assert message in capsys.readouterr().err


def test_a_mistyped_command_has_a_suggestion(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["genrate", "demo"])
    assert stop.value.code == 2
    assert "there is no command 'genrate'; did you mean generate?" in capsys.readouterr().err
