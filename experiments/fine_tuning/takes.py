"""Real takes in five contiguous parts: for each part a corpus of the others, prepared without it, and its speech."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_files import write_statistics
from a2g_jax.data.corpus_layout import MANIFEST
from a2g_jax.data.corpus_manifest import fingerprint_of
from a2g_jax.data.corpus_writer import prepare_recording, write_corpus
from a2g_jax.data.folder import read_pair
from a2g_jax.data.settings import Features
from a2g_jax.data.splits import Segment
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.files import read_json, sha256_file
from a2g_jax.io.sealed import write_sealed
from a2g_jax.recording import Recording
from a2g_jax.training.run import RunConfig
from experiments.motion.speeches import SAMPLE_RATE, Speech

#: Parts of a take; each is held out once.
FOLDS = 5


class Spoken(NamedTuple):
    """Motions for one speech."""

    motions: Sequence[Motion]
    speech: Speech


@dataclass(frozen=True, eq=False)
class Fold:
    """A take without one of its parts, prepared for a run."""

    take: str
    number: int
    corpus: Corpus
    """The rest of the take, in one or two recordings, all of it for training."""
    held_out: Speech
    """The part, with the person's motion; nothing of it is in the corpus or its statistics."""
    others: tuple[Speech, ...]
    """The recordings of the corpus."""
    rate: float
    """Frame rate of the recording, or the run's if that is lower: what interpolation adds between frames is no motion
    of the person."""

    def at_rate(self, motion: Motion) -> Motion:
        """A motion at that rate: every frame, or every second one, that the recording has too."""
        step = max(1, round(motion.fps / self.rate))
        rotations, root = np.asarray(motion.rotations)[::step], np.asarray(motion.root)[::step]
        return replace(motion, rotations=rotations, root=root, fps=motion.fps / step)

    def person(self, speech: Speech) -> Spoken:
        """The person's own motion for one of the speeches."""
        assert speech.truth is not None
        return Spoken([self.at_rate(speech.truth)], speech)


def find_takes(folder: Path) -> dict[str, Path]:
    """BVH files that have a WAV file beside them, by the names of their folders."""
    found = {}
    for bvh in sorted(folder.rglob("*.bvh")):
        if bvh.with_suffix(".wav").is_file():
            found[bvh.parent.name] = bvh
    return found


def bounds(frames: int, number: int, shift: float = 0.0) -> tuple[int, int]:
    """First frame, and the one after the last, of a part of a take.

    Args:
        shift: in parts; parts that are not whole are left out.
    """
    first, last = (round((number + shift + edge) * frames / FOLDS) for edge in (0, 1))
    return first, last


def prepare_folds(name: str, bvh: Path, config: RunConfig, cache: Path, shift: float = 0.0) -> list[Fold]:
    """The take for every part that may be held out; corpora are kept in ``cache``.

    Each piece of training motion is retargeted, and its audio normalised, as a recording of its own, so that nothing of
    the held-out part enters.
    """
    whole = read_pair(bvh.with_suffix(".wav"), bvh, SAMPLE_RATE)
    frames = whole.motion.frames
    folds = []
    for number in range(FOLDS if shift == 0.0 else FOLDS - 1):
        first, last = bounds(frames, number, shift)
        rest = [_piece(whole, *edges) for edges in ((0, first), (last, frames)) if edges[1] > edges[0]]
        held = _piece(whole, first, last)
        place = cache / f"{shift:g}_{number}"
        corpus = _corpus(place / "others", rest, config)
        alone = _corpus(place / "held_out", [held], config)
        rate = min(whole.motion.fps, corpus.fps)
        others = tuple(_speech(name, piece, corpus, index) for index, piece in enumerate(rest))
        folds.append(Fold(name, number, corpus, _speech(name, held, alone, 0), others, rate))
    return folds


def _piece(whole: Recording, first: int, last: int) -> Recording:
    """Frames of a recording as a recording of its own; words are left out."""
    motion, rate = whole.motion, whole.sample_rate / whole.motion.fps
    cut = replace(motion, rotations=np.asarray(motion.rotations)[first:last], root=np.asarray(motion.root)[first:last])
    audio = whole.audio[round(first * rate) : round(last * rate)]
    return replace(whole, name=f"{whole.name}_{first}", audio=audio, motion=cut, words=(), speaker="", emotion="")


def _corpus(folder: Path, pieces: Sequence[Recording], config: RunConfig) -> Corpus:
    """A corpus of all pieces for training, as ``a2g prepare --for RUN`` prepares them."""
    if not (folder / MANIFEST).is_file():
        features = Features(config.fps, config.mel, config.space.kind, "all")
        prepared = [prepare_recording(piece, features, skeleton=config.skeleton) for piece in pieces]
        corpus = write_corpus(folder, prepared, features=features, recipe={"reader": "folder"})
        splits = {"train": [Segment(index, 0, entry.frames) for index, entry in enumerate(corpus.recordings)]}
        write_statistics(folder, corpus.recordings, splits)
        _write_splits(folder, splits)
    return Corpus.open(folder)


def _write_splits(folder: Path, splits: dict[str, list[Segment]]) -> None:
    """Write other splits, and the hashes that changed with the statistics of their training part."""
    manifest = read_json(folder / MANIFEST)
    hashes = manifest["arrays"] | {"statistics.npz": sha256_file(folder / "statistics.npz")}
    write_sealed(
        folder / MANIFEST, manifest | {"splits": splits, "arrays": hashes, "fingerprint": fingerprint_of(hashes)}
    )


def _speech(name: str, piece: Recording, corpus: Corpus, index: int) -> Speech:
    entry = corpus.recordings[index]
    return Speech(name, piece.audio, name, corpus.motion(entry.first, entry.first + entry.frames))
