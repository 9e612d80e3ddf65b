import pytest
from bvh_trees import check_motion, check_sound, put, write_motion, write_sound

from a2g_jax.data.datasets import genea2023
from a2g_jax.errors import InputError
from a2g_jax.recording import Word

HEADER = "prefix,main-agent_id,main-agent_has_fingers,interloctr_id,interloctr_has_fingers\n"
ROWS = {
    "trn_2023_v0_000": "07,fingers_incl,12,fingers_excl",
    "trn_2023_v0_001": "12,fingers_excl,07,fingers_incl",
    "val_2023_v0_000": "02,fingers_incl,03,fingers_incl",
    "tst_2023_v0_000": "02,fingers_incl,07,fingers_incl",
}
ROLES = ("main-agent", "interloctr")


def write_release(root, test_motion=False, seconds=2.0):
    result = {}
    for dyad, row in ROWS.items():
        split = dyad[:3]
        table = root / split / "metadata.csv"
        put(table, (table.read_text() if table.exists() else HEADER) + f"{dyad},{row}\n")
        for role in ROLES:
            name, seed = f"{dyad}_{role}", len(result)
            folder, motion = root / split / role, None
            if split != "tst" or test_motion or role == "interloctr":
                motion = write_motion(folder / "bvh" / f"{name}.bvh", "talking_with_hands", seconds, 30.0, seed)
            result[name] = motion, write_sound(folder / "wav" / f"{name}.wav", seconds, 16000, seed)
            put(folder / "tsv" / f"{name}.tsv", f"0.5\t0.75\tword{seed}\n")
    return result


@pytest.mark.filterwarnings("ignore:.*no motion")
def test_both_speakers_are_what_was_written(tmp_path):
    written = write_release(tmp_path)
    takes = genea2023.find(tmp_path)
    expected = sorted(set(written) - {"tst_2023_v0_000_main-agent"}, key=lambda name: (name[:15], "inter" in name))
    assert [take.name for take in takes] == expected
    for take in takes:
        recording = genea2023.read(take, 16000)
        motion, sound = written[take.name]
        check_motion(recording.motion, motion)
        check_sound(recording.audio, sound)
        assert recording.words == (Word(f"word{list(written).index(take.name)}", 0.5, 0.75),)
        assert take.split == {"trn": "train", "val": "validation", "tst": "test"}[take.name[:3]]
    first, second = genea2023.read(takes[0], 16000), genea2023.read(takes[1], 16000)
    assert (first.name, first.speaker, second.name, second.speaker) == (
        "trn_2023_v0_000_main-agent", "07", "trn_2023_v0_000_interloctr", "12",
    )  # fmt: skip
    assert first.annotations == {
        "role": "main-agent", "partner": second.name, "partner_speaker": "12", "fingers": True,
    }  # fmt: skip
    assert second.annotations == {
        "role": "interloctr", "partner": first.name, "partner_speaker": "07", "fingers": False,
    }  # fmt: skip


def test_main_agents_of_the_test_set(tmp_path):
    write_release(tmp_path, seconds=0.1)
    with pytest.warns(
        UserWarning, match="1 test recordings have no motion and are left out: tst_2023_v0_000_main-agent"
    ):
        assert "tst_2023_v0_000_interloctr" in [take.name for take in genea2023.find(tmp_path)]
    write_release(tmp_path / "later", test_motion=True, seconds=0.1)
    assert len(genea2023.find(tmp_path / "later")) == 8


def test_a_speaker_who_says_nothing(tmp_path):
    write_release(tmp_path, seconds=0.1)
    put(tmp_path / "val" / "main-agent" / "tsv" / "val_2023_v0_000_main-agent.tsv", "")
    assert genea2023.read(genea2023.find(tmp_path / "val")[0], 16000).words == ()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("no table", "holds no metadata table"),
        ("no row", r"val_2023_v0_000_\S+: has no row in metadata\.csv"),
        ("a row more", r"metadata\.csv, line 3: there is no file of val_2023_v0_009"),
        ("no partner", r"val_2023_v0_000_main-agent\.bvh: there is no file of val_2023_v0_000_interloctr, the other"),
        ("no audio", r"val_2023_v0_000_main-agent\.bvh: has no WAV file"),
        ("no motion", r"val_2023_v0_000_main-agent\.tsv: has no BVH file"),
    ],
)
def test_what_is_missing(tmp_path, change, message):
    write_release(tmp_path, seconds=0.1)
    root = tmp_path / "val"
    table, dyad = root / "metadata.csv", "val_2023_v0_000"
    if change == "no table":
        table.unlink()
    elif change == "no row":
        put(table, HEADER + f"val_2023_v0_009,{ROWS[dyad]}\n")
    elif change == "a row more":
        put(table, table.read_text() + f"val_2023_v0_009,{ROWS[dyad]}\n")
    elif change == "no partner":
        for suffix in ("bvh", "wav", "tsv"):
            (root / "interloctr" / suffix / f"{dyad}_interloctr.{suffix}").unlink()
    else:
        suffix = {"no audio": "wav", "no motion": "bvh"}[change]
        (root / "main-agent" / suffix / f"{dyad}_main-agent.{suffix}").unlink()
    with pytest.raises(InputError, match=message):
        genea2023.find(root)


def test_other_folders(tmp_path):
    put(tmp_path / "trn" / "bvh" / "trn_2022_v1_000.bvh", "x")
    with pytest.raises(
        InputError, match=r"holds no recordings of the GENEA Challenge 2023; name the folder that holds"
    ):
        genea2023.find(tmp_path)
