"""The original takes of ZeroEGGS, cut to the acting as in the authors' ``data_pipeline.py``."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.data.datasets.csv_tables import read_columns
from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion

#: Columns of info.csv and the frame rates of their timecodes (HH:MM:SS:FF).
_RATES = {"audio_start_time": 30, "anim_start_time": 60, "acting_start_time": 60, "acting_end_time": 60}
COLUMNS = tuple(_RATES)
_TIMECODE = re.compile(r"([0-9]{1,2}):([0-9]{2}):([0-9]{2}):([0-9]{2})")
_MARK = re.compile(r"([0-9]{1,3}):([0-9]{1,2})[.:]([0-9]{3})")


def times(place: str, cells: Mapping[str, str]) -> dict[str, int]:
    """Start of the acting in the audio and in the motion, and its length, in sixtieths of a second.

    Raises:
        InputError: a cell that is no timecode, or acting that starts before the recording or has no length.
    """
    at = {column: _sixtieths(f"{place}: {column}", cells[column], rate) for column, rate in _RATES.items()}
    start = at["acting_start_time"]
    result = {
        "audio": start - at["audio_start_time"],
        "motion": start - at["anim_start_time"],
        "length": at["acting_end_time"] - start,
    }
    if result["length"] <= 0:
        raise InputError(f"{place}: acting_end_time is not after acting_start_time; correct the times.")
    if min(result.values()) < 0:
        raise InputError(f"{place}: the acting starts before the audio or the motion; correct the times.")
    return result


def _sixtieths(place: str, cell: str, rate: int) -> int:
    match = _TIMECODE.fullmatch(cell)
    hours, minutes, seconds, frames = (int(part) for part in match.groups()) if match else (0, 0, 0, rate)
    if minutes >= 60 or seconds >= 60 or frames >= rate:
        raise InputError(f"{place}: expected a time HH:MM:SS:FF of {rate} frames a second; got {cell[:40]!r}.")
    return ((hours * 60 + minutes) * 60 + seconds) * 60 + frames * (60 // rate)


def cut_to_acting(
    audio: Float[np.ndarray, " N"], sample_rate: int, motion: Motion, at: Mapping[str, int], sources: Sequence[str]
) -> tuple[Float[np.ndarray, " M"], Motion]:
    """Audio and motion from the start of the acting to its end, or to their own end.

    Raises:
        InputError: one of them ends before the acting starts.
    """
    starts, lengths = (at["audio"], at["motion"]), (len(audio) / sample_rate, motion.seconds)
    for source, start, seconds in zip(sources, starts, lengths, strict=False):
        if start / 60 >= seconds:
            raise InputError(
                f"{source}: lasts {seconds:.2f} s, and the acting starts at {start / 60:.2f} s; correct info.csv."
            )
    first, stop = (round(tick * sample_rate / 60) for tick in (at["audio"], at["audio"] + at["length"]))
    begin, end = (round(tick * motion.fps / 60) for tick in (at["motion"], at["motion"] + at["length"]))
    return audio[first:stop], motion.clip(begin, end)


def only_speaker(audio: Float[np.ndarray, " N"], sample_rate: int, marks: Path) -> Float[np.ndarray, " N"]:
    """The audio with silence where the actress does not speak, which removes the experimenter's voice.

    Args:
        marks: the table beside the audio: she speaks in the rows whose ``#`` holds an R, from ``Start`` to ``End`` as
            minutes:seconds.milliseconds.

    Raises:
        InputError: a row without times.
    """
    spoken = np.zeros(len(audio), np.bool_)
    for line, cells in read_columns(marks, ("#", "Start", "End")):
        if "R" in cells["#"]:
            start, end = (_mark(f"{marks}, line {line}", cells[column]) for column in ("Start", "End"))
            spoken[round(start * sample_rate) : round(end * sample_rate)] = True
    return np.where(spoken, audio, np.float32(0.0))


def _mark(place: str, cell: str) -> float:
    match = _MARK.fullmatch(cell)
    if match is None:
        raise InputError(f"{place}: expected a time minutes:seconds.milliseconds; got {cell[:40]!r}.")
    minutes, seconds, thousandths = (int(part) for part in match.groups())
    return 60.0 * minutes + seconds + thousandths / 1000
