import json
import shutil

import numpy as np
import pytest
from bvh_trees import TREES, check_motion, check_sound, put, tree, write_motion, write_sound

from a2g_jax.data.datasets import zeroeggs
from a2g_jax.data.datasets.zeroeggs_original import times
from a2g_jax.errors import InputError

HEADER = (
    "audio_filename,audio_start_time,audio_end_time,audio_duration,audio_clap_time,anim_fbx_file,anim_start_time,"
    "anim_end_time,anim_duration,anim_clap_time,style,capture_session,acting_start_time,acting_end_time,anim_bvh,"
    "validation\n"
)
# The audio starts 0.5 s before the motion, and the acting 0.5 s after it; frames of the audio's times are 30ths.
TIMES = "09:28:00:15,09:28:04:00,00:00:03:15,,20210604.fbx,09:28:01:00,09:28:03:30,00:00:02:30,No Clapping"


def row(name, style, validation, audio=None):
    audio = audio or f"{name.removesuffix('_mirror')}.wav"
    return f"{audio},{TIMES},{style},2,09:28:01:30   ,09:28:03:00,{name}.bvh,{validation}\n"


INFO = (
    HEADER
    + row("001_Neutral_0", "Neutral", "FALSE")
    + row("001_Neutral_0_mirror", "Neutral", "FALSE")
    + row("005_Sad_4", "Sad", "TRUE")
    + row("005_Sad_4_mirror", "Sad", "TRUE")
)
NAMES = ("001_Neutral_0", "001_Neutral_0_mirror", "005_Sad_4", "005_Sad_4_mirror")


def write_clean(root, names=NAMES, seconds=2.0):
    result = {}
    for name in names:
        stem, seed = f"{name}_x_1_0", len(result)
        motion = write_motion(root / "clean" / f"{stem}.bvh", "zeroeggs", seconds, 60.0, seed)
        result[stem] = motion, write_sound(root / "clean" / f"{stem}.wav", seconds, 16000, seed)
    return result


def write_original(root, seconds=2.5, fps=60.0):
    folder, result = root / "original", {}
    for name in NAMES:
        result[name] = write_motion(folder / f"{name}.bvh", "zeroeggs", seconds, fps, len(result))
    sounds = {name: write_sound(folder / f"{name}.wav", 3.5, 48000, 9) for name in ("001_Neutral_0", "005_Sad_4")}
    put(root / "info.csv", INFO)
    return result, sounds


def test_clean_takes_are_what_was_written(tmp_path):
    root = tmp_path / "data"
    written = write_clean(root)
    put(root / "info.csv", "\ufeff" + INFO.replace("\n", "\r\n"))
    put(root / "clean" / ".DS_Store", b"\0")
    for folder in (tmp_path, root, root / "clean"):
        takes = zeroeggs.find(folder)
        assert [take.name for take in takes] == sorted(written)
        assert [take.split for take in takes] == ["train", "train", "validation", "validation"]
    for take in takes:
        recording = zeroeggs.read(take, 16000)
        motion, sound = written[take.name]
        assert len(motion.names) == 75
        check_motion(recording.motion, motion)
        check_sound(recording.audio, sound)
        assert recording.annotations == {
            "style": "Neutral" if "Neutral" in take.name else "Sad", "mirrored": "mirror" in take.name, "session": "2",
        }  # fmt: skip
        assert (recording.speaker, recording.emotion, recording.words) == ("zeroeggs", "", ())


def test_clean_takes_without_a_table_or_their_mirrors(tmp_path):
    write_clean(tmp_path, ["001_Neutral_0", "005_Sad_4"], seconds=0.1)
    shutil.copy(tmp_path / "clean" / "005_Sad_4_x_1_0.bvh", tmp_path / "clean" / "005_Sad_4_x_0_9.bvh")
    shutil.copy(tmp_path / "clean" / "005_Sad_4_x_1_0.wav", tmp_path / "clean" / "005_Sad_4_x_0_9.wav")
    takes = zeroeggs.find(tmp_path)
    assert [take.split for take in takes] == [""] * 3
    assert [take.spec["annotations"] for take in takes] == [
        {"style": "Neutral", "mirrored": False},
        {"style": "Sad", "mirrored": False, "stretch": 0.9},
        {"style": "Sad", "mirrored": False},
    ]
    put(tmp_path / "info.csv", INFO)
    assert [take.split for take in zeroeggs.find(tmp_path)] == ["train", "validation", "validation"]


@pytest.mark.parametrize("fps", [60.0, 30.0])
def test_original_takes_are_cut_to_the_acting(tmp_path, fps):
    motions, sounds = write_original(tmp_path / "data", fps=fps)
    frames = slice(round(0.5 * fps), round(2 * fps))
    takes = zeroeggs.find(tmp_path)
    assert [(take.name, take.split) for take in takes] == list(
        zip(NAMES, ["train", "train", "validation", "validation"], strict=True)
    )
    for take in takes:
        recording = zeroeggs.read(take, 48000)
        assert len(recording.audio) == 72000
        np.testing.assert_allclose(recording.motion.positions(), motions[take.name].positions[frames], atol=2e-5)
        check_sound(recording.audio, sounds[take.name.removesuffix("_mirror")][48000:120000])
        assert recording.annotations["mirrored"] == take.name.endswith("_mirror")
        assert json.loads(json.dumps(take.spec)) == take.spec


def test_the_experimenter_is_silenced(tmp_path):
    _, sounds = write_original(tmp_path)
    put(tmp_path / "original" / "005_Sad_4.csv", "#,Name,Start,End\nM1,x,0:00.000,0:03.000\nR1,x,0:01.500,0:01.750\n")
    recording = zeroeggs.read(zeroeggs.find(tmp_path)[2], 48000)
    acted = np.zeros(72000, np.float32)
    acted[24000:36000] = sounds["005_Sad_4"][72000:84000]
    check_sound(recording.audio, acted)


def test_clean_is_taken_where_both_are(tmp_path):
    write_original(tmp_path, seconds=0.1)
    written = write_clean(tmp_path, seconds=0.1)
    assert [take.name for take in zeroeggs.find(tmp_path)] == sorted(written)
    assert [take.name for take in zeroeggs.find(tmp_path / "original")] == list(NAMES)


def test_timecodes():
    cells = {
        "audio_start_time": "09:28:00:01", "anim_start_time": "09:28:03:35", "acting_start_time": "09:28:15:21",
        "acting_end_time": "10:30:16:47",
    }  # fmt: skip
    assert times("x", cells) == {"audio": 15 * 60 + 21 - 2, "motion": 12 * 60 - 14, "length": 3721 * 60 + 26}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "09:28:01:30   ",
            "09:28:01",
            r"info\.csv, line 2: acting_start_time: expected a time HH:MM:SS:FF of 60 frames",
        ),
        ("09:28:00:15", "09:28:00:30", "line 2: audio_start_time: expected a time HH:MM:SS:FF of 30 frames"),
        ("09:28:03:00", "09:28:01:30", "line 2: acting_end_time is not after acting_start_time"),
        ("09:28:01:30   ", "09:28:00:59", "line 2: the acting starts before the audio or the motion"),
        ("FALSE", "perhaps", "line 2: validation: expected TRUE or FALSE; got 'perhaps'"),
        ("anim_bvh", "bvh", r"info\.csv, line 1: has no column 'anim_bvh'"),
        (",FALSE", "", r"info\.csv, line 2: expected 16 cells, as the header has; got 15"),
        ("005_Sad_4.bvh", "009_Sad_4.bvh", r"005_Sad_4\.(bvh|wav): has no row|line 4: there is no file 009_Sad_4\.bvh"),
        ("005_Sad_4.wav", "009_Sad_4.wav", r"there is no file 009_Sad_4\.wav; add it or remove the row"),
        ("005_Sad_4.bvh", "001_Neutral_0.bvh", "line 4: 001_Neutral_0 is in .*line 2 already"),
    ],
)
def test_damaged_tables(tmp_path, old, new, message):
    write_original(tmp_path, seconds=0.1)
    put(tmp_path / "info.csv", INFO.replace(old, new))
    with pytest.raises(InputError, match=message):
        zeroeggs.find(tmp_path)


def test_what_is_missing(tmp_path):
    write_original(tmp_path, seconds=0.1)
    (tmp_path / "info.csv").rename(tmp_path / "other.csv")
    with pytest.raises(InputError, match=r"holds no info\.csv, which says where the original takes start"):
        zeroeggs.find(tmp_path)
    write_clean(tmp_path, seconds=0.1)
    (tmp_path / "clean" / "005_Sad_4_x_1_0.wav").unlink()
    with pytest.raises(InputError, match=r"005_Sad_4_x_1_0\.bvh: has no WAV file of the same name"):
        zeroeggs.find(tmp_path / "clean")
    (tmp_path / "clean" / "005_Sad_4_x_1_0.bvh").unlink()
    (tmp_path / "other.csv").rename(tmp_path / "info.csv")
    with pytest.raises(InputError, match=r"info\.csv, line 4: there is no file of 005_Sad_4; add it or remove the row"):
        zeroeggs.find(tmp_path / "clean")
    put(tmp_path / "info.csv", HEADER)
    put(tmp_path / "info.csv", HEADER + row("001_Neutral_0", "Neutral", "FALSE"))
    with pytest.raises(InputError, match=r"001_Neutral_0_mirror_x_1_0\.\w+: has no row in info\.csv"):
        zeroeggs.find(tmp_path / "clean")


@pytest.mark.parametrize("files", [[], ["clean/a.bvh", "clean/a.wav"], ["067_Speech_2_x_1_0.json"]])
def test_wrong_folders(tmp_path, files):
    for name in files:
        put(tmp_path / name, "x")
    with pytest.raises(InputError, match="holds no takes of ZeroEGGS; name the folder data of ZeroEGGS"):
        zeroeggs.find(tmp_path)
    with pytest.raises(InputError, match="is not a folder; name the folder data of ZeroEGGS"):
        zeroeggs.find(tmp_path / "nowhere")


def test_acting_after_the_end(tmp_path):
    write_original(tmp_path, seconds=0.25)
    with pytest.raises(
        InputError, match=r"001_Neutral_0\.bvh: lasts 0\.25 s, and the acting starts at 0\.50 s; correct info\.csv"
    ):
        zeroeggs.read(zeroeggs.find(tmp_path)[0], 16000)


def test_real_take(shared, tmp_path):
    (tmp_path / "clean").mkdir()
    for path in (shared / "zeggs").iterdir():
        (tmp_path / "clean" / path.name).symlink_to(path)
    audio = "067_Speech_2.wav,11:33:48:20,11:35:17:13   ,00:01:28:23   ,,20210826_058_Speech_2_01.fbx,11:33:48:21,"
    rest = "11:35:11:02,00:01:22:41,11:33:54:17,Speech,2,11:34:00:10,11:35:09:00,067_Speech_2.bvh,TRUE\n"
    put(tmp_path / "info.csv", HEADER + audio + rest)
    (take,) = zeroeggs.find(tmp_path)
    assert (take.name, take.split) == ("067_Speech_2_x_1_0", "validation")
    recording = zeroeggs.read(take, 16000)
    assert recording.annotations == {"style": "Speech", "mirrored": False, "session": "2"}
    assert recording.motion.skeleton.names == tree(TREES["zeroeggs"])[0]
    # The cut by info.csv is as long as the clean take: 68 s and 50 sixtieths.
    assert recording.motion.seconds == pytest.approx(68 + 50 / 60, abs=0.04)
    assert len(recording.audio) / 16000 == pytest.approx(68 + 50 / 60, abs=0.04)
