"""GENEA Challenge 2022: 18 hours of Talking With Hands, each speaker of a conversation on their own."""

import re
from pathlib import Path

from a2g_jax.data.datasets.named_files import files_by_name, list_files, without_motion
from a2g_jax.data.datasets.source import DataSet, Take
from a2g_jax.data.datasets.talking_with_hands import (
    SPLITS,
    SUFFIXES,
    check_rows,
    has_fingers,
    make_take,
    read,
    read_metadata,
)
from a2g_jax.errors import InputError

_EXPECTED = (
    "the folder that holds trn, val and tst, each with bvh, wav, tsv and a metadata table, such as "
    "trn/bvh/trn_2022_v1_000.bvh"
)
_NAME = re.compile(r"(trn|val|tst)_2022_v[0-9]+_[0-9]{3}")
_COLUMNS = ("name", "finger_incl or finger_excl", "speaker")


def find(folder: Path) -> list[Take]:
    """All recordings under the folder, in the order of their names; their splits are the first part of the names."""
    files = list_files(folder, _EXPECTED)
    groups = files_by_name(files, lambda stem: stem if _NAME.fullmatch(stem) else None, SUFFIXES)
    if not groups:
        raise InputError(f"{folder}: holds no recordings of the GENEA Challenge 2022; name {_EXPECTED}.")
    rows = read_metadata(files, _NAME, _COLUMNS)
    check_rows({name: min(group.values()) for name, group in groups.items()}, rows, folder)
    left_out = without_motion(groups, lambda name: name.startswith("tst"))
    takes = []
    for name, group in groups.items():
        if name in left_out:
            continue
        _, fingers, speaker = rows[name].cells
        annotations: dict[str, object] = {"fingers": has_fingers(rows[name], fingers)}
        takes.append(make_take(name, group, SPLITS[name[:3]], annotations, speaker))
    if not takes:
        raise InputError(f"{folder}: none of its {len(left_out)} recordings has motion; name {_EXPECTED}.")
    return takes


DATASET = DataSet(
    name="genea2022",
    title="Talking With Hands, GENEA Challenge 2022",
    fps=30.0,
    find=find,
    read=read,
    about=(
        "youngwoo-yoon.github.io/GENEAchallenge2022, CC BY-NC 4.0. Name the folder of trn, val and tst; they are the "
        "official split. Test recordings that come without motion are left out, with a warning. The motion of some "
        "has no fingers (annotation fingers)."
    ),
)
