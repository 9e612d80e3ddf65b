"""The picture of retargeting can be drawn, and its other rig has the properties in its caption."""

import numpy as np
import pytest

from a2g_jax.geometry.retarget import find_rig


def test_the_other_rig_shares_nothing_with_the_talker():
    pytest.importorskip("matplotlib")
    from experiments.retarget_pictures import other_rig

    skeleton = other_rig()
    rig = find_rig(skeleton)
    assert rig.up == "+Z"
    assert "Y" in "".join(rig.notes)
    arm = np.asarray(skeleton.offsets)[skeleton.index("lowerarm_l")]
    assert arm[2] < -0.2  # an A-pose
    assert sum("twist" in name for name in skeleton.names) == 4
    assert len(rig.spine) == 5


@pytest.mark.slow
def test_picture(tmp_path):
    pytest.importorskip("matplotlib")
    from experiments.retarget_pictures import picture

    picture(tmp_path / "retarget.png", 7)
    assert (tmp_path / "retarget.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
