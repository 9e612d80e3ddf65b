"""The rig of a skinned character in a GLB or VRM file.

The skeleton has the joints of the file with other axes: those of the world in the rest pose, so that zero rotations are
the rest pose. With ``B_j`` the orientation of node ``j`` at rest and ``G_j(t)`` that of the joint in a motion, the node
has the orientation ``G_j(t) @ B_j``.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.retarget import Rig, find_rig
from a2g_jax.geometry.retarget.parts import find_parts
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.geometry.retarget.rest import oddness
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.io.gltf.buffers import read_matrices
from a2g_jax.io.gltf.container import Glb
from a2g_jax.io.gltf.nodes import Node, Placed, ancestors, joint_nodes, placed, read_nodes
from a2g_jax.io.gltf.vrm import humanoid_nodes

#: Oddness (degrees) up to which the pose that a skin was bound in is the rest pose, and of any pose.
_BOUND, _WORST = 40.0, 75.0
#: Largest turn (degrees) of a pose of the nodes from the one that the skin was bound in.
_NEAR = 44.0


@dataclass(frozen=True, eq=False)
class NodeRig:
    """The rig of a file and its nodes."""

    rig: Rig
    """Its skeleton begins at the pelvis, or at the lowest joint above all others."""
    nodes: tuple[int, ...]
    """Node of each joint of the skeleton."""
    rest: Float[np.ndarray, "J 3 3"]
    """Orientation of each node in the world at rest."""
    above: tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"], float]
    """Position, orientation and scale of the node above the first joint."""
    scale: Float[np.ndarray, " J"]
    """Scale of each node in the world."""


def find_node_rig(glb: Glb) -> NodeRig:
    """Find the body of the character in a file.

    Joints are those of the humanoid of a VRM file, or found by names or shape. The rest pose is the pose that the skin
    was bound in, where that is a standing person, or else that of the nodes.

    Raises:
        InputError: no skin, no human body, no pose of a standing person, or nodes that are damaged.
    """
    nodes = read_nodes(glb)
    humanoid = humanoid_nodes(glb)
    members = joint_nodes(glb, nodes, humanoid)
    where = placed(glb, nodes, members)
    given = {role: nodes[node].name for role, node in humanoid.items() if node in members}
    turns = _rest_pose(glb, nodes, members, where, given)
    full = _skeleton(nodes, members, turns, where.scales)
    roles, _ = find_parts(full, str(glb.path), given)
    first = members[roles["Pelvis"]] if "Pelvis" in roles else members[0]
    kept = [node for node in members if node == first or first in ancestors(nodes, node)]
    skeleton = _skeleton(nodes, kept, turns, where.scales)
    given = {role: name for role, name in given.items() if name in skeleton.names}
    rig = find_rig(skeleton, name=str(glb.path), rest="zero", joints=given)
    above = nodes[first].parent
    base = (np.zeros(3), np.eye(3), 1.0)
    if above >= 0:
        base = (where.positions[above], where.rotations[above], float(where.scales[above]))
    return NodeRig(rig, tuple(kept), np.stack([turns[node] for node in kept]), base, where.scales[kept])


def _skeleton(
    nodes: list[Node], members: list[int], turns: Mapping[int, np.ndarray], scales: Float[np.ndarray, " N"]
) -> Skeleton:
    """The skeleton whose zero pose has nodes with these orientations in the world."""
    order = {node: joint for joint, node in enumerate(members)}
    offsets = np.zeros((len(members), 3))
    for joint, node in enumerate(members[1:], start=1):
        up = nodes[node].parent
        offsets[joint] = scales[up] * turns[up] @ nodes[node].translation
    parents = tuple(-1 if node == members[0] else order[nodes[node].parent] for node in members)
    return Skeleton(offsets.astype(np.float32), tuple(nodes[node].name for node in members), parents)


def _rest_pose(
    glb: Glb, nodes: list[Node], members: list[int], where: Placed, given: Mapping[str, str]
) -> dict[int, np.ndarray]:
    """Orientations of the members at rest, in the world."""
    shown = {node: where.rotations[node] for node in members}
    bound = _bound_pose(glb, nodes, members, where)
    scores = []
    for turns in (bound, shown):
        skeleton = _skeleton(nodes, members, turns, where.scales)
        roles, unsided = find_parts(skeleton, str(glb.path), given)
        places = np.zeros((len(members), 3))
        for joint, parent in enumerate(skeleton.parents[1:], start=1):
            places[joint] = places[parent] + skeleton.offsets[joint]
        scores.append(float(oddness(places, roles)) if unsided is None else 0.0)
    if scores[0] <= max(_BOUND, scores[1]):
        best, odd = bound, scores[0]
    else:
        best, odd = shown, scores[1]
    if odd > _WORST:
        raise InputError(
            f"{glb.path}: neither the pose that the skin was bound in nor that of the nodes is a standing person"
            f" ({odd:.0f} degrees off); export the character in a T- or A-pose."
        )
    return best


def _bound_pose(glb: Glb, nodes: list[Node], members: list[int], where: Placed) -> dict[int, np.ndarray]:
    """Orientations in which the skins were bound; a joint without such follows the joint above as its node does."""
    matrices: dict[int, np.ndarray] = {}
    for number, skin in enumerate(glb.document.get("skins", [])):
        if "inverseBindMatrices" not in skin or not isinstance(skin.get("joints"), list):
            continue
        place = f"skins[{number}], inverseBindMatrices"
        inverse = read_matrices(glb, skin["inverseBindMatrices"], len(skin["joints"]), place)
        for at, joint in enumerate(skin["joints"] if inverse is not None else ()):
            turn = None if inverse is None else _orientation(inverse[at])
            if turn is not None:
                matrices.setdefault(joint, turn)
    found: dict[int, np.ndarray] = {}
    for node in members:
        up = nodes[node].parent
        if up not in found:
            found[node] = _first(nodes[node], matrices.get(node), where)
        elif up in matrices and node in matrices:
            found[node] = found[up] @ matrices[up].T @ matrices[node]
        else:
            found[node] = found[up] @ nodes[node].rotation
    return found


def _first(node: Node, bound: Float[np.ndarray, "3 3"] | None, where: Placed) -> Float[np.ndarray, "3 3"]:
    """The orientation of the first joint in the world when it was bound.

    Skins are bound in the world or in the space of the node above all joints, whichever is nearer to the pose of the
    nodes, which may be one of an animation. If neither is near, the joint is as its node is.
    """
    shown = where.rotations[node.index]
    if bound is None:
        return shown
    spaces = [np.eye(3)] + ([where.rotations[node.parent]] if node.parent >= 0 else [])
    turns = [space @ bound for space in spaces]
    away = [float(rotation_angle(turn, shown)) for turn in turns]
    return turns[int(np.argmin(away))] if min(away) < _NEAR else shown


def _orientation(inverse: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "3 3"] | None:
    """The orientation of a joint when it was bound; None where the matrix has none."""
    block = inverse[:3, :3]
    if not np.linalg.det(block) > 1e-18:
        return None
    u, _, v = np.linalg.svd(np.linalg.inv(block))
    turn = u @ v
    return turn if np.linalg.det(turn) > 0 else None
