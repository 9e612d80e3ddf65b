import json
import shutil

import numpy as np
import pytest
from bvh_trees import TREES, check_motion, check_sound, put, tree, write_motion, write_sound
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.cli import main
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.datasets import beat
from a2g_jax.data.datasets.beat_split import Part, parts
from a2g_jax.data.datasets.beat_take import describe_face, emotion, read_emotions, read_semantics
from a2g_jax.errors import InputError
from a2g_jax.io.textgrid import write_words
from a2g_jax.io.words import word_id
from a2g_jax.recording import Word
from a2g_jax.talker.views.upper_body import UPPER_BODY_JOINTS

WORDS = (Word("the", 0.25, 0.5), Word("first", 0.5, 1.0), Word("thing", 1.25, 1.75))
PHONES = (Word("DH", 0.25, 0.3), Word("AH0", 0.3, 0.5), Word("F", 0.5, 1.0))
EMOTIONS = "03_sadness, 0, 1.5, 1.5, 3\r\n00_netural, 1.5, 2, 0.5, 0\r\n"
SEMANTIC = "01_beat_align\t0\t0.5\t0.5\t0.1\n07_iconic_h\t0.5\t1.75\t1.25\t0.7\tfirst thing\n"


def write_take(folder, name, seconds=2.0, fps=120.0, labels=True):
    folder = folder / name.split("_")[0]
    motion = write_motion(folder / f"{name}.bvh", "beat", seconds, fps)
    sound = write_sound(folder / f"{name}.wav", seconds)
    if labels:
        write_words(folder / f"{name}.TextGrid", WORDS, seconds, tiers={"phones": PHONES})
        put(folder / f"{name}.csv", EMOTIONS)
        put(folder / f"{name}.txt", SEMANTIC)
        frames = [{"weights": [0.1] * 51, "time": frame / 60, "rotation": []} for frame in range(round(60 * seconds))]
        put(folder / f"{name}.json", json.dumps({"names": ["jawOpen"] * 51, "frames": frames}))
    return motion, sound


def test_a_take_is_what_was_written(tmp_path):
    root = tmp_path / "beat_english_v0.2.1"
    motion, sound = write_take(root, "2_scott_0_81_81")
    put(root / ".DS_Store", b"\0")
    put(root / "2" / "Thumbs.db", b"\0")
    for hidden in (".trash", "__MACOSX"):
        put(root / hidden / "2_scott_0_81_81.bvh", b"\0")
    assert len(motion.names) == 75
    for folder in (root, tmp_path, root / "2"):
        (take,) = beat.find(folder)
        assert (take.name, take.split) == ("2_scott_0_81_81", "test")
    recording = beat.read(take, 16000)
    check_motion(recording.motion, motion)
    check_sound(recording.audio, sound)
    assert (recording.name, recording.speaker, recording.emotion) == ("2_scott_0_81_81", "scott", "sadness")
    assert recording.words == WORDS
    annotations = recording.annotations
    assert (annotations["language"], annotations["scenario"], annotations["speaker_id"]) == ("english", "speech", 2)
    assert [(p["text"], p["start"], p["end"]) for p in annotations["phones"]] == [
        (p.text, p.start, p.end) for p in PHONES
    ]
    assert annotations["emotions"] == [
        {"label": "03_sadness", "emotion": "sadness", "start": 0.0, "end": 1.5},
        {"label": "00_netural", "emotion": "neutral", "start": 1.5, "end": 2.0},
    ]
    assert annotations["semantic"][1] == {
        "label": "07_iconic_h", "start": 0.5, "end": 1.75, "score": 0.7, "keywords": "first thing",
    }  # fmt: skip
    assert annotations["face"] == {
        "file": str(root / "2" / "2_scott_0_81_81.json"), "frames": 120, "fps": 60.0, "offset": 0.0,
    }  # fmt: skip
    json.dumps(annotations, allow_nan=False)


def test_labels_may_be_missing_or_lie_elsewhere(tmp_path):
    write_take(tmp_path / "raw", "1_wayne_1_12_12", labels=False)
    (take,) = beat.find(tmp_path)
    recording = beat.read(take, 16000)
    assert (take.split, recording.emotion, recording.words) == ("validation", "", ())
    assert recording.annotations == {"language": "english", "scenario": "conversation", "speaker_id": 1}
    put(tmp_path / "labels" / "1" / "1_wayne_1_12_12.txt", SEMANTIC)
    put(tmp_path / "raw" / "1" / "1_wayne_1_12_12.csv", b"")
    recording = beat.read(beat.find(tmp_path)[0], 16000)
    assert [label["label"] for label in recording.annotations["semantic"]] == ["01_beat_align", "07_iconic_h"]
    assert recording.annotations["emotions"] == []


def test_other_languages_may_have_running_text(tmp_path):
    write_take(tmp_path, "17_itoi_6_70_70", labels=False)
    put(tmp_path / "17" / "17_itoi_6_70_70.txt", "\ufeffこれは\r\nペンです")
    (take,) = beat.find(tmp_path)
    recording = beat.read(take, 16000)
    assert (take.split, recording.emotion, recording.annotations["language"]) == ("", "happiness", "japanese")
    assert recording.annotations["transcript"] == "これは ペンです"


def test_halves_are_cut_at_thirty_seconds(tmp_path):
    motion, sound = write_take(tmp_path, "5_stewart_0_65_65", seconds=31.5, fps=15.0)
    folder = tmp_path / "5"
    write_words(folder / "5_stewart_0_65_65.TextGrid", [Word("a", 1.0, 2.0), Word("b", 29.5, 30.5)], 31.5)
    put(folder / "5_stewart_0_65_65.txt", "02_deictic_l\t29\t31\t2\t0.2\tone\n")
    takes = beat.find(tmp_path)
    assert [(take.name, take.split) for take in takes] == [
        ("5_stewart_0_65_65_a", "test"),
        ("5_stewart_0_65_65_b", "validation"),
    ]
    first, second = (beat.read(take, 16000) for take in takes)
    assert takes[0].group == takes[1].group
    assert (first.motion.frames, second.motion.frames) == (450, 22)
    np.testing.assert_allclose(second.motion.positions(), motion.positions[450:], atol=2e-5)
    check_sound(second.audio, sound[30 * 16000 :])
    assert first.words == (Word("a", 1.0, 2.0), Word("b", 29.5, 30.0))
    assert second.words == (Word("b", 0.0, 0.5),)
    assert [(e["start"], e["end"]) for e in second.annotations["semantic"]] == [(0.0, 1.0)]
    assert (second.name, second.emotion, second.annotations["face"]["offset"]) == (takes[1].name, "happiness", 30.0)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), r"1_wayne_0_9_9\.TextGrid: has no words; align the transcript again, or remove the file if nothing is"),
        (
            (Word("late", 1.5, 2.2),),
            r"TextGrid: 'late' ends at 2\.20 s, but the audio lasts 0\.50 s; take the TextGrid",
        ),
    ],
)
def test_textgrids_that_do_not_belong_to_the_audio(tmp_path, words, message):
    write_take(tmp_path, "1_wayne_0_9_9", seconds=0.5, fps=15.0, labels=False)
    write_words(tmp_path / "1" / "1_wayne_0_9_9.TextGrid", words, 3.0)
    with pytest.raises(InputError, match=message):
        beat.read(beat.find(tmp_path)[0], 16000)


def test_an_empty_textgrid_is_one_line(tmp_path):
    write_take(tmp_path, "1_wayne_0_9_9", seconds=0.5, fps=15.0, labels=False)
    put(tmp_path / "1" / "1_wayne_0_9_9.TextGrid", b"")
    with pytest.raises(InputError, match=r"1_wayne_0_9_9\.TextGrid") as caught:
        beat.read(beat.find(tmp_path)[0], 16000)
    assert "\n" not in str(caught.value)


def test_a_word_may_end_a_moment_after_the_audio(tmp_path):
    write_take(tmp_path, "1_wayne_0_9_9", seconds=0.5, fps=15.0, labels=False)
    write_words(tmp_path / "1" / "1_wayne_0_9_9.TextGrid", [Word("last", 0.3, 0.8)], 1.0)
    assert beat.read(beat.find(tmp_path)[0], 16000).words == (Word("last", 0.3, 0.8),)


def test_emotions_by_sequence_number():
    edges = {0: "neutral", 64: "neutral", 65: "happiness", 72: "happiness", 73: "anger", 80: "anger", 86: "sadness"}
    edges |= {94: "contempt", 102: "surprise", 110: "fear", 111: "disgust", 118: "disgust", 119: ""}
    assert {number: emotion(0, number, number) for number in edges} == edges
    assert (emotion(6, 1, 8), emotion(0, 64, 65), emotion(1, 1, 1)) == ("neutral", "", "")


def test_frames_of_a_face_are_counted_wherever_they_lie(tmp_path):
    block = 2**20
    for gap in range(11):
        text = b" " * (block - gap) + b'"weights": []' + b" " * block + b'"weights"'
        assert describe_face(put(tmp_path / "face.json", text), 0.0)["frames"] == 2


@settings(max_examples=100, deadline=None)
@given(st.one_of(st.binary(max_size=60), st.text('0129.-e,\t\r\n "x', max_size=60).map(str.encode)))
def test_any_table_is_read_or_refused(tmp_path_factory, content):
    path = put(tmp_path_factory.getbasetemp() / "labels.csv", content)
    for read in (read_emotions, read_semantics):
        labels, refusal = [], str(path)
        try:
            labels = read(path)
        except InputError as error:
            refusal = str(error)
        assert str(path) in refusal
        assert all(0 <= label["start"] <= label["end"] for label in labels)
        json.dumps(labels, allow_nan=False)


def test_split_is_that_of_the_readme():
    def split(speaker, name):
        return [part.split for part in parts(speaker, *name)]

    four = {"test": [*range(1, 9), 65, 73, 81, 87, 95, 103, 111], "validation": [*range(57, 65), 72, 80, 86, 94, 118]}
    for name, numbers in four.items():
        assert all(split(21, (0, number, number)) == [name] for number in numbers)
    assert all(split(2, (0, number, number)) == ["train"] for number in [*range(9, 57), 66, 79, 117])
    assert [split(3, (1, number, number)) for number in (1, 2, 11, 12)] == [
        ["test"],
        ["train"],
        ["train"],
        ["validation"],
    ]
    assert [split(5, (0, number, number)) for number in (4, 5, 8, 9, 118)] == [
        ["test"], ["validation"], ["validation"], ["train"], ["train"],
    ]  # fmt: skip
    assert parts(30, 1, 1, 1) == (Part("a", "test", 0.0, 300.0), Part("b", "validation", 300.0, None))
    assert split(1, (0, 1, 8)) == ["test"]
    assert split(1, (0, 8, 9)) == [""]
    assert split(5, (0, 64, 65)) == [""]
    assert split(1, (2, 1, 1)) == [""]
    assert split(31, (0, 1, 1)) == [""]


@settings(max_examples=200, deadline=None)
@given(st.integers(1, 30), st.integers(0, 1), st.integers(1, 118))
def test_no_recording_is_both_for_training_and_held_out(speaker, kind, number):
    found = {part.split for part in parts(speaker, kind, number, number)}
    assert "train" not in found or found == {"train"}


def test_order_is_by_number(tmp_path):
    for name in ("10_kieks_0_9_9", "2_scott_1_2_2", "2_scott_0_10_10", "2_scott_0_9_9"):
        for suffix in ("bvh", "wav"):
            put(tmp_path / name.split("_")[0] / f"{name}.{suffix}", "x")
    names = [take.name for take in beat.find(tmp_path)]
    assert names == ["2_scott_0_9_9", "2_scott_0_10_10", "2_scott_1_2_2", "10_kieks_0_9_9"]


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ([], "holds no takes of BEAT; name the folder beat_english"),
        (["notes.txt", "a.bvh", "a.wav"], "holds no takes of BEAT"),
        (["2_scott_0_1_1.TextGrid"], "holds no takes of BEAT"),
        (["2/2_scott_0_1_1.bvh"], "2_scott_0_1_1.bvh: has no WAV file of the same name; add or remove it"),
        (["2/2_scott_0_1_1.wav"], "2_scott_0_1_1.wav: has no BVH file of the same name"),
        (["2/2_scott_0_9_1.wav", "2/2_scott_0_9_1.bvh"], "goes from 9 to 1; correct its name"),
        (["a/2_scott_0_1_1.wav", "b/2_scott_0_1_1.wav"], "a/2_scott_0_1_1.wav and .*b/2_scott_0_1_1.wav: are both"),
    ],
)
def test_wrong_folders(tmp_path, files, message):
    for name in files:
        put(tmp_path / name, "x")
    with pytest.raises(InputError, match=message) as caught:
        beat.find(tmp_path)
    assert str(tmp_path) in str(caught.value)


def test_no_folder(tmp_path):
    with pytest.raises(InputError, match="nowhere: is not a folder; name the folder beat_english"):
        beat.find(tmp_path / "nowhere")


def test_links_that_lead_in_a_circle(tmp_path):
    for suffix in ("bvh", "wav"):
        put(tmp_path / "data" / "2" / f"2_scott_0_1_1.{suffix}", "x")
    (tmp_path / "data" / "2" / "up").symlink_to(tmp_path)
    (tmp_path / "link").symlink_to(tmp_path / "data")
    assert len(beat.find(tmp_path)) == 1
    assert len(beat.find(tmp_path / "link")) == 1


@pytest.mark.parametrize(
    ("suffix", "content", "message"),
    [
        ("csv", "00_neutral,0,2,2", r"\.csv, line 1: expected name, start, end, duration and score; got 4"),
        ("csv", "\n00_neutral,0,x,2,0", r"\.csv, line 2: expected a number; got 'x'"),
        ("csv", "00_neutral,0,2,2,9", "line 1: expected a score of 0 to 7; got 9"),
        ("csv", "00_neutral,2,1,1,0", "line 1: expected rising times"),
        ("csv", "00_neutral,0,nan,2,0", "line 1: expected a number"),
        ("csv", b"\xe4,0,2,2,0", r"\.csv: is not UTF-8 text \(byte 0\)"),
        ("csv", 'a,0,2,2,0\n"b,0,2,2,0', r"\.csv, line 2: is damaged"),
        ("txt", "01_beat_align\t0\tx\t1\t0.1", r"\.txt, line 1: expected a number"),
        ("txt", "running text", r"\.txt, line 1"),
        ("json", "{}", r"\.json: holds no frames of face weights"),
        ("TextGrid", "no grid", r"\.TextGrid, line 1: expected a TextGrid"),
        ("bvh", "no motion", r"\.bvh, line 1"),
        ("wav", "no sound", r"\.wav: is text, not audio"),
    ],
)
def test_damaged_files(tmp_path, suffix, content, message):
    write_take(tmp_path, "1_wayne_0_9_9", seconds=0.5, fps=15.0, labels=False)
    put(tmp_path / "1" / f"1_wayne_0_9_9.{suffix}", content)
    (take,) = beat.find(tmp_path)
    with pytest.raises(InputError, match=message):
        beat.read(take, 16000)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_encodings_of_tables(tmp_path, encoding):
    write_take(tmp_path, "1_wayne_0_9_9", seconds=0.5, fps=15.0, labels=False)
    put(tmp_path / "1" / "1_wayne_0_9_9.csv", EMOTIONS.replace("\r\n", "\r").encode(encoding))
    recording = beat.read(beat.find(tmp_path)[0], 16000)
    assert [label["emotion"] for label in recording.annotations["emotions"]] == ["sadness", "neutral"]


def test_half_of_a_short_recording(tmp_path):
    write_take(tmp_path, "5_stewart_0_73_73", seconds=0.5, fps=15.0, labels=False)
    first, second = beat.find(tmp_path)
    assert beat.read(first, 16000).motion.frames == 8
    with pytest.raises(InputError, match=r"5_stewart_0_73_73\.bvh.* expected more than 30\.0 s"):
        beat.read(second, 16000)


def test_real_take(shared, tmp_path):
    for path in (shared / "beat").iterdir():
        (tmp_path / "2").mkdir(exist_ok=True)
        if path.suffix == ".wav":
            (tmp_path / "2" / path.name).symlink_to(path)
        else:
            shutil.copy(path, tmp_path / "2")
    (take,) = beat.find(tmp_path)
    assert (take.name, take.split) == ("2_scott_0_1_1", "test")
    recording = beat.read(take, 16000)
    # The task of EmotionGesture: 47 joints at 15 frames a second, words at their start frames.
    command = [
        "prepare",
        "beat",
        str(tmp_path),
        "--features",
        "emotion-gesture",
        "--workers",
        "1",
        "--labelled",
        "--waveform",
    ]
    assert main([*command, "--out", str(tmp_path / "corpus")]) == 2
    assert main([*command, "--random-split", "--out", str(tmp_path / "corpus")]) == 0
    corpus = Corpus.open(tmp_path / "corpus")
    assert (corpus.fps, corpus.emotions, corpus.pose.shape) == (15.0, ("neutral",), (956, 47, 6))
    assert corpus.skeleton.names == UPPER_BODY_JOINTS
    words, starts = corpus.array("words"), corpus.array("word_starts")
    assert words[starts].all()
    assert (words[21], starts[21], starts[22]) == (word_id("the"), True, True)  # at 1.42 and 1.52 s
    ends = {name: [(s.start, s.stop) for s in corpus.splits[name]] for name in ("train", "validation", "test")}
    assert ends["train"][0][1] == ends["validation"][0][0] < ends["validation"][0][1] == ends["test"][0][0]
    assert len(corpus.waveform) == round(956 * 16000 / 15)
    assert (recording.speaker, recording.emotion) == ("scott", "neutral")
    assert recording.motion.skeleton.names == tree(TREES["beat"])[0]
    assert (recording.motion.frames, recording.motion.fps) == (956, 15.0)
    assert len(recording.audio) == pytest.approx(64.1 * 16000, abs=1600)
    assert recording.words[:3] == (Word("the", 1.42, 1.52), Word("first", 1.52, 1.78), Word("thing", 1.78, 1.97))
    assert recording.annotations["phones"][0]["start"] == 1.42
