"""Placement of a figure on the stage: ground point, floor, heading and size."""

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.motion import Motion
from a2g_jax.viz.player.roles import find_roles
from a2g_jax.viz.player.shape import Shape

#: A figure whose mean heading is within this angle (radians) of +Z is not turned.
_KEEP_HEADING = 0.6
#: A floor within this distance (metres) of height zero counts as zero, so that floating feet are visible.
_KEEP_FLOOR = 0.12


def shape_points(motion: Motion, shape: Shape) -> Float[np.ndarray, "T P 3"]:
    """World positions of the points of a shape, metres."""
    owners = np.array([joint for joint, _ in shape.points])
    offsets = np.array([offset for _, offset in shape.points])
    points = motion.positions().astype(np.float64)[:, owners]
    away = np.flatnonzero(offsets.any(axis=1))
    if len(away):
        rotations = motion.world_rotations().astype(np.float64)
        points[:, away] += np.einsum("tpij,pj->tpi", rotations[:, owners[away]], offsets[away])
    return points


def placement(motion: Motion, points: Float[np.ndarray, "T P 3"]) -> dict:
    """Centre and floor (metres), heading (radians about +Y, 0 faces +Z), height and reach (metres) for the layout."""
    centre = np.median(points[:, 0], axis=0)
    floor = float(np.percentile(points[..., 1].min(axis=1), 2))
    roles = find_roles(motion.skeleton)
    if roles is None or not roles.legs:
        floor -= 0.02
    elif abs(floor) < _KEEP_FLOOR:
        floor = 0.0
    heading = 0.0
    if roles is not None:
        across = points[:, roles.arms["left"].top] - points[:, roles.arms["right"].top]
        # Front is left x up: ``across`` rotated by a quarter turn about +Y.
        front = np.stack([-across[:, 2], across[:, 0]], axis=1).mean(axis=0)
        angle = float(np.arctan2(front[0], front[1]))
        if np.linalg.norm(front) > 0.02 and abs(angle) > _KEEP_HEADING:
            heading = angle
    height = float(np.percentile(points[..., 1].max(axis=1), 99)) - floor
    away = np.linalg.norm(points[..., [0, 2]] - centre[[0, 2]], axis=2).max(axis=1)
    return {
        "centre": [round(float(centre[0]), 4), round(floor, 4), round(float(centre[2]), 4)],
        "heading": round(heading, 4),
        "height": round(max(height, 0.1), 4),
        "reach": round(float(np.percentile(away, 85)), 4),
    }
