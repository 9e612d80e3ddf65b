"""TED Gesture (Yoon et al. 2019; 2020, "Speech Gesture Generation from the Trimodal Context"): upper bodies in talks.

Layout and times: :mod:`~a2g_jax.data.datasets.ted_lmdb`. 10 joints, read as the unit directions of 9 bones (27 values)
in the axes of the file: y down, the speaker's left at -x. Nothing is subtracted; the authors' code subtracts the mean
direction when it cuts its samples. Gaps of up to half a second without a skeleton are bridged.
"""

from pathlib import Path

from a2g_jax.data.datasets.layouts import TED_LAYOUT
from a2g_jax.data.datasets.lookup import check_folder
from a2g_jax.data.datasets.source import DataSet, Take
from a2g_jax.data.datasets.ted_lmdb import databases, find_clips, read_clip
from a2g_jax.errors import InputError
from a2g_jax.recording import PoseRecording

_EXPECTED = "TED Gesture's, with lmdb_train, lmdb_val and lmdb_test (each with a data.mdb) in it"


def find(folder: Path) -> list[Take]:
    """A take for each clip of each video."""
    check_folder(folder, f"a folder that is {_EXPECTED}")
    takes = find_clips(databases(folder))
    if not takes:
        raise InputError(f"{folder}: has no LMDB database with clips; name a folder that is {_EXPECTED}.")
    return takes


def read(take: Take, sample_rate: int) -> PoseRecording:
    """Speech, words and directions of 9 bones."""
    return read_clip(take, sample_rate, TED_LAYOUT)


DATASET = DataSet(
    name="ted",
    title="TED Gesture",
    fps=15.0,
    find=find,
    read=read,
    pose="directions",
    about=(
        "From github.com/ai4r/Gesture-Generation-from-Trimodal-Context; the talks are TED's (CC BY-NC-ND 4.0). LMDB"
        " databases lmdb_train, lmdb_val and lmdb_test, which are the official split. 9 bone directions."
    ),
)
