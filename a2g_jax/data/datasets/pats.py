"""PATS (Ahuja et al. 2020, "Style Transfer for Co-Speech Gesture Animation"): keypoints of 25 speakers' videos.

Layout after the README and ``skeleton.py`` of github.com/chahuja/pats: ``cmu_intervals_df.csv`` (dataset, delta_time,
end_time, interval_id, speaker, start_time, video_fn, video_link), ``processed/<speaker>/<interval>.h5`` and, if
extracted, ``raw/<speaker>_cropped/<interval>.mp3``. ``pose/data`` of an h5 is (T, 104) at 15 frames a second: x of 52
points, then y; point 0 is the neck in pixels, the others are relative to it.

- Read as 49 keypoints relative to the neck, in the order of Speech2Gesture: nose and eyes are dropped
  (``joint_subset``), and so is the neck's position. Gaps (NaN) are bridged for up to half a second.
- **Speech.** The h5 hold log-mels but no samples, and other features cannot be computed from those. PATS' script
  ``youtube2croppedaudio/youtube2audio.py`` makes the mp3; an interval without one raises an error, and so does
  a folder in which no interval has one.
- Words (``text/meta``) are a pickled pandas table and are not read.
- The split is that of the table. The authors leave out the intervals in ``missing_intervals.h5``, which lack some
  feature; they are read here, where only poses and speech are needed.
"""

from pathlib import Path

import numpy as np

from a2g_jax.data.datasets.csv_tables import read_columns
from a2g_jax.data.datasets.keypoints import relative_keypoints
from a2g_jax.data.datasets.layouts import S2G_LAYOUT
from a2g_jax.data.datasets.lookup import SPLIT_NAMES, files_with
from a2g_jax.data.datasets.source import DataSet, Take
from a2g_jax.errors import InputError
from a2g_jax.geometry.pose_track import PoseTrack
from a2g_jax.io.audio import read_audio
from a2g_jax.io.hdf5 import read_hdf5
from a2g_jax.io.sound_file import AUDIO_SUFFIXES
from a2g_jax.io.untrusted import Limits
from a2g_jax.recording import PoseRecording

FPS = 15.0
_TABLE, _POINTS = "cmu_intervals_df.csv", 52
_EXPECTED = f"PATS', with {_TABLE} and processed/<speaker>/<interval>.h5 in it"
_SCRIPT = "make it from the videos with youtube2croppedaudio/youtube2audio.py of github.com/chahuja/pats"
_LIMITS = Limits(size=2**28)


def find(folder: Path) -> list[Take]:
    """A take for each h5, in the order of speakers and intervals; ``folder`` is PATS' ``data`` or its parent."""
    root = folder if (folder / "processed").is_dir() else folder / "data"
    files = files_with(root / "processed", ".h5", f"a folder that is {_EXPECTED}") if root.is_dir() else []
    if not files:
        raise InputError(f"{folder}: has no processed/<speaker>/<interval>.h5; name a folder that is {_EXPECTED}.")
    splits, links = _table(root / _TABLE)
    takes = []
    for path in files:
        speaker, interval = path.parent.name, path.stem
        sounds = [root / "raw" / f"{speaker}_cropped" / f"{interval}{suffix}" for suffix in AUDIO_SUFFIXES]
        sound = next((file for file in sounds if file.is_file()), sounds[-1].with_suffix(".mp3"))
        spec = {"speaker": speaker, "interval": interval, "video": links.get((speaker, interval), "")}
        split = splits.get((speaker, interval), "")
        takes.append(Take(f"{speaker}/{interval}", (str(sound), str(path)), split, spec))
    if not any(Path(take.sources[0]).is_file() for take in takes):
        raise InputError(
            f"{root}: has no speech for any interval: its h5 hold none, and {takes[0].sources[0]} is not there;"
            f" {_SCRIPT}."
        )
    return takes


def _table(path: Path) -> tuple[dict[tuple[str, str], str], dict[tuple[str, str], str]]:
    """Part of the split and link to the video of each speaker and interval."""
    splits: dict[tuple[str, str], str] = {}
    links = {}
    for line, row in read_columns(path, ("dataset", "interval_id", "speaker", "video_link")):
        if row["dataset"] not in SPLIT_NAMES:
            raise InputError(f"{path}, line {line}: expected train, dev or test; got {row['dataset'][:40]!r}.")
        owner, split = (row["speaker"], row["interval_id"]), SPLIT_NAMES[row["dataset"]]
        if splits.setdefault(owner, split) != split:
            raise InputError(f"{path}, line {line}: interval {owner[1]!r} is in two parts of the split; correct it.")
        links[owner] = row["video_link"]
    return splits, links


def read(take: Take, sample_rate: int) -> PoseRecording:
    """Speech and 49 keypoints of an interval.

    Raises:
        InputError: no speech, or the h5 is damaged or has another pose.
    """
    sound, path = take.sources
    if not Path(sound).is_file():
        raise InputError(f"{path}: has no speech, and {sound} is not there; {_SCRIPT}, or leave this interval out.")
    pose = read_hdf5(path, ["pose/data"], limits=_LIMITS)["pose/data"]
    if pose.ndim != 2 or pose.shape[1] != 2 * _POINTS or pose.dtype.kind not in "fiu" or len(pose) < 2:
        raise InputError(
            f"{path}, pose/data: expected numbers of shape (T, {2 * _POINTS}); got {pose.dtype} of shape {pose.shape}."
        )
    points = np.swapaxes(pose.astype(np.float64).reshape(len(pose), 2, _POINTS), 1, 2)
    points[:, 0] = 0.0
    return PoseRecording(
        name=take.name,
        audio=read_audio(sound, sample_rate),
        sample_rate=sample_rate,
        motion=PoseTrack("keypoints", relative_keypoints(points, FPS, f"{path}, pose/data"), S2G_LAYOUT, FPS),
        speaker=take.spec["speaker"],
        sources=take.sources,
        annotations={key: take.spec[key] for key in ("interval", "video") if take.spec[key]},
    )


DATASET = DataSet(
    name="pats",
    title="PATS",
    fps=FPS,
    find=find,
    read=read,
    pose="keypoints",
    about=(
        "From chahuja.com/pats, CC BY-NC 2.0, with the speech of the videos that it lists. cmu_intervals_df.csv, whose"
        " column 'dataset' is the official split, processed/<speaker>/<interval>.h5 and raw/<speaker>_cropped/. Needs"
        " h5py. 49 keypoints in the format of Speech2Gesture."
    ),
)
