"""Finding the 22 body joints in a rig by the names that riggers give them."""

from a2g_jax.geometry.joint_names import named_joints
from a2g_jax.geometry.skeleton import BODY_JOINTS, BODY_PARENTS, Skeleton


def find_body(skeleton: Skeleton) -> tuple[int, ...] | None:
    """Index of each of the 22 body joints (:data:`~a2g_jax.geometry.skeleton.BODY_JOINTS`, in their order).

    Knows the names that :mod:`~a2g_jax.geometry.joint_names` lists, with any prefix (``mixamorig:``), case or
    separator. Spines are counted, not named: of three or more between pelvis and neck the first, the middle and the
    last are taken. None when a joint is missing or the tree contradicts the names;
    :func:`~a2g_jax.geometry.retarget.find_rig` is content with less.
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


def path_up(parents: tuple[int, ...], joint: int, above: int) -> list[int] | None:
    """The joints strictly between ``joint`` and its ancestor ``above``, from below; None where it is none."""
    path = []
    joint = parents[joint]
    while joint not in (-1, above):
        path.append(joint)
        joint = parents[joint]
    return None if joint == -1 else path


def _is_body_tree(skeleton: Skeleton, joints: tuple[int, ...]) -> bool:
    """Whether each found joint hangs below the found parent."""
    if len(set(joints)) != len(joints):
        return False
    links = [(joint, joints[parent]) for joint, parent in zip(joints, BODY_PARENTS, strict=True) if parent >= 0]
    return all(path_up(skeleton.parents, joint, parent) is not None for joint, parent in links)
