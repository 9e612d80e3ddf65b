"""Speech2Gesture (Ginosar et al. 2019, "Learning Individual Styles of Conversational Gesture"): keypoints of videos.

Layout after ``extract_data_for_training.py``: ``train.csv`` (dataset, start, end, interval_id, pose_fn, audio_fn,
video_fn, speaker) and ``<speaker>/train/npz/<interval>-<start>-<end>.npz`` with ``pose`` (64, 2, 49 or 52) in pixels
and ``audio`` at 16 kHz, from the time of the first frame to that of the last one. Without the table, any folder of such
windows is read: the interval and the times from their names (colons may be underscores), the speaker from the folder
above ``train``, and no split. Windows named ``<interval>-<first frame>.npz`` are read too, at 15 frames a second.

Windows of an interval start 5 frames apart and share most of their frames: split one by one, the same second would be
in training and in test. Therefore the windows of an interval are joined into one recording:

- They are sorted by time. Only about every sixth is opened: the last one that still shares half of its frames with
  the one before.
- Shared frames must be equal at the shift that the times give (within one frame), else an error is raised.
- Where windows are missing, a new recording begins (``<interval>-part2``), which shares no frame with the others. The
  same holds where frames are missing: windows that last longer than others of their interval are left out, since
  poses and speech would be out of step.
- Audio is placed by the times; it ends with the last window's, a frame earlier than the poses.

Keypoints are 49, relative to point 0 (of 52, nose and eyes are dropped, as in ``get_pose``); gaps (NaN) are bridged for
up to half a second. The table has training and dev windows only; the test set is cut from videos by other code.
"""

import re
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from a2g_jax.data.datasets.gaps import rate_of
from a2g_jax.data.datasets.keypoints import relative_keypoints
from a2g_jax.data.datasets.layouts import S2G_LAYOUT
from a2g_jax.data.datasets.lookup import SPLIT_NAMES, check_folder, files_with, table_rows, unique_names
from a2g_jax.data.datasets.samples import speech_samples
from a2g_jax.data.datasets.source import DataSet, Take
from a2g_jax.errors import InputError
from a2g_jax.geometry.pose_track import PoseTrack
from a2g_jax.io.untrusted import Limits, read_npz
from a2g_jax.recording import PoseRecording

FPS = 15.0
AUDIO_RATE = 16000
WINDOW = 64
"""Frames in a window."""
_EXPECTED = "Speech2Gesture's, with train.csv and <speaker>/train/npz/<interval>-<start>-<end>.npz in it"
_COLUMNS = ("dataset", "start", "end", "interval_id", "pose_fn", "speaker")
_TIME = re.compile(r"(?:(\d{1,4}) days? \+?)?(\d{1,3})[:_](\d\d)[:_](\d\d(?:\.\d{1,9})?)")
_TIMES_IN_NAME = re.compile(rf"(?P<interval>.+?)-(?P<start>{_TIME.pattern})-(?P<end>{_TIME.pattern})")
_FRAME_IN_NAME = re.compile(r"(?P<interval>.+)-(?P<frame>\d{1,7})")
_LIMITS = Limits(size=2**26)


class _Window(NamedTuple):
    start: float
    end: float
    path: str


def find(folder: Path) -> list[Take]:
    """A take for each stretch of an interval without a missing window, in the order of the names."""
    check_folder(folder, f"a folder that is {_EXPECTED}")
    table = folder / "train.csv"
    intervals = _intervals_of_table(table) if table.is_file() else _intervals_of_names(folder)
    if not intervals:
        raise InputError(f"{folder}: has no windows (.npz); name a folder that is {_EXPECTED}.")
    takes = []
    for (speaker, interval, split), windows in sorted(intervals.items()):
        for number, part in enumerate(_stretches(sorted(set(windows))), start=1):
            chosen = _enough(part)
            name = f"{speaker}/{interval}".strip("/") + (f"-part{number}" if number > 1 else "")
            spec = {"speaker": speaker, "interval": interval, "times": [list(window[:2]) for window in chosen]}
            takes.append(Take(name, tuple(window.path for window in chosen), split, spec))
    return unique_names(takes)


def _intervals_of_table(table: Path) -> dict[tuple[str, str, str], list[_Window]]:
    intervals: dict[tuple[str, str, str], list[_Window]] = {}
    parts: dict[tuple[str, str], str] = {}
    for line, row in table_rows(table, _COLUMNS):
        if row["dataset"] not in SPLIT_NAMES:
            raise InputError(f"{table}, line {line}: expected train, dev or test; got {row['dataset'][:40]!r}.")
        start, end = _seconds(row["start"]), _seconds(row["end"])
        if start is None or end is None or not start < end:
            raise InputError(f"{table}, line {line}: expected rising times as 00:01:02.333; got {row['start'][:40]!r}.")
        split, owner = SPLIT_NAMES[row["dataset"]], (row["speaker"], row["interval_id"])
        if parts.setdefault(owner, split) != split:
            raise InputError(f"{table}, line {line}: interval {owner[1]!r} is in two parts of the split; correct it.")
        path = _locate(table.parent, row["pose_fn"], row["speaker"])
        intervals.setdefault((*owner, split), []).append(_Window(start, end, str(path)))
    return intervals


def _locate(folder: Path, written: str, speaker: str) -> Path:
    """The file of a window: at its path in the table, below our folder."""
    name = PureWindowsPath(written).name if "\\" in written else PurePosixPath(written).name
    for path in (folder / speaker / "train" / "npz" / name, folder / written):
        if path.is_file():
            return path
    return folder / speaker / "train" / "npz" / name


def _intervals_of_names(folder: Path) -> dict[tuple[str, str, str], list[_Window]]:
    intervals: dict[tuple[str, str, str], list[_Window]] = {}
    for path in files_with(folder, ".npz", _EXPECTED):
        above = path.absolute().parts[:-1]
        speaker = above[-3] if above[-2:] == ("train", "npz") and len(above) > 3 else ""
        if match := _TIMES_IN_NAME.fullmatch(path.stem):
            start, end = _seconds(match["start"]) or 0.0, _seconds(match["end"]) or 0.0
        elif match := _FRAME_IN_NAME.fullmatch(path.stem):
            start = int(match["frame"]) / FPS
            end = start + (WINDOW - 1) / FPS
        else:
            raise InputError(
                f"{path}: its name has no interval and no time; expected <interval>-<start>-<end>.npz as"
                " written by Speech2Gesture's code, so that overlapping windows can be joined."
            )
        intervals.setdefault((speaker, match["interval"], ""), []).append(_Window(start, end, str(path)))
    return intervals


def _seconds(text: str) -> float | None:
    match = _TIME.search(text)
    if not match:
        return None
    days, hours, minutes, seconds = match.groups()
    return float(days or 0) * 86400 + int(hours) * 3600 + int(minutes) * 60 + float(seconds)


def _stretches(windows: list[_Window]) -> Iterable[list[_Window]]:
    """Runs of windows without a gap in time, in order."""
    part: list[_Window] = []
    reached = 0.0
    usual = min(window.end - window.start for window in windows)
    for window in windows:
        if window.end - window.start > usual + 1.5 / FPS:
            continue
        if part and window.start > reached + 0.5 / FPS:
            yield part
            part = []
        reached = max(reached, window.end) if part else window.end
        part.append(window)
    yield part


def _enough(windows: list[_Window]) -> list[_Window]:
    """The first and the last window of a run, and the fewest between that overlap by half, where possible."""
    chosen = [windows[0]]
    for window, following in pairwise([*windows[1:], windows[-1]]):
        last = chosen[-1]
        if following is window or following.start > last.start + 0.5 * (last.end - last.start):
            chosen.append(window)
    return chosen


def read(take: Take, sample_rate: int) -> PoseRecording:
    """Speech and 49 keypoints of a stretch of an interval.

    Raises:
        InputError: a window is missing, damaged, of another shape, or of another recording.
    """
    times = [(float(start), float(end)) for start, end in take.spec["times"]]
    pose, sound = _read_window(take.sources[0])
    poses, sounds = [pose], [sound]
    frame = sample = 0  # start of the last window
    for number, (before, path) in enumerate(pairwise(take.sources), start=1):
        start, end = times[number]
        following, speech = _read_window(path)
        guess = round((start - times[number - 1][0]) * (len(following) - 1) / (end - start))
        # Times may be rounded.
        shift = _shift(pose, following, (guess, guess + 1, guess - 1))
        if shift is None:
            raise InputError(
                f"{path}: does not continue {before}, whose frames it should share; extract this interval again."
            )
        offset = int((start - times[0][0]) * AUDIO_RATE + 1e-3) - sample
        if offset > len(sound):
            raise InputError(f"{before}, audio: ends before the next window begins; extract this interval again.")
        # The windows' authors may have rounded the other way.
        found = _shift(sound, speech, (offset, offset + 1, offset - 1))
        offset = offset if found is None else found
        poses.append(following[len(pose) - shift :])
        sounds.append(speech[len(sound) - offset :])
        frame, sample, pose, sound = frame + shift, sample + offset, following, speech
    frames = frame + len(pose)
    points = np.concatenate(poses)
    fps = rate_of(frames - 1, times[-1][1] - times[0][0], slack=0.25)
    place = take.sources[0]
    return PoseRecording(
        name=take.name,
        audio=speech_samples(np.concatenate(sounds), AUDIO_RATE, sample_rate, f"{place}, audio"),
        sample_rate=sample_rate,
        motion=PoseTrack("keypoints", relative_keypoints(points, fps, f"{place}, pose"), S2G_LAYOUT, fps),
        speaker=take.spec["speaker"],
        sources=take.sources,
        annotations={"interval": take.spec["interval"], "video_start": times[0][0]},
    )


def _read_window(path: str) -> tuple[Float[np.ndarray, "T P 2"], np.ndarray]:
    arrays = read_npz(path, ("pose", "audio"), limits=_LIMITS)
    pose, sound = arrays["pose"], arrays["audio"]
    if pose.ndim != 3 or pose.shape[1] != 2 or pose.shape[2] not in (49, 52) or pose.dtype.kind not in "fiu":
        raise InputError(f"{path}, pose: expected numbers of shape (T, 2, 49 or 52); got {pose.dtype} {pose.shape}.")
    if len(pose) < 2 or sound.ndim != 1 or sound.dtype.kind not in "if":
        raise InputError(
            f"{path}: has {len(pose)} frames and audio {sound.dtype} of shape {sound.shape}; extract the window again."
        )
    return np.swapaxes(pose, 1, 2).astype(np.float64), sound


def _shift(before: np.ndarray, after: np.ndarray, candidates: Sequence[int]) -> int | None:
    """Shift of ``after`` against ``before``: the first candidate at which their shared part is equal."""
    for shift in candidates:
        shared = min(len(before) - shift, len(after))
        if shift >= 0 and shared > 0 and np.array_equal(before[shift : shift + shared], after[:shared], equal_nan=True):
            return shift
    return None


DATASET = DataSet(
    name="s2g",
    title="Speech2Gesture",
    fps=FPS,
    find=find,
    read=read,
    pose="keypoints",
    about=(
        "From github.com/amirbar/speech2gesture, with the speech of the videos that it lists. train.csv and"
        " <speaker>/train/npz/ as its code extracts them; train and dev of the table are the official split."
        " 49 keypoints; overlapping windows are joined into the intervals they were cut from."
    ),
)
