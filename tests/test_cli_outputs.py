"""Outputs that cannot be written are one line, before any work; a full disk leaves the earlier results."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from a2g_jax.cli import main
from a2g_jax.evaluation.report import write_report
from a2g_jax.generation.formats import MotionFiles
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.talker.recordings import talk
from tests.disk_for_tests import small_files

TAKE = talk(3.0, 1)


def fails(capsys, *arguments):
    assert main([str(argument) for argument in arguments]) == 2
    captured = capsys.readouterr()
    (line,) = captured.err.strip().splitlines()
    assert captured.out == ""
    return line


@pytest.fixture
def files(tmp_path, toy_corpus):
    write_audio(tmp_path / "a.wav", TAKE.audio, TAKE.sample_rate)
    write_bvh(tmp_path / "a.bvh", TAKE.motion)
    (tmp_path / "file").write_text("")
    return tmp_path, toy_corpus.path


@pytest.mark.parametrize("place", ["/proc/nowhere", "file"])
def test_places_that_cannot_be_written_to_are_found_before_the_work(files, capsys, monkeypatch, place):
    folder, corpus = files
    monkeypatch.chdir(folder)
    out = f"{place}/out"
    # Work would begin with the corpus, the run or the file that is read.
    for name in ("a2g_jax.data.corpus.Corpus.open", "a2g_jax.training.run.open_run", "a2g_jax.io.bvh.read_bvh"):
        monkeypatch.setattr(name, None)
    for command in (
        f"prepare talker --out {out}/corpus",
        f"train audio2gestures --corpus {corpus} --out {out}",
        f"generate demo --audio a.wav --out {out}",
        f"demo --out {out}",
        f"talk --out {out}",
        f"evaluate --corpus {corpus} --out {out}",
        f"retarget a.bvh --to body --out {out}/b.bvh",
    ):
        assert place in fails(capsys, *command.split()), command


def test_a_full_disk_while_generating_leaves_the_earlier_files(tmp_path):
    out = tmp_path / "out"
    write = lambda count: [files.write(number, TAKE.motion) for number in range(count)]  # noqa: E731
    with MotionFiles(out, ("sample",), ("bvh", "npz")) as files:
        write(3)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    assert len(before) == 6
    size = (out / "sample_00.npz").stat().st_size

    def again():
        nonlocal files
        with small_files(size - 1), MotionFiles(out, ("sample",), ("npz", "bvh")) as files:
            write(1)

    with pytest.raises(ValueError, match=r"out/sample_00\.npz: cannot be written \(File too large\)"):
        again()
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_a_full_disk_while_writing_a_report_leaves_the_earlier_one(tmp_path, monkeypatch):
    import a2g_jax.evaluation.report as report

    monkeypatch.setattr(report, "find_spec", lambda name: None)
    monkeypatch.setattr(report, "markdown", lambda result: "x" * 5000)
    monkeypatch.setattr(report, "latex", lambda result: "y")
    out = tmp_path / "report"
    write_report({"rows": []}, out)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    assert set(before) == {"report.json", "report.md", "report.tex"}
    with pytest.raises(ValueError, match=r"report: cannot be written \(File too large\)"), small_files(1000):
        write_report({"rows": [1]}, out)
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_a_full_disk_behind_the_output_of_a_command():
    with Path("/dev/full").open("w") as full:
        line = [sys.executable, "-m", "a2g_jax.cli", "generate", "demo", "--settings"]
        done = subprocess.run(line, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "a2g: the output: cannot be used (No space left on device); check path and free space.\n"


def test_force_is_a_flag_of_three_commands(files, capsys, toy_corpus, tmp_path):
    corpus = shutil.copytree(toy_corpus.path, tmp_path / "corpus")
    assert main(["inspect", str(corpus), "--verify", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["kind"] == "corpus"
    data = bytearray((corpus / "pose.npy").read_bytes())
    data[4000] ^= 4
    (corpus / "pose.npy").write_bytes(data)
    for command in (("train", "audio2gestures"), ("evaluate",)):
        line = fails(capsys, *command, "--corpus", corpus, "--out", tmp_path / "out", "--verify")
        assert line.startswith(f"a2g: {corpus}/pose.npy: differs from its hash in manifest.json")
    assert not (tmp_path / "out").exists()
