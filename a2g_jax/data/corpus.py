"""A prepared corpus on disk: features and motion at the same frame times, as memory-mapped arrays."""

import os
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from jaxtyping import Float

from a2g_jax.data.splits import Segment, Splits
from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.rotation import matrix_from_6d
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.files import read_json

FORMAT = "a2g_jax corpus"
#: Of corpora whose recordings are all stored, and of those that leave most of them to be generated in training.
VERSION, VERSION_ON_DEMAND = 1, 2
MANIFEST = "manifest.json"
#: In a corpus of the second kind: what to generate, part by part.
PARTS = "parts.json"
#: The arrays of a corpus, all recordings one after the other: log-mel (N, bands), 6D rotations (N, J, 6), root (N, 3).
ARRAYS = ("audio.npy", "pose.npy", "root.npy")


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


@dataclass(frozen=True, eq=False)
class Corpus:
    """An open corpus; its arrays are read from disk as they are used."""

    path: Path
    fps: float
    mel: MelConfig
    skeleton: Skeleton
    recordings: tuple[Entry, ...]
    splits: Splits
    recipe: dict[str, Any]
    """How it was made: reader, source, seed, options."""
    fingerprint: str
    """SHA-256 over the hashes of its arrays: equal data, equal fingerprint."""
    on_demand: bool = False
    """Whether most training recordings are not stored but generated in training."""

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> "Corpus":
        """Open a corpus folder.

        Raises:
            InputError: not a corpus, a damaged one, or one of a later version.
        """
        path = Path(path)
        if not (path / MANIFEST).is_file():
            raise InputError(f"{path}: is not a corpus (no {MANIFEST} in it); make one with 'a2g prepare'.")
        manifest = read_json(path / MANIFEST)
        if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
            raise InputError(f"{path / MANIFEST}: is not the manifest of a corpus; make one with 'a2g prepare'.")
        if manifest.get("version") not in (VERSION, VERSION_ON_DEMAND):
            raise InputError(
                f"{path / MANIFEST}: has version {manifest.get('version')}; expected {VERSION} or"
                f" {VERSION_ON_DEMAND}; prepare it anew."
            )
        try:
            corpus = cls(
                path=path,
                fps=float(manifest["fps"]),
                mel=MelConfig(**manifest["mel"]),
                skeleton=skeleton_from_json(manifest["skeleton"]),
                recordings=tuple(Entry(**entry) for entry in manifest["recordings"]),
                splits={name: [Segment(*row) for row in rows] for name, rows in manifest["splits"].items()},
                recipe=manifest["recipe"],
                fingerprint=manifest["fingerprint"],
                on_demand=manifest["version"] == VERSION_ON_DEMAND,
            )
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise InputError(f"{path / MANIFEST}: is damaged ({error!r}); prepare the corpus anew.") from None
        corpus._check()
        return corpus

    def _check(self) -> None:
        """Shapes and bounds, so that nothing fails later, in the middle of a training."""
        where = self.path / MANIFEST
        if not 0 < self.fps < 10_000:
            raise InputError(f"{where}: is damaged (fps is {self.fps}); prepare the corpus anew.")
        for name, segments in self.splits.items():
            for index, start, stop in segments:
                if not (0 <= index < len(self.recordings) and 0 <= start < stop <= self.recordings[index].frames):
                    raise InputError(f"{where}: is damaged ({name} holds {[index, start, stop]}); prepare it anew.")
        shapes = {"audio": (self.mel.bands,), "pose": (self.skeleton.joints, 6), "root": (3,)}
        for name, statistics in self.statistics.items():
            if not statistics.mean.shape == statistics.std.shape == shapes[name] or not np.all(statistics.std > 0):
                raise InputError(f"{self.path / 'statistics.npz'}: is damaged ({name}); prepare the corpus anew.")
        if self.on_demand:
            self._check_parts()
        frames, joints = self.frames, self.skeleton.joints
        for name, shape in zip(ARRAYS, ((frames, self.mel.bands), (frames, joints, 6), (frames, 3)), strict=True):
            array = self._array(name)
            if array.shape != shape or array.dtype != np.float32:
                raise InputError(
                    f"{self.path / name}: expected float32 {shape}; got {array.dtype} {array.shape}; prepare anew."
                )

    def _check_parts(self) -> None:
        parts = self.later.get("parts") if isinstance(self.later, dict) else None
        if not (parts and all(isinstance(roles, list) and roles for roles in parts) and self.later.get("stored")):
            raise InputError(f"{self.path / PARTS}: is damaged; prepare the corpus anew.")

    def _array(self, name: str) -> np.ndarray:
        try:
            return np.load(self.path / name, mmap_mode="r", allow_pickle=False)
        except (OSError, ValueError, EOFError) as error:
            raise InputError(f"{self.path / name}: cannot be read ({error}); prepare the corpus anew.") from None

    @cached_property
    def later(self) -> dict[str, Any]:
        """What is generated in training: see :mod:`a2g_jax.data.on_demand`; nothing for an ordinary corpus."""
        return read_json(self.path / PARTS) if self.on_demand else {}

    @property
    def parts(self) -> int:
        """Parts that training takes in turns: the stored recordings, and those that are generated."""
        return 1 + len(self.later.get("parts", ()))

    @property
    def frames(self) -> int:
        """Number of frames of all stored recordings together."""
        return sum(entry.frames for entry in self.recordings)

    @cached_property
    def audio(self) -> Float[np.ndarray, "N bands"]:
        """Log-mel energies in dB."""
        return self._array("audio.npy")

    @cached_property
    def pose(self) -> Float[np.ndarray, "N J 6"]:
        """Local rotations, first two columns of each matrix."""
        return self._array("pose.npy")

    @cached_property
    def root(self) -> Float[np.ndarray, "N 3"]:
        """Root positions, metres."""
        return self._array("root.npy")

    @cached_property
    def statistics(self) -> dict[str, Statistics]:
        """``audio`` (bands,), ``pose`` (J, 6) and ``root`` (3,), over the training split only."""
        path = self.path / "statistics.npz"
        try:
            with np.load(path, allow_pickle=False) as arrays:
                return {
                    name: Statistics(arrays[f"{name}_mean"], arrays[f"{name}_std"])
                    for name in ("audio", "pose", "root")
                }
        except (OSError, ValueError, KeyError, EOFError, BadZipFile) as error:
            raise InputError(f"{path}: cannot be read ({error}); prepare the corpus anew.") from None

    def segments(self, split: str) -> list[Segment]:
        """The stretches of a split, as rows of the arrays.

        Raises:
            InputError: no such split, or an empty one.
        """
        if not self.splits.get(split):
            there = ", ".join(name for name, rows in self.splits.items() if rows)
            raise InputError(f"{self.path}: has no split {split!r}; there are: {there}.")
        return [
            Segment(index, self.recordings[index].first + start, self.recordings[index].first + stop)
            for index, start, stop in self.splits[split]
        ]

    def motion(self, start: int, stop: int) -> Motion:
        """The motion in rows ``start`` to ``stop`` of the arrays."""
        rotations = np.asarray(matrix_from_6d(np.asarray(self.pose[start:stop])))
        return Motion(rotations, np.asarray(self.root[start:stop]), self.skeleton, self.fps)

    def annotations(self, recording: int) -> dict[str, Any]:
        """Words and whatever else is known about a recording; times in seconds."""
        return read_json(self.path / "annotations" / f"{recording:05d}.json")


def skeleton_to_json(skeleton: Skeleton) -> dict[str, Any]:
    """A skeleton as JSON values."""
    return {
        "names": list(skeleton.names),
        "parents": list(skeleton.parents),
        "offsets": np.asarray(skeleton.offsets).tolist(),
        "ends": [[joint, list(offset)] for joint, offset in skeleton.ends],
    }


def skeleton_from_json(value: dict[str, Any]) -> Skeleton:
    """Inverse of :func:`skeleton_to_json`."""
    return Skeleton(
        offsets=np.asarray(value["offsets"], np.float32).reshape(-1, 3),
        names=tuple(value["names"]),
        parents=tuple(value["parents"]),
        ends=tuple((int(joint), (float(x), float(y), float(z))) for joint, (x, y, z) in value.get("ends", [])),
    )


def mel_to_json(mel: MelConfig) -> dict[str, Any]:
    """Settings of the audio features as JSON values."""
    return asdict(mel)
