"""Samples with clips pinned to their timeline, and a report on the pins."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.generation.audio2gestures.latent_space import LatentSpace
from a2g_jax.generation.audio2gestures.pin_report import corpus_jerk, local_places, report_pins, wrist_jerk
from a2g_jax.generation.audio2gestures.pins import Pin, check_pins, pin_codes, read_pin
from a2g_jax.geometry.motion import Motion
from a2g_jax.training.run import Run

if TYPE_CHECKING:
    from a2g_jax.viz.player import Track


@dataclass(frozen=True)
class Pins:
    """Options of pinning."""

    texts: tuple[str, ...]
    """Each ``FILE@SECOND`` or ``FILE@SECOND+LENGTH``."""
    blend: float = 0.75
    """Seconds of blending on either side of a clip."""
    shared: float = 1.0
    """Share of a clip's own shared code that replaces the audio's, from 0 to 1.

    0 as in the paper, whose motion-specific code determines nearly everything. One at a lower rate leaves the times of
    the strokes to the shared code: with the audio's, a pinned clip gestures to the speech instead of as it was.
    """
    corpus: Corpus | None = None
    """Its 99th percentile of wrist jerk limits seams; without one, that of the clips and the unpinned sample."""

    def place(self, run: Run, frames: int) -> "Pinned":
        """The clips on a run's skeleton, for speech of ``frames`` frames.

        Raises:
            InputError: a run without codes, a clip that cannot be used, one that ends too late, or two that overlap.
        """
        space = LatentSpace(run)
        config = run.config
        skeleton = config.skeleton
        facing = np.asarray(config.space.mean_rotations(config.statistics["pose"].mean)[0], np.float64)
        pins = [read_pin(text, skeleton, config.fps, facing) for text in self.texts]
        if self.corpus is not None and not self.corpus.skeleton.same_tree(config.skeleton):
            raise InputError(f"--pin-corpus {self.corpus.path}: has another skeleton than the run.")
        limit = None if self.corpus is None else corpus_jerk(self.corpus)
        return Pinned(self, run, space, tuple(check_pins(pins, frames, config.fps)), limit)


@dataclass(frozen=True, eq=False)
class Pinned:
    """A sampler with pinned clips."""

    request: Pins
    run: Run
    space: LatentSpace
    pins: tuple[Pin, ...]
    limit: float | None
    """Limit of jerk from the corpus, m/s3; None without one."""

    reports: list[list[dict[str, Any]]] = field(default_factory=list)
    """Report on each sample of :meth:`stream` so far, from :func:`report_pins`."""

    def stream(self, audio: Float[np.ndarray, " N"], samples: int, seed: int = 0) -> Iterator[Motion]:
        """Samples of :meth:`~a2g_jax.generation.generator.Generator.stream` with the pinned clips."""
        edits = self.space.sampling.all_edits
        self.reports.clear()
        for sample in range(samples):
            codes = self.space.edit(self.space.from_audio(audio, seed, sample), *edits)
            plain = self.space.to_motion(codes)
            changed = pin_codes(self.space, codes, self.pins, blend=self.request.blend, shared=self.request.shared)
            motion = self.space.to_motion(changed)
            limit, source = self.limit, "99th percentile of the corpus"
            if limit is None:
                limit, source = self._own_limit(plain), "99th percentile of the clips and the unpinned sample"
            self.reports.append(report_pins(self.pins, motion, plain, limit, source, self.request.blend))
            yield motion

    def lane(self) -> "Track":
        """The pinned stretches as a lane of the page's timeline."""
        from a2g_jax.viz.player import Track

        spans = tuple((pin.start, pin.start + pin.motion.seconds, Path(pin.name).stem, "hold") for pin in self.pins)
        return Track("pinned", spans)

    def _own_limit(self, plain: Motion) -> float:
        motions = [plain, *(pin.motion for pin in self.pins if pin.motion.frames > 3)]
        values = [wrist_jerk(local_places(motion), motion.skeleton, motion.fps) for motion in motions]
        return float(np.percentile(np.concatenate(values), 99.0))
