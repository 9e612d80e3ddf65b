"""A prepared corpus on disk: features and motion at the same frame times."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int16, Int32, Int64

from a2g_jax.data.corpus_files import read_json_file, read_statistics
from a2g_jax.data.corpus_layout import ANNOTATIONS, PARTS, WAVEFORM, Entry
from a2g_jax.data.corpus_manifest import read_manifest
from a2g_jax.data.frame_labels import label_rows, word_rows
from a2g_jax.data.scaled_waveform import ScaledWaveform
from a2g_jax.data.splits import Segment, Splits
from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.stored_array import StoredArray


@dataclass(frozen=True, eq=False)
class Corpus:
    """An open corpus; its arrays are read from disk piece by piece."""

    path: Path
    fps: float
    mel: MelConfig
    space: PoseSpace
    """The body, and the kind of numbers that its poses are written in."""
    recordings: tuple[Entry, ...]
    splits: Splits
    recipe: dict[str, Any]
    """How it was made: reader, source, seed, options."""
    fingerprint: str
    """SHA-256 over the hashes of its arrays: equal data, equal fingerprint."""
    on_demand: bool = False
    """Whether most training recordings are generated during training instead of stored."""
    hashes: Mapping[str, str] = field(default_factory=dict)
    """SHA-256 of its arrays, statistics and recipes by file name."""
    annotation_hashes: tuple[str, ...] = ()
    """SHA-256 of the annotations of each recording; empty in corpora of version 0.1.0."""

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> "Corpus":
        """Open a corpus folder.

        Raises:
            InputError: not a corpus, a damaged one, or one of a later version.
        """
        path = Path(path)
        corpus = cls(path=path, **read_manifest(path))
        corpus._check()
        return corpus

    def _check(self) -> None:
        """Check the shapes of the arrays, so that nothing fails in the middle of a training."""
        shapes = {"audio": (self.mel.width,), "pose": self.space.shape, "root": (3,)}
        for name, statistics in self.statistics.items():
            if not statistics.mean.shape == statistics.std.shape == shapes[name] or not np.all(statistics.std > 0):
                raise InputError(f"{self.path / 'statistics.npz'}: is damaged ({name}); prepare the corpus anew.")
        if self.on_demand:
            self._check_parts()
        expected: dict[str, tuple[Any, tuple[int, ...]]] = {
            f"{name}.npy": (np.float32, (self.frames, *shape)) for name, shape in shapes.items()
        }
        if samples := sum(entry.samples for entry in self.recordings):
            expected[WAVEFORM] = (np.int16, (samples,))
        for name, (kind, shape) in expected.items():
            array = self._samples if name == WAVEFORM else getattr(self, name.removesuffix(".npy"))
            if array.shape != shape or array.dtype != kind:
                raise InputError(
                    f"{self.path / name}: expected {np.dtype(kind)} {shape}; got {array.dtype} {array.shape}; prepare"
                    " anew."
                )

    def _check_parts(self) -> None:
        parts = self.later.get("parts") if isinstance(self.later, dict) else None
        if not (parts and all(isinstance(roles, list) and roles for roles in parts) and self.later.get("stored")):
            raise InputError(f"{self.path / PARTS}: is damaged; prepare the corpus anew.")

    @cached_property
    def later(self) -> dict[str, Any]:
        """Recipes of recordings that are generated in training (:mod:`a2g_jax.data.on_demand`); else empty."""
        return read_json_file(self.path / PARTS, self.hashes.get(PARTS)) if self.on_demand else {}

    @property
    def body(self) -> Skeleton | PoseLayout:
        """Rows of a pose: joints of a skeleton, or points and bones."""
        return self.space.body

    @property
    def skeleton(self) -> Skeleton:
        """The skeleton whose rotations the corpus holds.

        Raises:
            InputError: it holds keypoints or directions.
        """
        self.require_rotations()
        return self.space.skeleton

    def require_rotations(self) -> None:
        """Refuse a corpus of other poses.

        Raises:
            InputError: the corpus holds keypoints or directions.
        """
        if not self.space.has_rotations:
            remedy = "this needs a corpus of rotations (prepared with --pose 6d, exponential or euler)"
            raise InputError(f"{self.path}: holds {self.space.noun} and no skeleton; {remedy}.")

    def require_pose(self, *kinds: str) -> None:
        """Refuse a corpus of other kinds of poses.

        Raises:
            InputError: the corpus holds poses of none of the kinds.
        """
        if self.space.kind not in kinds:
            raise InputError(
                f"{self.path}: holds poses as {self.space.kind}; this needs {' or '.join(kinds)}."
                f" Prepare one with --pose {kinds[0]}."
            )

    def require_emotions(self) -> None:
        """Refuse a corpus with recordings that have no emotion.

        Raises:
            InputError: there are some.
        """
        without = [entry.name for entry in self.recordings if not entry.emotion]
        if without:
            raise InputError(
                f"{self.path}: {len(without)} of {len(self.recordings)} recordings have no emotion, such as"
                f" {without[0]}; leave them out with 'a2g prepare ... --labelled', or label them with 'a2g label'."
            )

    @cached_property
    def emotions(self) -> tuple[str, ...]:
        """Emotions of the corpus, including recordings to be generated, in alphabetical order."""
        later = self.recipe.get("emotions", ()) if self.on_demand else ()
        return tuple(sorted({*later, *(entry.emotion for entry in self.recordings)}))

    @cached_property
    def speakers(self) -> tuple[str, ...]:
        """Speakers of the corpus, likewise."""
        later = self.recipe.get("speakers", ()) if self.on_demand else ()
        return tuple(sorted({*later, *(entry.speaker for entry in self.recordings)}))

    @cached_property
    def labels(self) -> Int32[np.ndarray, "N 2"]:
        """Indices into :attr:`emotions` and :attr:`speakers` of each row."""
        recordings = [(entry.emotion, entry.speaker, entry.frames) for entry in self.recordings]
        return label_rows(self.emotions, self.speakers, recordings)

    @property
    def parts(self) -> int:
        """Number of parts that training takes in turns: the stored recordings, and those that are generated."""
        return 1 + len(self.later.get("parts", ()))

    @property
    def frames(self) -> int:
        """Number of frames of all stored recordings together."""
        return sum(entry.frames for entry in self.recordings)

    @cached_property
    def audio(self) -> Float[StoredArray, "N width"]:
        """Log-mel energies in dB."""
        return StoredArray(self.path / "audio.npy")

    @cached_property
    def pose(self) -> Float[StoredArray, "N R D"]:
        """Poses in the corpus's :attr:`space`; in 6D the first two columns of each local rotation."""
        return StoredArray(self.path / "pose.npy")

    @cached_property
    def root(self) -> Float[StoredArray, "N 3"]:
        """Root positions, metres."""
        return StoredArray(self.path / "root.npy")

    @cached_property
    def _samples(self) -> Int16[StoredArray, " samples"]:
        return StoredArray(self.path / WAVEFORM)

    @cached_property
    def waveform(self) -> "StoredArray | ScaledWaveform":
        """The audio itself, at ``mel.sample_rate``, in units of 16-bit samples.

        Raises:
            InputError: the corpus does not store it.
        """
        if not any(entry.samples for entry in self.recordings):
            raise InputError(f"{self.path}: stores no waveforms; prepare it with --waveform.")
        if all(entry.waveform_gain == 1.0 for entry in self.recordings):
            return self._samples
        return ScaledWaveform(self._samples, self.recordings)

    def array(self, name: str) -> "np.ndarray | StoredArray | ScaledWaveform":
        """An array that batches are gathered from: a row a frame, and ``waveform`` with a row a sample.

        Args:
            name: one of :data:`a2g_jax.data.batch.FIELDS`' arrays.

        Raises:
            InputError: the corpus does not have it, such as words where no recording has a transcript.
        """
        if name in ("emotion", "speaker"):
            return self.labels[:, ("emotion", "speaker").index(name)]
        if name in ("words", "word_starts"):
            if not self.has_words:
                raise InputError(f"{self.path}: none of its recordings has words; prepare them with transcripts.")
            return self._words[("words", "word_starts").index(name)]
        if name == "waveform_start":
            return self._first_samples
        stored: StoredArray | ScaledWaveform = getattr(self, name)  # audio, pose or waveform
        return stored

    @cached_property
    def _words(self) -> tuple[Int32[np.ndarray, " N"], Bool[np.ndarray, " N"]]:
        rows = [
            word_rows(self.annotations(index).get("words", ()), self.fps, entry.frames)
            for index, entry in enumerate(self.recordings)
        ]
        words, starts = (np.concatenate(part) for part in zip(*rows, strict=True))
        return words, starts

    @property
    def has_words(self) -> bool:
        """Whether any recording has a transcript."""
        return bool(self._words[0].any())

    @cached_property
    def vocabulary(self) -> tuple[str, ...]:
        """The words of all recordings' transcripts without case, in alphabetical order."""
        rows = (self.annotations(index).get("words", ()) for index in range(len(self.recordings)))
        return tuple(sorted({str(word["text"]).strip().casefold() for words in rows for word in words}))

    @cached_property
    def _first_samples(self) -> Int64[np.ndarray, " N"]:
        """Row in the waveform of the first sample of each frame."""
        step = self.mel.sample_rate / self.fps
        rows = [entry.first_sample + np.rint(np.arange(entry.frames) * step) for entry in self.recordings]
        return np.concatenate(rows).astype(np.int64)

    @cached_property
    def statistics(self) -> dict[str, Statistics]:
        """``audio`` (width,), ``pose`` (R, D) and ``root`` (3,), over the training split only."""
        path = self.path / "statistics.npz"
        return read_statistics(path, self.hashes.get(path.name))

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
        """The motion in rows ``start`` to ``stop`` of the arrays.

        Raises:
            InputError: the corpus holds no rotations.
        """
        self.require_rotations()
        return self.space.motion(np.asarray(self.pose[start:stop]), self.fps, np.asarray(self.root[start:stop]))

    def annotations(self, recording: int) -> dict[str, Any]:
        """Words and other annotations of a recording; times in seconds."""
        expected = self.annotation_hashes[recording] if self.annotation_hashes else None
        found: dict[str, Any] = read_json_file(self.path / ANNOTATIONS / f"{recording:05d}.json", expected)
        return found
