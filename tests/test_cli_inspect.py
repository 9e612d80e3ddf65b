"""The command ``a2g inspect``."""

import argparse
import json

import numpy as np
import pytest

from a2g_jax.cli.inspect import add_arguments, run
from a2g_jax.errors import InputError
from a2g_jax.inspection.report import FORMAT, VERSION
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.io.npz import write_motion_npz
from a2g_jax.io.textgrid import write_words
from a2g_jax.talker.recordings import talk


def inspect(*arguments):
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    return run(parser.parse_args([str(argument) for argument in arguments]), [])


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    recording = talk(20.0, 3)
    write_bvh(folder / "a.bvh", recording.motion)
    write_motion_npz(folder / "a.npz", recording.motion)
    write_audio(folder / "a.wav", recording.audio, 16000)
    write_audio(folder / "a.flac", recording.audio[: 16000 * 15], 16000)
    write_words(folder / "a.TextGrid", recording.words, 20.0)
    waves = np.sin(np.arange(90)[:, None] / 20 + np.arange(165))
    waves.reshape(90, 55, 3)[:, [0, 1, 2, 4, 5, 7, 8, 10, 11]] = 0.0  # the feet stand
    smplx = {"poses": waves * 0.1, "trans": np.zeros((90, 3)), "mocap_frame_rate": 30}
    np.savez(folder / "smplx.npz", **smplx)
    np.savez(folder / "other.npz", values=np.array([1.0, np.nan, 2.0]), names=np.array(["a", "b"]))
    return folder


def test_text(files, capsys):
    assert inspect(files / "a.bvh", "--audio", files / "a.wav", "--strict") == 0
    out = capsys.readouterr().out
    for piece in (
        "├─ L_Hip",
        "└─ R_Wrist",
        "R_Wrist\n",
        "rotation orders",
        "ZXY",
        "active level (dBFS)",
        "no warnings",
    ):
        assert piece in out, out
    assert "  up          +Y" in out


def test_json_is_one_document_and_says_the_same(files, capsys):
    assert inspect(files / "a.bvh", "--audio", files / "a.flac", "--json") == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["format"], document["version"], document["kind"]) == (FORMAT, VERSION, "pair")
    assert set(document) == {"format", "version", "path", "kind", "facts", "findings"}
    (found,) = [finding for finding in document["findings"] if finding["severity"] == "warning"]
    assert set(found) == {"severity", "code", "message", "fix", "place", "value"}
    assert found["code"] == "length"
    assert document["facts"]["skeleton"]["joints"][1] == {
        "name": "L_Hip", "parent": 0, "bone_cm": pytest.approx(11.2, abs=0.1), "part": "L_Hip", "end": False,
    }  # fmt: skip
    inspect(files / "a.bvh", "--audio", files / "a.flac")
    assert found["message"] in capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "kind", "strict"),
    [
        ("a.wav", "audio", 0), ("a.npz", "motion npz", 0), ("a.TextGrid", "transcript", 0), ("other.npz", "npz", 1),
        ("smplx.npz", "smplx npz", 0),
    ],
)  # fmt: skip
def test_kinds_and_status(name, kind, strict, files, capsys):
    assert inspect(files / name) == 0
    assert inspect(files / name, "--strict", "--json") == strict
    assert f'"kind": "{kind}"' in capsys.readouterr().out


def test_words_after_the_end(files, capsys):
    assert inspect(files / "a.TextGrid", "--audio", files / "a.flac", "--strict") == 1
    assert "[words-beyond]" in capsys.readouterr().out


def test_errors_name_what_is_wrong(files, tmp_path):
    for arguments, message in (
        ([tmp_path / "no.bvh"], "no such file"),
        ([__file__], "cannot be inspected"),
        ([files / "other.npz", "--audio", files / "a.wav"], "neither a motion nor a transcript"),
        ([files / "a.bvh", "--audio", files / "a.bvh"], "is no audio"),
        ([tmp_path, "--audio", files / "a.wav"], "is a folder"),
        ([tmp_path], "holds no WAV and no BVH"),
    ):
        with pytest.raises(InputError, match=message):
            inspect(*arguments)
    (tmp_path / "cut.bvh").write_text(
        "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n}\n"
    )
    with pytest.raises(InputError, match="without a MOTION"):
        inspect(tmp_path / "cut.bvh")


@pytest.mark.parametrize(("name", "model"), [("demo", "audio2gestures"), ("demo-flow", "stylized_flow")])
def test_runs_of_the_package_by_name(name, model, files, tmp_path, monkeypatch, capsys):
    """By name as ``a2g generate`` and ``a2g evaluate`` open them; with ./ the name is a folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).mkdir()
    assert inspect(name, "--json") == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["kind"], document["path"], document["facts"]["run"]["model"]) == ("run", name, model)
    with pytest.raises(InputError, match="is a run; --audio belongs to one motion"):
        inspect(name, "--audio", files / "a.wav")
    with pytest.raises(InputError, match="holds no WAV and no BVH"):
        inspect(f"./{name}")
