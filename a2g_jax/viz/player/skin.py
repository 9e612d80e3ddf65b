"""The skinned mesh of a character on the page: light enough to be drawn without a GPU, and bound to few joints."""

import base64
import hashlib
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.gltf.figure import Surface
from a2g_jax.viz.player.parts import Shape
from a2g_jax.viz.player.roles import ancestors, find_roles, rest_positions

#: Most vertices of a mesh on the page; those of larger ones are merged.
MOST_VERTICES = 4000
#: Most vertices that 16-bit triangles of the page can have.
_INDICES = 65_536
#: Length of the axes of a joint on the page, metres.
_AXIS = 0.25
#: Largest difference in a rotation matrix of a joint that counts as not moving.
_STILL = 1e-3
_GLOSS = 0.12


@dataclass(frozen=True, eq=False)
class Skin:
    """A mesh that is bound to the joints of a skeleton."""

    skeleton: Skeleton
    places: Float[np.ndarray, "V 3"]
    """At zero rotations, with the first joint at the origin, metres."""
    normals: Float[np.ndarray, "V 3"]
    colours: Float[np.ndarray, "V 3"]
    """Linear."""
    joints: Int[np.ndarray, "V 4"]
    weights: Float[np.ndarray, "V 4"]
    triangles: Int[np.ndarray, "F 3"]
    two_sided: bool = False
    """Whether some triangles are visible from behind."""

    @cached_property
    def content(self) -> str:
        """A digest of the skeleton and the mesh, equal for equal ones, such as of two readings of a file."""
        of, skeleton = hashlib.sha256(), self.skeleton
        of.update(repr((skeleton.names, skeleton.parents, skeleton.ends, self.two_sided)).encode())
        arrays = (self.places, self.normals, self.colours, self.joints, self.weights, self.triangles)
        for array in (np.asarray(skeleton.offsets), *arrays):
            of.update(repr((array.shape, array.dtype.str)).encode() + np.ascontiguousarray(array).tobytes())
        return of.hexdigest()

    def posed(self, rotations: Float[np.ndarray, "J 3 3"], root: Float[np.ndarray, "3"]) -> "Skin":
        """The vertices in a pose, bound as before: linear blend skinning.

        Args:
            rotations: local.
            root: place of the first joint.
        """
        motion = Motion(np.asarray(rotations, np.float32)[None], np.asarray(root, np.float32)[None], self.skeleton, 1.0)
        turns = motion.world_rotations()[0].astype(np.float64)
        shifts = motion.positions()[0] - np.einsum("jab,jb->ja", turns, rest_positions(self.skeleton))
        places, normals = np.zeros_like(self.places), np.zeros_like(self.normals)
        for at in range(self.joints.shape[1]):
            joint, weight = self.joints[:, at], self.weights[:, at, None]
            places += weight * ((turns[joint] @ self.places[..., None])[..., 0] + shifts[joint])
            normals += weight * (turns[joint] @ self.normals[..., None])[..., 0]
        return replace(self, places=places, normals=_unit(normals))


def make_skin(skeleton: Skeleton, surfaces: Sequence[Surface], most: int = MOST_VERTICES) -> Skin | None:
    """One mesh of all surfaces, with at most so many vertices; None without triangles.

    Vertices are merged in cells of a grid, as large as needed, where they belong to the same joint, face the same way
    and have the same colour; where that leaves too many, of any colour, and then of any direction.

    Args:
        skeleton: whose joints they are bound to, with the surfaces at zero rotations.
        most: up to 65536, the most that the page can have.

    Raises:
        InputError: there are more even so.
    """
    most = min(most, _INDICES)
    starts = np.cumsum([0, *(len(surface.places) for surface in surfaces)])
    if not any(len(surface.triangles) for surface in surfaces):
        return None
    join = lambda name: np.concatenate([getattr(surface, name) for surface in surfaces])  # noqa: E731
    colours = np.concatenate([np.tile(surface.colour, (len(surface.places), 1)) for surface in surfaces])
    triangles = np.concatenate([one.triangles + start for one, start in zip(surfaces, starts, strict=False)])
    two_sided = any(surface.two_sided for surface in surfaces)
    skin = Skin(
        skeleton, join("places"), join("normals"), colours, join("joints"), join("weights"), triangles, two_sided
    )
    used, triangles = np.unique(triangles, return_inverse=True)
    skin = _at(skin, used, triangles.reshape(-1, 3))
    return skin if len(skin.places) <= most else _merged(skin, _cells(skin, most))


def _at(skin: Skin, rows: Int[np.ndarray, " K"], triangles: Int[np.ndarray, "F 3"]) -> Skin:
    names = ("places", "normals", "colours", "joints", "weights")
    return replace(skin, triangles=triangles, **{name: getattr(skin, name)[rows] for name in names})


def _cells(skin: Skin, most: int) -> Int[np.ndarray, "V K"]:
    """Cells of vertices that are merged; there are at most so many.

    Raises:
        InputError: there are more, however large they are.
    """
    owner = np.take_along_axis(skin.joints, skin.weights.argmax(axis=1)[:, None], axis=1)
    axis = np.abs(skin.normals).argmax(axis=1)[:, None]
    facing = np.hstack([axis, np.take_along_axis(skin.normals, axis, axis=1) > 0])
    colour = np.round(skin.colours * 255).astype(int) @ np.array([[1], [256], [65536]])
    for same in ((owner, facing, colour), (owner, facing), (owner,)):
        if (cells := _smallest_cells(skin.places, np.hstack(same), most)) is not None:
            return cells
    raise InputError(f"its mesh has too many parts for a page, which shows {most} vertices; export fewer objects.")


def _smallest_cells(
    places: Float[np.ndarray, "V 3"], same: Int[np.ndarray, "V C"], most: int
) -> Int[np.ndarray, "V K"] | None:
    """Cells of at most half a metre, apart where ``same`` differs; None where there are always more than ``most``."""
    low, high = 1e-4, 0.5
    divided = lambda edge: np.hstack([np.floor(places / edge).astype(int), same])  # noqa: E731
    found = divided(high)
    if len(np.unique(found, axis=0)) > most:
        return None
    for _ in range(16):
        middle = float(np.sqrt(low * high))
        cells = divided(middle)
        if len(np.unique(cells, axis=0)) > most:
            low = middle
        else:
            high, found = middle, cells
    return found


def _merged(skin: Skin, cells: Int[np.ndarray, "V K"]) -> Skin:
    _, first, group, count = np.unique(cells, axis=0, return_index=True, return_inverse=True, return_counts=True)
    group = group.reshape(-1)
    merged = _at(skin, first, _whole(group[skin.triangles]))
    mean = lambda values: np.stack(  # noqa: E731
        [np.bincount(group, values[:, axis], len(count)) / count for axis in range(3)], axis=1
    )
    normals = mean(skin.normals)
    # Those of the two sides of a thin part may cancel out.
    normals = np.where(np.linalg.norm(normals, axis=1, keepdims=True) > 1e-3, normals, merged.normals)
    return replace(merged, places=mean(skin.places), normals=_unit(normals), colours=mean(skin.colours))


def _whole(triangles: Int[np.ndarray, "F 3"]) -> Int[np.ndarray, "G 3"]:
    """Triangles of three different vertices, each once."""
    triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
    once = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True)[1]
    return triangles[np.sort(once)]


@dataclass(frozen=True, eq=False)
class Bound:
    """A mesh as the page moves it: every vertex with a few bones, which are joints that move."""

    skin: Skin
    """With bones in place of joints, in the pose in which they are bound."""
    joints: tuple[int, ...]
    """Joint of each bone."""
    centres: Float[np.ndarray, "K 3"]
    """Of the bones, when bound."""
    turns: Float[np.ndarray, "K 3 3"]
    """Orientations of the joints of the bones, when bound."""

    def shape(self) -> Shape:
        """What the page needs of a motion: three points of each bone, and a plain cone where it cannot draw meshes."""
        skeleton = self.skin.skeleton
        shape = Shape(points=[])
        for joint, turn in zip(self.joints, self.turns, strict=True):
            origin = shape.point(joint, np.zeros(3))
            left, up = (shape.point(joint, _AXIS * turn.T[:, axis]) for axis in (0, 1))
            shape.frame(origin, up, left, origin)
        place = {joint: 3 * bone for bone, joint in enumerate(self.joints)}
        for joint, end in place.items():
            above = next((one for one in ancestors(skeleton.parents, joint) if one in place), None)
            if above is not None:
                length = float(np.linalg.norm(self.centres[end // 3] - self.centres[place[above] // 3]))
                shape.add((place[above],), (end,), (max(0.16 * length, 0.01), max(0.13 * length, 0.01)))
        roles = find_roles(skeleton)
        tips = [] if roles is None else [roles.arms[side].tip for side in ("left", "right")]
        shape.wrists = tuple(shape.point(joint, np.zeros(3)) for joint in tips)
        return shape

    def encoded(self) -> dict:
        """The mesh for the page: 16-bit places, bones and triangles, then 8-bit normals, colours and weights."""
        skin = self.skin
        low = skin.places.min(axis=0)
        step = np.maximum((skin.places.max(axis=0) - low) / 65535, 1e-9)
        parts = (
            np.round((skin.places - low) / step).astype("<u2"),
            skin.joints.astype("<u2"),
            skin.triangles.astype("<u2"),
            np.round(127 * skin.normals).astype("i1"),
            np.round(255 * np.clip(skin.colours, 0, 1) ** (1 / 2.2)).astype("u1"),
            np.round(255 * skin.weights).astype("u1"),
        )
        data = zlib.compress(b"".join(part.tobytes() for part in parts), 9)
        return {
            "vertices": len(skin.places),
            "triangles": len(skin.triangles),
            "open": skin.two_sided,
            "low": low.tolist(),
            "step": step.tolist(),
            "centres": [round(float(value), 6) for value in self.centres.reshape(-1)],
            "data": base64.b64encode(data).decode("ascii"),
        }


def bind(skin: Skin, motions: Sequence[Motion] = ()) -> Bound:
    """A mesh bound to the joints that move in some of these motions; without motions, to all.

    Others stay as they always are. Where vertices belong to such a joint and to several that move, they may be placed a
    little differently.
    """
    parents, count = skin.skeleton.parents, skin.skeleton.joints
    moves, held = np.ones(count, bool), np.tile(np.eye(3), (count, 1, 1))
    if motions:
        first = np.asarray(motions[0].rotations[0], np.float64)
        away = [np.abs(np.asarray(one.rotations) - first).max(axis=(0, 2, 3)) for one in motions]
        moves = np.max(away, axis=0) > _STILL
        moves[0] = True
        held = np.where(moves[:, None, None], held, first)
    owner = [next(one for one in (joint, *ancestors(parents, joint)) if moves[one]) for joint in range(count)]
    posed = skin.posed(held, np.zeros(3))
    still = Motion(np.asarray(held, np.float32)[None], np.zeros((1, 3), np.float32), skin.skeleton, 1.0)
    owned = np.where(skin.weights > 0, np.asarray(owner)[skin.joints], 0)
    joints, bones = np.unique(owned, return_inverse=True)
    bound = replace(posed, joints=bones.reshape(skin.joints.shape))
    places, turns = still.positions()[0].astype(np.float64), still.world_rotations()[0].astype(np.float64)
    return Bound(bound, tuple(joints.tolist()), places[joints], turns[joints])


def _unit(vectors: Float[np.ndarray, "V 3"]) -> Float[np.ndarray, "V 3"]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
