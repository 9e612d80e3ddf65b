"""Your own recordings: any folder of WAV and BVH files of equal names."""

from pathlib import Path

from a2g_jax.data.datasets.source import DataSet, Take
from a2g_jax.data.folder import find_pairs, read_pair
from a2g_jax.recording import Recording


def find(folder: Path) -> list[Take]:
    """Every pair under the folder, named by its path."""
    return [
        Take(bvh.relative_to(folder).with_suffix("").as_posix(), (str(audio), str(bvh)))
        for audio, bvh in find_pairs(folder)
    ]


def read(take: Take, sample_rate: int) -> Recording:
    """A pair of files, with the words of a TextGrid beside the audio if there is one."""
    audio, bvh = take.sources
    return read_pair(Path(audio), Path(bvh), sample_rate, take.name)


DATASET = DataSet(
    name="folder",
    title="WAV and BVH files of equal names",
    fps=30.0,
    find=find,
    read=read,
    about="Side by side, or in parallel trees such as wav/ and bvh/. A TextGrid of the same name gives the words.",
)
