"""Three skinned characters as other programs write them: a GLB of Mixamo's rig, VRM 0.x and VRM 1.0."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from a2g_jax.io.gltf.container import write_glb
from a2g_jax.io.gltf.figure import Above, figure_document
from a2g_jax.viz.mannequin_mesh import mannequin_surfaces
from experiments.characters.exporter import Exporter, with_names
from experiments.characters.person import Stance
from experiments.characters.rigs import mixamo, vroid

#: Parts of the body by the humanoid bones of VRM.
_HUMANOID = {
    "Pelvis": "hips",
    "Spine1": "spine",
    "Spine2": "chest",
    "Spine4": "upperChest",
    "Neck": "neck",
    "Head": "head",
}
_SIDED = {
    "Collar": "Shoulder",
    "Shoulder": "UpperArm",
    "Elbow": "LowerArm",
    "Wrist": "Hand",
    "Hip": "UpperLeg",
    "Knee": "LowerLeg",
    "Ankle": "Foot",
    "Foot": "Toes",
}
_BONES = {1: "Proximal", 2: "Intermediate", 3: "Distal"}
_THUMBS = {1: "Metacarpal", 2: "Proximal", 3: "Distal"}


def humanoid_bones(rig: Exporter, version: int) -> dict[str, int]:
    """Nodes by the humanoid bones of VRM."""
    found = {}
    for node, (_, _, part) in enumerate(rig.rows):
        side, _, name = part.rpartition("_")
        word = {"L": "left", "R": "right"}.get(side, "")
        if not word and name in _HUMANOID:
            found.setdefault(_HUMANOID[name], node)
        elif word and name in _SIDED:
            found[word + _SIDED[name]] = node
        elif word and name[-1:] in "123" and name[:-1] in ("Thumb", "Index", "Middle", "Ring", "Pinky"):
            bones = _THUMBS if version == 1 and name.startswith("Thumb") else _BONES
            finger = {"Pinky": "Little"}.get(name[:-1], name[:-1])
            found[word + finger + bones[int(name[-1])]] = node
    return found


def write_character(
    path: Path, rig: Exporter, *, named: Exporter | None = None, above: Above | None = None, **more: Any
) -> Path:
    """Write a rig with the surface of the page's figure.

    Args:
        named: the same rig with names by which the surface is found.
        above: of a node above the first joint.
        more: further JSON of the file.
    """
    skeleton, root = rig.skeleton()
    body, _ = (named or rig).skeleton()
    surfaces = mannequin_surfaces(body, root)
    buffer, _ = figure_document(skeleton, rig.orientations(), root, surfaces, f"a rig as of {rig.name}", above)
    document, binary = buffer.finished()
    document |= more
    if "extensions" in more:
        document["extensionsUsed"] = sorted(more["extensions"])
    write_glb(path, document, binary)
    return path


def mixamo_glb(path: Path) -> Path:
    """Mixamo's rig by way of Blender: an armature of centimetres turned from z up, bones along y."""
    turned = Rotation.from_euler("x", -90, degrees=True).as_matrix()
    return write_character(path, mixamo(), above=(np.array([0.0, 0.0, 0.0]), turned, 0.01))


def vrm_0(path: Path) -> Path:
    """VRM 0.x of VRoid: axes of the world, facing -z, hair and eyes."""
    rig = vroid()
    bones = [{"bone": bone, "node": node, "useDefaultValues": True} for bone, node in humanoid_bones(rig, 0).items()]
    return write_character(path, rig, extensions={"VRM": {"specVersion": "0.0", "humanoid": {"humanBones": bones}}})


def vrm_1(path: Path) -> Path:
    """VRM 1.0 with joints that only the humanoid names: A-pose, bones along x."""
    named = replace(vroid(1), name="vrm 1.0", stance=Stance(lowered=30.0), axes="X")
    rig = with_names(named, {name: f"bone_{at}" for at, (name, _, _) in enumerate(named.rows)})
    bones = {bone: {"node": node} for bone, node in humanoid_bones(rig, 1).items()}
    extension = {"specVersion": "1.0", "humanoid": {"humanBones": bones}}
    return write_character(path, rig, named=named, extensions={"VRMC_vrm": extension})


#: Writers by the name of the file.
SKINNED = {"mixamo.glb": mixamo_glb, "vrm_0.vrm": vrm_0, "vrm_1.vrm": vrm_1}
