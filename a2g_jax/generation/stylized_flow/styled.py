"""Samples in the style or with the seed poses of clips from files."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.generation.clips import read_facing
from a2g_jax.generation.stylized_flow.latent_space import FlowSpace
from a2g_jax.generation.stylized_flow.style import Style, blend
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.audio import read_audio
from a2g_jax.training.run import Run

#: Shortest clip that a style is taken from, seconds: shorter ones have a pose or two, and no style.
SHORTEST = 1.0


@dataclass(frozen=True)
class Clip:
    """A motion file, optionally with its speech."""

    flag: str
    """The option that named it, for messages."""
    path: Path
    audio: Path | None = None


@dataclass(frozen=True)
class Styling:
    """Options of styled generation."""

    style: Clip | None = None
    second: Clip | None = None
    """Blended with the first."""
    seed_clip: Clip | None = None
    """Motion whose last poses are the seed poses of the samples."""
    share: float = 0.9
    """Share of the style; the rest is drawn."""
    mode: str = "repeat"
    """See :mod:`a2g_jax.generation.stylized_flow.style`."""
    mix: float = 0.5
    """Share of the second clip in the blend."""

    @property
    def label(self) -> str:
        """Description for a page's heading."""
        words = []
        if self.style is not None:
            other = "" if self.second is None else f" and {self.second.path.name} ({self.mix:g})"
            words.append(f"style of {self.style.path.name}{other}, share {self.share:g}, {self.mode}")
        if self.seed_clip is not None:
            words.append(f"continuing {self.seed_clip.path.name}")
        return ", ".join(words)

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings for the user."""
        silent = [clip for clip in (self.style, self.second) if clip is not None and clip.audio is None]
        return tuple(f"{clip.path}: encoded with silence; give its speech with {clip.flag}-audio" for clip in silent)

    def place(self, run: Run, samples: int) -> "Styled":
        """The clips, encoded with a run.

        Raises:
            InputError: a run of another model, a clip that cannot be used, or samples that would all be the same.
        """
        space = FlowSpace(run)
        if self.style is not None and self.share == 1.0 and self.mode == "repeat" and samples > 1:
            raise InputError(
                "--style-share 1: draws nothing, so that all samples would be equal; use --samples 1, a smaller share,"
                " or --style-mode statistics."
            )
        style = seed = None
        if self.style is not None:
            style = self._style(space, self.style)
            if self.second is not None:
                style = blend(style, self._style(space, self.second), self.mix)
        if self.seed_clip is not None:
            seed = read_facing(self.seed_clip.path, run)
            if seed.frames < space.history:
                raise InputError(
                    f"{self.seed_clip.flag} {self.seed_clip.path}: has {seed.frames} frames at the run's"
                    f" {seed.fps:g} fps; give a clip of {space.history} or more."
                )
        return Styled(space, style, seed)

    def _style(self, space: FlowSpace, clip: Clip) -> Style:
        motion = read_facing(clip.path, space.run)
        if motion.seconds < SHORTEST:
            raise InputError(
                f"{clip.flag} {clip.path}: lasts {motion.seconds:.2f} s; give a clip of {SHORTEST:g} s or more."
            )
        audio = None if clip.audio is None else read_audio(clip.audio, space.run.config.mel.sample_rate)
        return space.style(motion, audio, self.mode, self.share, name=f"{clip.flag} {clip.path}")


@dataclass(frozen=True, eq=False)
class Styled:
    """A sampler with a style and seed poses."""

    space: FlowSpace
    style: Style | None
    seed_poses: Motion | None

    def stream(self, audio: Float[np.ndarray, " N"], samples: int, seed: int = 0) -> Iterator[Motion]:
        """Yield samples one after another."""
        yield from self.space.stream(audio, samples, seed, self.style, self.seed_poses)
