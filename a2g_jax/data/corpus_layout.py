"""The files of a corpus folder, and the entry of a recording in its manifest."""

from dataclasses import asdict, dataclass
from typing import Any

FORMAT = "a2g_jax corpus"
#: Versions of corpora that store all recordings, and of those that generate most of them in training.
VERSION, VERSION_ON_DEMAND = 1, 2
MANIFEST = "manifest.json"
#: In place of the manifest, in a part of a corpus that is prepared on one of several machines.
SHARD = "shard.json"
#: In a corpus of the second kind: the recipes of the recordings to generate, part by part.
PARTS = "parts.json"
#: The arrays of a corpus, all recordings one after the other: log-mel (N, width), poses (N, R, D), root (N, 3).
ARRAYS = ("audio.npy", "pose.npy", "root.npy")
#: Folder of a JSON file for each recording: its words and other annotations.
ANNOTATIONS = "annotations"
#: The audio itself, where it is stored: 16-bit samples, as many for each recording as its frames last.
WAVEFORM = "waveform.npy"


@dataclass(frozen=True)
class Entry:
    """One recording of a corpus."""

    name: str
    first: int
    """Row of its first frame in the arrays."""
    frames: int
    speaker: str
    emotion: str
    sources: dict[str, str]
    """SHA-256 of each file it was read from."""
    split: str = ""
    """Its part of the data set by its authors; empty where there is none."""
    first_sample: int = 0
    """Row of its first sample in the waveform."""
    samples: int = 0
    """Number of samples; 0 where the corpus stores no audio."""
    waveform_gain: float = 1.0
    """What its stored samples were multiplied by (:mod:`a2g_jax.data.scaled_waveform`)."""

    def to_json(self) -> dict[str, Any]:
        """The entry as JSON values, without a gain of 1."""
        values = asdict(self)
        return {name: value for name, value in values.items() if name != "waveform_gain" or value != 1.0}
