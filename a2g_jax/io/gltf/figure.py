"""A skinned figure as a new GLB document: nodes of a skeleton, meshes bound to them, and an animation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.gltf.animation import Animation, continuous_quaternions, node_tracks
from a2g_jax.io.gltf.buffers import Buffer

#: Position, orientation and scale of a node.
Above = tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"], float]
PLAIN: Above = (np.zeros(3), np.eye(3), 1.0)
_VERTICES, _TRIANGLES = 34962, 34963


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles of one colour, bound to joints."""

    colour: tuple[float, float, float]
    """Red, green, blue from 0 to 1, linear."""
    places: Float[np.ndarray, "V 3"]
    """At rest in the world, metres."""
    normals: Float[np.ndarray, "V 3"]
    joints: Int[np.ndarray, "V 4"]
    weights: Float[np.ndarray, "V 4"]
    """Of the joints; their sum is 1."""
    triangles: Int[np.ndarray, "F 3"]
    two_sided: bool = False
    """Whether triangles are visible from behind as well."""


def figure_document(
    skeleton: Skeleton,
    rest: Float[np.ndarray, "J 3 3"],
    root: Float[np.ndarray, "3"],
    surfaces: Mapping[str, Surface],
    generator: str,
    above: Above | None = None,
) -> tuple[Buffer, list[int]]:
    """A document with the figure at rest, to which animations can be added.

    Args:
        skeleton: its offsets are in the axes of the world, with zero rotations at rest.
        rest: orientation of each node in the world at rest.
        root: place of the first joint at rest.
        surfaces: by the name of their material.
        generator: what wrote the file.
        above: of a node "Armature" above the first joint; None for no such node.

    Returns:
        The document, and the node of each joint.
    """
    buffer = Buffer()
    document = buffer.document
    parents, offsets = skeleton.parents, np.asarray(skeleton.offsets, np.float64)
    position, turned, scale = PLAIN if above is None else above
    places = np.zeros((skeleton.joints, 3))
    places[0] = root
    nodes: list[dict[str, Any]] = []
    for joint, parent in enumerate(parents):
        turn, bone = turned.T @ rest[joint], turned.T @ (places[0] - position)
        if parent >= 0:
            places[joint] = places[parent] + offsets[joint]
            turn, bone = rest[parent].T @ rest[joint], rest[parent].T @ offsets[joint]
        node: dict[str, Any] = {"name": skeleton.names[joint], "translation": (bone / scale).tolist()}
        if not np.allclose(turn, np.eye(3), atol=1e-9):
            node["rotation"] = continuous_quaternions(turn[None])[0].tolist()
        children = [child for child, above in enumerate(parents) if above == joint]
        nodes.append(node | ({"children": children} if children else {}))
    inverse = np.tile(np.eye(4), (skeleton.joints, 1, 1))
    inverse[:, :3, :3] = np.swapaxes(rest, -1, -2) / scale
    inverse[:, :3, 3] = -np.einsum("jba,jb->ja", rest, places) / scale
    columns = np.swapaxes(inverse, -1, -2).astype(np.float32)
    materials, primitives = [], []
    for name, surface in surfaces.items():
        materials.append(
            {
                "name": name,
                "pbrMetallicRoughness": {
                    "baseColorFactor": [*surface.colour, 1.0],
                    "metallicFactor": 0.0,
                    "roughnessFactor": 0.8,
                },
            }
        )
        primitives.append(_primitive(buffer, surface, len(materials) - 1))
    nodes.append({"name": "figure", "mesh": 0, "skin": 0})
    if above is not None:
        quaternion = continuous_quaternions(turned[None])[0].tolist()
        size = {"translation": position.tolist(), "rotation": quaternion, "scale": [scale] * 3}
        nodes.append({"name": "Armature", "children": [0], **size})
    document |= {
        "asset": {"version": "2.0", "generator": generator},
        "scene": 0,
        "scenes": [{"nodes": [0 if above is None else len(nodes) - 1, skeleton.joints]}],
        "nodes": nodes,
        "skins": [{"inverseBindMatrices": buffer.add(columns), "joints": list(range(skeleton.joints)), "skeleton": 0}],
        "meshes": [{"name": "figure", "primitives": primitives}],
        "materials": materials,
    }
    return buffer, list(range(skeleton.joints))


def _primitive(buffer: Buffer, surface: Surface, material: int) -> dict[str, Any]:
    weights = surface.weights.astype(np.float32)
    weights /= weights.sum(axis=1, keepdims=True)
    attributes = {
        "POSITION": buffer.add(surface.places.astype(np.float32), bounds=True, target=_VERTICES),
        "NORMAL": buffer.add(surface.normals.astype(np.float32), target=_VERTICES),
        "JOINTS_0": buffer.add(surface.joints.astype(np.uint16), target=_VERTICES),
        "WEIGHTS_0": buffer.add(weights, target=_VERTICES),
    }
    indices = buffer.add(surface.triangles.astype(np.uint32).reshape(-1), target=_TRIANGLES)
    return {"attributes": attributes, "indices": indices, "material": material}


def add_animation(
    buffer: Buffer, nodes: Sequence[int], motion: Motion, rest: Float[np.ndarray, "J 3 3"], name: str
) -> None:
    """Add a motion of the figure's skeleton."""
    places, turns = node_tracks(motion, rest, PLAIN)
    animation = Animation(buffer, motion.frames, motion.fps)
    animation.add(nodes[0], "translation", places)
    for joint, node in enumerate(nodes):
        animation.add(node, "rotation", continuous_quaternions(turns[:, joint]))
    buffer.document.setdefault("animations", []).append(animation.finished(name))
