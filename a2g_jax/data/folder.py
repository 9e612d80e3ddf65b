"""Your own recordings: a folder of WAV and BVH files with the same names."""

import os
import re
from pathlib import Path

from a2g_jax.data.recording import Recording
from a2g_jax.errors import InputError
from a2g_jax.io.audio import read_audio
from a2g_jax.io.bvh import read_bvh
from a2g_jax.io.textgrid import read_words

AUDIO_SUFFIXES = (".wav", ".flac", ".ogg", ".mp3")


def find_pairs(folder: str | os.PathLike[str]) -> list[tuple[Path, Path]]:
    """(audio, BVH) files of equal name anywhere under a folder, in the order of their names.

    Raises:
        InputError: no such folder, a BVH without audio or audio without a BVH, or no pairs.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: is not a folder; name one that holds WAV and BVH files of equal names.")
    sounds: dict[Path, Path] = {}
    motions: dict[Path, Path] = {}
    for path in sorted(folder.rglob("*")):
        if path.name.startswith("."):
            continue
        if path.suffix.lower() in AUDIO_SUFFIXES:
            sounds.setdefault(path.with_suffix(""), path)
        elif path.suffix.lower() == ".bvh":
            motions[path.with_suffix("")] = path
    # Folders that keep audio and motion apart pair by file name alone.
    if not set(sounds) & set(motions):
        sounds = {Path(path.stem): path for path in sounds.values()}
        motions = {Path(path.stem): path for path in motions.values()}
    if not sounds and not motions:
        raise InputError(f"{folder}: holds no WAV and no BVH files; name a folder that does.")
    for missing, there, kind in ((motions, sounds, "BVH"), (sounds, motions, "audio")):
        lonely = sorted(set(there) - set(missing))
        if lonely:
            raise InputError(f"{there[lonely[0]]}: has no {kind} file of the same name beside it; add or remove it.")
    return [(sounds[key], motions[key]) for key in sorted(motions)]


def read_pair(audio: Path, bvh: Path, sample_rate: int) -> Recording:
    """One recording; words come from a TextGrid of the same name, where there is one."""
    motion = read_bvh(bvh)
    grid = audio.with_suffix(".TextGrid")
    return Recording(
        name=bvh.stem,
        audio=read_audio(audio, sample_rate),
        sample_rate=sample_rate,
        motion=motion,
        words=read_words(grid) if grid.exists() else (),
        speaker=_speaker(bvh.stem),
        sources=(str(audio), str(bvh)),
    )


def _speaker(name: str) -> str:
    """BEAT names a speaker in ``2_scott_0_1_1``; other names say nothing reliable."""
    match = re.fullmatch(r"\d+_([a-z]+)_\d+_\d+_\d+", name)
    return match.group(1) if match else ""
