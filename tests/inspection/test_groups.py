"""Folders, corpora and runs: what is wrong among recordings."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
import pytest
from recordings_for_tests import CAST, clean, codes, long_talk, write_pair

from a2g_jax.data.corpus_layout import MANIFEST
from a2g_jax.data.corpus_writer import prepare_recording, write_corpus
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.pose_track import PoseTrack
from a2g_jax.inspection.inspect import inspect
from a2g_jax.inspection.rigs import check_skeletons
from a2g_jax.io.bvh import write_bvh
from a2g_jax.recording import PoseRecording
from a2g_jax.training.run import Run, save_run

DEMO = Path(__file__).parents[2] / "a2g_jax" / "demo"


def corpus_of(path, recordings, **manifest):
    """A corpus, with entries of its manifest changed."""
    features = Features()
    rows = (prepare_recording(recording, features) for recording in recordings)
    write_corpus(path, rows, features=features, recipe={"reader": "folder"})
    values = json.loads((path / MANIFEST).read_text())
    values.update(manifest, checksum=None)
    (path / MANIFEST).write_text(json.dumps(values))
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("raw")
    for number in range(3):
        write_pair(path, clean(number), f"take{number}")
    return path


def test_sound_folder(folder):
    report = inspect(folder)
    assert report.warnings == 0, report.text()
    assert report.facts["recordings"]["count"] == 3
    assert report.facts["recordings"]["minutes of audio"] == 1.0
    assert report.facts["each"]["take1"]["fps"] == 30.0


def test_faults_of_a_folder(folder, tmp_path):
    path = tmp_path / "raw"
    shutil.copytree(folder, path)
    write_pair(path, clean(0), "again")
    (path / "broken.bvh").write_text("HIERARCHY\nROOT\n")
    shutil.copy(path / "take1.wav", path / "broken.wav")
    report = inspect(path)
    assert codes(report.findings) == {"duplicate", "unreadable"}
    twice = {x.place.recording: x.message for x in report.findings if x.code == "duplicate"}
    assert "same audio as broken" in twice["take1"] or "same audio as take1" in twice["broken"]
    assert "take0" in {x.place.recording for x in report.findings if x.code == "duplicate"}
    (path / "take2.wav").unlink()
    report = inspect(path)
    assert "pairs" in codes(report.findings)
    assert "take2" in next(x.message for x in report.findings if x.code == "pairs")
    with pytest.raises(InputError, match="holds no WAV and no BVH"):
        inspect(Path(__file__).parent / "..")  # tests, and no recordings


def test_skeletons():
    usual = clean(0).motion.skeleton
    many, names = [usual] * 4, [f"take{number}" for number in range(5)]
    speakers = ["ada"] * 4 + ["bruno"]
    offsets = np.asarray(usual.offsets).copy()
    assert check_skeletons([*many, usual], names) == []
    assert [x.code for x in check_skeletons([*many, usual.scaled(100.0)], names)] == ["unit"]
    taller = usual.scaled(1.1)
    assert codes(check_skeletons([*many, taller], names, speakers)) == set()
    assert codes(check_skeletons([*many, taller], names, ["ada"] * 5)) == {"bones"}
    (found,) = check_skeletons([*many, taller], names)
    assert (found.severity, found.code) == ("info", "bones")
    lowered = offsets.copy()
    for joint in ("L_Elbow", "L_Wrist"):
        x, y, z = lowered[usual.index(joint)]
        lowered[usual.index(joint)] = (x * 0.7 + y * 0.7, -x * 0.7 + y * 0.7, z)
    (found,) = check_skeletons([*many, replace(usual, offsets=lowered)], names, speakers)
    assert (found.code, found.place.recording) == ("rest-pose", "take4")
    renamed = replace(usual, names=(*usual.names[:-1], "R_Hand"))
    (found,) = check_skeletons([renamed, *many], names)
    assert (found.code, found.place.recording) == ("skeleton", "take0")
    assert "lacks R_Wrist; has R_Hand" in found.message


def test_rest_pose_in_a_folder(folder, tmp_path):
    path = tmp_path / "raw"
    shutil.copytree(folder, path)
    motion = clean(2).motion
    offsets = np.asarray(motion.skeleton.offsets).copy()
    offsets[motion.skeleton.index("L_Elbow")] = np.linalg.norm(offsets[motion.skeleton.index("L_Elbow")]) * np.float32(
        [0.6, -0.8, 0]
    )
    write_bvh(path / "take2.bvh", replace(motion, skeleton=replace(motion.skeleton, offsets=offsets)))
    assert codes(inspect(path).findings) == {"rest-pose"}


def test_sound_corpus(toy_corpus):
    report = inspect(toy_corpus.path)
    assert report.warnings == 0, report.text()
    facts = report.facts
    assert facts["corpus"]["fingerprint"] == toy_corpus.fingerprint
    assert facts["corpus"]["minutes"] == 1.0
    assert {name: split["recordings"] for name, split in facts["splits"].items()} == {
        name: len(parts) for name, parts in toy_corpus.splits.items()
    }
    assert facts["speakers"] == {"ada": 1.0}
    assert len(facts["skeleton"]["joints"]) == 22


def test_leaks_of_a_corpus(tmp_path):
    splits = {"train": [[0, 0, 600], [1, 0, 600]], "validation": [[2, 0, 600]], "test": [[3, 0, 600]]}
    recordings = [replace(clean(number), name=str(number)) for number in range(3)]
    sound = corpus_of(tmp_path / "sound", [*recordings, replace(clean(3), name="3")], splits=splits)
    assert inspect(sound).warnings == 0
    same = corpus_of(tmp_path / "same", [*recordings, replace(clean(0), name="3")], splits=splits)
    report = inspect(same)
    assert codes(report.findings) == {"leak"}
    assert [x.message.split(" for")[0] for x in report.findings if x.code == "leak"] == [
        "has the same audio as 0",
        "has the same motion as 0",
    ]
    only_motion = replace(clean(3), name="3", motion=clean(1).motion)
    (leak,) = (
        x
        for x in inspect(corpus_of(tmp_path / "motion", [*recordings, only_motion], splits=splits)).findings
        if x.severity == "warning"
    )
    assert "same motion as 1" in leak.message
    within = {**splits, "train": [[0, 0, 600], [3, 0, 600]], "test": [[1, 0, 600]]}
    assert codes(inspect(corpus_of(tmp_path / "within", [*recordings, only_motion], splits=within)).findings) == {
        "leak"
    }
    within = {**splits, "train": [[0, 0, 600], [1, 0, 600], [3, 0, 600]], "test": [[0, 590, 600]]}
    report = inspect(corpus_of(tmp_path / "over", [*recordings, replace(clean(3), name="3")], splits=within))
    (leak,) = (x for x in report.findings if x.severity == "warning")
    assert "frames 590 to 600 lie in both" in leak.message


def test_same_files_in_two_splits(tmp_path):
    file = tmp_path / "a.wav"
    file.write_bytes(b"anything")
    entries = [
        replace(clean(number), name=str(number), sources=(str(file),) if number < 2 else ()) for number in range(4)
    ]
    for last, code in (([[1, 0, 600]], {"leak"}), ([[3, 0, 600]], set())):
        train = [[number, 0, 600] for number in range(4) if [number, 0, 600] not in last]
        path = corpus_of(tmp_path / str(last[0][0]), entries, splits={"train": train, "test": last})
        report = inspect(path)
        assert codes(report.findings) == code
        assert code or "same-files" in {x.code for x in report.findings}


def test_nan_in_a_corpus(tmp_path):
    path = corpus_of(tmp_path / "corpus", [replace(clean(number), name=str(number)) for number in range(2)])
    pose = np.load(path / "pose.npy")
    pose[700, 3, 2] = np.inf
    np.save(path / "pose.npy", pose)
    damaged, found = (x for x in inspect(path).findings if x.severity == "warning")
    assert (damaged.code, damaged.place.path) == ("damaged", "pose.npy")
    assert (found.code, found.place.recording) == ("nan", "1")
    assert "[100, 3, 2]" in found.message


def test_corpus_without_a_skeleton(tmp_path):
    points = np.random.default_rng(0).normal(size=(2, 600, 3, 2)).astype(np.float32)
    layout = PoseLayout(("hip", "neck", "hand"), ((0, 1), (1, 2)))
    recordings = [
        PoseRecording(
            name=str(number),
            audio=clean(number).audio,
            sample_rate=16000,
            motion=PoseTrack("keypoints", values, layout, 30.0),
        )
        for number, values in enumerate((points[0], points[1], points[0]))
    ]
    features = Features(pose="keypoints")
    rows = (prepare_recording(recording, features) for recording in recordings)
    write_corpus(tmp_path / "corpus", rows, features=features, recipe={"reader": "s2g"})
    report = inspect(tmp_path / "corpus")
    assert report.facts["points"]["bones"] == ["hip-neck", "neck-hand"]
    (found,) = report.findings
    assert (found.code, found.place.recording) == ("leak", "2")  # three recordings are split in time


def test_late_motion_in_a_corpus(tmp_path):
    spoken = long_talk()
    late = replace(spoken, audio=spoken.audio[11200:], motion=spoken.motion.clip(0, 1899))
    report = inspect(corpus_of(tmp_path / "corpus", [late], splits={"train": [[0, 0, 1800]]}))
    (found,) = (x for x in report.findings if x.severity == "warning")
    assert (found.code, found.place.recording) == ("offset", "long")
    assert found.value == pytest.approx(0.7, abs=0.1)
    assert report.facts["offset"]["measured in"] == "1 of 1 recordings"


def test_run(tmp_path):
    report = inspect(DEMO)
    assert report.warnings == 0
    assert report.facts["run"]["parameters"] == sum(report.facts["run"]["of which"].values())
    stages = report.facts["training settings"]["steps"], report.facts["model settings"]["adversarial_steps"]
    assert sum(stages) == report.facts["run"]["steps"]
    run = tmp_path / "run"
    shutil.copytree(DEMO.parent / "demo_flow", run)
    about = json.loads((run / "run.json").read_text())
    about["steps"] -= 1000
    about["checksum"] = None
    (run / "run.json").write_text(json.dumps(about))
    lines = [{"step": step, "split": "validation", "loss": loss} for step, loss in ((1, 2.0), (2, 1.0), (3, 1.4))]
    lines += [{"step": 3, "split": "train", "loss": None}]
    (run / "metrics.jsonl").write_text("\n".join(json.dumps(line) for line in lines) + '\n{"step": 4, "spl')
    report = inspect(run)
    assert {x.code: x.severity for x in report.findings} == {
        "unfinished": "info",
        "overfitting": "info",
        "nan": "warning",
    }
    assert report.facts["last losses"]["validation"]["loss"] == 1.4


@pytest.mark.parametrize(("kind", "rows", "width"), [("directions", 2, 3), ("keypoints", 3, 2)])
def test_run_without_a_skeleton(kind, rows, width, toy_run_config, tmp_path):
    layout = PoseLayout(("hip", "neck", "hand"), ((0, 1), (1, 2)), (0.5, 0.6) if kind == "directions" else ())
    config = toy_run_config()
    pose = Statistics(np.zeros((rows, width), np.float32), np.ones((rows, width), np.float32))
    config = replace(config, space=PoseSpace(layout, kind), statistics={**config.statistics, "pose": pose})
    code = np.ones((1, config.model_config.code_channels), np.float32)
    summary = {"specific_mean": code, "specific_std": code}
    save_run(tmp_path / "run", Run(config, config.build().init(jax.random.key(0)), summary, 30))
    report = inspect(tmp_path / "run")
    assert report.facts["points"]["bones"] == ["hip-neck", "neck-hand"]
    assert ("bone lengths (cm)" in report.facts["points"]) == (kind == "directions")
    assert report.facts["run"]["pose"] == f"{kind}, {rows} rows"
    assert "hip-neck" in report.text()


def test_cast_is_varied():
    """The clean recordings that nothing is warned of are of all speakers."""
    assert len({speaker for speaker, _, _ in CAST}) == 6
