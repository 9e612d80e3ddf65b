"""The tree of nodes of a GLB file, and which of them are the joints of a character."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from a2g_jax.io.bvh_hierarchy import MAX_DEPTH, MAX_JOINTS
from a2g_jax.io.gltf.buffers import item
from a2g_jax.io.gltf.container import Glb, fail

#: Most nodes that are read.
MAX_NODES = 65_536
#: Largest share by which the three scales of a node may differ, and largest length that is read, metres.
_EQUAL, _FARTHEST = 1e-3, 1e6


@dataclass(frozen=True, eq=False)
class Node:
    """A node's name, parent and transform relative to it."""

    index: int
    name: str
    """Unique in the file."""
    parent: int
    """Index of the node above, -1 at the top."""
    translation: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]
    scale: Float[np.ndarray, "3"]

    def place(self) -> str:
        """The node for messages."""
        return f"nodes[{self.index}] ({self.name})"


def read_nodes(glb: Glb) -> list[Node]:
    """All nodes of a file, in its order.

    Raises:
        InputError: numbers that are none, circles, two parents, or too many nodes.
    """
    rows = glb.document.get("nodes", [])
    if len(rows) > MAX_NODES:
        fail(glb.path, "nodes", f"has {len(rows)}, and {MAX_NODES} are read at most; export the character alone.")
    nodes: list[Node] = []
    used: set[str] = set()
    for index, row in enumerate(rows):
        given = row.get("name")
        name = given.strip() if isinstance(given, str) and given.strip() else f"node_{index}"
        unique, number = name, 2
        while unique in used:
            unique, number = f"{name}_{number}", number + 1
        used.add(unique)
        nodes.append(Node(index, unique, -1, *_transform(glb, row, f"nodes[{index}] ({unique})")))
    for index, row in enumerate(rows):
        children = row.get("children", [])
        for child in children if isinstance(children, list) else [children]:
            item(glb, "nodes", child, nodes[index].place())
            if nodes[child].parent >= 0 or child == index:
                fail(glb.path, nodes[child].place(), "has two parents: the file is damaged; export it again.")
            nodes[child] = replace(nodes[child], parent=index)
    _check_circles(glb, nodes)
    return nodes


def _check_circles(glb: Glb, nodes: list[Node]) -> None:
    depth: dict[int, int] = {-1: -1}
    for start in range(len(nodes)):
        path = [start]
        while nodes[path[-1]].parent not in depth:
            path.append(nodes[path[-1]].parent)
            if len(path) > MAX_DEPTH:
                what = "is its own parent" if len(set(path)) < len(path) else f"lies below more than {MAX_DEPTH} others"
                fail(glb.path, nodes[start].place(), f"{what}: the file is damaged; export it again.")
        for node in reversed(path):
            depth[node] = depth[nodes[node].parent] + 1


def _transform(glb: Glb, row: dict[str, Any], place: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    if "matrix" in row:
        matrix = _numbers(glb, row["matrix"], 16, f"{place}, matrix").reshape(4, 4).T
        scale = np.linalg.norm(matrix[:3, :3], axis=0)
        if np.min(scale) < 1e-12:
            return matrix[:3, 3], np.eye(3), scale
        turn = matrix[:3, :3] / scale
        if np.linalg.det(turn) < 0:
            scale, turn = -scale, -turn
        return matrix[:3, 3], Rotation.from_matrix(turn).as_matrix(), scale
    translation = _numbers(glb, row.get("translation", (0, 0, 0)), 3, f"{place}, translation")
    quaternion = _numbers(glb, row.get("rotation", (0, 0, 0, 1)), 4, f"{place}, rotation")
    scale = _numbers(glb, row.get("scale", (1, 1, 1)), 3, f"{place}, scale")
    if np.linalg.norm(quaternion) < 1e-6:
        fail(glb.path, f"{place}, rotation", "is no rotation (all zero); export it again.")
    return translation, Rotation.from_quat(quaternion).as_matrix(), scale


def _numbers(glb: Glb, values: object, count: int, place: str) -> Float[np.ndarray, " n"]:
    rows = list(values) if isinstance(values, list | tuple) else []
    numbers = [
        one for one in rows if isinstance(one, int | float) and not isinstance(one, bool) and abs(one) < _FARTHEST
    ]
    if len(rows) != count or len(numbers) != count:
        fail(glb.path, place, f"expected {count} numbers below {_FARTHEST:g}; the file is damaged: export it again.")
    return np.array(numbers, np.float64)


def joint_nodes(glb: Glb, nodes: list[Node], humanoid: dict[str, int]) -> list[int]:
    """Nodes of a character's skeleton, parents first: the joints of all skins and those of a humanoid, and the nodes
    that join them.

    Of several trees, the one with most of them.

    Raises:
        InputError: no skin has a joint, or too many have.
    """
    joints: set[int] = set(humanoid.values())
    for number, skin in enumerate(glb.document.get("skins", [])):
        listed = skin.get("joints", [])
        for joint in listed if isinstance(listed, list) else [listed]:
            item(glb, "nodes", joint, f"skins[{number}], joints")
            joints.add(joint)
    if not joints:
        fail(glb.path, "skins", "there is no skin with joints, so nothing can be moved; export it with its armature.")
    above: dict[int, list[int]] = {joint: [*reversed(ancestors(nodes, joint)), joint] for joint in joints}
    trees: dict[int, list[int]] = {}
    for joint, path in above.items():
        trees.setdefault(path[0], []).append(joint)
    members = max(trees.values(), key=len)
    shared = 0
    paths = [above[joint] for joint in members]
    while all(len(path) > shared and path[shared] == paths[0][shared] for path in paths):
        shared += 1
    found = {node for path in paths for node in path[shared - 1 :]}
    if len(found) > MAX_JOINTS:
        fail(glb.path, "skins", f"have {len(found)} joints, and {MAX_JOINTS} are read at most; export one character.")
    depth = {node: len(ancestors(nodes, node)) for node in found}
    return sorted(found, key=lambda node: (depth[node], node))


def ancestors(nodes: list[Node], index: int) -> list[int]:
    """Parent, grandparent and so on, up to the top."""
    found = []
    while nodes[index].parent >= 0:
        index = nodes[index].parent
        found.append(index)
    return found


@dataclass(frozen=True, eq=False)
class Placed:
    """Nodes in the world of the file at rest."""

    positions: Float[np.ndarray, "N 3"]
    rotations: Float[np.ndarray, "N 3 3"]
    scales: Float[np.ndarray, " N"]


def placed(glb: Glb, nodes: list[Node], wanted: list[int]) -> Placed:
    """Where the wanted nodes and those above them are.

    Raises:
        InputError: a node above another of these has unequal, negative or no scales.
    """
    chain = set(wanted) | {above for node in wanted for above in ancestors(nodes, node)}
    count = len(nodes)
    result = Placed(np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1)), np.ones(count))
    inner = {nodes[node].parent for node in wanted} | (chain - set(wanted))
    for index in sorted(chain, key=lambda node: len(ancestors(nodes, node))):
        node = nodes[index]
        scale = float(np.mean(node.scale))
        if index in inner and not (scale > 1e-9 and np.ptp(node.scale) <= _EQUAL * scale):
            shown = ", ".join(f"{one:g}" for one in node.scale)
            fail(
                glb.path,
                node.place(),
                f"has the scales ({shown}), which must be equal and positive above a joint; apply the scale in your"
                " program and export it again.",
            )
        up = node.parent
        above = result.scales[up] if up >= 0 else 1.0
        turn = result.rotations[up] if up >= 0 else np.eye(3)
        origin = result.positions[up] if up >= 0 else np.zeros(3)
        result.positions[index] = origin + above * turn @ node.translation
        result.rotations[index] = turn @ node.rotation
        result.scales[index] = above * scale
    return result
