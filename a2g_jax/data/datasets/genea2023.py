"""GENEA Challenge 2023: conversations of Talking With Hands, both speakers."""

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
    "the folder that holds trn, val and tst, each with metadata.csv, main-agent and interloctr, such as "
    "trn/main-agent/bvh/trn_2023_v0_000_main-agent.bvh"
)
_DYAD = re.compile(r"(trn|val|tst)_2023_v[0-9]+_[0-9]{3}")
_NAME = re.compile(rf"({_DYAD.pattern})_(?:main-agent|interloctr)")
_ROLES = ("main-agent", "interloctr")
_COLUMNS = ("prefix", "main-agent_id", "main-agent_has_fingers", "interloctr_id", "interloctr_has_fingers")


def find(folder: Path) -> list[Take]:
    """Both speakers of every conversation under the folder, in the order of their names."""
    files = list_files(folder, _EXPECTED)
    groups = files_by_name(files, lambda stem: stem if _NAME.fullmatch(stem) else None, SUFFIXES)
    if not groups:
        raise InputError(f"{folder}: holds no recordings of the GENEA Challenge 2023; name {_EXPECTED}.")
    rows = read_metadata(files, _DYAD, _COLUMNS)
    dyads = {name.rpartition("_")[0]: min(group.values()) for name, group in groups.items()}
    check_rows(dyads, rows, folder)
    left_out = without_motion(groups, lambda name: name.startswith("tst") and name.endswith(_ROLES[0]))
    takes = []
    for dyad in sorted(dyads):
        row = rows[dyad]
        speakers = dict(zip(_ROLES, row.cells[1::2], strict=True))
        fingers = dict(zip(_ROLES, row.cells[2::2], strict=True))
        for role, other in (_ROLES, _ROLES[::-1]):
            name, partner = f"{dyad}_{role}", f"{dyad}_{other}"
            if name not in groups:
                raise InputError(f"{dyads[dyad]}: there is no file of {name}, the other speaker; add or remove it.")
            if name in left_out:
                continue
            annotations: dict[str, object] = {
                "role": role,
                "partner": partner,
                "partner_speaker": speakers[other],
                "fingers": has_fingers(row, fingers[role]),
            }
            takes.append(make_take(name, groups[name], SPLITS[dyad[:3]], annotations, speakers[role]))
    return takes


DATASET = DataSet(
    name="genea2023",
    title="Talking With Hands, GENEA Challenge 2023",
    fps=30.0,
    find=find,
    read=read,
    about=(
        "genea-workshop.github.io/2023/challenge, for its participants and later in public; CC BY-NC 4.0. Name the "
        "folder of trn, val and tst; they are the official split. Both speakers of a conversation are recordings, and "
        "each names the other (annotation partner). The training set holds every conversation twice, with the roles "
        "exchanged. Main agents of the test set that come without motion are left out, with a warning."
    ),
)
