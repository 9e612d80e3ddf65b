"""The data that metrics are computed from: a motion and its target, several motions for a clip, or a whole split."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Array, Float, Int

from a2g_jax.metrics import beats, pointwise
from a2g_jax.metrics.units import OURS, Units

Pose = Float[np.ndarray, "T R D"]
Points = Float[np.ndarray, "T P _"]
Rotations = Float[np.ndarray, "T R 3 3"]
Features = Float[np.ndarray, "_ F"]


@runtime_checkable
class FeatureExtractor(Protocol):
    """A trained network whose features learned metrics compare."""

    @property
    def clip_frames(self) -> int:
        """Frames of a clip, from which one feature vector is taken."""

    def blocks(self, pose: Float[np.ndarray, "B T R D"]) -> list[Float[np.ndarray, "B T _"]]:
        """Features of every block, frame by frame."""


@runtime_checkable
class EmotionClassifier(Protocol):
    """A trained classifier of emotions in motion."""

    def accuracy(self, pose: Pose, emotion: str) -> float:
        """Share of the motion's clips that are classified as the emotion; NaN where it is not defined."""


class PairContext(NamedTuple):
    """A motion's points and its target's, as arrays that JAX may trace: all metrics over it share one program."""

    positions: Float[Array | np.ndarray, "T P D"]
    """Metres, or the corpus's own unit; the root is at the origin."""
    target_positions: Float[Array | np.ndarray, "T P D"]
    threshold: float | Float[Array, ""]
    """Distance within which a point counts as correct, in the unit of the positions."""
    fps: float | Float[Array, ""]
    scale: float | Float[Array, ""]
    """Factor from the unit of the positions to that of a report: 100 for metres, else 1."""
    distance_scale: float | Float[Array, ""]
    """Factor from an L1 distance of positions to a report's units (:class:`~a2g_jax.metrics.units.Units`)."""
    speed_scale: float | Float[Array, ""]
    """The same from an L1 distance of first differences."""
    acceleration_scale: float | Float[Array, ""]
    """The same from an L1 distance of second differences."""
    weights: Float[Array | np.ndarray, " P"] | None
    """Weights of the points in a mean; None where all count alike."""


@dataclass(frozen=True, eq=False)
class MotionContext:
    """One motion and its target. Costly values are computed on first use."""

    pose: Pose
    """Rows as the corpus has them."""
    target_pose: Pose
    positions: Points
    """Metres, or the corpus's own unit; the root is at the origin."""
    target_positions: Points
    fps: float
    metres: bool
    """Whether positions are metres."""
    onsets: Float[np.ndarray, " n"]
    """Onsets of the speech, seconds."""
    rotations_of: Callable[[Pose], Rotations | None] = lambda pose: None
    """Local rotations of a pose; None where poses are no rotations."""
    wrists_of: Callable[[Points], Points] = lambda positions: positions
    """The wrists among the points; all points where wrists are not found."""
    wrist_to_wrist: float | None = None
    """Distance of the wrists in T-pose, metres; None where wrists are not found."""
    emotion: str = ""
    relevance: Float[np.ndarray, " T"] | None = None
    """Semantic relevance of each frame; None without labels."""
    network: FeatureExtractor | None = None
    classifier: EmotionClassifier | None = None
    pair_scores: Mapping[str, Any] = field(default_factory=dict)
    """Values of the metrics over :class:`PairContext`, by key."""
    units: Units = OURS
    weights: Float[np.ndarray, " P"] | None = None
    """Weights of the points in a mean, with a sum of 1; None where all count alike."""

    @property
    def scale(self) -> float:
        """Factor from the unit of the positions to that of a report."""
        return 100.0 if self.metres else 1.0

    @property
    def size(self) -> float:
        """Factor from the lengths of the body to those of the skeleton of the units (Eq. 23); 1 where they have none,
        or where wrists are not found."""
        if self.units.reference is None or self.wrist_to_wrist is None:
            return 1.0
        return self.units.reference / self.wrist_to_wrist

    @property
    def distance_scale(self) -> float:
        """Factor from an L1 distance of positions to the units."""
        return self.scale * self.size * self.units.axis_share(self.positions.shape[-1])

    @property
    def weighted(self) -> Points:
        """Positions whose plain mean over points of L1 distances is the weighted one."""
        if self.weights is None:
            return self.positions
        return self.positions * (len(self.weights) * self.weights)[:, None]

    @cached_property
    def threshold(self) -> float:
        """Distance within which a point counts as correct, in the unit of the positions."""
        return pointwise.correct_within(self.target_positions, self.metres) / self.size

    @property
    def pair(self) -> PairContext:
        """The part that compiled metrics look at."""
        distance, per_frame = self.distance_scale, self.units.per_frame
        return PairContext(
            self.positions,
            self.target_positions,
            self.threshold,
            self.fps,
            self.scale,
            distance,
            distance if per_frame else distance * self.fps,
            # In metres per second squared: centimetres give large numbers.
            distance if per_frame else distance / self.scale * self.fps**2,
            self.weights,
        )

    @cached_property
    def rotations(self) -> Rotations | None:
        """Local rotations of the motion."""
        return self.rotations_of(self.pose)

    @cached_property
    def target_rotations(self) -> Rotations | None:
        """Local rotations of the target."""
        return self.rotations_of(self.target_pose)

    @cached_property
    def wrists(self) -> Points:
        """Wrists of the motion."""
        return self.wrists_of(self.positions)

    @cached_property
    def target_wrists(self) -> Points:
        """Wrists of the target."""
        return self.wrists_of(self.target_positions)

    @cached_property
    def beats(self) -> Float[np.ndarray, " n"]:
        """Beats of the motion, seconds."""
        return beats.motion_beats(self.positions, self.fps, beats.SMOOTHING)


@dataclass(frozen=True, eq=False)
class ClipContext:
    """Several motions of one candidate for the same clip."""

    motions: tuple[MotionContext, ...]

    @property
    def scale(self) -> float:
        """Factor from the unit of the positions to that of a report."""
        return self.motions[0].scale

    @cached_property
    def positions(self) -> Float[np.ndarray, "N T P _"]:
        """Points of all motions."""
        return np.stack([motion.positions for motion in self.motions])

    @property
    def weighted(self) -> Float[np.ndarray, "N T P _"]:
        """:attr:`MotionContext.weighted` of all motions."""
        return np.stack([motion.weighted for motion in self.motions])


class SetContext(NamedTuple):
    """Feature vectors of one motion for every clip of a split; no vectors without a feature network."""

    features: Features
    reference: Features
    """Of the recorded motion."""
    speakers: Int[np.ndarray, " n"]
    """Number of the speaker of each vector."""
