"""Figures taken during training: the validation loss, and what a model keeps about its latent space."""

from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np

from a2g_jax.data.batch import Batch
from a2g_jax.data.batches import Dressing, gather_from_disk, tiled_starts
from a2g_jax.data.corpus import Corpus
from a2g_jax.geometry.kinematics import joint_positions
from a2g_jax.geometry.rotation import matrix_from_6d, matrix_from_axis_angle
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models.base import Model, Params, Summary
from a2g_jax.training.run import RunConfig

#: Most clips looked at for a validation loss, and for the latent statistics.
_VALIDATION_CLIPS, _SUMMARY_CLIPS = 64, 4096
_BATCH = 16


def _batches(model: Model, corpus: Corpus, config: RunConfig, split: str, most: int) -> Iterator[Batch]:
    """Batches over clips spread evenly through a split; the last one may be smaller."""
    frames = model.clip_frames
    if not corpus.splits.get(split):
        return
    starts = tiled_starts(corpus, split, frames)
    if len(starts) == 0:
        return
    starts = starts[np.linspace(0, len(starts) - 1, min(most, len(starts))).round().astype(int)]
    dressing = Dressing(config.statistics["audio"], 0.0)
    for first in range(0, len(starts), _BATCH):
        rows = starts[first : first + _BATCH]
        audio, pose = gather_from_disk(corpus.audio, rows, frames), gather_from_disk(corpus.pose, rows, frames)
        yield dressing(None, jnp.asarray(audio), jnp.asarray(pose), jnp.asarray(corpus.labels[rows]))


def validate(
    model: Model, params: Params, corpus: Corpus, config: RunConfig, split: str = "validation"
) -> dict[str, float]:
    """Loss terms on a held-out split with a fixed key, and the reconstruction beside the mean pose.

    These are mean distances of joints in cm (``reconstruction_cm``, ``mean_pose_cm``), or for poses without a skeleton
    mean distances of rows in their own unit (``reconstruction_error``, ``mean_pose_error``).

    Empty when every stretch of the split is shorter than a clip.
    """
    totals: dict[str, float] = {}
    count = 0
    loss, rebuild = jax.jit(model.validation_loss or model.loss), jax.jit(_rebuild, static_argnums=(0, 3, 4))
    body, mean_pose = config.body, config.statistics["pose"].mean
    parents, offsets = (body.parents, jnp.asarray(body.offsets)) if isinstance(body, Skeleton) else ((), None)
    for number, batch in enumerate(_batches(model, corpus, config, split, _VALIDATION_CLIPS)):
        value, terms = loss(params, jax.random.fold_in(jax.random.key(0), number), batch, jnp.int32(2**30))
        figures = {"loss": value, **terms}
        figures |= rebuild(_Static(model), params, batch, config.representation, parents, offsets, mean_pose)
        clips = len(batch.audio)
        for name, figure in figures.items():
            totals[name] = totals.get(name, 0.0) + float(figure) * clips
        count += clips
    return {name: total / count for name, total in totals.items()}


class _Static:
    """A model as a static argument: one compilation for one reconstruct function."""

    def __init__(self, model: Model) -> None:
        self.reconstruct = model.reconstruct

    def __hash__(self) -> int:
        return hash(self.reconstruct)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Static) and self.reconstruct is other.reconstruct


def _rebuild(model: _Static, params: Params, batch: Batch, representation: str, parents, offsets, mean_pose):
    """Mean distance of joints from where they were, for the reconstruction and for the mean pose."""
    if model.reconstruct is None:
        return {}
    clips, frames = batch.pose.shape[:2]
    still = jnp.broadcast_to(jnp.asarray(mean_pose)[None, None], (clips, frames, *mean_pose.shape))
    poses = jnp.stack([batch.pose, model.reconstruct(params, batch), still])
    places, scale, unit = poses, 1.0, "error"
    if parents:
        rotations = matrix_from_6d(poses) if representation == "6d" else matrix_from_axis_angle(poses)
        places, scale, unit = joint_positions(rotations, offsets, parents), 100.0, "cm"
    target, rebuilt, mean = places
    error = lambda p: scale * jnp.mean(jnp.linalg.norm(p - target, axis=-1))  # noqa: E731
    return {f"reconstruction_{unit}": error(rebuilt), f"mean_pose_{unit}": error(mean)}


def collect_summary(model: Model, params: Params, corpus: Corpus, config: RunConfig) -> Summary:
    """:attr:`Model.summarise` of clips spread evenly through the training split, one row a clip."""
    summarise = jax.jit(model.summarise)
    parts = [
        jax.device_get(summarise(params, jax.random.fold_in(jax.random.key(1), number), batch))
        for number, batch in enumerate(_batches(model, corpus, config, "train", _SUMMARY_CLIPS))
    ]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
