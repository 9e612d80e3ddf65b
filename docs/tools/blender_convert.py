"""Convert characters and motions between FBX, GLB and BVH with Blender, without its window.

    blender -b --python blender_convert.py -- IN.fbx OUT.glb [FPS]

Tested with Blender 3.4. FPS is the frame rate of the scene (default 30): that of the motion.
"""

import builtins
import sys
from pathlib import Path

import bpy
import numpy

# The glTF add-on of Blender 3.4 uses names that NumPy 1.24 has no longer.
for name, kind in {"bool": bool, "int": int, "float": float, "object": object}.items():
    if name not in vars(numpy):
        setattr(numpy, name, kind)


def read(path: Path) -> None:
    """Import a file into the empty scene."""
    kind = path.suffix.lower()
    if kind in (".glb", ".vrm"):
        # Bones as they were: other heuristics turn their axes.
        bpy.ops.import_scene.gltf(filepath=str(path), bone_heuristic="BLENDER")
    elif kind == ".fbx":
        bpy.ops.import_scene.fbx(filepath=str(path), automatic_bone_orientation=False, use_anim=True)
    elif kind == ".bvh":
        from io_anim_bvh import import_bvh

        # Blender 3.4 opens BVH files in mode "rU", which Python 3.11 refuses.
        import_bvh.open = lambda path, mode="r": builtins.open(path, mode.replace("U", ""))  # noqa: PTH123, SIM115
        bpy.ops.import_anim.bvh(
            filepath=str(path), global_scale=0.01, axis_forward="-Z", axis_up="Y", update_scene_duration=True
        )
    else:
        sys.exit(f"{path}: expected .glb, .vrm, .fbx or .bvh")


def write(path: Path) -> None:
    """Export the scene."""
    kind = path.suffix.lower()
    if kind == ".fbx":
        bpy.ops.export_scene.fbx(
            filepath=str(path),
            add_leaf_bones=False,
            bake_anim=True,
            bake_anim_use_nla_strips=False,
            bake_anim_use_all_actions=False,
            bake_anim_simplify_factor=0.0,
        )
    elif kind == ".glb":
        bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLB", export_force_sampling=True)
    else:
        sys.exit(f"{path}: expected .fbx or .glb")


def last_frame() -> int:
    """The last frame of all actions."""
    return max([round(action.frame_range[1]) for action in bpy.data.actions], default=1)


def main(source: str, target: str, fps: str = "30") -> None:
    """Convert one file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = round(float(fps))
    read(Path(source))
    bpy.context.scene.frame_start = 0
    bpy.context.scene.frame_end = last_frame()
    write(Path(target))


if __name__ == "__main__":
    given = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    if len(given) not in (2, 3):
        sys.exit("blender -b --python blender_convert.py -- IN.fbx OUT.glb [FPS]")
    main(*given)
