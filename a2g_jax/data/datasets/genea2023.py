"""GENEA Challenge 2023: conversations of Talking With Hands, both speakers."""

from pathlib import Path

from a2g_jax.data.datasets.source import DataSet, Take
from a2g_jax.data.datasets.talking_with_hands import find_release, has_fingers, make_take, read
from a2g_jax.errors import InputError

_EXPECTED = (
    "the folder that holds trn, val and tst, each with metadata.csv, main-agent and interloctr, such as "
    "trn/main-agent/bvh/trn_2023_v0_000_main-agent.bvh"
)
_ROLES = ("main-agent", "interloctr")
_COLUMNS = ("prefix", "main-agent_id", "main-agent_has_fingers", "interloctr_id", "interloctr_has_fingers")


def find(folder: Path) -> list[Take]:
    """Both speakers of every conversation under the folder, in the order of the conversations' names."""
    release = find_release(folder, 2023, _COLUMNS, _EXPECTED, _ROLES)
    takes = []
    for conversation, row in sorted(release.rows.items()):
        speakers = dict(zip(_ROLES, row.cells[1::2], strict=True))
        fingers = dict(zip(_ROLES, row.cells[2::2], strict=True))
        for role, other in (_ROLES, _ROLES[::-1]):
            name, partner = f"{conversation}_{role}", f"{conversation}_{other}"
            if name not in release.files:
                path = min(release.files[partner].values())
                raise InputError(f"{path}: there is no file of {name}, the other speaker; add or remove it.")
            if name not in release.with_motion:
                continue
            annotations: dict[str, object] = {
                "role": role,
                "partner": partner,
                "partner_speaker": speakers[other],
                "fingers": has_fingers(row, fingers[role]),
            }
            takes.append(make_take(release, name, speakers[role], annotations))
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
