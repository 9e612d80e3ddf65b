"""ZeroEGGS (Ghorbani et al., 2022): 67 monologues of an actress in 19 styles.

Layout, times and split: ``README.md``, ``data/info.csv`` and ``ZEGGS/data_pipeline.py`` of
github.com/ubisoft/ubisoft-laforge-ZeroEGGS.
"""

import re
from collections.abc import Sequence
from pathlib import Path

from a2g_jax.data.datasets import zeroeggs_original
from a2g_jax.data.datasets.csv_tables import read_columns
from a2g_jax.data.datasets.named_files import NamedFiles, files_by_name, list_files, require
from a2g_jax.data.datasets.source import DataSet, Take
from a2g_jax.errors import InputError
from a2g_jax.io.audio import read_audio
from a2g_jax.io.bvh import read_bvh
from a2g_jax.recording import Recording

_EXPECTED = "the folder data of ZeroEGGS, which holds info.csv with clean or original, or one of these two"
_ORIGINAL = re.compile(r"[0-9]{3}_([A-Za-z]+)_[0-9]+(_mirror)?")
_CLEAN = re.compile(rf"({_ORIGINAL.pattern})_x_([0-9])_([0-9])")
_COLUMNS = ("audio_filename", "style", "capture_session", "anim_bvh", "validation")
_SPLITS = {"true": "validation", "false": "train"}


class _Info:
    """A row of info.csv."""

    def __init__(self, path: Path, line: int, cells: dict[str, str]) -> None:
        self.place, self.cells = f"{path}, line {line}", cells
        self.name, self.audio = Path(cells["anim_bvh"]).stem, Path(cells["audio_filename"]).stem
        if cells["validation"].lower() not in _SPLITS:
            raise InputError(f"{self.place}: validation: expected TRUE or FALSE; got {cells['validation'][:40]!r}.")
        self.split = _SPLITS[cells["validation"].lower()]


def find(folder: Path) -> list[Take]:
    """All takes of ``clean`` under the folder, or else all of ``original``, in the order of their names.

    ``clean`` holds the same takes, cut and without the experimenter's voice; for the others, name ``original`` itself.
    """
    files = list_files(folder, _EXPECTED)
    clean = files_by_name(files, lambda stem: stem if _CLEAN.fullmatch(stem) else None, (".bvh", ".wav"))
    if clean:
        return _clean_takes(clean, _read_info(folder, files, _COLUMNS))
    original = files_by_name(files, lambda stem: stem if _ORIGINAL.fullmatch(stem) else None, (".bvh", ".wav", ".csv"))
    if not original:
        raise InputError(f"{folder}: holds no takes of ZeroEGGS; name {_EXPECTED}.")
    info = _read_info(folder, files, (*_COLUMNS, *zeroeggs_original.COLUMNS))
    if not info:
        raise InputError(f"{folder}: holds no info.csv, which says where the original takes start; add it.")
    return _original_takes(original, info)


def _read_info(folder: Path, files: Sequence[Path], columns: Sequence[str]) -> dict[str, _Info]:
    found = [path for path in files if path.name.lower() == "info.csv"]
    beside = folder.absolute().parent / "info.csv"
    if not found and beside.is_file():
        found = [beside]
    if len(found) > 1:
        raise InputError(f"{found[0]} and {found[1]}: are both tables of the takes; remove one.")
    result: dict[str, _Info] = {}
    for path in found:
        for line, cells in read_columns(path, columns):
            row = _Info(path, line, cells)
            if row.name in result:
                raise InputError(f"{row.place}: {row.name} is in {result[row.name].place} already; remove one.")
            result[row.name] = row
    return result


def _clean_takes(groups: NamedFiles, info: dict[str, _Info]) -> list[Take]:
    takes, found = [], set()
    for name, files in groups.items():
        match = _CLEAN.fullmatch(name)
        take, style, mirror, whole, tenth = match.groups() if match else ("", "", "", "", "")
        row = info.get(take)
        if info and row is None:
            raise InputError(f"{min(files.values())}: has no row in info.csv; add or remove it.")
        found.add(take)
        annotations: dict[str, object] = {"style": row.cells["style"] if row else style, "mirrored": bool(mirror)}
        if (whole, tenth) != ("1", "0"):
            annotations["stretch"] = float(f"{whole}.{tenth}")
        if row:
            annotations["session"] = row.cells["capture_session"]
        sources = (str(require(files, ".wav", "WAV file")), str(require(files, ".bvh", "BVH file")))
        takes.append(Take(name, sources, row.split if row else "", {"annotations": annotations}))
    mirrors = any(name.endswith("_mirror") for name in found)
    for row in info.values():
        if row.name not in found and (mirrors or not row.name.endswith("_mirror")):
            raise InputError(f"{row.place}: there is no file of {row.name}; add it or remove the row.")
    return takes


def _original_takes(groups: NamedFiles, info: dict[str, _Info]) -> list[Take]:
    listed = set(info) | {row.audio for row in info.values()}
    if unlisted := sorted(set(groups) - listed):
        raise InputError(f"{min(groups[unlisted[0]].values())}: has no row in info.csv; add or remove it.")
    takes = []
    for name, row in sorted(info.items()):
        motion, speech = groups.get(name, {}), groups.get(row.audio, {})
        for file, files, suffix in ((name, motion, ".bvh"), (row.audio, speech, ".wav")):
            if suffix not in files:
                raise InputError(f"{row.place}: there is no file {file}{suffix}; add it or remove the row.")
        sources = [str(speech[".wav"]), str(motion[".bvh"])] + ([str(speech[".csv"])] if ".csv" in speech else [])
        annotations = {
            "style": row.cells["style"],
            "mirrored": name.endswith("_mirror"),
            "session": row.cells["capture_session"],
        }
        spec = {"annotations": annotations, "times": zeroeggs_original.times(row.place, row.cells)}
        takes.append(Take(name, tuple(sources), row.split, spec))
    return takes


def read(take: Take, sample_rate: int) -> Recording:
    """A take. Annotations: ``style``, ``mirrored``, ``session`` of capture, and ``stretch`` of takes played faster."""
    wav, bvh, *speech = (Path(source) for source in take.sources)
    audio, motion = read_audio(wav, sample_rate), read_bvh(bvh)
    if "times" in take.spec:
        if speech:
            audio = zeroeggs_original.only_speaker(audio, sample_rate, speech[0])
        audio, motion = zeroeggs_original.cut_to_acting(audio, sample_rate, motion, take.spec["times"], take.sources)
    return Recording(
        name=take.name,
        audio=audio,
        sample_rate=sample_rate,
        motion=motion,
        speaker="zeroeggs",
        sources=take.sources,
        annotations=take.spec["annotations"],
    )


DATASET = DataSet(
    name="zeroeggs",
    title="ZeroEGGS",
    fps=60.0,
    find=find,
    read=read,
    about=(
        "github.com/ubisoft/ubisoft-laforge-ZeroEGGS, CC BY-NC-ND 4.0; one speaker. Name the folder data: clean is "
        "read if it is there, else original, cut to the acting. The column validation of info.csv is the official "
        "split (training and validation). Mirrored takes have the annotation mirrored."
    ),
)
