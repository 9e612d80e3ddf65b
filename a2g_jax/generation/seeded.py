"""Samples that continue the last poses of a clip from a file, for any model that takes seed poses."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.generation.clips import read_facing
from a2g_jax.generation.generator import Generator, plant_rotations
from a2g_jax.generation.seed_bounds import REMEDY, seed_stretches
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_rows import rotations_from_rows
from a2g_jax.geometry.pose_track import represent
from a2g_jax.metrics.body.check import Stretch
from a2g_jax.training.run import Run


@dataclass(frozen=True, eq=False)
class Seeded:
    """A sampler with seed poses."""

    generator: Generator
    seed_poses: Float[np.ndarray, "S R D"]
    notes: tuple[str, ...] = ()
    """What was left out of the clip, for the user."""

    @cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        """Bounds of the beginning."""
        run = self.generator.run
        return seed_stretches(run, plant_rotations(run, rotations_from_rows(self.seed_poses, run.config.space.kind)))

    @property
    def remedy(self) -> str:
        """What changes the first frame."""
        return REMEDY

    def stream(self, audio: Float[np.ndarray, " N"], samples: int, seed: int = 0) -> Iterator[Motion]:
        """Yield samples one after another."""
        yield from self.generator.stream(audio, samples, seed, seed_poses=self.seed_poses)


def continue_clip(run: Run, path: Path) -> Seeded:
    """A sampler whose motions continue a clip.

    Args:
        path: any humanoid BVH, or an NPZ that this package wrote.

    Raises:
        InputError: a file or rig that cannot be used, a clip that is too short, or a run without seed poses.
    """
    generator = Generator(run)
    needed, config = generator.engine.model.seed_frames, run.config
    if needed == 0:
        raise InputError(f"--seed-clip: runs of {config.model} take no seed poses.")
    motion, notes = read_facing(path, run)
    if motion.frames < needed:
        raise InputError(
            f"--seed-clip {path}: has {motion.frames} frames at the run's {motion.fps:g} fps; give a clip of"
            f" {needed} or more{_after(notes)}."
        )
    return Seeded(generator, represent(motion, config.space.kind, str(path))[0][-needed:], notes)


def _after(notes: tuple[str, ...]) -> str:
    return f" ({notes[0]})" if notes else ""
