"""The 22 body joints of a rig, found by joint names."""

from a2g_jax.geometry.joint_names import named_joints
from a2g_jax.geometry.skeleton import BODY_JOINTS, BODY_PARENTS, Skeleton


def find_body_joints(skeleton: Skeleton) -> tuple[int, ...] | None:
    """Index of each of the 22 body joints (:data:`~a2g_jax.geometry.skeleton.BODY_JOINTS`, in their order).

    Recognises the names listed in :mod:`~a2g_jax.geometry.joint_names`, with any prefix (``mixamorig:``), case or
    separator. Spines are identified by position: of three or more between pelvis and neck the first, the middle and the
    last. None when a joint is missing or the tree contradicts the names;
    :func:`~a2g_jax.geometry.retarget.find_rig` requires fewer joints.
    """
    joints = {role: joint for role, joint in named_joints(skeleton.names).items() if role in BODY_JOINTS}
    if "Pelvis" not in joints or "Neck" not in joints:
        return None
    spine = path_up(skeleton.parents, joints["Neck"], joints["Pelvis"])
    if spine is None or len(spine) < 3:
        return None
    spine.reverse()
    joints["Spine1"], joints["Spine2"], joints["Spine3"] = spine[0], spine[len(spine) // 2], spine[-1]
    if set(joints) != set(BODY_JOINTS):
        return None
    found = tuple(joints[name] for name in BODY_JOINTS)
    return found if _is_body_tree(skeleton, found) else None


def find_wrists(skeleton: Skeleton) -> tuple[int, int] | None:
    """Indices of the left and the right wrist, also in rigs that lack other joints of the body, such as upper bodies.

    None where a wrist is missing.
    """
    joints = named_joints(skeleton.names)
    left, right = joints.get("L_Wrist"), joints.get("R_Wrist")
    return None if left is None or right is None else (left, right)


def path_up(parents: tuple[int, ...], joint: int, above: int) -> list[int] | None:
    """The joints strictly between ``joint`` and its ancestor ``above``, from below; None if it is no ancestor."""
    path = []
    joint = parents[joint]
    while joint not in (-1, above):
        path.append(joint)
        joint = parents[joint]
    return None if joint == -1 else path


def _is_body_tree(skeleton: Skeleton, joints: tuple[int, ...]) -> bool:
    """Whether each joint is a descendant of its parent in the body."""
    if len(set(joints)) != len(joints):
        return False
    links = [(joint, joints[parent]) for joint, parent in zip(joints, BODY_PARENTS, strict=True) if parent >= 0]
    return all(path_up(skeleton.parents, joint, parent) is not None for joint, parent in links)


def common_ancestor(parents: tuple[int, ...], first: int, second: int) -> int:
    """Lowest common ancestor of two joints, which may be one of them."""
    while first != second:
        if first > second:
            first = parents[first]
        else:
            second = parents[second]
    return first
