"""The skinned meshes of a character in a GLB file, as plain surfaces (glTF 2.0, sections 3.7 and 5.24).

Vertices are placed in the reference pose of the rig, in the axes of :func:`~a2g_jax.geometry.retarget.upright`: with
``B_j`` the orientation of node ``j`` at rest, ``s_j`` its scale and ``M_j`` its inverse bind matrix, a vertex ``v`` has
the offset ``u_j = s_j B_j M_j v`` from joint ``j``, and its place is the mean over its joints by weight.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from a2g_jax.geometry.retarget.match_table import body_frame_of, body_places
from a2g_jax.io.gltf.buffers import element_count, item, read_matrices, read_values, why_not_plain
from a2g_jax.io.gltf.container import Glb, fail
from a2g_jax.io.gltf.figure import Surface
from a2g_jax.io.gltf.nodes import Node, ancestors, placed, read_nodes
from a2g_jax.io.gltf.rig import NodeRig

#: Most vertices, and most corners of triangles, that are read of a character.
MOST_VERTICES, MOST_CORNERS = 500_000, 3_000_000
#: Linear colour of parts whose own is in a texture.
_CLAY = (0.36, 0.33, 0.30)
_TRIANGLES = 4
#: Attributes that are read, with their types.
_READ = {"POSITION": "VEC3", "NORMAL": "VEC3", "JOINTS_0": "VEC4", "WEIGHTS_0": "VEC4"}


def read_surfaces(glb: Glb, found: NodeRig, metres: float) -> list[Surface]:
    """The meshes that move with the rig, one surface a primitive.

    A mesh without a skin is rigid to the joint above it, and left out where there is none. Colours are the base colours
    of the materials; textures are not read.

    Args:
        metres: in one unit of the rig's lengths.

    Raises:
        InputError: no such mesh, one that cannot be read without a decoder, an accessor that is damaged, or too many
            vertices or triangles.
    """
    nodes = read_nodes(glb)
    order = {node: joint for joint, node in enumerate(found.nodes)}
    body = body_frame_of(found.rig).T
    # From the offset in the axes of the file to that in the plain axes of each joint.
    turns = metres * body @ found.rig.rest_world
    places = metres * body_places(found.rig)
    places -= places[0]
    surfaces, room = [], [MOST_VERTICES, MOST_CORNERS]
    for index, row in enumerate(glb.document.get("nodes", [])):
        if "mesh" not in row:
            continue
        owners = [order[one] for one in (index, *ancestors(nodes, index)) if one in order]
        skin = row.get("skin")
        if skin is None and not owners:
            continue
        bones = _rigid(glb, nodes, index, found, owners[0]) if skin is None else _bones(glb, nodes, skin, found, order)
        joints, matrices = bones
        bound = turns[joints] @ matrices[:, :3]
        bound[..., 3] += places[joints]
        for part in _primitives(glb, row["mesh"], room):
            points, normals, own, weights, triangles, (colour, two_sided) = part
            if skin is None or own is None or weights is None:
                own, weights = np.zeros((len(points), 4), int), np.tile([1.0, 0, 0, 0], (len(points), 1))
            if own.max(initial=0) >= len(joints) or own.min(initial=0) < 0:
                fail(glb.path, "meshes", "a vertex belongs to a joint that its skin has not; export it again.")
            moved, facing = np.zeros_like(points), np.zeros_like(points)
            for at in range(own.shape[1]):
                moves, share = bound[own[:, at]], weights[:, at, None]
                moved += share * ((moves[..., :3] @ points[..., None])[..., 0] + moves[..., 3])
                facing += share * (moves[..., :3] @ normals[..., None])[..., 0]
            facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-12)
            surfaces.append(Surface(colour, moved, facing, joints[own], weights, triangles, two_sided))
    if not any(len(surface.triangles) for surface in surfaces):
        fail(glb.path, "meshes", "no triangles that move with the joints; export the character with its mesh.")
    return surfaces


def _bones(
    glb: Glb, nodes: list[Node], skin: object, found: NodeRig, order: dict[int, int]
) -> tuple[Int[np.ndarray, " K"], Float[np.ndarray, "K 4 4"]]:
    """For each joint of a skin, the rig's joint that it moves with, and the offset from it of what is bound."""
    place = f"skins[{skin!r:.20}]"
    row = item(glb, "skins", skin, place)
    listed = row.get("joints", [])
    inverse: Any = np.tile(np.eye(4), (len(listed), 1, 1))
    if "inverseBindMatrices" in row:
        inverse = read_matrices(glb, row["inverseBindMatrices"], len(listed), place)
    if inverse is None:
        reason = why_not_plain(glb, row["inverseBindMatrices"], place)
        fail(glb.path, f"{place}, inverseBindMatrices", reason or "cannot be read; export it again.")
    where = placed(glb, nodes, [*listed, *found.nodes])
    joints, matrices = np.zeros(len(listed), int), np.zeros((len(listed), 4, 4))
    for at, node in enumerate(listed):
        above = next((one for one in (node, *ancestors(nodes, node)) if one in order), None)
        joints[at] = 0 if above is None else order[above]
        # A joint that the rig has not moves with the next one above, as its node stands there.
        matrices[at] = _offset(found, where, int(joints[at]), node) @ inverse[at]
    return joints, matrices


def _rigid(
    glb: Glb, nodes: list[Node], node: int, found: NodeRig, joint: int
) -> tuple[Int[np.ndarray, " 1"], Float[np.ndarray, "1 4 4"]]:
    where = placed(glb, nodes, [node, *found.nodes])
    return np.array([joint]), _offset(found, where, joint, node)[None]


def _offset(found: NodeRig, where: Any, joint: int, node: int) -> Float[np.ndarray, "4 4"]:
    """The transform of a node relative to the place of a joint, in the axes of the file at rest."""
    matrix = np.eye(4)
    own = found.nodes[joint]
    matrix[:3, :3] = found.rest[joint] * found.scale[joint]
    if node != own:
        inner = where.rotations[own].T / where.scales[own]
        below = np.eye(4)
        below[:3, :3] = inner @ where.rotations[node] * where.scales[node]
        below[:3, 3] = inner @ (where.positions[node] - where.positions[own])
        matrix = matrix @ below
    return matrix


def _take(room: list[int], glb: Glb, part: dict[str, Any], place: str) -> None:
    """Take what a primitive needs from the vertices and corners that may still be read, before any is."""
    counts = {name: element_count(glb, part["attributes"][name], place) for name in _READ if name in part["attributes"]}
    if len(set(counts.values())) > 1:
        fail(glb.path, place, "its vertices are damaged; export it again.")
    vertices = counts["POSITION"]
    corners = element_count(glb, part["indices"], place) if "indices" in part else vertices
    room[0] -= vertices
    room[1] -= corners
    if min(room) < 0:
        most = f"{MOST_VERTICES} vertices or {MOST_CORNERS // 3} triangles"
        fail(glb.path, "meshes", f"have more than {most}; export fewer objects.")


def _primitives(glb: Glb, mesh: object, room: list[int]) -> Iterator[tuple[Any, ...]]:
    """Places, normals, joints, weights, triangles and look of primitives of triangles.

    Args:
        room: vertices and corners of triangles that may still be read; those of the primitives are taken from it.
    """
    row = item(glb, "meshes", mesh, "nodes, mesh")
    parts = row.get("primitives", [])
    for number, part in enumerate(parts if isinstance(parts, list) else []):
        place = f"meshes[{mesh}], primitives[{number}]"
        attributes = part.get("attributes") if isinstance(part, dict) else None
        if not isinstance(attributes, dict) or "POSITION" not in attributes:
            continue
        if part.get("mode", _TRIANGLES) != _TRIANGLES:
            continue
        extensions = part.get("extensions")
        if isinstance(extensions, dict) and "KHR_draco_mesh_compression" in extensions:
            fail(glb.path, place, "is compressed (Draco), which is not read; export it without compression.")
        values: dict[str, Any] = {}
        _take(room, glb, part, place)
        for name, shape in _READ.items():
            if name in attributes:
                values[name] = read_values(glb, attributes[name], shape, f"{place}, {name}")
        indices: Any = np.arange(len(values["POSITION"]))
        if "indices" in part:
            indices = read_values(glb, part["indices"], "SCALAR", f"{place}, indices")
        points, joints, weights = (values.get(name) for name in ("POSITION", "JOINTS_0", "WEIGHTS_0"))
        count = len(values["POSITION"])
        if not all(np.isfinite(value).all() for value in values.values()):
            fail(glb.path, place, "its vertices are damaged; export it again.")
        if len(indices) and not (indices.min() >= 0 and indices.max() < count):
            fail(glb.path, place, "a triangle has a vertex that does not exist; export it again.")
        triangles = indices[: len(indices) // 3 * 3].astype(np.int64).reshape(-1, 3)
        normals = values["NORMAL"] if "NORMAL" in values else vertex_normals(values["POSITION"], triangles)
        if weights is not None:
            weights = np.clip(weights, 0, None)
            weights = weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-9)
            weights[weights.sum(axis=1) < 0.5] = (1.0, 0.0, 0.0, 0.0)
        yield points, normals, None if joints is None else joints.astype(int), weights, triangles, _look(glb, part)


def vertex_normals(points: Float[np.ndarray, "V 3"], triangles: Int[np.ndarray, "F 3"]) -> Float[np.ndarray, "V 3"]:
    """Unit normals of vertices: means of those of the triangles around, by area."""
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    faces = np.cross(b - a, c - a)
    normals = np.zeros_like(points)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], faces)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def _look(glb: Glb, part: dict[str, Any]) -> tuple[tuple[float, float, float], bool]:
    """The base colour of a primitive's material, linear, and whether it is visible from behind."""
    if "material" not in part:
        return _CLAY, False
    material = item(glb, "materials", part["material"], "meshes, material")
    base = material.get("pbrMetallicRoughness")
    base = base if isinstance(base, dict) else {}
    given = base.get("baseColorFactor")
    factor = given[:3] if isinstance(given, list) and len(given) >= 3 else [1.0, 1.0, 1.0]
    red, green, blue = (float(one) if isinstance(one, int | float) and 0 <= one <= 1 else 1.0 for one in factor)
    if "baseColorTexture" in base:
        red, green, blue = red * _CLAY[0], green * _CLAY[1], blue * _CLAY[2]
    return (red, green, blue), material.get("doubleSided") is True
