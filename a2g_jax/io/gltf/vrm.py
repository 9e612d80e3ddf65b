"""The humanoid bones of VRM files: 0.x (extension ``VRM``) and 1.0 (extension ``VRMC_vrm``)."""

from a2g_jax.io.gltf.buffers import item
from a2g_jax.io.gltf.container import Glb, fail

_BODY = {
    "hips": "Pelvis",
    "neck": "Neck",
    "head": "Head",
}
_SIDED = {
    "Shoulder": "Collar",
    "UpperArm": "Shoulder",
    "LowerArm": "Elbow",
    "Hand": "Wrist",
    "UpperLeg": "Hip",
    "LowerLeg": "Knee",
    "Foot": "Ankle",
    "Toes": "Foot",
}
_FINGERS = {"Index": "Index", "Middle": "Middle", "Ring": "Ring", "Little": "Pinky"}
_BONES = {"Proximal": 1, "Intermediate": 2, "Distal": 3}


def role_of(bone: str, version: int) -> str | None:
    """The part of the body of a humanoid bone, such as ``L_Elbow`` of ``leftLowerArm``; None for others.

    The spine is found by its place between pelvis and arms.

    Args:
        version: of VRM, 0 or 1; the bones of a thumb have other names in each.
    """
    if bone in _BODY:
        return _BODY[bone]
    for word, side in (("left", "L"), ("right", "R")):
        if not bone.startswith(word):
            continue
        part = bone.removeprefix(word)
        if part in _SIDED:
            return f"{side}_{_SIDED[part]}"
        thumb = ("Metacarpal", "Proximal", "Distal") if version == 1 else ("Proximal", "Intermediate", "Distal")
        if part.startswith("Thumb") and part.removeprefix("Thumb") in thumb:
            return f"{side}_Thumb{thumb.index(part.removeprefix('Thumb')) + 1}"
        for finger, name in _FINGERS.items():
            if part.startswith(finger) and part.removeprefix(finger) in _BONES:
                return f"{side}_{name}{_BONES[part.removeprefix(finger)]}"
    return None


def humanoid_nodes(glb: Glb) -> dict[str, int]:
    """Nodes by part of the body in a VRM file; empty for other files.

    Raises:
        InputError: a bone is no node of the file, or two bones are the same.
    """
    extensions = glb.document.get("extensions")
    extensions = extensions if isinstance(extensions, dict) else {}
    bones: list[tuple[object, object]] = []
    version, place = 1, "extensions.VRMC_vrm.humanoid"
    try:
        if "VRMC_vrm" in extensions:
            table = extensions["VRMC_vrm"]["humanoid"]["humanBones"]
            bones = [(name, bone["node"]) for name, bone in table.items()]
        elif "VRM" in extensions:
            version, place = 0, "extensions.VRM.humanoid"
            table = extensions["VRM"]["humanoid"]["humanBones"]
            bones = [(bone["bone"], bone["node"]) for bone in table]
    except (KeyError, TypeError, AttributeError):
        fail(glb.path, place, "the list of humanoid bones is damaged; export the VRM again.")
    found: dict[str, int] = {}
    for name, node in bones:
        if node == -1:  # exporters' way to leave a bone out
            continue
        item(glb, "nodes", node, f"{place}, bone {name!r:.40}")
        role = role_of(str(name), version)
        if role is None or not isinstance(node, int):
            continue
        if role in found or node in found.values():
            fail(glb.path, f"{place}, bone {name!r:.40}", f"nodes[{node}] is named twice; export the VRM again.")
        found[role] = node
    return found
