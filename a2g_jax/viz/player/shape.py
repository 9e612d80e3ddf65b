"""The drawn surface of a figure on any skeleton."""

import numpy as np

from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.viz.player.mannequin import Mannequin
from a2g_jax.viz.player.parts import Shape
from a2g_jax.viz.player.roles import find_roles, is_finger, rest_positions


def build_shape(skeleton: Skeleton) -> Shape:
    """The shape to draw for ``skeleton``: a mannequin where two arms are found, plain capsules otherwise."""
    shape = Shape(points=[(joint, (0.0, 0.0, 0.0)) for joint in range(skeleton.joints)])
    ends: dict[int, int] = {}
    for joint, offset in skeleton.ends:
        ends.setdefault(joint, shape.point(joint, np.asarray(offset)))
    roles = find_roles(skeleton)
    if roles is None:
        _generic(shape, skeleton, set(), 1.0)
        for joint, end in ends.items():
            _bone(shape, joint, end, float(np.linalg.norm(shape.points[end][1])), 1.0)
        shape.wrists = _leaves(skeleton)
        return shape
    maker = Mannequin(shape, skeleton, roles, ends)
    maker.torso()
    maker.head()
    for side, arm in roles.arms.items():
        maker.arm(side, arm)
    for leg in roles.legs.values():
        maker.leg(leg)
    # What does not hang below the pelvis is no part of the body: a root on the floor, targets of hands and feet.
    body = {roles.pelvis}
    for joint, parent in enumerate(skeleton.parents):
        if parent in body:
            body.add(joint)
    maker.drawn.update(set(range(skeleton.joints)) - body, {roles.pelvis})
    _generic(shape, skeleton, maker.drawn, maker.size)
    shape.wrists = tuple(roles.arms[side].tip for side in ("left", "right"))
    return shape


def _generic(shape: Shape, skeleton: Skeleton, drawn: set[int], size: float) -> None:
    """Add a capsule for every bone without one."""
    lengths = np.linalg.norm(np.asarray(skeleton.offsets), axis=1)
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0 and joint not in drawn:
            _bone(shape, parent, joint, float(lengths[joint]), size, is_finger(skeleton.names[joint]))


def _bone(shape: Shape, parent: int, joint: int, length: float, size: float, finger: bool = False) -> None:
    if length < 0.004 * size:
        return
    if finger:
        shape.add((parent,), (joint,), (0.0105 * size, 0.009 * size), tint="skin")
    else:
        thick = float(np.clip(0.16 * length, 0.008 * size, 0.05 * size))
        shape.add((parent,), (joint,), (thick, 0.8 * thick))


def _leaves(skeleton: Skeleton) -> tuple[int, ...]:
    """The two joints farthest from the root: a guess at the hands of an unknown tree."""
    return tuple(sorted(np.argsort(-np.linalg.norm(rest_positions(skeleton), axis=1))[:2].tolist()))
