"""Samples with clips pinned to their timeline through their codes, and a report on the pins."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.generation.audio2gestures.latent_space import LatentSpace
from a2g_jax.generation.audio2gestures.pins import pin_codes
from a2g_jax.generation.drafts import Draft, enter, recorded
from a2g_jax.generation.pins.pinned import OF_CORPUS, OF_MOTIONS, jerk_limit, own_limit, pin_caption, pin_lane
from a2g_jax.generation.pins.report import Ends, report_pins
from a2g_jax.generation.pins.request import Pin, check_pins, read_pin
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
        pins = check_pins([read_pin(text, run) for text in self.texts], frames, run.config.fps)
        return Pinned(self, run, space, tuple(pins), jerk_limit(self.corpus, run))


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
        return recorded(self.drafts(audio, samples, seed))

    def drafts(self, audio: Float[np.ndarray, " N"], samples: int, seed: int = 0) -> Iterator[Draft]:
        """The motions of :meth:`stream`, which add to the reports when they are recorded."""
        edits = self.space.sampling.all_edits
        for sample in range(samples):
            codes = self.space.edit(self.space.from_audio(audio, seed, sample), *edits)
            plain = self.space.to_motion(codes)
            changed = pin_codes(self.space, codes, self.pins, blend=self.request.blend, shared=self.request.shared)
            motion = self.space.to_motion(changed)
            limit, source = self.limit, OF_CORPUS
            if limit is None:
                limit, source = own_limit([plain, *(pin.motion for pin in self.pins)]), OF_MOTIONS
            yield Draft(motion, partial(self._record, plain, limit, source))

    def _record(self, plain: Motion, limit: float, source: str, sample: int, motion: Motion) -> None:
        blend = round(self.request.blend * motion.fps)
        ends = Ends(blend, blend, blend)
        enter(self.reports, sample, report_pins(self.pins, motion, plain, limit, source, ends))

    @property
    def caption(self) -> str:
        """The clips and their seconds, for a page's subtitle."""
        return f"{pin_caption(self.pins)}, through their codes"

    def lane(self) -> "Track":
        """The pinned stretches as a lane of the page's timeline."""
        return pin_lane(self.pins)
