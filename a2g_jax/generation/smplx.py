"""Motions as SMPL-X parameters, in the layout of BEAT2's files, which the tools of the field read."""

import os
from functools import lru_cache

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from a2g_jax.data.datasets.smplx import BODY, HANDS, PELVIS_AT_REST
from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget import Rig, find_rig, match_rigs, retarget, with_relaxed_hands
from a2g_jax.geometry.retarget.relaxed import relaxed_rotations
from a2g_jax.io.files import atomic_path
from a2g_jax.talker.skeleton import TALKER_HANDS_SKELETON, TALKER_SKELETON

#: Joints of SMPL-X, and the numbers of shape and expression parameters in BEAT2's files.
_JOINTS, _BETAS, _EXPRESSIONS = 55, 300, 100


def write_smplx_npz(path: str | os.PathLike[str], motion: Motion) -> None:
    """Write SMPL-X parameters as ``.npz``.

    ======================  ========  ==========================================================================
    key                     shape     what
    ======================  ========  ==========================================================================
    ``poses``               (T, 165)  rotation vectors of 55 joints, radians: body, jaw, eyes, hands (not relative
                                      to a mean hand: ``flat_hand_mean=True``)
    ``trans``               (T, 3)    metres, y up; the pelvis is at ``trans`` plus its place in the model at rest
    ``betas``               (300,)    zeros, the average shape
    ``expressions``         (T, 100)  zeros
    ``mocap_frame_rate``    ()        frames per second
    ``gender``              ()        ``neutral``
    ``model``               ()        ``smplx2020``
    ``surface_model_type``  ()        ``smplx``
    ======================  ========  ==========================================================================

    Rotations of the 22 body joints are those of the motion where it has SMPL-X's skeleton; others are retargeted.
    Fingers that the motion lacks are relaxed.

    Raises:
        InputError: no frames, NaN, or a skeleton without arms.
    """
    if motion.frames == 0:
        raise InputError(f"{path}: not written: the motion has no frames.")
    rotations, root = smplx_rotations(motion)
    vectors = Rotation.from_matrix(rotations.reshape(-1, 3, 3).astype(np.float64)).as_rotvec()
    poses = np.zeros((motion.frames, _JOINTS, 3), np.float32)
    poses[:, BODY] = vectors.reshape(motion.frames, -1, 3)[:, BODY]
    poses[:, HANDS] = vectors.reshape(motion.frames, -1, 3)[:, BODY.stop :]
    trans = (root.astype(np.float64) - PELVIS_AT_REST).astype(np.float32)
    if not (np.all(np.isfinite(poses)) and np.all(np.isfinite(trans))):
        raise InputError(f"{path}: not written: NaN or infinity in the motion.")
    rate = int(motion.fps) if float(motion.fps).is_integer() else motion.fps
    with atomic_path(path) as temporary:
        np.savez_compressed(
            temporary,
            poses=poses.reshape(motion.frames, -1),
            trans=trans,
            betas=np.zeros(_BETAS, np.float32),
            expressions=np.zeros((motion.frames, _EXPRESSIONS), np.float32),
            mocap_frame_rate=np.array(rate),
            gender=np.array("neutral"),
            model=np.array("smplx2020"),
            surface_model_type=np.array("smplx"),
        )


def smplx_rotations(motion: Motion) -> tuple[Float[np.ndarray, "T 52 3 3"], Float[np.ndarray, "T 3"]]:
    """Local rotations of the 22 body joints and 30 finger joints of SMPL-X, and the place of the pelvis."""
    rotations = np.asarray(motion.rotations)
    if motion.skeleton.same_tree(TALKER_HANDS_SKELETON):
        return rotations, np.asarray(motion.root)
    if motion.skeleton.same_tree(TALKER_SKELETON):
        relaxed = relaxed_rotations(_target())
        assert relaxed is not None
        still = relaxed[BODY.stop :].astype(np.float32)
        fingers = np.broadcast_to(still, (motion.frames, *still.shape))
        return np.concatenate([rotations, fingers], axis=1), np.asarray(motion.root)
    source = find_rig(motion.skeleton, name="the motion's skeleton")
    moved = retarget(motion, with_relaxed_hands(match_rigs(source, _target())))
    return np.asarray(moved.rotations), np.asarray(moved.root)


@lru_cache(maxsize=1)
def _target() -> Rig:
    return find_rig(TALKER_HANDS_SKELETON, name="SMPL-X")
