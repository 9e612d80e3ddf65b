"""The validation loss of a training, and the summary of the latent space."""

from collections.abc import Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from a2g_jax.data.batch import Batch, clip_shape, gather_clips, gather_from_disk
from a2g_jax.data.batches import BatchMaker, opposite_starts, tiled_starts
from a2g_jax.data.corpus import Corpus
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.models.base import Model, Params, Stage, Summary
from a2g_jax.training.run import RunConfig
from a2g_jax.training.state import joint_loss

#: Most clips of a validation loss, and of the latent statistics.
_VALIDATION_CLIPS, _SUMMARY_CLIPS = 64, 4096
_BATCH = 16
#: Tilings of the training split of a fine-tuning, which is short, each a fraction of a clip after the one before.
_TILINGS = 8


def _batches(
    model: Model,
    corpus: Corpus,
    config: RunConfig,
    split: str,
    most: int,
    fields: tuple[str, ...] = (),
    tilings: int = 1,
) -> Iterator[Batch]:
    """Batches over clips spread evenly through a split; the last one may be smaller.

    Args:
        fields: of the batches; those of training if empty.
        tilings: times that the split is tiled. Within each, clips that follow one another stay neighbours.
    """
    frames = model.clip_frames
    if not corpus.splits.get(split):
        return
    starts = np.concatenate(
        [tiled_starts(corpus, split, frames, offset=number * frames // tilings) for number in range(tilings)]
    )
    if len(starts) == 0:
        return
    starts = starts[np.linspace(0, len(starts) - 1, min(most, len(starts))).round().astype(int)]
    make = BatchMaker(config.statistics["audio"], 0.0)
    shape = clip_shape(fields or model.batch_fields, frames, corpus.fps, corpus.mel.sample_rate)
    arrays = {name: corpus.array(name) for name in shape.arrays}
    for first in range(0, len(starts), _BATCH):
        rows = starts[first : first + _BATCH]
        others = opposite_starts(corpus, split, frames, rows) if shape.paired else None
        clips = gather_clips(arrays, shape, rows, gather_from_disk, others)
        yield make(None, {name: jnp.asarray(clip) for name, clip in clips.items()})


class Validator:
    """Held-out losses of a run; its programs are compiled once."""

    def __init__(self, model: Model, corpus: Corpus, config: RunConfig) -> None:
        self._model, self._corpus, self._config = model, corpus, config
        self._losses = {stage.name: jax.jit(stage.validation_loss or joint_loss(stage)) for stage in model.stages}
        self._rebuild = jax.jit(lambda *inputs: _rebuild(model.reconstruct, config.space, *inputs))

    def __call__(self, params: Params, stage: Stage | None = None, split: str = "validation") -> dict[str, float]:
        """Loss terms on a held-out split with a fixed key, and errors of the reconstruction and of the mean pose.

        Errors are mean distances of joints in cm (``reconstruction_cm``, ``mean_pose_cm``), or for poses without a
        skeleton mean distances of rows in their own unit (``reconstruction_error``, ``mean_pose_error``).

        Empty when every stretch of the split is shorter than a clip.

        Args:
            stage: its loss is computed; the last stage of the model if None.
        """
        totals: dict[str, float] = {}
        count = 0
        loss = self._losses[(stage or self._model.stages[-1]).name]
        mean_pose = self._config.statistics["pose"].mean
        batches = _batches(self._model, self._corpus, self._config, split, _VALIDATION_CLIPS)
        for number, batch in enumerate(batches):
            value, terms = loss(params, jax.random.fold_in(jax.random.key(0), number), batch, jnp.int32(2**30))
            figures = {"loss": value, **terms}
            if self._model.reconstruct is not None:
                figures |= self._rebuild(params, batch, mean_pose)
            clips = len(batch.audio)
            for name, figure in figures.items():
                totals[name] = totals.get(name, 0.0) + float(figure) * clips
            count += clips
        return {name: total / count for name, total in totals.items()}


def _rebuild(reconstruct: Any, space: PoseSpace, params: Params, batch: Batch, mean_pose: Any) -> dict[str, Any]:
    """Mean distance of joints from the truth, for the reconstruction and for the mean pose."""
    clips, frames = batch.pose.shape[:2]
    still = jnp.broadcast_to(jnp.asarray(mean_pose)[None, None], (clips, frames, *mean_pose.shape))
    poses = jnp.stack([batch.pose, reconstruct(params, batch), still])
    rotations = space.rotations(poses)
    places, scale, unit = poses, 1.0, "error"
    if rotations is not None:
        places, scale, unit = space.joint_positions(rotations), 100.0, "cm"
    target, rebuilt, mean = places
    error = lambda p: scale * jnp.mean(jnp.linalg.norm(p - target, axis=-1))  # noqa: E731
    return {f"reconstruction_{unit}": error(rebuilt), f"mean_pose_{unit}": error(mean)}


def collect_summary(model: Model, params: Params, corpus: Corpus, config: RunConfig) -> Summary:
    """:attr:`Model.summarise` of clips spread evenly through the training split, one row a clip."""
    summarise = jax.jit(model.summarise)
    tilings = 1 if config.source is None else _TILINGS
    parts = [
        jax.device_get(summarise(params, jax.random.fold_in(jax.random.key(1), number), batch))
        for number, batch in enumerate(
            _batches(model, corpus, config, "train", _SUMMARY_CLIPS, model.summary_fields, tilings)
        )
    ]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
