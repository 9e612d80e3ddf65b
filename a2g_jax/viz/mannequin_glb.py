"""Animated GLB files without a character: the page's figure, skinned, on the skeleton of a motion."""

import os

import numpy as np

from a2g_jax.geometry.motion import Motion
from a2g_jax.io.gltf.character import ANIMATION, check_motion_values
from a2g_jax.io.gltf.container import write_glb
from a2g_jax.io.gltf.figure import add_animation, figure_document
from a2g_jax.viz.mannequin_mesh import floor_height, mannequin_surfaces


def write_mannequin_glb(path: str | os.PathLike[str], motion: Motion) -> None:
    """Write a motion as GLB: a node for each joint, the figure's surface, and one animation.

    Nodes have the names and the axes of the joints, y up and metres, so that a player's nodes are where
    :meth:`~a2g_jax.geometry.motion.Motion.positions` has the joints.

    Raises:
        InputError: the motion has no frames, or NaN.
        OutputError: the file cannot be written.
    """
    check_motion_values(path, motion)
    skeleton = motion.skeleton
    rest = np.tile(np.eye(3), (skeleton.joints, 1, 1))
    root = np.array([0.0, floor_height(skeleton), 0.0])
    buffer, nodes = figure_document(skeleton, rest, root, mannequin_surfaces(skeleton, root), "a2g_jax")
    add_animation(buffer, nodes, motion, rest, ANIMATION)
    write_glb(path, *buffer.finished())
