"""TED-Expressive (Liu et al. 2022, "Learning Hierarchical Cross-Modal Association for Co-Speech Gesture Generation").

TED's talks with fingers: 43 joints fitted by ExPose, read as the unit directions of 42 bones (126 values) in the axes
of the camera: y down, the speaker's left at +x, z away from the camera. Two layouts:

- LMDB databases as in TED Gesture (:mod:`~a2g_jax.data.datasets.ted_lmdb`), with their official split.
- One ``.npz`` a clip, as published by others: ``dir_vec`` (N, 126), ``audio`` (int16), ``sr``, ``fps`` (15 where it
  is missing) and ``sentence``, which has no times and is kept in ``annotations``. They have no official split. A name
  of the 11 characters of a YouTube video and three numbers gives the talk, which serves as the speaker.
"""

import re
from pathlib import Path

import numpy as np

from a2g_jax.data.datasets.directions import unit_directions
from a2g_jax.data.datasets.layouts import TED_EXPRESSIVE_LAYOUT
from a2g_jax.data.datasets.lookup import check_folder, files_with
from a2g_jax.data.datasets.samples import speech_samples
from a2g_jax.data.datasets.smplx import float_array
from a2g_jax.data.datasets.source import DataSet, Take
from a2g_jax.data.datasets.ted_lmdb import databases, find_clips, read_clip
from a2g_jax.errors import InputError
from a2g_jax.geometry.pose_track import PoseTrack
from a2g_jax.io.untrusted import Limits, read_npz
from a2g_jax.recording import PoseRecording

FPS = 15.0
_EXPECTED = (
    "TED-Expressive's, with lmdb_train, lmdb_val and lmdb_test (each with a data.mdb) or with one .npz a clip in it"
)
_VIDEO = re.compile(r"([\w-]{11})_\d+_\d+_\d+")
_LIMITS = Limits(size=2**28)
#: Tolerance of the length of a direction; vectors with the mean subtracted exceed it.
_ROUNDING = 0.01


def find(folder: Path) -> list[Take]:
    """A take for each clip of each video, or for each npz."""
    check_folder(folder, f"a folder that is {_EXPECTED}")
    takes = find_clips(databases(folder))
    if not takes:
        files = files_with(folder, ".npz", _EXPECTED)
        takes = [Take(path.relative_to(folder).with_suffix("").as_posix(), (str(path),)) for path in files]
    if not takes:
        raise InputError(f"{folder}: has no clips; name a folder that is {_EXPECTED}.")
    return takes


def read(take: Take, sample_rate: int) -> PoseRecording:
    """Speech, words (of LMDB clips) and directions of 42 bones.

    Raises:
        InputError: damaged, an array missing or of another shape, or directions that are not unit vectors.
    """
    if "key" in take.spec:
        return read_clip(take, sample_rate, TED_EXPRESSIVE_LAYOUT)
    path = take.sources[0]
    arrays = read_npz(path, limits=_LIMITS)
    missing = [name for name in ("dir_vec", "audio", "sr") if name not in arrays]
    if missing:
        raise InputError(f"{path}: has no array {missing[0]!r}; expected a clip with 'dir_vec', 'audio' and 'sr'.")
    bones = len(TED_EXPRESSIVE_LAYOUT.bones)
    vectors = float_array(arrays["dir_vec"], ((bones, 3), (3 * bones,)), f"{path}, dir_vec")
    if len(vectors) < 2:
        raise InputError(f"{path}, dir_vec: has {len(vectors)} frames; expected two or more.")
    length = np.linalg.norm(vectors, axis=-1)
    wrong = np.isfinite(length) & (length > _ROUNDING) & (np.abs(length - 1.0) > _ROUNDING)
    if wrong.any():
        frame, bone = (int(at) for at in np.argwhere(wrong)[0])
        raise InputError(
            f"{path}, dir_vec, frame {frame}: bone {bone} has length {length[frame, bone]:.3f}; expected unit vectors"
            " (was the mean direction subtracted? Add it again)."
        )
    rate = _number(arrays["sr"], 1e3, 1e6, f"{path}, sr")
    fps = _number(arrays["fps"], 1.0, 240.0, f"{path}, fps") if "fps" in arrays else FPS
    sentence = str(arrays["sentence"]) if arrays.get("sentence", np.array(0)).dtype.kind == "U" else ""
    video = _VIDEO.fullmatch(Path(path).stem)
    return PoseRecording(
        name=take.name,
        audio=speech_samples(arrays["audio"], round(rate), sample_rate, f"{path}, audio"),
        sample_rate=sample_rate,
        motion=PoseTrack("directions", unit_directions(vectors, fps, f"{path}, dir_vec"), TED_EXPRESSIVE_LAYOUT, fps),
        speaker=video.group(1) if video else "",
        sources=take.sources,
        annotations={"sentence": " ".join(sentence.split())} if sentence else {},
    )


def _number(array: np.ndarray, lowest: float, highest: float, place: str) -> float:
    if array.size == 1 and array.dtype.kind in "iuf" and lowest <= float(array.reshape(-1)[0]) <= highest:
        return float(array.reshape(-1)[0])
    raise InputError(f"{place}: expected a number from {lowest:g} to {highest:g}; download the clip again.")


DATASET = DataSet(
    name="ted-expressive",
    title="TED-Expressive",
    fps=FPS,
    find=find,
    read=read,
    pose="directions",
    about=(
        "From github.com/alvinliu0/HA2G; the talks are TED's (CC BY-NC-ND 4.0). LMDB databases lmdb_train, lmdb_val and"
        " lmdb_test, which are the official split, or one .npz a clip. 42 bone directions, with fingers."
    ),
)
