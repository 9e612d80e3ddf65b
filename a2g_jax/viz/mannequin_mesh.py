"""The page's figure as triangles that are bound to the joints of a skeleton."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.gltf.figure import Surface
from a2g_jax.viz.player.parts import Anchor, Cone, Shape
from a2g_jax.viz.player.roles import ancestors, rest_positions
from a2g_jax.viz.player.shape import build_shape

#: Vertices around a cone, and rings of each of its round ends.
_AROUND, _RINGS = 14, 4
#: Linear red, green and blue of the page's first figure.
_COLOURS = {
    "body": (0.093, 0.271, 0.571),
    "legs": (0.051, 0.075, 0.116),
    "shoe": (0.014, 0.018, 0.025),
    "skin": (0.62, 0.37, 0.25),
    "lips": (0.45, 0.185, 0.12),
    "hair": (0.023, 0.044, 0.080),
    "eye": (0.012, 0.013, 0.018),
}


def mannequin_surfaces(skeleton: Skeleton, root: Float[np.ndarray, "3"]) -> dict[str, Surface]:
    """Surfaces by colour of the figure at rest: round cones between its points, as on the page.

    A cone is rigid to the joint whose bone it covers, or bends between the joints of its two ends.

    Args:
        root: place of the first joint, metres.
    """
    shape = build_shape(skeleton)
    body = _Body(skeleton, shape, root)
    parts: dict[str, list[tuple[np.ndarray, ...]]] = {}
    for cone in shape.cones:
        parts.setdefault(cone.tint if cone.tint in _COLOURS else "body", []).append(body.mesh(cone))
    return {tint: _joined(tint, meshes) for tint, meshes in parts.items()}


def floor_height(skeleton: Skeleton) -> float:
    """Height of the first joint above the lowest point of the figure at rest, metres."""
    surfaces = mannequin_surfaces(skeleton, np.zeros(3))
    return -min(float(surface.places[:, 1].min()) for surface in surfaces.values())


def _joined(tint: str, meshes: list[tuple[np.ndarray, ...]]) -> Surface:
    starts = np.cumsum([0] + [len(mesh[0]) for mesh in meshes])
    places, normals, joints, weights = (np.concatenate([mesh[part] for mesh in meshes]) for part in range(4))
    triangles = np.concatenate([_TRIANGLES + start for start in starts[:-1]])
    return Surface(_COLOURS[tint], places, normals, joints, weights, triangles)


def _grid() -> np.ndarray:
    """Triangles of rings of vertices, counterclockwise as seen from outside."""
    faces = []
    for ring in range(2 * _RINGS - 1):
        for at in range(_AROUND):
            a, b = ring * _AROUND + at, ring * _AROUND + (at + 1) % _AROUND
            faces += [(a, b, a + _AROUND), (b, b + _AROUND, a + _AROUND)]
    return np.array(faces)


_TRIANGLES = _grid()


@dataclass(frozen=True)
class _Spot:
    """An anchor at rest: its place, and the joints that it moves with."""

    place: Float[np.ndarray, "3"]
    joints: tuple[tuple[int, float], ...]


class _Body:
    """A shape at rest."""

    def __init__(self, skeleton: Skeleton, shape: Shape, root: Float[np.ndarray, "3"]) -> None:
        self.parents, self.shape = skeleton.parents, shape
        joints = rest_positions(skeleton) + root
        self.points = np.array([joints[joint] + np.asarray(offset) for joint, offset in shape.points])
        self.above = [{joint, *ancestors(skeleton.parents, joint)} for joint in range(skeleton.joints)]
        self.frames = [self._axes(frame) for frame in shape.frames]

    def _axes(self, frame: tuple[int, int, int, int]) -> Float[np.ndarray, "3 3"]:
        """Columns x, y and z of a frame."""
        origin, up, left, right = (self.points[point] for point in frame)
        y = _unit(up - origin, np.array([0.0, 1.0, 0.0]))
        across = left - right
        x = _unit(across - y * (across @ y), np.array([1.0, 0.0, 0.0]))
        return np.stack([x, y, np.cross(x, y)], axis=1)

    def _owner(self, point: int, other: int) -> int:
        """The joint that a point is rigid to: a joint's own place belongs to the bone that the cone covers."""
        joint, offset = self.shape.points[point]
        begins = joint in self.above[self.shape.points[other][0]] and (joint != self.shape.points[other][0])
        if any(offset) or begins or self.parents[joint] < 0 or point == other:
            return joint
        same = self.shape.points[other][0] == joint
        return joint if same else self.parents[joint]

    def spot(self, anchor: Anchor, other: Anchor) -> _Spot:
        """An anchor, given that of the cone's other end."""
        far = self.shape.frames[int(other[0])][0] if len(other) == 4 else int(other[0])
        if len(anchor) == 4:
            frame = int(anchor[0])
            origin = self.shape.frames[frame][0]
            place = self.points[origin] + self.frames[frame] @ np.array(anchor[1:], np.float64)
            return _Spot(place, ((self.shape.points[origin][0], 1.0),))
        first = int(anchor[0])
        if len(anchor) == 1:
            return _Spot(self.points[first], ((self._owner(first, far), 1.0),))
        second, weight = int(anchor[1]), float(anchor[2])
        place = self.points[first] * (1 - weight) + self.points[second] * weight
        inside = float(np.clip(weight, 0.0, 1.0))
        owners = self._owner(first, far), self._owner(second, first)
        return _Spot(place, ((owners[0], 1 - inside), (owners[1], inside)))

    def mesh(self, cone: Cone) -> tuple[np.ndarray, ...]:
        """Places, normals, joints and weights of the vertices of a cone with round ends."""
        start, end = self.spot(cone.start, cone.end), self.spot(cone.end, cone.start)
        along = _unit(end.place - start.place, np.array([0.0, 1.0, 0.0]))
        side = _unit(np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))]), np.array([1.0, 0.0, 0.0]))
        third = np.cross(along, side)
        angles = np.linspace(0, 2 * np.pi, _AROUND, endpoint=False)
        round_ = np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * third
        # The end rings are almost closed; exactly closed ones would have triangles without area.
        lift = np.linspace(-0.5 * np.pi + 0.02, -0.12, _RINGS)
        directions = [np.cos(a) * round_ + np.sin(a) * along for a in (*lift, *-lift[::-1])]
        squeeze = np.eye(3)
        if cone.frame >= 0 and cone.flat != 1.0:
            axis = self.frames[cone.frame][:, cone.axis]
            squeeze = squeeze - (1 - cone.flat) * np.outer(axis, axis)
        places, normals, joints, weights = [], [], [], []
        for ring, unit in enumerate(directions):
            at_start = ring < _RINGS
            spot, radius = (start, cone.start_radius) if at_start else (end, cone.end_radius)
            places.append(spot.place + radius * unit @ squeeze)
            normals.append(unit @ np.linalg.inv(squeeze))
            row, weight = np.zeros(4, int), np.zeros(4)
            for at, (joint, share) in enumerate(_merged(spot.joints)):
                row[at], weight[at] = joint, share
            joints.append(np.tile(row, (_AROUND, 1)))
            weights.append(np.tile(weight, (_AROUND, 1)))
        directions_ = np.concatenate(normals)
        directions_ /= np.linalg.norm(directions_, axis=1, keepdims=True)
        return np.concatenate(places), directions_, np.concatenate(joints), np.concatenate(weights)


def _merged(joints: tuple[tuple[int, float], ...]) -> list[tuple[int, float]]:
    """Each joint once, without those of no weight."""
    total: dict[int, float] = {}
    for joint, share in joints:
        total[joint] = total.get(joint, 0.0) + share
    return [(joint, share) for joint, share in total.items() if share > 0]


def _unit(vector: np.ndarray, fallback: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-9 else fallback
