"""A small Audio2Gestures, with data, a batch and parameters for it."""

from dataclasses import replace

import jax
import numpy as np
from scipy.spatial.transform import Rotation

from a2g_jax.data.batch import Batch
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models.audio2gestures.config import PRESETS
from a2g_jax.models.audio2gestures.model import build
from a2g_jax.models.base import Data
from tests.arrays_for_tests import on_device

#: Codes at the rate of the motion with the papers' mapping net, and their losses on random codes.
MAPPING = {
    "specific_frames": 1,
    "stored_codes": False,
    "specific_jitter": 0,
    "smoothing": 0,
    "adversarial_steps": 0,
    "relative_losses": False,
    "relaxed_weight": 1.0,
    "bicycle_weight": 0.02,
    "diversity_weight": 0.02,
}
CONFIG = replace(
    PRESETS["tiny"],
    audio_channels=(8,),
    motion_channels=(8,),
    decoder_channels=(8,),
    head_channels=8,
    code_channels=4,
    clip_frames=6,
    kl_ramp_steps=10,
    alignment_ramp_steps=10,
    diversity_decay_steps=20,
    kl_shared_weight=0.01,
    kl_specific_weight=0.02,
    sampled_rotation_weight=0.5,
    sampled_speed_weight=2.0,
    **MAPPING,
)
BANDS, JOINTS = 5, 5
SKELETON = Skeleton(
    np.random.default_rng(0).normal(scale=0.3, size=(JOINTS, 3)).astype(np.float32), tuple("abcde"), (-1, 0, 1, 1, 3)
)
DATA = Data(
    PoseSpace(SKELETON),
    30.0,
    BANDS,
    Statistics(
        np.random.default_rng(1).normal(size=(JOINTS, 6)).astype(np.float32), np.full((JOINTS, 6), 0.5, np.float32)
    ),
)
MODEL = build(CONFIG, DATA)
TERMS = ("rotation", "position", "speed", "alignment", "kl_shared", "kl_specific", "relaxed")
TERMS += ("sampled_rotation", "sampled_speed", "bicycle", "bicycle_shared", "diversity", "spread")


def make_batch(dtype=np.float32, clips=2, frames=6):
    random = np.random.default_rng(2)
    turns = Rotation.random(clips * frames * JOINTS, rng=random).as_matrix()
    pose = np.concatenate([turns[:, :, 0], turns[:, :, 1]], axis=1).reshape(clips, frames, JOINTS, 6)
    return Batch(on_device(random.normal(size=(clips, frames, BANDS)), dtype), on_device(pose, dtype))


def make_params(dtype=np.float32, model=MODEL):
    """Like ``init``, without the seconds that compiling its random numbers takes."""
    random = np.random.default_rng(3)

    def fill(leaf):
        width = np.sqrt(1.5 / np.prod(leaf.shape[:-1])) if len(leaf.shape) > 1 else 0.3
        return on_device(random.normal(scale=width, size=leaf.shape), dtype)

    return jax.tree.map(fill, jax.eval_shape(model.init, jax.random.key(0)))
