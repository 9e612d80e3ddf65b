"""BEAT2 (Liu et al. 2024, "EMAGE"): BEAT as SMPL-X parameters at 30 frames a second.

Layout: ``beat_<language>_v2.0.0/{smplxflame_30/<id>.npz, wave16k/<id>.wav, textgrid/<id>.TextGrid, sem/<id>.txt}`` and
``train_test_split.csv`` (``id,type``), as EMAGE's ``beat_sep.py`` opens them. The 55 joints of ``poses`` are 22 of the
body, jaw, two eyes, 15 of the left and 15 of the right hand (issue 133 of PantoMatrix).

How they are read:

- A motion of 52 joints, body and fingers. Expressions and jaw are left out; ``annotations["face"]`` counts them.
- Rotations are exact; ``betas`` are ignored and bones are those of the talker's average adult, so positions are
  approximate (:mod:`~a2g_jax.data.datasets.smplx`). Finger rotations are relative to flat hands, not to a mean hand:
  on the recording 2_scott_0_1_1 they bend fingers as the BVH of BEAT does.
- The world is y-up and the body looks along z, as in that recording; nothing is turned.
- ``additional`` in the table is for training: EMAGE adds it to the training set or leaves it out.
"""

import re
from pathlib import Path

import numpy as np

from a2g_jax.data.datasets.beat_take import emotion, read_semantics
from a2g_jax.data.datasets.csv_tables import read_columns
from a2g_jax.data.datasets.lookup import SPLIT_NAMES, check_folder, files_with, unique_names
from a2g_jax.data.datasets.smplx import BODY, HANDS, float_array, smplx_motion
from a2g_jax.data.datasets.source import DataSet, Take
from a2g_jax.data.datasets.word_times import words_of_audio
from a2g_jax.errors import InputError
from a2g_jax.io.audio import read_audio
from a2g_jax.io.untrusted import read_npz
from a2g_jax.recording import Recording

FPS = 30.0
_POSES, _SPLIT = "smplxflame_30", "train_test_split.csv"
_EXPECTED = f"BEAT2's, with {_POSES}/<id>.npz, wave16k/<id>.wav and {_SPLIT} in it"
_TYPES = {**SPLIT_NAMES, "additional": "train"}
#: Speaker, type, first and last sequence number, as in BEAT.
_NAME = re.compile(r"\d+_([^_]+)_(\d)_(\d{1,4})_(\d{1,4})")
_ARRAYS = ("poses", "trans", "expressions", "mocap_frame_rate")


def find(folder: Path) -> list[Take]:
    """A take for each npz, by language and id; ``folder`` is one language or holds several."""
    check_folder(folder, f"a folder that is {_EXPECTED}")
    languages = [folder] if (folder / _POSES).is_dir() else sorted(path.parent for path in folder.glob(f"*/{_POSES}"))
    takes = [take for language in languages for take in _takes(language)]
    if not takes:
        raise InputError(f"{folder}: has no {_POSES}/ with .npz files; name a folder that is {_EXPECTED}.")
    if not any(Path(take.sources[1]).is_file() for take in takes):
        raise InputError(f"{folder}: has no wave16k/ with .wav files of the same names; download BEAT2's audio too.")
    return unique_names(takes)


def _takes(language: Path) -> list[Take]:
    splits: dict[str, str] = {}
    table = language / _SPLIT
    if table.exists():
        for line, row in read_columns(table, ("id", "type")):
            if row["type"] not in _TYPES:
                raise InputError(f"{table}, line {line}: expected {', '.join(_TYPES)}; got {row['type'][:40]!r}.")
            splits[row["id"]] = _TYPES[row["type"]]
    takes = []
    for path in files_with(language / _POSES, ".npz", _EXPECTED):
        files = [path, language / "wave16k" / f"{path.stem}.wav"]
        extra = (language / "textgrid" / f"{path.stem}.TextGrid", language / "sem" / f"{path.stem}.txt")
        files += [file for file in extra if file.is_file()]
        takes.append(Take(path.stem, tuple(str(file) for file in files), splits.get(path.stem, "")))
    return takes


def read(take: Take, sample_rate: int) -> Recording:
    """Speech, words, the motion of body and fingers, and annotations.

    Raises:
        InputError: a file is missing or damaged, or an array has another shape or rate than BEAT2's.
    """
    path, sound, *extra = take.sources
    grid, meanings = (next((file for file in extra if file.endswith(end)), "") for end in (".TextGrid", ".txt"))
    arrays = read_npz(path, _ARRAYS)
    poses = float_array(arrays["poses"], ((55, 3), (165,)), f"{path}, poses")
    trans = float_array(arrays["trans"], ((3,),), f"{path}, trans")
    if len(trans) != len(poses):
        raise InputError(f"{path}, trans: has {len(trans)} frames; 'poses' has {len(poses)}.")
    rate = arrays["mocap_frame_rate"]
    if rate.size != 1 or rate.dtype.kind not in "iuf" or not 1 <= float(rate.reshape(-1)[0]) <= 1000:
        raise InputError(f"{path}, mocap_frame_rate: expected frames a second, such as 30; download the file again.")
    motion = smplx_motion(
        np.concatenate([poses[:, BODY], poses[:, HANDS]], axis=1), trans, float(rate.reshape(-1)[0]), path
    )
    face = arrays["expressions"].shape[-1] if arrays["expressions"].ndim == 2 else 0
    annotations: dict = {"face": {"expressions": int(face), "jaw": True}}
    if meanings:
        annotations["semantic"] = read_semantics(Path(meanings))
    match = _NAME.fullmatch(Path(path).stem)
    audio = read_audio(sound, sample_rate)
    return Recording(
        name=take.name,
        audio=audio,
        sample_rate=sample_rate,
        motion=motion,
        words=words_of_audio(grid, len(audio) / sample_rate) if grid else (),
        speaker=match[1] if match else "",
        emotion=emotion(int(match[2]), int(match[3]), int(match[4])) if match else "",
        sources=take.sources,
        annotations=annotations,
    )


DATASET = DataSet(
    name="beat2",
    title="BEAT2",
    fps=FPS,
    find=find,
    read=read,
    about=(
        "From github.com/PantoMatrix/PantoMatrix, CC BY-NC 4.0. A folder such as beat_english_v2.0.0 with"
        " smplxflame_30/, wave16k/, textgrid/, sem/ and train_test_split.csv, which is the official split."
        " 52 joints, with fingers."
    ),
)
