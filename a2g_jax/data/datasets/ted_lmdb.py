"""Clips in the LMDB databases of TED Gesture and TED-Expressive.

Layout: ``lmdb_train``, ``lmdb_val`` and ``lmdb_test`` (or ``train``, ``val``, ``test``) with a ``data.mdb`` each; keys
``0000000000`` on; a value is ``pyarrow.serialize`` of a video, ``{"vid", "clips": [...]}``, and a clip is ``{"words":
[[word, start, end]], "skeletons_3d", "audio_raw", "audio_feat", "start_frame_no", "end_frame_no", "start_time",
"end_time"}`` (``data_preprocessor.py`` of Yoon et al. 2020, ``make_ted_dataset.py`` of Liu et al. 2022).

- Times, of words too, are seconds from the start of the video. Here words are relative to the start of the clip and cut
  at its ends; words that the authors' cleaning left empty are dropped.
- The frames last from ``start_time`` to ``end_time`` (their code resamples them so), which gives their rate: the usual
  one that fits within a frame. ``audio_raw`` has 16 kHz.
- The talk is the speaker. TED-Expressive's authors distribute the clips of each talk over the three parts, so each part
  of its official split has all speakers.

A database may be larger than the memory; one video is in memory at a time.
"""

import math
import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.data.datasets.directions import unit_directions
from a2g_jax.data.datasets.gaps import rate_of
from a2g_jax.data.datasets.lookup import SPLIT_NAMES, unique_names
from a2g_jax.data.datasets.samples import speech_samples
from a2g_jax.data.datasets.smplx import float_array
from a2g_jax.data.datasets.source import Take
from a2g_jax.errors import InputError
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_track import PoseTrack
from a2g_jax.io.untrusted import Limits, LmdbFile, decode_arrow
from a2g_jax.io.words import Word
from a2g_jax.recording import PoseRecording

AUDIO_RATE = 16000
#: Limit on the memory of one video: an hour with poses, speech and mels takes about 400 MB.
_LIMITS = Limits(size=2 * 2**30)
_LONGEST_CLIP = 4 * 3600.0


def databases(folder: Path) -> dict[str, Path]:
    """The database of each part of the official split; only one if the folder itself is a database."""
    if (folder / "data.mdb").is_file():
        return {SPLIT_NAMES.get(folder.name.removeprefix("lmdb_"), ""): folder / "data.mdb"}
    found: dict[str, Path] = {}
    for name in ("train", "val", "test"):
        for candidate in (folder / f"lmdb_{name}", folder / name):
            if (candidate / "data.mdb").is_file():
                found.setdefault(SPLIT_NAMES[name], candidate / "data.mdb")
    return found


def find_clips(parts: dict[str, Path]) -> list[Take]:
    """A take for each clip, in the order of parts, keys and clips. Reads every video once, one at a time."""
    takes = []
    for split, path in parts.items():
        with LmdbFile(path, _LIMITS) as database:
            for key, value in database.items():
                video, clips = _video_of(value, f"{path}, key {_text(key)}")
                for number, clip in enumerate(clips):
                    place = f"{path}, key {_text(key)}, clip {number}"
                    first, last = (_whole(clip, name, place) for name in ("start_frame_no", "end_frame_no"))
                    spec = {"key": key.hex(), "clip": number}
                    takes.append(Take(f"{video}_{first}_{last}", (str(path),), split, spec))
    return unique_names(takes)


def read_clip(take: Take, sample_rate: int, layout: PoseLayout) -> PoseRecording:
    """A clip with the directions of the bones of ``layout``.

    Raises:
        InputError: the video is damaged, or the clip differs from the above layout; the message gives its place.
    """
    path, key, number = Path(take.sources[0]), bytes.fromhex(take.spec["key"]), take.spec["clip"]
    place = f"{path}, key {_text(key)}, clip {number}"
    status = path.stat() if path.is_file() else None
    video, clips = _video(path, key, (status.st_mtime_ns, status.st_size) if status else (0, 0))
    if number >= len(clips):
        raise InputError(f"{place}: the video has {len(clips)} clips; prepare again, the database has changed.")
    clip = clips[number]
    start, end = (_time(clip, name, place) for name in ("start_time", "end_time"))
    if not 0.0 < end - start <= _LONGEST_CLIP:
        raise InputError(f"{place}: lasts from {start} to {end} s; expected rising times in seconds.")
    points = len(layout.names)
    poses = float_array(_entry(clip, "skeletons_3d", place), ((points, 3), (3 * points,)), f"{place}, skeletons_3d")
    if len(poses) < 2:
        raise InputError(f"{place}, skeletons_3d: has {len(poses)} frames; expected two or more.")
    fps = rate_of(len(poses), end - start, slack=1.0)
    sound = _entry(clip, "audio_raw", place)
    if not isinstance(sound, np.ndarray):
        raise InputError(f"{place}, audio_raw: expected an array of samples; got {type(sound).__name__}.")
    return PoseRecording(
        name=take.name,
        audio=speech_samples(sound, AUDIO_RATE, sample_rate, f"{place}, audio_raw"),
        sample_rate=sample_rate,
        motion=PoseTrack("directions", _directions(poses, layout, fps, place), layout, fps),
        words=tuple(_words(clip, start, end, place)),
        speaker=video,
        sources=take.sources,
        annotations={"video": video, "video_start": start, "video_end": end},
    )


def _directions(
    poses: Float[np.ndarray, "T P 3"], layout: PoseLayout, fps: float, place: str
) -> Float[np.ndarray, "T B 3"]:
    above, joint = np.array(layout.bones).T
    with np.errstate(invalid="ignore", over="ignore"):  # infinities are gaps as NaN are
        bones = poses[:, joint] - poses[:, above]
    return unit_directions(bones, fps, f"{place}, skeletons_3d")


@lru_cache(maxsize=1)  # the clips of a video are read one after the other, and decoding it is most of the work
def _video(path: Path, key: bytes, _changed: tuple[int, int]) -> tuple[str, list[dict[str, Any]]]:
    with LmdbFile(path, _LIMITS) as database:
        value = database.get(key)
    if value is None:
        raise InputError(f"{path}: has no key {_text(key)}; prepare again, the database has changed.")
    return _video_of(value, f"{path}, key {_text(key)}")


def _video_of(value: bytes, place: str) -> tuple[str, list[dict[str, Any]]]:
    video = decode_arrow(value, place, _LIMITS)
    clips = video.get("clips") if isinstance(video, dict) else None
    name = video.get("vid") if isinstance(video, dict) else None
    if not isinstance(name, str) or not isinstance(clips, list) or any(not isinstance(clip, dict) for clip in clips):
        raise InputError(
            f"{place}: expected a video with 'vid' and 'clips', as in the authors' databases; those of the"
            " samples that their code cuts (..._cache) are not read."
        )
    return re.sub(r"[^\w-]", "_", name)[:64], clips


def _words(clip: dict[str, Any], start: float, end: float, place: str) -> Iterator[Word]:
    words = _entry(clip, "words", place)
    for number, word in enumerate(words if isinstance(words, list | tuple) else [words]):
        if not isinstance(word, list | tuple) or len(word) != 3 or not isinstance(word[0], str):
            raise InputError(f"{place}, word {number}: expected a word, its start and its end.")
        first, last = (_seconds(time, f"{place}, word {number}") for time in word[1:])
        first, last = max(first, start) - start, min(last, end) - start
        text = " ".join(word[0].split())
        if text and first <= last:
            yield Word(text, first, last)


def _entry(clip: dict[str, Any], name: str, place: str) -> Any:
    if name not in clip:
        raise InputError(f"{place}: has no {name!r}; expected a clip as in the authors' databases.")
    return clip[name]


def _time(clip: dict[str, Any], name: str, place: str) -> float:
    return _seconds(_entry(clip, name, place), f"{place}, {name}")


def _seconds(value: Any, place: str) -> float:
    number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    if not number or not math.isfinite(value):
        raise InputError(f"{place}: expected a time in seconds; got {type(value).__name__}.")
    return float(value)


def _whole(clip: dict[str, Any], name: str, place: str) -> int:
    value = _time(clip, name, place)
    if value != int(value):
        raise InputError(f"{place}, {name}: expected a whole number of frames; got {value}.")
    return int(value)


def _text(key: bytes) -> str:
    return ascii(key.decode("latin-1")[:40])[1:-1]
