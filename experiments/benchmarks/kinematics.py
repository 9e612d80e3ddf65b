"""6D to rotation matrices to joint positions, with the gradient: of 4096 frames, ours and PyTorch's."""

from collections.abc import Callable
from typing import Any

from experiments.benchmarks.measure import load_torch
from experiments.benchmarks.turns import Call, Case

_FRAMES = 4096


def case(joints: int, seed: int = 0) -> Case:
    """The case of a skeleton of 22 or 55 joints."""
    import numpy as np

    from experiments.benchmarks.workload import make_skeleton

    skeleton, rng = make_skeleton(joints, seed), np.random.default_rng(seed)
    pose = rng.normal(size=(_FRAMES, joints, 6)).astype(np.float32)
    upstream = rng.normal(size=(_FRAMES, joints, 3)).astype(np.float32)
    contenders: dict[str, Callable[[], Call]] = {
        "a2g_jax": lambda: _ours(skeleton, pose, upstream),
        "torch_eager": lambda: _theirs(skeleton, pose, upstream, False),
        "torch_compiled": lambda: _theirs(skeleton, pose, upstream, True),
    }
    # Read: poses and the gradient of positions; written: positions and the gradient of poses.
    return Case(contenders, moved=2.0 * (pose.nbytes + upstream.nbytes))


def _ours(skeleton: Any, pose: Any, upstream: Any) -> Call:
    import jax

    from a2g_jax.geometry.pose_space import PoseSpace

    space = PoseSpace(skeleton)

    @jax.jit
    def both(pose: Any, upstream: Any) -> Any:
        places, pull = jax.vjp(lambda pose: space.joint_positions(space.rotations(pose)), pose)
        return places, pull(upstream)

    pose, upstream = jax.device_put((pose, upstream))
    return lambda: jax.block_until_ready(both(pose, upstream))


def _theirs(skeleton: Any, pose: Any, upstream: Any, compiled: bool) -> Call:
    torch = load_torch()
    from a2g_jax.models.audio2gestures.config import PRESETS
    from experiments.benchmarks.torch_rotations import matrix_from_6d
    from experiments.benchmarks.torch_twin import Twin

    twin = Twin(PRESETS["paper"], skeleton, 1)
    values, gradient = torch.from_numpy(pose).requires_grad_(True), torch.from_numpy(upstream)
    places = lambda values: twin.positions(matrix_from_6d(values))  # noqa: E731
    compute = torch.compile(places) if compiled else places

    def call() -> None:
        values.grad = None
        compute(values).backward(gradient)

    return call
