"""Motion files as clips for generation, on the skeleton of a run."""

from pathlib import Path

import numpy as np

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.calibration import calibration_frames
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


def without_calibration(motion: Motion) -> tuple[Motion, tuple[str, ...]]:
    """A clip without a calibration pose at its start, as ``a2g prepare`` leaves it out, and a note if there was one."""
    count = calibration_frames(motion)
    if count == 0:
        return motion, ()
    which = "frame 0" if count == 1 else f"frames 0 to {count - 1}"
    note = f"{which} ({count / motion.fps:.2f} s), a calibration pose such as a T-pose, left out"
    return motion.clip(count, motion.frames), (note,)


def read_facing(path: Path, run: Run) -> tuple[Motion, tuple[str, ...]]:
    """A clip on the run's skeleton, at its rate, turned about the vertical to the facing direction of the run.

    A calibration pose at its start is left out; a note says so.

    Raises:
        InputError: a file that cannot be read, a rig that is not recognised, or a run without a skeleton.
    """
    config = run.config
    whole = read_motion(path)
    motion, notes = without_calibration(whole)
    motion = on_skeleton(motion, config.skeleton, config.fps, str(path), whole)
    facing = config.space.mean_rotations(config.statistics["pose"].mean)
    return face(motion, np.asarray(facing[0], np.float64))[0], notes
