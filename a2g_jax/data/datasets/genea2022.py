"""GENEA Challenge 2022: 18 hours of Talking With Hands, each speaker of a conversation on their own."""

from pathlib import Path

from a2g_jax.data.datasets.source import DataSet, Take
from a2g_jax.data.datasets.talking_with_hands import find_release, has_fingers, make_take, read

_EXPECTED = (
    "the folder that holds trn, val and tst, each with bvh, wav, tsv and a metadata table, such as "
    "trn/bvh/trn_2022_v1_000.bvh"
)
_COLUMNS = ("name", "finger_incl or finger_excl", "speaker")


def find(folder: Path) -> list[Take]:
    """All recordings under the folder, in the order of their names."""
    release = find_release(folder, 2022, _COLUMNS, _EXPECTED)
    takes = []
    for name in release.with_motion:
        row = release.rows[name]
        _, fingers, speaker = row.cells
        takes.append(make_take(release, name, speaker, {"fingers": has_fingers(row, fingers)}))
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
