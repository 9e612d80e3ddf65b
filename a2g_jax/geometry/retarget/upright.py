"""A motion in plain axes: y up, x to the left, z forward, metres, and zero rotations in the reference pose."""

import numpy as np

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.match_table import body_frame_of, body_places
from a2g_jax.geometry.retarget.poses import world_rotations
from a2g_jax.geometry.retarget.rig import Rig
from a2g_jax.geometry.skeleton import Skeleton


def upright_motion(motion: Motion, rig: Rig, metres: float = 1.0) -> Motion:
    """The same motion in plain axes, of a skeleton whose joints have the axes of the body in the reference pose.

    With the frames of :mod:`~a2g_jax.geometry.retarget.rest`, a joint of the orientation ``W_j(t)`` gets
    ``R_world_body^T W_j(t) R_rest_joint^T R_rest_body``. Names, parents and bone lengths stay.

    Args:
        motion: of the rig's skeleton.
        metres: in one unit of its lengths.
    """
    skeleton, parents = rig.skeleton, rig.skeleton.parents
    body, rest = body_frame_of(rig), rig.rest_world
    world = world_rotations(np.asarray(motion.rotations, np.float64), parents)
    turned = rig.world.T @ world @ np.swapaxes(rest, -1, -2) @ body
    local = turned.copy()
    for joint, parent in enumerate(parents[1:], start=1):
        local[:, joint] = np.swapaxes(turned[:, parent], -1, -2) @ turned[:, joint]
    places = body_places(rig) * metres
    offsets = places - places[[max(parent, 0) for parent in parents]]
    ends = []
    for joint, end in skeleton.ends:
        x, y, z = (body.T @ rest[joint] @ np.asarray(end, np.float64) * metres).tolist()
        ends.append((joint, (x, y, z)))
    root = np.asarray(motion.root, np.float64) @ rig.world * metres
    plain = Skeleton(offsets.astype(np.float32), skeleton.names, parents, tuple(ends))
    return Motion(local.astype(np.float32), root.astype(np.float32), plain, motion.fps)


def facing(motion: Motion, direction: str) -> Motion:
    """A motion that faces +z, turned about the vertical axis to face another way.

    Args:
        direction: ``+z``, ``-z``, ``+x`` or ``-x``.
    """
    quarter = {"+z": 0, "+x": 1, "-z": 2, "-x": 3}[direction]
    if quarter == 0:
        return motion
    cosine, sine = ((1, 0), (0, 1), (-1, 0), (0, -1))[quarter]
    turn = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]], np.float32)
    rotations = np.array(motion.rotations)
    rotations[:, 0] = turn @ rotations[:, 0]
    return Motion(rotations, np.asarray(motion.root) @ turn.T, motion.skeleton, motion.fps)
