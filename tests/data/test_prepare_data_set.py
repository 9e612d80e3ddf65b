"""From a data set on disk to a corpus, by the command: features, poses, official splits, broken recordings."""

import json

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.cli.prepare import READERS
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.datasets import NAMES, find_data_set
from a2g_jax.data.settings import PRESETS
from a2g_jax.data.splits import Segment, official_splits
from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig, log_mel
from a2g_jax.io.audio import read_audio, write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.views.catalogue import VIEWS


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Six short takes with fingers."""
    source = tmp_path_factory.mktemp("recordings")
    for seed in range(6):
        take = talk(3.0, seed, fingers=True)
        write_audio(source / f"take{seed}.wav", take.audio, 16000)
        write_bvh(source / f"take{seed}.bvh", take.motion)
    return source


def test_the_command_line_knows_every_reader():
    assert set(READERS) == {"talker", *NAMES}
    for name in NAMES:
        assert find_data_set(name).name == name
    with pytest.raises(InputError, match=r"no data set 'beet'; there are: "):
        find_data_set("beet")


def test_the_list_is_complete(capsys):
    assert main(["prepare", "--list"]) == 0
    printed = capsys.readouterr().out
    for name in (*NAMES, *PRESETS):
        assert f"{name}: " in printed


@pytest.mark.parametrize("paper", ["audio2gestures", "stylized-flow", "emotion-gesture"])
def test_features_of_the_papers(tmp_path, folder, paper):
    out = tmp_path / "corpus"
    command = ["prepare", "folder", str(folder), "--out", str(out), "--features", paper, "--workers", "1"]
    features = PRESETS[paper]
    assert main(command) == 0
    corpus = Corpus.open(out)
    rows = {"audio2gestures": (22, 6), "stylized-flow": (22, 3), "emotion-gesture": (47, 6)}[paper]
    frames = round(3.0 * features.fps)
    assert corpus.fps == features.fps
    assert corpus.pose.shape == (6 * frames, *rows)
    assert corpus.audio.shape == (6 * frames, features.mel.width)
    assert corpus.statistics["pose"].mean.shape == rows
    entry = corpus.recordings[1]
    audio = read_audio(folder / f"{entry.name}.wav", 16000)
    there = slice(entry.first, entry.first + frames)
    np.testing.assert_allclose(corpus.audio[there], log_mel(audio, features.mel, features.fps, frames), atol=1e-4)
    assert np.isfinite(corpus.motion(entry.first, entry.first + frames).positions()).all()
    if features.waveform:
        kept = corpus.waveform[entry.first_sample : entry.first_sample + entry.samples]
        np.testing.assert_allclose(kept / 32767.0, audio[: entry.samples], atol=2e-5)
        assert sum(one.samples for one in corpus.recordings) == len(corpus.waveform) == 6 * 48000
    else:
        with pytest.raises(InputError, match="stores no waveforms"):
            _ = corpus.waveform


def test_exponential_maps_and_6d_tell_the_same_motion(tmp_path, folder):
    motions = []
    for pose in ("6d", "exponential"):
        out = tmp_path / pose
        command = [
            "prepare",
            "folder",
            str(folder),
            "--out",
            str(out),
            "--pose",
            pose,
            "--limit",
            "1",
            "--workers",
            "1",
        ]
        assert main(command) == 0
        motions.append(Corpus.open(out).motion(0, 90).positions())
    np.testing.assert_allclose(*motions, atol=1e-3)


@pytest.mark.parametrize("view", ["beat", "ted", "ted-expressive", "s2g"])
def test_generated_talk_as_data_sets_show_it(tmp_path, view):
    out = tmp_path / "corpus"
    assert main(["prepare", "talker", "--minutes", "0.2", "--view", view, "--out", str(out), "--workers", "1"]) == 0
    corpus = Corpus.open(out)
    shape = {"beat": (47, 6), "ted": (9, 3), "ted-expressive": (42, 3), "s2g": (49, 2)}[view]
    assert (corpus.fps, corpus.space.kind) == (15.0, VIEWS[view].pose)
    assert corpus.pose.shape[1:] == shape
    if view == "beat":
        assert corpus.skeleton.joints == 47
        return
    with pytest.raises(InputError, match="holds (bone directions|keypoints) and no skeleton"):
        _ = corpus.skeleton


@pytest.mark.slow  # compiles a training
def test_a_run_on_keypoints_writes_no_motion(tmp_path, capsys):
    out, run = tmp_path / "corpus", str(tmp_path / "run")
    assert main(["prepare", "talker", "--minutes", "0.2", "--view", "s2g", "--out", str(out), "--workers", "1"]) == 0
    quick = [
        "--steps",
        "2",
        "--clip-frames",
        "16",
        "--batch-size",
        "2",
        "--audio-channels",
        "4",
        "--motion-channels",
        "4",
    ]
    assert main(["train", "audio2gestures", "--corpus", str(out), "--out", run, *quick]) == 0
    write_audio(tmp_path / "speech.wav", np.asarray(talk(2.0, 1).audio), 16000)
    capsys.readouterr()
    assert main(["generate", run, "--audio", str(tmp_path / "speech.wav"), "--out", str(tmp_path / "made")]) == 2
    assert "have no skeleton" in capsys.readouterr().err
    assert not (tmp_path / "made").exists()


def test_broken_recordings_end_the_work_or_are_left_out(tmp_path, folder, capsys):
    source = tmp_path / "mine"
    source.mkdir()
    for path in folder.iterdir():
        (source / path.name).write_bytes(path.read_bytes())
    (source / "take2.bvh").write_text("HIERARCHY\nROOT hips\n")
    command = ["prepare", "folder", str(source), "--workers", "1", "--out"]
    assert main([*command, str(tmp_path / "strict")]) == 2
    assert "take2.bvh" in capsys.readouterr().err
    assert not (tmp_path / "strict").exists()
    out = tmp_path / "corpus"
    assert main([*command, str(out), "--skip-broken"]) == 0
    assert "skipped: " in capsys.readouterr().err
    corpus = Corpus.open(out)
    assert [entry.name for entry in corpus.recordings] == ["take0", "take1", "take3", "take4", "take5"]
    (skipped,) = json.loads((out / "manifest.json").read_text())["skipped"]
    assert skipped["name"] == "take2"
    assert "take2.bvh" in skipped["reason"]


def test_testing_recordings_alone_are_refused_before_any_work(tmp_path, folder, capsys):
    source = tmp_path / "2"
    source.mkdir()
    for suffix in (".wav", ".bvh"):
        (source / f"2_scott_0_1_1{suffix}").write_bytes((folder / f"take0{suffix}").read_bytes())
    out = tmp_path / "corpus"
    assert main(["prepare", "beat", str(tmp_path), "--out", str(out), "--workers", "1"]) == 2
    assert "split by the seed with --random-split" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [source]
    assert main(["prepare", "beat", str(tmp_path), "--out", str(out), "--workers", "1", "--random-split"]) == 0
    assert [len(Corpus.open(out).splits[part]) for part in ("train", "validation", "test")] == [1, 1, 1]


class TestOfficialSplits:
    def test_parts_stay_where_the_authors_put_them(self):
        parts = ["test", "train", "validation", "train", ""]
        splits = official_splits([10] * 5, parts, 0)
        assert [s.recording for s in splits["train"]] == [1, 3, 4]
        assert [s.recording for s in splits["validation"]] == [2]
        assert [s.recording for s in splits["test"]] == [0]

    def test_validation_is_taken_from_training_where_there_is_none(self):
        parts = ["test", *["train"] * 20]
        splits = official_splits([10] * 21, parts, 3)
        assert splits["test"] == [Segment(0, 0, 10)]
        train, validation = ({s.recording for s in splits[name]} for name in ("train", "validation"))
        assert (len(train), len(validation)) == (18, 2)
        assert train | validation == set(range(1, 21))
        assert splits == official_splits([10] * 21, parts, 3)

    def test_few_training_recordings_are_cut_in_time(self):
        splits = official_splits([100, 50], ["train", "test"], 0)
        assert splits["train"] == [Segment(0, 0, 90)]
        assert splits["validation"] == [Segment(0, 90, 100)]
        assert splits["test"] == [Segment(1, 0, 50)]

    def test_without_any_part_the_seed_decides(self):
        assert [len(part) for part in official_splits([9] * 10, [""] * 10, 0).values()] == [8, 1, 1]


def test_settings_that_do_not_exist(tmp_path, folder, capsys):
    for flags, message in (
        (["--features", "nobody"], "--features: there is no 'nobody'; there are: audio2gestures"),
        (["--pose", "keypoints"], "holds rotations of joints; prepare it with --pose 6d"),
        (["--view", "ted"], "--view is for 'a2g prepare talker'"),
    ):
        assert main(["prepare", "folder", str(folder), "--out", str(tmp_path / "c"), "--workers", "1", *flags]) == 2
        assert message in capsys.readouterr().err
    assert main(["prepare", "talker", "--out", str(tmp_path / "c"), "--joints", "all"]) == 2
    assert "--joints is for recordings" in capsys.readouterr().err
    assert MelConfig().width == 64
