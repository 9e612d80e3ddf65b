"""A run with the speeches that its controls are measured on."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.features.hand_properties import PROPERTIES, hand_properties
from a2g_jax.generation.controls import control_rows, controls_of
from a2g_jax.generation.generator import Generator, speech_features
from a2g_jax.geometry.joint_names import named_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.training.run import Run
from experiments.motion.speeches import SAMPLE_RATE, Speech

Rows = Float[np.ndarray, "T R D"]

#: Seconds of every speech that are generated.
SECONDS = 30.0
#: Seconds of the parts of true motion whose properties are the unit of side effects.
PART_SECONDS = 4.0


class Figures(NamedTuple):
    """Measured on one motion."""

    properties: Float[np.ndarray, " 5"]
    """:data:`~a2g_jax.features.hand_properties.PROPERTIES`."""
    jerk: Float[np.ndarray, " J"]
    """Of both wrists relative to the root, m/s3, not smoothed."""
    agreement: float
    """With the speech, as in :func:`a2g_jax.metrics.rhythm.agreement`."""
    excess: float
    """The same less that of the shifted motion."""


class Ruler:
    """Measures poses of one body at one frame rate; compiled once for each length."""

    def __init__(self, space: PoseSpace, fps: float) -> None:
        self.space, self.fps = space, fps
        joints = named_joints(space.skeleton.names)
        self._wrists = np.array([joints["L_Wrist"], joints["R_Wrist"]])
        self._properties = jax.jit(lambda hands, root: hand_properties(hands, root, fps))

    def hands(self, rows: Rows) -> tuple[Float[np.ndarray, "T 2 3"], Float[np.ndarray, "T 3"]]:
        """Both wrists and the root, metres."""
        places = np.asarray(self.space.positions(rows))
        return places[:, self._wrists], places[:, 0]

    def properties(self, rows: Rows) -> Float[np.ndarray, " 5"]:
        """:data:`~a2g_jax.features.hand_properties.PROPERTIES` of poses."""
        return np.asarray(self._properties(*self.hands(rows)))

    def parts(self, rows: Rows, seconds: float = PART_SECONDS) -> Float[np.ndarray, "P 5"]:
        """The same of consecutive parts; a remainder is left out."""
        frames = round(seconds * self.fps)
        firsts = range(0, len(rows) - frames + 1, frames)
        return np.array([self.properties(rows[first : first + frames]) for first in firsts])

    def jerk(self, rows: Rows) -> Float[np.ndarray, " J"]:
        """Jerk of both wrists relative to the root, m/s3."""
        hands, root = self.hands(rows)
        third = np.diff(hands - root[:, None], n=3, axis=0) * self.fps**3
        found: Float[np.ndarray, " J"] = np.linalg.norm(third, axis=-1).ravel()
        return found


@dataclass(frozen=True, eq=False)
class Subject:
    """A run, and the speeches that it generates motion for."""

    run: Run
    speeches: Sequence[Speech]
    draws: int
    """Motions for each speech, with keys of their own."""
    seed: int
    """Of the first speech; the next one has the next."""

    @cached_property
    def ruler(self) -> Ruler:
        """Measures the run's poses."""
        return Ruler(self.run.config.space, self.run.config.fps)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Controls that are quantiles."""
        controls = controls_of(self.run)
        return tuple(name for name in controls.names if name not in controls.categories)

    @cached_property
    def training(self) -> dict[str, Float[np.ndarray, " N"]]:
        """Values of the training clips that the quantiles of each control refer to."""
        stored = self.run.summary
        table = stored.get("clip_properties", stored.get("control_mean"))
        columns = np.asarray(table, np.float64).reshape(-1, np.shape(table)[-1])
        return dict(zip(self.names, columns.T, strict=True))

    @cached_property
    def _generator(self) -> Generator:
        return Generator(self.run)

    @cached_property
    def _features(self) -> list[Any]:
        return [speech_features(self.run, speech.audio[: round(SECONDS * SAMPLE_RATE)]) for speech in self.speeches]

    def rows(self, lines: Sequence[str]) -> Iterator[tuple[Speech, Rows]]:
        """Every motion with the requested controls, speech by speech; without a request for no lines.

        Each speech has a seed of its own: with one seed, speeches get the same stored codes at the same second.
        """
        for number, (speech, features) in enumerate(zip(self.speeches, self._features, strict=True)):
            given = {"controls": control_rows(self.run, lines, len(features))} if lines else {}
            for rows in self._generator.rows(features, self.draws, self.seed + number, **given):
                yield speech, rows

    def measure(self, lines: Sequence[str]) -> list[Figures]:
        """Figures of every motion; :attr:`draws` of one speech follow one another."""
        return [self.figures(speech, rows) for speech, rows in self.rows(lines)]

    def figures(self, speech: Speech, rows: Rows) -> Figures:
        """Figures of one motion."""
        space, fps = self.run.config.space, self.run.config.fps
        rotations = np.asarray(space.rotations(jnp.asarray(rows)))
        motion = Motion(rotations, np.zeros((len(rows), 3), np.float32), space.skeleton, fps)
        cut = Speech(speech.name, speech.audio[: round(SECONDS * SAMPLE_RATE)], speech.speaker, None)
        found = cut.agreement(motion)
        return Figures(self.ruler.properties(rows), self.ruler.jerk(rows), found.value, found.value - found.null_mean)


def by_speech(values: Float[np.ndarray, " N"], draws: int) -> Float[np.ndarray, "S draws"]:
    """Values of motions as a row for each speech."""
    return np.asarray(values).reshape(-1, draws)


def column(figures: Sequence[Figures], name: str) -> Float[np.ndarray, " N"]:
    """One property of every motion."""
    return np.array([one.properties[PROPERTIES.index(name)] for one in figures])
