import pytest
from bvh_trees import check_motion, check_sound, put, write_motion, write_sound

from a2g_jax.data.datasets import genea2022
from a2g_jax.errors import InputError
from a2g_jax.recording import Word

TSV = "0.2\t0.55\tYeah.\r\n0.55\t1.319\tI am\r\n1.5\t1.75\t#laughter\r\n"
WORDS = (Word("Yeah.", 0.2, 0.55), Word("I am", 0.55, 1.319), Word("#laughter", 1.5, 1.75))
ROWS = {"trn": ["000,finger_incl,1", "001,finger_excl,17"], "val": ["000,finger_incl,17"], "tst": ["000,finger_incl,3"]}
TABLES = {"trn": "trn_2022_v1_metadata.csv", "val": "val_metadata.csv", "tst": "tst_metadata.csv"}


def write_release(root, test_motion=True, seconds=2.0):
    result = {}
    for split, rows in ROWS.items():
        put(root / split / TABLES[split], "".join(f"{split}_2022_v1_{row}\r\n" for row in rows))
        for row in rows:
            name = f"{split}_2022_v1_{row[:3]}"
            motion, seed = None, len(result)
            if split != "tst" or test_motion:
                motion = write_motion(root / split / "bvh" / f"{name}.bvh", "talking_with_hands", seconds, 30.0, seed)
            result[name] = motion, write_sound(root / split / "wav" / f"{name}.wav", seconds, 16000, seed)
            put(root / split / "tsv" / f"{name}.tsv", TSV)
    return result


def test_recordings_are_what_was_written(tmp_path):
    written = write_release(tmp_path / "dataset_v1")
    put(tmp_path / "dataset_v1" / "trn" / "._trn_2022_v1_metadata.csv", b"\0")
    for folder in (tmp_path, tmp_path / "dataset_v1"):
        takes = genea2022.find(folder)
        assert [(take.name, take.split) for take in takes] == [
            ("trn_2022_v1_000", "train"),
            ("trn_2022_v1_001", "train"),
            ("tst_2022_v1_000", "test"),
            ("val_2022_v1_000", "validation"),
        ]
    speakers = {"trn_2022_v1_000": "1", "trn_2022_v1_001": "17", "tst_2022_v1_000": "3", "val_2022_v1_000": "17"}
    for take in takes:
        recording = genea2022.read(take, 16000)
        motion, sound = written[take.name]
        assert len(motion.names) == 83
        check_motion(recording.motion, motion)
        check_sound(recording.audio, sound)
        assert (recording.words, recording.speaker) == (WORDS, speakers[take.name])
        assert recording.annotations == {"fingers": take.name != "trn_2022_v1_001"}


def test_one_part_and_folders_within_folders(tmp_path):
    write_release(tmp_path / "all", seconds=0.1)
    assert [take.name for take in genea2022.find(tmp_path / "all" / "val")] == ["val_2022_v1_000"]
    (tmp_path / "zip" / "val").mkdir(parents=True)
    (tmp_path / "all" / "val").rename(tmp_path / "zip" / "val" / "val")
    assert [take.name for take in genea2022.find(tmp_path / "zip")] == ["val_2022_v1_000"]


def test_a_speaker_who_says_nothing(tmp_path):
    write_release(tmp_path, seconds=0.1)
    put(tmp_path / "val" / "tsv" / "val_2022_v1_000.tsv", "")
    assert genea2022.read(genea2022.find(tmp_path / "val")[0], 16000).words == ()


def test_test_set_without_motion(tmp_path):
    write_release(tmp_path, test_motion=False, seconds=0.1)
    with pytest.warns(UserWarning, match=r"1 test recordings have no motion and are left out: tst_2022_v1_000"):
        assert {take.split for take in genea2022.find(tmp_path)} == {"train", "validation"}
    with (
        pytest.warns(UserWarning, match="left out"),
        pytest.raises(InputError, match="none of its 1 recordings has motion"),
    ):
        genea2022.find(tmp_path / "tst")


@pytest.mark.parametrize("text", ["\ufeffname,fingers,speaker\nval_2022_v1_000, finger_incl , 17 \n\n"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_tables_with_headers_marks_and_spaces(tmp_path, text, encoding):
    write_release(tmp_path, seconds=0.1)
    content = text if encoding == "utf-8" else text.removeprefix("\ufeff")
    put(tmp_path / "val" / "val_metadata.csv", content.encode(encoding))
    (take,) = genea2022.find(tmp_path / "val")
    assert take.spec == {"speaker": "17", "annotations": {"fingers": True}}


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("", "holds no metadata table, such as metadata.csv"),
        ("val_2022_v1_001,finger_incl,3\n", r"val_2022_v1_000\.bvh: has no row in val_metadata\.csv"),
        (
            "val_2022_v1_000,finger_incl,3\nval_2022_v1_001,finger_incl,3\n",
            r"val_metadata\.csv, line 2: there is no file of val_2022_v1_001; add it or remove the row",
        ),
        (
            "val_2022_v1_000,finger_incl\n",
            r"val_metadata\.csv, line 1: expected name, finger_incl or finger_excl, speak",
        ),
        ("val_2022_v1_000,maybe,3\n", "line 1: expected fingers_incl or fingers_excl; got 'maybe'"),
        ("val_2022_v1_000,finger_incl,3\nsomething,finger_incl,3\n", r"line 2: expected name, .*; got 'something"),
        ("val_2022_v1_000,finger_incl,3\n" * 2, r"line 2: val_2022_v1_000 is in .*line 1 already"),
        (b"val_2022_v1_000,finger_incl,\xff\xfe", r"val_metadata\.csv: is not UTF-8 text"),
        (b"val_2022_v1_000,finger_incl,3\0", "is binary, not text"),
        ('val_2022_v1_000,finger_incl,"3\n', "line 1: is damaged|line 2: is damaged"),
    ],
)
def test_damaged_tables(tmp_path, table, message):
    write_release(tmp_path, seconds=0.1)
    put(tmp_path / "val" / "val_metadata.csv", table)
    with pytest.raises(InputError, match=message):
        genea2022.find(tmp_path / "val")


@pytest.mark.parametrize("lost", ["wav", "tsv", "bvh"])
def test_missing_partners(tmp_path, lost):
    write_release(tmp_path, seconds=0.1)
    (tmp_path / "trn" / lost / f"trn_2022_v1_001.{lost}").unlink()
    with pytest.raises(InputError, match=rf"trn_2022_v1_001\.\w+: has no {lost.upper()} file of the same name"):
        genea2022.find(tmp_path)


def test_other_folders(tmp_path):
    put(tmp_path / "trn" / "main-agent" / "bvh" / "trn_2023_v0_000_main-agent.bvh", "x")
    with pytest.raises(
        InputError, match="holds no recordings of the GENEA Challenge 2022; name the folder that holds trn"
    ):
        genea2022.find(tmp_path)
