"""Motion files as clips for generation, on the skeleton of a run."""

from pathlib import Path

import numpy as np

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.onto import face, on_skeleton
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.bvh import read_bvh
from a2g_jax.io.npz import read_motion_npz
from a2g_jax.training.run import Run


def read_on_skeleton(path: Path, skeleton: Skeleton, fps: float) -> Motion:
    """Any humanoid BVH, or an NPZ that this package wrote, on a run's skeleton at its frame rate.

    Raises:
        InputError: a file that cannot be read, or a rig that is not recognised.
    """
    return on_skeleton(read_motion(path), skeleton, fps, str(path))


def read_motion(path: Path) -> Motion:
    """A motion file on its own rig: a BVH, or an NPZ that this package wrote.

    Raises:
        InputError: a file that cannot be read.
    """
    return read_motion_npz(path) if path.suffix.lower() == ".npz" else read_bvh(path)


def read_facing(path: Path, run: Run) -> Motion:
    """A clip on the run's skeleton, at its rate, turned about the vertical to the facing direction of the run.

    Raises:
        InputError: a file that cannot be read, a rig that is not recognised, or a run without a skeleton.
    """
    config = run.config
    motion = read_on_skeleton(path, config.skeleton, config.fps)
    facing = config.space.mean_rotations(config.statistics["pose"].mean)
    return face(motion, np.asarray(facing[0], np.float64))[0]
