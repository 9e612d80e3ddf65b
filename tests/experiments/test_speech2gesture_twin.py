"""Our Speech2Gesture and its PyTorch twin: same weights, same numbers."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from flax.traverse_util import flatten_dict

from a2g_jax.data.batch import Batch
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models import speech2gesture
from a2g_jax.models.base import Data
from a2g_jax.models.speech2gesture.model import build
from a2g_jax.training.state import joint_loss

torch = pytest.importorskip("torch")
twins = pytest.importorskip("experiments.benchmarks.torch_speech2gesture")
others = pytest.importorskip("experiments.benchmarks.torch_rotations")

PARENTS = (-1, 0, 0, 1)
#: Frames that are no multiple of the stride and an odd number of bands show whether both sides pad alike.
CLIPS, FRAMES, BANDS, ROWS = 2, 14, 11, len(PARENTS)
CONFIG = speech2gesture.Speech2GestureConfig(
    audio_channels=(2, 3, 3, 4, 4, 5, 5, 6),
    channels=6,
    depth=2,
    decoder_layers=1,
    discriminator_channels=(4, 5, 6),
    clip_frames=FRAMES,
)


def _positions(offsets):
    """Forward kinematics, joint by joint."""

    def positions(values):
        rotations = others.matrix_from_6d(values)
        world, places = [rotations[..., 0, :, :]], [torch.zeros_like(rotations[..., 0, :, 0])]
        for joint, parent in enumerate(PARENTS[1:], start=1):
            places.append(places[parent] + world[parent] @ offsets[joint])
            world.append(world[parent] @ rotations[..., joint, :, :])
        return rotations, torch.stack(places, dim=-2)

    return positions


def _setting(representation, dtype):
    """A model, its parameters, a batch and the twin; all from fixed seeds."""
    rng = np.random.default_rng(3)
    width = {"6d": 6, "keypoints": 2}[representation]
    offsets = rng.normal(0, 0.2, (ROWS, 3)).astype(dtype)
    body = (
        Skeleton(offsets, tuple("abcd"), PARENTS)
        if representation == "6d"
        else PoseLayout(tuple("abcd"), ((0, 1), (0, 2), (1, 3)))
    )
    mean, std = rng.normal(size=(ROWS, width)).astype(dtype), rng.uniform(0.3, 0.6, (ROWS, width)).astype(dtype)
    model = build(CONFIG, Data(PoseSpace(body, representation), 30.0, BANDS, Statistics(mean, std)))
    shapes = jax.eval_shape(model.init, jax.random.key(0))
    draw = lambda leaf: jnp.asarray(rng.normal(0, 1 / np.sqrt(np.prod(leaf.shape[:-1])), leaf.shape), dtype)  # noqa: E731
    params = jax.tree.map(lambda leaf: draw(leaf) if len(leaf.shape) > 1 else 0.5 + 0.3 * draw(leaf), shapes)
    pose = np.cumsum(rng.normal(0, 0.3, (CLIPS, FRAMES, ROWS, width)), axis=1) + rng.normal(size=(ROWS, width))
    if representation == "6d":
        pose = others.matrix_from_6d(torch.from_numpy(pose))[..., :2].transpose(-1, -2).flatten(-2).numpy()
    batch = Batch(jnp.asarray(rng.normal(size=(CLIPS, FRAMES, BANDS)), dtype), jnp.asarray(pose, dtype))
    places = _positions(torch.from_numpy(offsets)) if representation == "6d" else None
    twin = twins.Twin(CONFIG, BANDS, mean, std, places).to(getattr(torch, np.dtype(dtype).name))
    twins.load_params(twin, params)
    return model, params, batch, twin


def _compare(representation, dtype, output, tolerance):
    model, params, batch, twin = _setting(representation, dtype)

    def terms(params):
        values = joint_loss(model.stages[0])(params, jax.random.key(0), batch, jnp.int32(0))[1]
        return jnp.stack([values[name] for name in sorted(values)])

    names = sorted(jax.eval_shape(joint_loss(model.stages[0]), params, jax.random.key(0), batch, jnp.int32(0))[1])

    @jax.jit
    def ours_with_gradients(params):
        values, pull = jax.vjp(terms, params)
        # One term after another: a loop compiles the backward pass once.
        gradients = jax.lax.map(lambda row: pull(row)[0], jnp.eye(len(names), dtype=dtype))
        return model.reconstruct(params, batch), values, gradients

    pose, ours, ours_gradients = ours_with_gradients(params)
    audio, target = (torch.from_numpy(np.array(array)) for array in (batch.audio, batch.pose))
    np.testing.assert_allclose(pose, twin.generate(audio).detach().numpy(), atol=output)
    theirs = twin.terms(audio, target)
    assert sorted(theirs) == names
    for number, name in enumerate(names):
        np.testing.assert_allclose(float(ours[number]), theirs[name].item(), rtol=tolerance, err_msg=name)
        twin.zero_grad()
        theirs[name].backward(retain_graph=True)
        expected = twins.gradients(twin, params)
        largest = max(np.abs(leaf).max() for leaf in expected.values())
        assert largest > 0, name
        for path, leaf in flatten_dict(ours_gradients, sep=".").items():
            np.testing.assert_allclose(
                leaf[number], expected[path], rtol=tolerance, atol=tolerance * largest, err_msg=f"{name} {path}"
            )


@pytest.mark.parametrize("representation", ["6d", "keypoints"])
def test_outputs_losses_and_gradients_agree(representation):
    _compare(representation, np.float32, 1e-4, 1e-3)


def test_they_agree_in_double_precision(x64):
    _compare("6d", np.float64, 1e-10, 1e-7)


def test_load_params_refuses_other_networks():
    _, params, _, twin = _setting("keypoints", np.float32)
    with pytest.raises(ValueError, match="only one side has"):
        twins.load_params(twin, {"generator": params["generator"]})
    wrong = {**params["generator"], "Dense_0": {"kernel": np.zeros((6, 5)), "bias": np.zeros(5)}}
    with pytest.raises(ValueError, match="of shape"):
        twins.load_params(twin, {**params, "generator": wrong})
