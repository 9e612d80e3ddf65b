"""Your own recordings: a folder of WAV and BVH files with the same names."""

import os
import re
from collections.abc import Callable
from pathlib import Path

from a2g_jax.errors import InputError
from a2g_jax.io.audio import read_audio
from a2g_jax.io.bvh import read_bvh
from a2g_jax.io.sound_file import AUDIO_SUFFIXES, FFMPEG_SUFFIXES
from a2g_jax.io.textgrid import read_words
from a2g_jax.recording import Recording


def find_pairs(folder: str | os.PathLike[str]) -> list[tuple[Path, Path]]:
    """(audio, BVH) files of equal name anywhere under a folder, in the order of their names.

    Raises:
        InputError: no such folder, no files, one without its partner, or two of one name.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: is not a folder; name one that holds WAV and BVH files of equal names.")
    files = [path for path in sorted(folder.rglob("*")) if not path.name.startswith(".")]
    sounds = find_sounds(files)
    motions = [path for path in files if path.suffix.lower() == ".bvh"]
    if not sounds and not motions:
        raise InputError(f"{folder}: holds no WAV and no BVH files; name a folder that does.")
    # Side by side; else in parallel trees such as wav/s1/a.wav and bvh/s1/a.bvh; else by file name only.
    for key in (_whole_path, _below_first_folder, _name_alone):
        audio_files, bvh_files = _by_key(sounds, folder, key), _by_key(motions, folder, key)
        if set(audio_files) & set(bvh_files):
            break
    for others, files_of, kind in ((bvh_files, audio_files, "BVH"), (audio_files, bvh_files, "audio")):
        unpaired = sorted(set(files_of) - set(others))
        if unpaired:
            raise InputError(f"{files_of[unpaired[0]][0]}: has no {kind} file of the same name; add or remove it.")
    for paths in (*audio_files.values(), *bvh_files.values()):
        if len(paths) > 1:
            raise InputError(f"{paths[0]} and {paths[1]}: have the same name; rename or remove one.")
    return [(audio_files[name][0], bvh_files[name][0]) for name in sorted(bvh_files)]


def find_sounds(files: list[Path]) -> list[Path]:
    """The audio files; those that need ffmpeg, such as a video beside its WAV, only where there is no other."""
    sounds = [path for path in files if path.suffix.lower() in AUDIO_SUFFIXES]
    names = {path.stem for path in sounds}
    return sorted(
        sounds + [path for path in files if path.suffix.lower() in FFMPEG_SUFFIXES and path.stem not in names]
    )


def _whole_path(path: Path) -> str:
    return path.with_suffix("").as_posix()


def _below_first_folder(path: Path) -> str:
    return Path(*path.with_suffix("").parts[1:]).as_posix() if len(path.parts) > 1 else path.stem


def _name_alone(path: Path) -> str:
    return path.stem


def _by_key(paths: list[Path], folder: Path, key: Callable[[Path], str]) -> dict[str, list[Path]]:
    groups: dict[str, list[Path]] = {}
    for path in paths:
        groups.setdefault(key(path.relative_to(folder)), []).append(path)
    return groups


def read_pair(audio: Path, bvh: Path, sample_rate: int, name: str = "") -> Recording:
    """One recording, named after the BVH file unless given a name.

    Words come from a TextGrid of the same name beside the audio, where there is one.
    """
    motion = read_bvh(bvh)
    grid = audio.with_suffix(".TextGrid")
    return Recording(
        name=name or bvh.stem,
        audio=read_audio(audio, sample_rate),
        sample_rate=sample_rate,
        motion=motion,
        words=read_words(grid) if grid.exists() else (),
        speaker=_speaker(bvh.stem),
        sources=(str(audio), str(bvh)),
    )


def _speaker(name: str) -> str:
    """The speaker of a name as in BEAT, ``2_scott_0_1_1``; empty for other names."""
    match = re.fullmatch(r"\d+_([a-z]+)_\d+_\d+_\d+", name)
    return match.group(1) if match else ""
