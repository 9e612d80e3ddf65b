import json

import numpy as np
import pytest
from bvh_trees import check_motion, put, write_motion, write_sound

from a2g_jax.data.datasets import trinity
from a2g_jax.errors import InputError
from a2g_jax.recording import Word

WORDS = (Word("so", 0.4, 0.9), Word("hello", 0.9, 1.5))


def transcript(*results):
    entries = [{"start_time": f"{w.start:.3f}s", "end_time": f"{w.end:.3f}s", "word": w.text} for w in WORDS]
    return json.dumps([{"alternatives": [{"transcript": "so hello", "confidence": 0.9, "words": entries}]}, *results])


def write_recording(motion, audio, name, seed=0):
    written = write_motion(motion / f"{name}.bvh", "trinity", 2.0, 60.0, seed)
    return written, write_sound(audio / f"{name}.wav", 2.0, 44100, seed)


def write_release(root, train="Training_data"):
    result = {}
    for part, name in ((train, "Recording_001"), (train, "Recording_008"), ("Test_data", "TestSeq001")):
        seed = len(result)
        result[name] = write_recording(root / part / "Motion", root / part / "Audio", name, seed)
        put(root / part / "Transcripts" / f"{name}.json", transcript())
    return result


@pytest.mark.parametrize("train", ["Training_data", "Training_Data"])
def test_the_release_for_genea(tmp_path, train):
    root = tmp_path / "GENEA_Challenge_2020_data_release"
    written = write_release(root, train)
    put(root / train / "Motion" / ".DS_Store", b"\0")
    put(root / "Thumbs.db", b"\0")
    for folder in (tmp_path, root):
        takes = trinity.find(folder)
        assert [(take.name, take.split) for take in takes] == [
            ("Recording_001", "train"),
            ("Recording_008", "train"),
            ("TestSeq001", "test"),
        ]
    assert [take.name for take in trinity.find(root / "Test_data")] == ["TestSeq001"]
    for take in takes:
        recording = trinity.read(take, 44100)
        motion, sound = written[take.name]
        assert len(motion.names) == 56
        check_motion(recording.motion, motion)
        np.testing.assert_allclose(recording.audio, sound, atol=1 / 32768)
        assert (recording.words, recording.speaker, recording.emotion) == (WORDS, "trinity", "")


def test_audio_is_resampled(tmp_path):
    sound = write_recording(tmp_path, tmp_path, "NaturalTalking_001")[1]
    recording = trinity.read(trinity.find(tmp_path)[0], 16000)
    assert len(recording.audio) == 32000
    at = np.arange(3200, 28800) / 16000
    np.testing.assert_allclose(
        recording.audio[3200:28800], np.interp(at, np.arange(len(sound)) / 44100, sound), atol=5e-3
    )


def test_original_names(tmp_path):
    names = ["NaturalTalking_001", "NaturalTalking_002_2", "NaturalTalking_25", "NaturalTalking_030"]
    for name in names:
        put(tmp_path / "BVH" / f"{name}.bvh", "x")
        put(tmp_path / "Audio" / f"{name.replace('_25', '_025')}.wav", "x")
    assert [(take.name, take.split) for take in trinity.find(tmp_path)] == [
        ("NaturalTalking_001", "test"),
        ("NaturalTalking_002_2", "train"),
        ("NaturalTalking_025", "test"),
        ("NaturalTalking_030", "test"),
    ]


def test_a_transcript_may_be_missing(tmp_path):
    write_recording(tmp_path, tmp_path, "Recording_003")
    assert trinity.read(trinity.find(tmp_path)[0], 16000).words == ()


def test_test_set_without_motion(tmp_path):
    for name in ("Recording_001.bvh", "Recording_001.wav", "TestSeq001.wav", "TestSeq002.wav", "TestSeq002.json"):
        put(tmp_path / name, "x")
    with pytest.warns(UserWarning, match=r"2 test recordings have no motion and are left out: TestSeq001"):
        takes = trinity.find(tmp_path)
    assert [take.name for take in takes] == ["Recording_001"]
    put(tmp_path / "TestSeq001.bvh", "x")
    with pytest.raises(InputError, match=r"TestSeq002\.json: has no BVH file of the same name"):
        trinity.find(tmp_path)


@pytest.mark.filterwarnings("ignore:.*no motion")
@pytest.mark.parametrize(
    ("files", "message"),
    [
        ([], "holds no recordings of Trinity; name the folder GENEA_Challenge_2020_data_release"),
        (["Motion/take1.bvh", "Audio/take1.wav"], "holds no recordings of Trinity"),
        (["Transcripts/Recording_001.json"], "holds no recordings of Trinity"),
        (["Recording_001.bvh"], r"Recording_001\.bvh: has no WAV file"),
        (["Recording_001.wav"], r"Recording_001\.wav: has no BVH file"),
        (["TestSeq001.wav", "TestSeq002.wav"], "none of its 2 recordings has motion"),
        (["Recording_001.wav", "NaturalTalking_001.wav"], "two releases of the same takes"),
        (["a/Recording_1.bvh", "b/recording_001.bvh"], "are both Recording_001"),
    ],
)
def test_wrong_folders(tmp_path, files, message):
    for name in files:
        put(tmp_path / name, "x")
    with pytest.raises(InputError, match=message):
        trinity.find(tmp_path)


def test_damaged_transcript(tmp_path):
    write_recording(tmp_path, tmp_path, "Recording_001")
    put(tmp_path / "Recording_001.json", transcript({"words": []}))
    (take,) = trinity.find(tmp_path)
    with pytest.raises(InputError, match=r"Recording_001\.json: result 2: expected 'alternatives'"):
        trinity.read(take, 16000)
