"""BEAT (Liu et al., ECCV 2022): 76 hours of 30 speakers, eight emotions, four languages.

Names, rates and splits are those of its README (github.com/PantoMatrix/PantoMatrix).
"""

import re
from pathlib import Path
from typing import Any, NamedTuple

from a2g_jax.data.datasets.beat_split import parts
from a2g_jax.data.datasets.beat_take import LANGUAGES, describe_face, emotion, read_emotions, read_phones, read_text
from a2g_jax.data.datasets.cut import cut
from a2g_jax.data.datasets.named_files import files_by_name, list_files, require
from a2g_jax.data.datasets.source import DataSet, Take
from a2g_jax.data.datasets.word_times import words_of_audio
from a2g_jax.errors import InputError
from a2g_jax.io.audio import read_audio
from a2g_jax.io.bvh import read_bvh
from a2g_jax.recording import Recording

_EXPECTED = (
    "the folder beat_english_v0.2.1 (or of another language), which holds <speaker>/<take>.bvh with .wav and "
    ".TextGrid, such as 2/2_scott_0_1_1.bvh"
)
_NAME = re.compile(r"([0-9]{1,2})_([a-z]+)_([0-7])_([0-9]{1,3})_([0-9]{1,3})")
_SUFFIXES = (".bvh", ".wav", ".textgrid", ".csv", ".txt", ".json")
#: Suffixes that every take needs; the labels of some takes are missing in the release.
_RECORDED = (".bvh", ".wav")


def find(folder: Path) -> list[Take]:
    """All takes under the folder, in the order of speaker, type and sequence; labels may be in a separate tree."""
    files = list_files(folder, _EXPECTED)
    groups = files_by_name(files, lambda stem: stem if _parse(stem) else None, _SUFFIXES)
    groups = {name: group for name, group in groups.items() if not group.keys().isdisjoint(_RECORDED)}
    if not groups:
        raise InputError(f"{folder}: holds no takes of BEAT; name {_EXPECTED}.")
    takes = []
    for take, name in sorted((take, name) for name in groups if (take := _parse(name))):
        if take.last < take.first:
            raise InputError(f"{min(groups[name].values())}: goes from {take.first} to {take.last}; correct its name.")
        require(groups[name], ".bvh", "BVH file")
        require(groups[name], ".wav", "WAV file")
        sources = tuple(str(groups[name][suffix]) for suffix in _SUFFIXES if suffix in groups[name])
        for part in parts(take.speaker_id, take.kind, take.first, take.last):
            spec = {"start": part.start, "end": part.end} if part.label else {}
            # Halves of a recording are a group: also a split by the seed keeps them together.
            takes.append(Take(f"{name}_{part.label}" if part.label else name, sources, part.split, spec, name))
    return takes


class _Name(NamedTuple):
    speaker_id: int
    kind: int
    first: int
    last: int
    speaker: str


def _parse(stem: str) -> _Name | None:
    match = _NAME.fullmatch(stem)
    return _Name(int(match[1]), int(match[3]), int(match[4]), int(match[5]), match[2]) if match else None


def read(take: Take, sample_rate: int) -> Recording:
    """A take with its words and emotion.

    Annotations: ``language``, ``scenario`` (speech or conversation), ``speaker_id``, and if their files exist:
    ``phones``, ``emotions`` and ``semantic`` (timed labels), ``transcript`` (running text that other languages than
    English may have in place of semantic labels) and ``face`` (its file, number of frames and rate, and the time in
    it at which the recording starts; not read).
    """
    files = {Path(source).suffix.lower(): Path(source) for source in take.sources}
    name = _parse(files[".bvh"].stem)
    if name is None:
        raise InputError(f"{files['.bvh']}: is not named like a take of BEAT; rename it, such as 2_scott_0_1_1.bvh.")
    annotations: dict[str, Any] = {
        "language": LANGUAGES[name.kind // 2],
        "scenario": "conversation" if name.kind % 2 else "speech",
        "speaker_id": name.speaker_id,
    }
    audio = read_audio(files[".wav"], sample_rate)
    words = words_of_audio(files[".textgrid"], len(audio) / sample_rate) if ".textgrid" in files else ()
    if ".textgrid" in files and (phones := read_phones(files[".textgrid"])):
        annotations["phones"] = phones
    if ".csv" in files:
        annotations["emotions"] = read_emotions(files[".csv"])
    if ".txt" in files:
        annotations |= read_text(files[".txt"], english=name.kind < 2)
    if ".json" in files:
        annotations["face"] = describe_face(files[".json"], take.spec.get("start", 0.0))
    recording = Recording(
        name=take.name,
        audio=audio,
        sample_rate=sample_rate,
        motion=read_bvh(files[".bvh"]),
        words=words,
        speaker=name.speaker,
        emotion=emotion(name.kind, name.first, name.last),
        sources=take.sources,
        annotations=annotations,
    )
    return cut(recording, take.spec["start"], take.spec["end"]) if take.spec else recording


DATASET = DataSet(
    name="beat",
    title="BEAT",
    fps=15.0,
    find=find,
    read=read,
    about=(
        "github.com/PantoMatrix/PantoMatrix, CC BY-NC 4.0. Name beat_english_v0.2.1 or a folder of several languages. "
        "The official split of the English data is by sequence number (the README's); first sequences of speakers "
        "of one hour are two halves, a and b. Other papers have other splits: EmotionGesture takes 70/10/20 percent."
    ),
)
