"""Gradients of complete objectives are those of central differences, in double precision."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.data.batch import Batch
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models import emotion_classifier, motion_autoencoder, stylized_flow
from a2g_jax.models.base import Data
from a2g_jax.models.emotion_classifier.config import EmotionClassifierConfig
from a2g_jax.models.motion_autoencoder.config import MotionAutoencoderConfig
from a2g_jax.models.motion_autoencoder.model import encode
from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from a2g_jax.training.state import joint_loss
from tests.arrays_for_tests import on_device

LAYOUT = PoseLayout(("a", "b", "c"), ((0, 1), (1, 2)))
CHAIN = Skeleton(np.array([[0, 0, 0], [0, 0.3, 0], [0.2, 0, 0]], np.float32), ("a", "b", "c"), (-1, 0, 1))
SHAPES = {"6d": (3, 6), "exponential": (3, 3), "directions": (2, 3), "keypoints": (3, 2)}
#: Parts of the flow that are not trained: permutations, signs, and the fitted spread of the predictor.
FIXED = ("permutation", "sign", "spread")


def data_of(kind):
    body = CHAIN if kind in ("6d", "exponential") else LAYOUT
    shape = SHAPES[kind]
    statistics = Statistics(np.full(shape, 0.1, np.float32), np.full(shape, 0.8, np.float32))
    return Data(PoseSpace(body, kind), 15.0, 4, statistics, ("anger", "neutral", "sadness"))


def batch_of(kind, frames, clips=3, seed=0):
    """Random slow poses, audio and emotions, in double precision."""
    random = np.random.default_rng(seed)
    shape = SHAPES[kind]
    if kind == "6d":
        turns = Rotation.from_rotvec(random.normal(size=(clips * frames * 3, 3)) * 0.7).as_matrix()
        pose = np.swapaxes(turns[:, :, :2], 1, 2).reshape(clips, frames, 3, 6)
    else:
        pose = np.cumsum(0.3 * random.normal(size=(clips, frames, *shape)), axis=1)
    audio = random.normal(size=(clips, frames, 4))
    return Batch(on_device(audio), on_device(pose), on_device(random.integers(0, 3, clips), jnp.int32))


def in_double(tree):
    """Parameters in double precision, moved a little so that none starts at a special value such as zero."""
    leaves, form = jax.tree.flatten(jax.device_get(tree))
    random = np.random.default_rng(7)
    wide = [a + 0.05 * random.normal(size=a.shape) if a.dtype.kind == "f" and a.ndim else a for a in leaves]
    return form.unflatten([on_device(a, jnp.float64) if a.dtype.kind == "f" else a for a in wide])


def check(function, params, seed=0, step=1e-6, rtol=1e-5, fixed=()):
    """The gradient along one random direction in each top-level part is the central difference along it.

    Args:
        function: compiled; of parameters to the value and its gradient.
        fixed: names of parameters that are not trained.
    """
    gradient = function(params)[1]
    random = np.random.default_rng(seed)
    for name in params:
        leaves, form = jax.tree.flatten(jax.device_get(params[name]))
        paths = [path for path, _ in jax.tree_util.tree_leaves_with_path(params[name])]
        still = [any(getattr(key, "key", None) in fixed for key in path) for path in paths]
        way = [0.0 if stays else random.normal(size=a.shape) for stays, a in zip(still, leaves, strict=True)]
        ends = [
            {**params, name: form.unflatten([a + sign * step * w for a, w in zip(leaves, way, strict=True)])}
            for sign in (1, -1)
        ]
        numeric = float(function(ends[0])[0] - function(ends[1])[0]) / (2 * step)
        parts = zip(jax.tree.leaves(gradient[name]), way, strict=True)
        exact = sum(float(np.sum(np.asarray(g) * w)) for g, w in parts)
        assert abs(numeric) > 1e-4, name
        np.testing.assert_allclose(exact, numeric, rtol=rtol, err_msg=name)
    return gradient


def objective(loss, batch):
    """The compiled value and gradient of a loss for one key: dropout and noise are the same on either side."""
    return jax.jit(jax.value_and_grad(lambda params: loss(params, jax.random.key(3), batch, jnp.int32(0))[0]))


@pytest.mark.parametrize(("source", "encoder"), [("motion", "convolutions"), ("audio", "attention")])
def test_emotion_classifier(x64, source, encoder):
    config = EmotionClassifierConfig(
        source, encoder, channels=(6, 6), hidden=6, width=8, layers=2, heads=2, dropout=0.3, clip_frames=12
    )
    model, batch = emotion_classifier.ENTRY.builder()(config, data_of("directions")), batch_of("directions", 12)
    params = in_double(jax.jit(model.init)(jax.random.key(0)))
    gradient = check(objective(joint_loss(model.stages[0]), batch), params)
    for path, leaf in jax.tree_util.tree_leaves_with_path(gradient):
        assert np.isfinite(leaf).all(), path


@pytest.mark.parametrize("kind", ["6d", "exponential", "directions", "keypoints"])
def test_motion_autoencoder(x64, kind):
    """Rotations have losses of rotations, places and speeds; other poses the branch of values."""
    config = MotionAutoencoderConfig(
        encoder_channels=(6, 6, 6, 8, 4), decoder_channels=(4, 6), clip_frames=16, noise=0.1
    )
    model, batch = motion_autoencoder.ENTRY.builder()(config, data_of(kind)), batch_of(kind, 16)
    params = in_double(jax.jit(model.init)(jax.random.key(1)))
    loss = joint_loss(model.stages[0])
    terms = jax.eval_shape(loss, params, jax.random.key(3), batch, jnp.int32(0))[1]
    assert ("value" in terms) == (kind in ("directions", "keypoints"))
    gradient = check(objective(loss, batch), params)
    for path, leaf in jax.tree_util.tree_leaves_with_path(gradient):
        assert np.abs(leaf).max() > 0, path


def test_complete_objective_of_the_flow(x64):
    """Likelihood, and through the reverse pass the L1 and the perceptual loss of a frozen feature network."""
    config = StylizedFlowConfig(
        flow_steps=2, hidden=6, layers=1, history_frames=3, lookahead_frames=2, clip_frames=14, global_channels=3,
        encoder_channels=6, encoder_blocks=1, embedding_channels=3, reverse_share=1.0,
        perceptual_weight=0.7, reconstruction_weight=0.9, predictor=True,
    )  # fmt: skip
    kind, features = "directions", MotionAutoencoderConfig((4, 4, 4, 5, 3), (3,), clip_frames=8)
    data = data_of(kind)
    frozen = in_double(jax.jit(motion_autoencoder.ENTRY.builder()(features, data).init)(jax.random.key(2)))
    data = data._replace(perceptual=lambda pose: encode(features, data_of(kind), frozen, pose))
    model, batch = stylized_flow.ENTRY.builder()(config, data), batch_of(kind, 14)
    params = in_double(jax.jit(model.stages[0].warm_start)(jax.jit(model.init)(jax.random.key(0)), batch))
    loss = joint_loss(model.stages[0])

    def mixed(params, weights):
        total, terms = loss(params, jax.random.key(5), batch, jnp.int32(0))
        each = jnp.stack([total, terms["reconstruction"], terms["perceptual"]])
        return weights @ each, each

    function = jax.jit(jax.value_and_grad(mixed, has_aux=True, allow_int=True))
    each = np.asarray(function(params, jnp.array([1.0, 0, 0]))[0][1])
    assert each[1:].min() > 1e-3, each
    # Each of the two losses of the reverse pass alone, too: the likelihood would hide a mistake in them.
    for weights in np.eye(3):

        def one(params, weights=weights):
            (value, _), gradient = function(params, on_device(weights))
            return value, gradient

        check(one, params, fixed=FIXED, rtol=1e-4)
