"""A small Speech2Gesture, with data, a batch and parameters for it."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from a2g_jax.data.batch import Batch
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import WIDTHS, PoseSpace
from a2g_jax.geometry.rotation import axis_angle_from_matrix, matrix_from_6d
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models.base import Data
from a2g_jax.models.speech2gesture.config import PRESETS
from a2g_jax.training.state import joint_loss
from tests.arrays_for_tests import on_device

CONFIG = replace(
    PRESETS["tiny"],
    audio_channels=(2, 2, 3, 3, 4, 4, 6, 6),
    channels=6,
    depth=2,
    decoder_layers=1,
    discriminator_channels=(4, 5, 6),
    clip_frames=16,
    value_speed_weight=0.5,
    adversarial_weight=0.7,
)
BANDS, ROWS = 10, 4


def make_data(representation="6d"):
    random = np.random.default_rng(0)
    shape = ROWS, WIDTHS[representation]
    mean = np.zeros(shape) if representation == "exponential" else random.normal(size=shape)
    statistics = Statistics(mean.astype(np.float32), random.uniform(0.3, 0.6, shape).astype(np.float32))
    body = Skeleton(random.normal(scale=0.3, size=(ROWS, 3)).astype(np.float32), tuple("abcd"), (-1, 0, 1, 1))
    if representation in ("keypoints", "directions"):
        bones = tuple((0, end) for end in range(1, ROWS + (representation == "directions")))
        body = PoseLayout(tuple("abcde"[: len(bones) + 1]), bones)
    return Data(PoseSpace(body, representation), 30.0, BANDS, statistics)


def make_batch(representation="6d", clips=2, frames=16, dtype=np.float32):
    random = np.random.default_rng(2)
    pose = random.normal(size=(clips, frames, ROWS, WIDTHS[representation]))
    if representation == "exponential":
        pose = np.asarray(axis_angle_from_matrix(matrix_from_6d(random.normal(size=(clips, frames, ROWS, 6)))))
    return Batch(on_device(random.normal(size=(clips, frames, BANDS)), dtype), on_device(pose, dtype))


def make_params(model, dtype=np.float32):
    """Like ``init``, without the seconds that compiling its random numbers takes; every bias and scale is drawn too."""
    random = np.random.default_rng(3)

    def fill(path, leaf):
        if path[-1].key == "scale":
            return on_device(random.uniform(0.5, 1.5, leaf.shape), dtype)
        width = np.sqrt(1.5 / np.prod(leaf.shape[:-1])) if len(leaf.shape) > 1 else 0.3
        return on_device(random.normal(scale=width, size=leaf.shape), dtype)

    return jax.tree_util.tree_map_with_path(fill, jax.eval_shape(model.init, jax.random.key(0)))


def terms_of(model, params, batch):
    return joint_loss(model.stages[0])(params, jax.random.key(0), batch, jnp.int32(0))
