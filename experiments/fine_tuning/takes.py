"""Real takes: a corpus of each, and its end, which no training sees."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.prepare import prepare_data_set
from a2g_jax.data.settings import Features
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.audio import read_audio
from a2g_jax.io.bvh import read_bvh
from a2g_jax.training.run import RunConfig
from experiments.motion.speeches import SAMPLE_RATE, Speech


@dataclass(frozen=True, eq=False)
class TakeData:
    """A take prepared for a run."""

    name: str
    corpus: Corpus
    trained: Speech
    """The first 80 %, the training split, with the person's motion."""
    held_out: Speech
    """The rest."""
    rate: float
    """Frame rate of the recording, or the run's if that is lower: what interpolation adds between frames is no motion
    of the person."""

    def at_rate(self, motion: Motion) -> Motion:
        """A motion at that rate: every frame, or every second one, that the recording has too."""
        step = max(1, round(motion.fps / self.rate))
        rotations, root = np.asarray(motion.rotations)[::step], np.asarray(motion.root)[::step]
        return replace(motion, rotations=rotations, root=root, fps=motion.fps / step)

    def person(self, speech: Speech) -> list[Motion]:
        """The person's own motion for one of the two speeches."""
        assert speech.truth is not None
        return [self.at_rate(speech.truth)]


def find_takes(folder: Path) -> dict[str, Path]:
    """BVH files that have a WAV file beside them, by the names of their folders."""
    found = {}
    for bvh in sorted(folder.rglob("*.bvh")):
        if bvh.with_suffix(".wav").is_file():
            found[bvh.parent.name] = bvh
    return found


def prepare_take(name: str, bvh: Path, config: RunConfig, cache: Path) -> TakeData:
    """The take as ``a2g prepare folder DIR --out CORPUS --for RUN`` prepares it; kept in ``cache``."""
    if not (cache / "manifest.json").is_file():
        features = Features(config.fps, config.mel, config.space.kind, "all")
        source = cache.parent / f"{cache.name}_files"
        source.mkdir(parents=True, exist_ok=True)
        # A folder of this take alone: other takes may lie beside it.
        for file in (bvh, bvh.with_suffix(".wav")):
            if not (source / file.name).exists():
                (source / file.name).symlink_to(file.resolve())
        prepare_data_set("folder", source, cache, features, workers=1, skeleton=config.skeleton)
    corpus = Corpus.open(cache)
    audio = read_audio(bvh.with_suffix(".wav"), SAMPLE_RATE)
    (train,) = corpus.segments("train")
    held = (train.stop, corpus.frames)
    speeches = (_speech(name, audio, corpus, part) for part in ((train.start, train.stop), held))
    return TakeData(name, corpus, *speeches, min(read_bvh(bvh).fps, corpus.fps))


def _speech(name: str, audio: np.ndarray, corpus: Corpus, rows: tuple[int, int]) -> Speech:
    first, last = (round(row / corpus.fps * SAMPLE_RATE) for row in rows)
    return Speech(name, audio[first:last], name, corpus.motion(*rows))
