"""A small EmotionGesture, with data, a batch and parameters for it."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from a2g_jax.data.batch import Batch
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models.base import Data
from a2g_jax.models.emotion_gesture.config import PRESETS
from tests.arrays_for_tests import on_device

CONFIG = replace(
    PRESETS["tiny"],
    channels=8,
    heads=2,
    hidden=12,
    layers=1,
    dropout=0.0,
    audio_blocks=(1, 1),
    audio_channels=(4, 6),
    emotion_hidden=(6,),
    word_width=6,
    word_layers=2,
    word_buckets=32,
    clip_frames=12,
    seed_frames=4,
    transition_frames=3,
    discriminator_channels=8,
    discriminator_hidden=(6,),
    vae_latent=3,
    vae_channels=4,
    mining_steps=5,
    vae_steps=8,
    sampled_steps=6,
    average_decay=0.0,
    continued_chunks=2,
)
BANDS, SPECTRA, JOINTS = 6, 2, 3
EMOTIONS = ("anger", "happiness", "neutral")


def make_data(joints=JOINTS, emotions=EMOTIONS, bands=BANDS, spectra=SPECTRA):
    """Properties of a corpus of 6D poses at 15 frames a second."""
    random = np.random.default_rng(0)
    shape = joints, 6
    statistics = Statistics(
        random.normal(size=shape).astype(np.float32), random.uniform(0.3, 0.6, shape).astype(np.float32)
    )
    names = tuple(f"joint{number}" for number in range(joints))
    offsets = random.normal(scale=0.3, size=(joints, 3)).astype(np.float32)
    body = Skeleton(offsets, names, tuple(range(-1, joints - 1)))
    return Data(PoseSpace(body, "6d"), 15.0, bands * spectra, statistics, emotions, spectra=spectra)


def stage(model, name):
    """The stage of a model with a name."""
    return next(each for each in model.stages if each.name == name)


def make_batch(clips=3, frames=CONFIG.clip_frames, dtype=np.float32, seed=2):
    """Clips with words: the first has none, the second one on its last frame."""
    random = np.random.default_rng(seed)
    starts = random.uniform(size=(clips, frames)) < 0.4
    starts[0] = False
    starts[1] = np.arange(frames) == frames - 1
    words = np.where(random.uniform(size=(clips, frames)) < 0.7, random.integers(1, 2**31 - 1, (clips, frames)), 0)
    words = np.where(starts, np.maximum(words, 1), words)
    return Batch(
        on_device(random.normal(size=(clips, frames, BANDS * SPECTRA)), dtype),
        on_device(random.normal(size=(clips, frames, JOINTS, 6)), dtype),
        emotion=on_device(random.integers(0, len(EMOTIONS), clips), jnp.int32),
        words=on_device(words, jnp.int32),
        word_starts=on_device(starts),
    )


def make_params(model, dtype=np.float32, seed=3):
    """Like ``init``, without the seconds that compiling its random numbers takes; every bias and scale is drawn too."""
    random = np.random.default_rng(seed)

    def fill(path, leaf):
        if path[-1].key == "scale":
            return on_device(random.uniform(0.5, 1.5, leaf.shape), dtype)
        width = np.sqrt(1.5 / np.prod(leaf.shape[:-1])) if len(leaf.shape) > 1 else 0.3
        return on_device(random.normal(scale=width, size=leaf.shape), dtype)

    return jax.tree_util.tree_map_with_path(fill, jax.eval_shape(model.init, jax.random.key(0)))
