"""Scores of motions: the metrics of :mod:`a2g_jax.metrics.catalogue` on stretches of a corpus."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from a2g_jax.evaluation.arrays import Points, Pose
from a2g_jax.evaluation.emotion_judge import EmotionJudge
from a2g_jax.evaluation.feature_network import FeatureNetwork
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.metrics import pointwise
from a2g_jax.metrics.catalogue import METRICS as METRICS
from a2g_jax.metrics.context import ClipContext, MotionContext, PairContext, SetContext
from a2g_jax.metrics.registry import Metric as Metric
from a2g_jax.metrics.units import OURS, Units

#: Metrics that are a number for each motion; the others are one for a clip, or one for a split.
PER_SAMPLE = tuple(name for name, metric in METRICS.items() if metric.per_sample)


@dataclass(frozen=True, eq=False)
class Target:
    """The recorded motion of a stretch, and what is annotated for it."""

    pose: Pose
    places: Points
    onsets: Float[np.ndarray, " n"]
    """Onsets of the speech, seconds."""
    emotion: str = ""
    relevance: Float[np.ndarray, " T"] | None = None
    """Semantic relevance of each frame."""


@dataclass(frozen=True, eq=False)
class Scorer:
    """Computes the metrics; holds everything they need besides motions."""

    space: PoseSpace
    fps: float
    network: FeatureNetwork | None
    judge: EmotionJudge | None = None
    extra_metrics: tuple[Metric, ...] = ()
    """Metrics of other packages, after :data:`METRICS`."""
    units: Units = OURS

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """All metrics, in the order of a report."""
        return (*METRICS.values(), *self.extra_metrics)

    def context(self, pose: Pose, target: Target) -> MotionContext:
        """Everything that a metric may look at for one motion, with the compiled metrics computed."""
        context = MotionContext(
            pose=pose,
            target_pose=target.pose,
            positions=self.space.positions(pose),
            target_positions=target.places,
            fps=self.fps,
            metres=self.space.metres,
            onsets=target.onsets,
            rotations_of=self.space.read,
            wrists_of=self.space.wrists,
            wrist_to_wrist=self.wrist_to_wrist,
            emotion=target.emotion,
            relevance=target.relevance,
            network=self.network,
            classifier=self.judge,
            units=self.units,
            weights=self._weights,
        )
        compiled = tuple(metric for metric in self.metrics if metric.scope == "pair")
        return replace(context, pair_scores=_pair_scores(compiled, context.pair))

    def motion_scores(self, context: MotionContext) -> dict[str, float]:
        """Metrics of one motion; those that are not defined for it are left out."""
        values = {
            metric.key: context.pair_scores[metric.key] if metric.scope == "pair" else _value(metric, context)
            for metric in self.metrics
            if metric.per_sample
        }
        return {key: float(value) for key, value in values.items() if value is not None}

    def sample(self, pose: Pose, target: Target) -> dict[str, float]:
        """:meth:`motion_scores` of a pose."""
        return self.motion_scores(self.context(pose, target))

    def clip_scores(self, motions: Sequence[MotionContext]) -> dict[str, float]:
        """Metrics of several motions for one clip."""
        clip = ClipContext(tuple(motions))
        values = {metric.key: _value(metric, clip) for metric in self.metrics if metric.scope == "clip"}
        return {key: float(value) for key, value in values.items() if value is not None}

    def set_scores(self, split: SetContext) -> dict[str, float]:
        """Metrics of one motion for every clip of a split."""
        values = {metric.key: _value(metric, split) for metric in self.metrics if metric.scope == "set"}
        return {key: float(value) for key, value in values.items() if value is not None}

    def features(self, pose: Pose) -> Float[np.ndarray, "n F"]:
        """Feature vectors of a motion's clips; none without a network."""
        return np.zeros((0, 1), np.float32) if self.network is None else self.network.clip_features(pose)

    @cached_property
    def wrist_to_wrist(self) -> float | None:
        """Distance of the body's wrists in T-pose, metres; None where wrists are not found."""
        body = self.space.body
        return pointwise.wrist_to_wrist(body) if isinstance(body, Skeleton) else None

    @cached_property
    def _weights(self) -> Float[np.ndarray, " P"] | None:
        return self.units.weights(self.space.body)


def _value(metric: Metric, context: Any) -> Any:
    assert metric.function is not None
    return metric.function(context)


@partial(jax.jit, static_argnums=0)
def _pair_scores(metrics: tuple[Metric, ...], pair: PairContext) -> dict[str, Any]:
    """All metrics over pairs, in one program."""
    return {metric.key: _value(metric, pair) for metric in metrics}
