"""Points and bones of poses without a skeleton, in the order of the data sets.

TED Gesture and TED-Expressive: the pairs and the lengths with which their authors' code draws poses (``dir_vec_pairs``
in ``data_utils.py`` of Yoon et al. 2020 and in ``data_utils_expressive.py`` of Liu et al. 2022), as
in :mod:`~a2g_jax.talker.views.directions`. Speech2Gesture and PATS: the order of ``joint_names`` in PATS'
``skeleton.py``, which is that of ``consts.py`` of Ginosar et al. 2019 (there, 7 to 27 are the left hand and 28 to 48
the right one once nose and eyes are gone).
"""

from a2g_jax.geometry.pose_layout import PoseLayout
from a2g_jax.talker.views.directions import TED, TED_EXPRESSIVE, BoneLayout
from a2g_jax.talker.views.keypoints import KEYPOINTS


def _directions(layout: BoneLayout) -> PoseLayout:
    return PoseLayout(names=layout.points, bones=layout.bones, lengths=layout.lengths)


TED_LAYOUT = _directions(TED)
"""10 points, 9 bones."""
TED_EXPRESSIVE_LAYOUT = _directions(TED_EXPRESSIVE)
"""43 points, 42 bones."""


def _keypoint_bones() -> tuple[tuple[int, int], ...]:
    bones = [(0, 1), (1, 2), (2, 3), (0, 4), (4, 5), (5, 6), (6, 7)]
    for wrist in (7, 28):
        bones += [(3, 28)] if wrist == 28 else []
        for finger in range(5):
            first = wrist + 1 + 4 * finger
            bones += [(wrist, first), *((joint, joint + 1) for joint in range(first, first + 3))]
    return tuple(bones)


S2G_LAYOUT = PoseLayout(names=KEYPOINTS, bones=_keypoint_bones())
"""49 points: neck, right arm, left arm, left hand, right hand; wrists occur twice, as the end of an arm and as the
start of a hand."""
