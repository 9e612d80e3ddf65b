"""Characters and the files that are written for them in Blender, where there is one."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from a2g_jax.generation.delivery import Delivery
from a2g_jax.io.bvh import read_bvh, write_bvh
from a2g_jax.io.character import read_character
from a2g_jax.talker.recordings import talk
from a2g_jax.viz.mannequin_glb import write_mannequin_glb
from experiments.characters.rigs import mixamo, unreal
from experiments.characters.skinned import mixamo_glb, vrm_0

CONVERT = Path(__file__).parents[2] / "docs" / "tools" / "blender_convert.py"
FRAMES = [0, 1, 17, 46]
pytestmark = pytest.mark.slow

#: Import the character, then the written file, and put its action onto the character.
SCRIPT = """
import json, sys
sys.argv = ["-"]
exec(open({convert!r}).read().split("if __name__")[0])
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.scene.render.fps = {fps}
def armature(path):
    before = set(bpy.data.objects)
    read(Path(path))
    return next(one for one in bpy.data.objects if one not in before and one.type == "ARMATURE")
first, second = armature({character!r}), armature({written!r})
if first.animation_data is None:
    first.animation_data_create()
for track in list(first.animation_data.nla_tracks):
    first.animation_data.nla_tracks.remove(track)
action = second.animation_data.action or second.animation_data.nla_tracks[0].strips[0].action
first.animation_data.action = action
found = {{}}
for name, rig in (("character", first), ("written", second)):
    for frame in {frames!r}:
        bpy.context.scene.frame_set(frame + {start})
        found[f"{{name}} {{frame}}"] = {{bone.name: list(rig.matrix_world @ bone.head) for bone in rig.pose.bones}}
meshes = [one for one in bpy.data.objects if one.type == "MESH"]
print("FOUND" + json.dumps({{"places": found, "range": list(action.frame_range), "meshes": len(meshes)}}))
"""


def blender(*arguments):
    program = shutil.which("blender")
    if program is None:
        pytest.skip("no Blender here")
    return subprocess.run([program, "-b", *map(str, arguments)], capture_output=True, text=True, timeout=400)


def in_blender(character, written, fps, start):
    script = SCRIPT.format(
        convert=str(CONVERT), character=str(character), written=str(written), fps=fps, frames=FRAMES, start=start
    )
    shown = blender("--python-expr", script)
    line = next((line for line in shown.stdout.splitlines() if line.startswith("FOUND")), None)
    assert line is not None, shown.stdout[-2000:] + shown.stderr[-2000:]
    return json.loads(line.removeprefix("FOUND"))


def away(found, who, motion, positions):
    """Largest distance in metres of the bones from the joints; Blender is z up."""
    worst = 0.0
    for frame in FRAMES:
        places = found["places"][f"{who} {frame}"]
        for joint, name in enumerate(motion.skeleton.names):
            x, y, z = places[name]
            worst = max(worst, float(np.linalg.norm(np.array([x, z, -y]) - positions[frame, joint])))
    return worst


@pytest.fixture(scope="module")
def motion():
    return talk(2.0, 1).motion


@pytest.mark.parametrize("fps", [24, 30])
@pytest.mark.parametrize("make", [mixamo, unreal], ids=lambda make: make.__name__)
def test_the_action_of_a_bvh_fits_the_characters_armature(make, fps, motion, tmp_path):
    path = make().write(tmp_path / "character.bvh")
    delivery = Delivery(character=read_character(path), fps=float(fps))
    made = delivery.make(motion)
    delivery.written(tmp_path / "out.bvh", made.own)
    found = in_blender(path, tmp_path / "out.bvh", fps, 1)
    assert found["range"] == [1, 2 * fps]  # a second has as many frames as the scene
    positions = read_bvh(tmp_path / "out.bvh").positions()
    assert away(found, "written", made.own, positions) < 1e-3
    assert away(found, "character", made.own, positions) < 1e-3


@pytest.mark.parametrize("fps", [24, 30])
@pytest.mark.parametrize("make", [mixamo_glb, vrm_0], ids=["mixamo.glb", "vrm_0.glb"])
def test_a_glb_character_in_a_scene(make, fps, motion, tmp_path):
    path = make(tmp_path / "character.glb")
    delivery = Delivery(character=read_character(path), fps=float(fps))
    made = delivery.make(motion)
    delivery.written(tmp_path / "out.glb", made.own)
    found = in_blender(path, tmp_path / "out.glb", fps, 0)
    assert found["range"] == pytest.approx([0, 2 * fps - 1], abs=1e-3)
    assert found["meshes"] >= 2
    positions = made.own.positions()
    assert away(found, "written", made.own, positions) < 1e-3
    assert away(found, "character", made.own, positions) < 1e-3


def test_the_mannequin_in_a_scene(motion, tmp_path):
    write_mannequin_glb(tmp_path / "a.glb", motion)
    found = in_blender(tmp_path / "a.glb", tmp_path / "a.glb", 30, 0)
    assert away(found, "written", motion, motion.positions()) < 1e-3


def test_an_fbx_character_by_way_of_glb_and_back(motion, tmp_path):
    vrm_0(tmp_path / "character.glb")
    blender("--python", CONVERT, "--", tmp_path / "character.glb", tmp_path / "character.fbx")
    blender("--python", CONVERT, "--", tmp_path / "character.fbx", tmp_path / "again.glb")
    assert (tmp_path / "character.fbx").read_bytes().startswith(b"Kaydara FBX Binary")
    delivery = Delivery(character=read_character(tmp_path / "again.glb"), fps=24.0)
    made = delivery.make(motion)
    delivery.written(tmp_path / "out.glb", made.own)
    blender("--python", CONVERT, "--", tmp_path / "out.glb", tmp_path / "out.fbx", 24)
    found = in_blender(tmp_path / "out.fbx", tmp_path / "out.fbx", 24, 1)
    assert away(found, "written", made.own, made.own.positions() * delivery.character.metres) < 1e-3


def test_bvh_of_a_motion_without_a_character(motion, tmp_path):
    write_bvh(tmp_path / "a.bvh", motion)
    found = in_blender(tmp_path / "a.bvh", tmp_path / "a.bvh", 30, 1)
    assert away(found, "written", motion, motion.positions()) < 1e-3
