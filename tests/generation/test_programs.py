import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.errors import InputError
from a2g_jax.generation.engine import Engine
from a2g_jax.generation.generator import Generator
from a2g_jax.generation.programs.loaded import Programs
from a2g_jax.generation.programs.manifest import Manifest
from a2g_jax.generation.programs.writing import export_programs
from a2g_jax.io.sealed import read_sealed, write_sealed
from a2g_jax.models.base import Condition
from a2g_jax.training.run import open_run

WINDOW = 128


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Programs of the run ``demo``."""
    made = tmp_path_factory.mktemp("programs") / "demo"
    export_programs(open_run("demo"), made, window=WINDOW, platforms=("cpu",))
    return made


def features(bands: int, frames: int) -> np.ndarray:
    return np.random.default_rng(0).normal(-40, 10, (frames, bands)).astype(np.float32)


#: Runs the programs of a folder where no code of models can be imported.
ALONE = """
import sys

class Refused:
    def find_spec(self, name, path=None, target=None):
        if name.startswith(("a2g_jax.models", "a2g_jax.training", "flax", "optax")):
            raise ImportError(name)

sys.meta_path.insert(0, Refused())
import numpy as np
from a2g_jax.generation.programs.loaded import Programs

audio = 0.1 * np.random.default_rng(1).normal(size=16000 * 6).astype(np.float32)
(motion,) = Programs(sys.argv[1]).generate(audio, 1, seed=5)
np.savez(sys.argv[2], rotations=motion.rotations, root=motion.root)
"""


def test_programs_give_the_motion_of_the_run_without_its_model(folder: Path, tmp_path: Path):
    subprocess.run([sys.executable, "-c", ALONE, str(folder), str(tmp_path / "found.npz")], check=True)
    found = np.load(tmp_path / "found.npz")
    audio = 0.1 * np.random.default_rng(1).normal(size=16000 * 6).astype(np.float32)
    (expected,) = Generator(open_run("demo"), WINDOW).generate(audio, 1, seed=5)
    np.testing.assert_allclose(found["rotations"], expected.rotations, atol=1e-5)
    np.testing.assert_allclose(found["root"], expected.root, atol=1e-5)


def test_each_sample_is_that_of_its_number(folder: Path):
    programs, audio = Programs(folder), features(64, 200)
    many = list(programs.rows(audio, 2, seed=1))
    (one,) = programs.rows(audio, 1, seed=1)
    assert np.array_equal(many[0], one)
    assert not np.allclose(many[0], many[1], atol=1e-2)
    assert many[0].shape == (200, 22, 6)


def test_programs_have_the_weights_that_they_use_and_no_others(folder: Path):
    from safetensors.numpy import load_file

    names = [name for name in load_file(folder / "weights.safetensors") if name.startswith("params/")]
    assert names
    assert not any("discriminator" in name for name in names)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["demo-flow", "demo-emotion"])
def test_autoregressive_runs_keep_their_state_between_windows(name: str, tmp_path: Path):
    run, frames, given = open_run(name), 1100, {}
    if name == "demo-emotion":
        run = replace(run, config=run.config.with_sampling(emotion="neutral"))
        given = {"emotion": np.eye(8, dtype=np.float32)[np.repeat([1, 3], frames // 2)]}
    export_programs(run, tmp_path, tuple(given), platforms=("cpu",))
    programs, audio = Programs(tmp_path), features(run.config.mel.width, frames)
    ours = list(programs.rows(audio, 2, 4, **given))
    theirs = list(Engine(run).rows(Condition(audio, **given), 2, 4))
    np.testing.assert_allclose(ours, theirs, atol=2e-5)


def test_what_cannot_be_exported_is_named(tmp_path: Path):
    run = open_run("demo")
    with pytest.raises(InputError, match="style: is no condition of audio2gestures"):
        export_programs(run, tmp_path, ("style",))
    requests = replace(run, config=run.config.with_sampling(controls=("energy=0.9",)))
    with pytest.raises(InputError, match="export it with --conditions controls"):
        export_programs(requests, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_inputs_that_do_not_fit_are_named(folder: Path):
    programs = Programs(folder)
    with pytest.raises(InputError, match="expected nothing besides the audio; got emotion"):
        next(programs.rows(features(64, 20), 1, emotion=np.zeros((20, 8))))
    with pytest.raises(InputError, match="less than a frame"):
        next(programs.generate(np.zeros(100, np.float32), 1))
    with pytest.raises(InputError, match="seed: expected 0 to"):
        next(programs.rows(features(64, 20), 1, seed=-1))


@pytest.mark.parametrize("name", ["../window.stablehlo", "begin.stablehlo"])
def test_a_manifest_with_other_files_is_refused(name: str, folder: Path, tmp_path: Path):
    values = read_sealed(folder / "manifest.json")
    values["programs"][name] = values["programs"]["window.stablehlo"]
    write_sealed(tmp_path / "manifest.json", values)
    with pytest.raises(InputError, match="manifest.json: is damaged"):
        Manifest.read(tmp_path)


@pytest.mark.parametrize("name", ["window.stablehlo", "weights.safetensors", "manifest.json"])
def test_a_damaged_file_is_named_before_it_is_used(name: str, folder: Path, tmp_path: Path):
    for path in folder.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    data = bytearray((tmp_path / name).read_bytes())
    data[len(data) // 2] ^= 1
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=name):
        Programs(tmp_path)
    (tmp_path / name).unlink()
    with pytest.raises(InputError, match="missing"):
        Programs(tmp_path)


def test_the_command_exports_and_lists_the_inputs(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    out = tmp_path / "programs"
    assert main(["export", "demo", "--out", str(out), "--platforms", "cpu", "--conditions", "controls"]) == 0
    printed = capsys.readouterr().out
    assert "controls: float32[1280, 6]" in printed
    assert json.loads((out / "manifest.json").read_text())["model"] == "audio2gestures"
    assert main(["export", "demo", "--out", str(out), "--platforms", "gpu"]) == 2
    assert "expected some of cpu, cuda, rocm, tpu" in capsys.readouterr().err
