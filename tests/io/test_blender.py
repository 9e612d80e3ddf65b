"""The writer's files open in Blender, where there is one."""

import json
import shutil
import subprocess

import numpy as np
import pytest

from a2g_jax.io.bvh import write_bvh
from a2g_jax.talker.recordings import talk

_SCRIPT = """
import bpy, builtins, json
from io_anim_bvh import import_bvh
# Blender 3.4 opens BVH files in mode 'rU', which Python 3.11 no longer knows.
import_bvh.open = lambda path, mode="r": builtins.open(path, mode.replace("U", ""))
bpy.ops.import_anim.bvh(filepath={path!r}, global_scale=0.01, axis_forward='-Z', axis_up='Y', use_fps_scale=False,
                        update_scene_fps=True, update_scene_duration=True, rotate_mode='NATIVE')
rig = bpy.context.object
heads = {{}}
for frame in {frames!r}:
    bpy.context.scene.frame_set(frame + 1)
    heads[frame] = {{bone.name: list(rig.matrix_world @ bone.head) for bone in rig.pose.bones}}
scene = bpy.context.scene
print("HEADS" + json.dumps({{"fps": scene.render.fps, "last": scene.frame_end, "heads": heads}}))
"""


@pytest.mark.slow
def test_blender_sees_the_same_joints(tmp_path):
    blender = shutil.which("blender")
    if blender is None:
        pytest.skip("no Blender here")
    motion = talk(4.0, 1).motion
    path = tmp_path / "motion.bvh"
    write_bvh(path, motion)
    frames = [0, 40, 119]
    script = _SCRIPT.format(path=str(path), frames=frames)
    shown = subprocess.run([blender, "-b", "--python-expr", script], capture_output=True, text=True, timeout=240)
    line = next((line for line in shown.stdout.splitlines() if line.startswith("HEADS")), None)
    assert line is not None, shown.stdout[-2000:] + shown.stderr[-2000:]
    found = json.loads(line.removeprefix("HEADS"))
    assert found["fps"] == 30
    assert found["last"] >= 119
    positions = motion.positions()
    for frame in frames:
        for joint, name in enumerate(motion.skeleton.names):
            x, y, z = found["heads"][str(frame)][name]
            # Blender is Z-up.
            np.testing.assert_allclose([x, z, -y], positions[frame, joint], atol=1e-3)
