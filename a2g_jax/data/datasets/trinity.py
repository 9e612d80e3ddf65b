"""Trinity Speech-Gesture I (Ferstl & McDonnell, IVA 2018), also as released for the GENEA Challenge 2020.

Names of folders and files: the readers of Gesticulator, StyleGestures and Gesture2Vec (on GitHub:
Svito-zar/gesticulator, simonalexanderson/StyleGestures, pjyazdian/Gesture2Vec). The split of the original names:
Audio2Gestures (Li et al., extended version, section 5.1).
"""

import re
from pathlib import Path

from a2g_jax.data.datasets.named_files import files_by_name, list_files, require, without_motion
from a2g_jax.data.datasets.source import DataSet, Take
from a2g_jax.errors import InputError
from a2g_jax.io.audio import read_audio
from a2g_jax.io.bvh import read_bvh
from a2g_jax.io.transcripts import read_transcript
from a2g_jax.recording import Recording

_EXPECTED = (
    "the folder GENEA_Challenge_2020_data_release, which holds Training_data and Test_data with Audio, Motion and "
    "Transcripts, or a folder of NaturalTalking_001.bvh, .wav ..."
)
_GENEA = re.compile(r"(Recording_|TestSeq)([0-9]{1,3})", re.IGNORECASE)
_ORIGINAL = re.compile(r"(NaturalTalking_)([0-9]{1,3})(_[0-9])?", re.IGNORECASE)
#: The sequences that Audio2Gestures tests on.
_TEST = frozenset({1, 25, 27, 30})


def find(folder: Path) -> list[Take]:
    """All recordings under the folder, with the names of one of the two releases."""
    groups = files_by_name(list_files(folder, _EXPECTED), _name, (".bvh", ".wav", ".json"))
    groups = {name: files for name, files in groups.items() if not files.keys().isdisjoint((".bvh", ".wav"))}
    if not groups:
        raise InputError(f"{folder}: holds no recordings of Trinity; name {_EXPECTED}.")
    original = [name for name in groups if _ORIGINAL.fullmatch(name)]
    if 0 < len(original) < len(groups):
        genea = min(set(groups) - set(original))
        raise InputError(
            f"{folder}: holds {original[0]} and {genea}, two releases of the same takes; name one of them."
        )
    left_out = without_motion(groups, lambda name: name.startswith("TestSeq"))
    takes = []
    for name in (name for name in groups if name not in left_out):
        files = groups[name]
        sources = [require(files, ".wav", "WAV file"), require(files, ".bvh", "BVH file")]
        sources += [files[".json"]] if ".json" in files else []
        takes.append(Take(name, tuple(map(str, sources)), _split(name)))
    if not takes:
        raise InputError(f"{folder}: none of its {len(left_out)} recordings has motion; name {_EXPECTED}.")
    return takes


def _name(stem: str) -> str | None:
    # One spelling: releases differ in case and in leading zeros.
    if match := _GENEA.fullmatch(stem):
        return f"{'TestSeq' if match[1][0] in 'tT' else 'Recording_'}{int(match[2]):03d}"
    if match := _ORIGINAL.fullmatch(stem):
        return f"NaturalTalking_{int(match[2]):03d}{match[3] or ''}"
    return None


def _split(name: str) -> str:
    match = _ORIGINAL.fullmatch(name)
    test = int(match[2]) in _TEST if match else name.startswith("TestSeq")
    return "test" if test else "train"


def read(take: Take, sample_rate: int) -> Recording:
    """A recording with the words of its transcript, where the release has one."""
    wav, bvh, *transcript = (Path(source) for source in take.sources)
    return Recording(
        name=take.name,
        audio=read_audio(wav, sample_rate),
        sample_rate=sample_rate,
        motion=read_bvh(bvh),
        words=read_transcript(transcript[0]) if transcript else (),
        speaker="trinity",
        sources=take.sources,
    )


DATASET = DataSet(
    name="trinity",
    title="Trinity Speech-Gesture I, GENEA Challenge 2020",
    fps=30.0,
    find=find,
    read=read,
    about=(
        "trinityspeechgesture.scss.tcd.ie, for research, after signing a licence; one speaker, 244 minutes. Name "
        "GENEA_Challenge_2020_data_release (its Test_data are the test set; left out, with a warning, where they come "
        "without motion) or a folder of the original names, as BVH in step with the audio (the test set is then "
        "Audio2Gestures': NaturalTalking 01, 25, 27 and 30). StyleGestures held out Recording_008."
    ),
)
