"""The flags of ``a2g generate`` for a character."""

from pathlib import Path

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import read_bvh, write_bvh
from a2g_jax.talker.recordings import talk
from experiments.characters.decoded import Decoded
from experiments.characters.rigs import unreal
from experiments.characters.skinned import mixamo_glb


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Two seconds of speech, a rig and a skinned character."""
    folder = tmp_path_factory.mktemp("files")
    recording = talk(2.0, 1)
    write_audio(folder / "speech.wav", recording.audio, recording.sample_rate)
    write_bvh(folder / "talk.bvh", recording.motion)
    unreal().write(folder / "unreal.bvh")
    mixamo_glb(folder / "mixamo.glb")
    (folder / "model.fbx").write_bytes(b"Kaydara FBX Binary")
    return folder


def generate(files, out, *flags):
    return main(["generate", "demo", "--audio", str(files / "speech.wav"), "--out", str(out), *map(str, flags)])


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (("--to", "{}/none.glb"), ("none.glb", "there is no such file")),
        (("--to", "{}/model.fbx"), ("model.fbx", "Blender", ".glb")),
        (("--to", "{}/speech.wav"), ("speech.wav", "BVH, GLB or VRM")),
        (("--to", "{}/unreal.bvh", "--facing=-z"), ("--facing", "keeps its own axes")),
        (("--fingers", "none"), ("--fingers", "--to")),
    ],
)
def test_flags_that_do_not_fit(files, flags, words, tmp_path, capsys):
    assert generate(files, tmp_path / "out", *(flag.format(files) for flag in flags)) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    for word in words:
        assert word in message
    assert not (tmp_path / "out").exists()


def test_a_character_that_is_damaged_is_refused_before_any_work(files, tmp_path, capsys):
    (tmp_path / "cut.glb").write_bytes((files / "mixamo.glb").read_bytes()[:5000])
    assert generate(files, tmp_path / "out", "--to", tmp_path / "cut.glb") == 2
    assert "cut short" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_samples_for_a_rig_at_24_frames_a_second(files, tmp_path, capsys):
    out = tmp_path / "out"
    assert generate(files, out, "--to", files / "unreal.bvh", "--fps", "24", "--samples", "2") == 0
    assert "25 of 81 joints move, 30 of fingers are relaxed" in capsys.readouterr().out
    assert {path.name for path in out.iterdir()} == {
        *(f"sample_0{number}.{kind}" for number in (0, 1) for kind in ("bvh", "npz")),
        "index.html",
        "checks.json",
    }
    first, second = (read_bvh(out / f"sample_0{number}.bvh") for number in (0, 1))
    assert (first.fps, first.frames) == (24.0, 48)
    assert np.abs(first.rotations - second.rotations).max() > 0.01
    assert (out / "sample_00.bvh").read_text().startswith((files / "unreal.bvh").read_text().split("MOTION")[0].strip())


@pytest.mark.slow
def test_samples_for_a_skinned_character_and_other_formats(files, tmp_path):
    out = tmp_path / "out"
    flags = ("--to", files / "mixamo.glb", "--samples", "1", "--fingers", "none", "--formats", "glb,smplx,bvh")
    assert generate(files, out, *flags) == 0
    assert {path.suffix for path in out.iterdir()} == {".glb", ".npz", ".bvh", ".json"}
    decoded = Decoded(out / "sample_00.glb")
    tracks, bones = decoded.tracks(), read_bvh(out / "sample_00.bvh")
    places = decoded.places(1.0, tracks)
    for joint, name in enumerate(bones.skeleton.names):
        np.testing.assert_allclose(places[name], bones.positions()[30, joint], atol=1e-4)


def test_retarget_to_a_skinned_character(files, tmp_path, capsys):
    flags = ["retarget", str(files / "talk.bvh"), "--to", str(files / "mixamo.glb"), "--out"]
    assert main([*flags, str(tmp_path / "x.bvh")]) == 2
    assert "a GLB file's name ends in .glb" in capsys.readouterr().err
    assert main([*flags, str(tmp_path / "x.glb"), "--fingers", "relaxed", "--fps", "24"]) == 0
    assert "mixamorig:LeftForeArm" in capsys.readouterr().out
    assert len(Decoded(tmp_path / "x.glb").document["animations"]) == 1


GUIDE = Path(__file__).parents[1] / "docs" / "character.md"
COMMANDS = [line.split("#")[0].split()[1:] for line in GUIDE.read_text().splitlines() if line.startswith("a2g ")]


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_commands_of_the_guide_have_flags_that_there_are(command, tmp_path, monkeypatch, capsys):
    """Their files do not exist here, which is what is said."""
    monkeypatch.chdir(tmp_path)
    assert main(command) == 2
    assert "there is no such file" in capsys.readouterr().err
