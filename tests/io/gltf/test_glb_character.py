"""Characters in GLB and VRM files come back with the motion, and are otherwise as they were."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.generation.delivery import Delivery
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.character import read_character
from a2g_jax.io.gltf.animation import continuous_quaternions
from a2g_jax.io.gltf.character import GlbCharacter
from a2g_jax.io.gltf.container import read_glb, write_glb
from a2g_jax.io.gltf.nodes import read_nodes
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.skeleton import TALKER_SKELETON
from a2g_jax.viz.mannequin_glb import write_mannequin_glb
from experiments.characters.decoded import Decoded
from experiments.characters.skinned import SKINNED, mixamo_glb


@pytest.fixture(scope="module")
def motion():
    return talk(2.0, 1).motion.clip(5, 45)


@pytest.fixture(scope="module", params=sorted(SKINNED))
def character(request, tmp_path_factory):
    return SKINNED[request.param](tmp_path_factory.mktemp("character") / request.param)


def written(path, motion, target, **options):
    """The file of a motion, the character and what was written."""
    delivery = Delivery(character=read_character(path), **options)
    made = delivery.make(motion)
    delivery.written(target, made.own)
    return Decoded(target), delivery.character, made


def errors(decoded, names, positions, fps):
    tracks = decoded.tracks()
    places = [decoded.places(frame / fps, tracks) for frame in range(len(positions))]
    found = np.array([[frame[name] for name in names] for frame in places])
    return float(np.abs(found - positions).max())


@pytest.mark.parametrize("fps", [None, 24.0])
def test_nodes_are_where_the_joints_are(character, motion, fps, tmp_path):
    decoded, read, made = written(character, motion, tmp_path / "out.glb", fps=fps)
    assert made.own.fps == (fps or 30.0)
    assert errors(decoded, read.rig.skeleton.names, made.own.positions(), made.own.fps) < 1e-5
    times = decoded.tracks()[read._found.nodes[0], "translation"][0]
    np.testing.assert_allclose(times, np.arange(made.own.frames) / made.own.fps, atol=1e-6)


def test_everything_else_is_as_it_was(character, motion, tmp_path):
    before = Decoded(character)
    after, _, _ = written(character, motion, tmp_path / "out.glb")
    assert after.binary[: len(before.binary)] == before.binary
    for key in set(before.document) - {"buffers", "bufferViews", "accessors"}:
        assert after.document[key] == before.document[key], key
    for key in ("bufferViews", "accessors"):
        assert after.document[key][: len(before.document[key])] == before.document[key]
    assert [one["name"] for one in after.document["animations"]] == ["gesture"]


def test_a_second_animation_comes_before_the_first(character, motion, tmp_path):
    written(character, motion, tmp_path / "once.glb")
    after, _, _ = written(tmp_path / "once.glb", motion, tmp_path / "twice.glb", fps=24.0)
    assert len(after.document["animations"]) == 2
    counts = [max(len(times) for times, _ in after.tracks(number).values()) for number in (0, 1)]
    assert counts == [32, 40]


def test_a_sampler_for_each_joint_without_jumps(character, motion, tmp_path):
    decoded, read, _ = written(character, motion, tmp_path / "out.glb")
    animation = decoded.document["animations"][0]
    assert len(animation["samplers"]) == len(animation["channels"]) == read.rig.skeleton.joints + 1
    for (_, path), (_, values) in decoded.tracks().items():
        if path == "rotation":
            np.testing.assert_allclose(np.linalg.norm(values, axis=1), 1, atol=1e-6)
            assert np.all(np.sum(values[1:] * values[:-1], axis=1) > 0)


def test_signs_of_quaternions_follow_the_one_before():
    angles = np.linspace(0, 4 * np.pi, 60)
    zero, one = np.zeros_like(angles), np.ones_like(angles)
    rows = [[np.cos(angles), -np.sin(angles), zero], [np.sin(angles), np.cos(angles), zero], [zero, zero, one]]
    found = continuous_quaternions(np.moveaxis(np.array(rows), -1, 0))
    assert found[0, 3] > 0
    assert np.all(np.sum(found[1:] * found[:-1], axis=1) > 0.99)
    assert found[30, 3] < -0.9 or found[29, 3] < -0.9


def test_arms_point_where_the_motions_do(character, motion, tmp_path):
    """In the person's own axes, which differ: VRM 0.x faces -z."""
    _, read, made = written(character, motion, tmp_path / "out.glb")
    roles = read.rig.roles
    ours, theirs = made.shown.positions(), motion.positions()
    for side in "LR":
        for first, second in (("Shoulder", "Elbow"), ("Elbow", "Wrist"), ("Hip", "Knee"), ("Knee", "Ankle")):
            a, b = (f"{side}_{part}" for part in (first, second))
            bone = ours[:, roles[b]] - ours[:, roles[a]]
            other = theirs[:, motion.skeleton.index(b)] - theirs[:, motion.skeleton.index(a)]
            cosine = np.sum(bone * other, -1) / np.linalg.norm(bone, axis=-1) / np.linalg.norm(other, axis=-1)
            assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 6, (a, b)
    wrist = made.own.positions()[:, roles["L_Wrist"]] - made.own.positions()[:, roles["R_Wrist"]]
    assert (wrist[:, 0].mean() < 0) == ("vrm_0" in character.name)


def test_the_body_is_found_by_the_humanoid_and_not_by_names(character):
    read = GlbCharacter(character)
    assert read.rig.by_shape is False
    assert len([role for role in read.rig.roles if role[-1].isdigit()]) >= 30
    if character.name == "vrm_1.vrm":
        assert read.rig.skeleton.names[0].startswith("bone_")


def test_nodes_with_matrices(character, motion, tmp_path):
    """Their matrices become translations, rotations and scales, since animated nodes may have none."""
    glb = read_glb(character)
    nodes = read_nodes(glb)
    document = json.loads(json.dumps(glb.document))
    for row, one in zip(document["nodes"], nodes, strict=True):
        matrix = np.eye(4)
        matrix[:3, :3] = one.rotation * one.scale
        matrix[:3, 3] = one.translation
        for key in ("translation", "rotation", "scale"):
            row.pop(key, None)
        row["matrix"] = matrix.T.reshape(-1).tolist()
    write_glb(tmp_path / "matrices.glb", document, glb.binary)
    decoded, read, made = written(tmp_path / "matrices.glb", motion, tmp_path / "out.glb")
    assert errors(decoded, read.rig.skeleton.names, made.own.positions(), 30.0) < 1e-5
    np.testing.assert_allclose(
        Decoded(tmp_path / "matrices.glb").world(0.0), Decoded(tmp_path / "out.glb").world(0.0), atol=1e-6
    )


def test_the_pose_of_the_nodes_need_not_be_the_rest_pose(motion, tmp_path):
    """Files saved in the middle of an animation: the skin's own pose counts."""
    path = mixamo_glb(tmp_path / "a.glb")
    decoded, read, made = written(path, motion, tmp_path / "once.glb")
    glb = read_glb(tmp_path / "once.glb")
    document = json.loads(json.dumps(glb.document))
    for (index, path_name), (_, values) in decoded.tracks().items():
        document["nodes"][index][path_name] = np.asarray(values[-1], float).tolist()
    document.pop("animations")
    write_glb(tmp_path / "posed.glb", document, glb.binary)
    _, posed, again = written(tmp_path / "posed.glb", motion, tmp_path / "twice.glb")
    np.testing.assert_allclose(posed.rig.skeleton.offsets, read.rig.skeleton.offsets, atol=1e-4)
    np.testing.assert_allclose(again.own.positions(), made.own.positions(), atol=1e-3)


def test_names_that_are_missing_or_there_twice(motion, tmp_path):
    glb = read_glb(SKINNED["vrm_1.vrm"](tmp_path / "a.vrm"))
    document = json.loads(json.dumps(glb.document))
    for index, one in enumerate(document["nodes"]):
        one["name"] = "bone"
        if index % 3 == 0:
            del one["name"]
    write_glb(tmp_path / "b.vrm", document, glb.binary)
    _, read, made = written(tmp_path / "b.vrm", motion, tmp_path / "out.glb")
    assert len(set(read.rig.skeleton.names)) == read.rig.skeleton.joints
    assert Decoded(tmp_path / "out.glb").document["nodes"] == document["nodes"]
    assert made.own.frames == 40


def test_a_character_of_another_size_stands_on_its_feet(motion, tmp_path):
    """A giant whose lengths are in centimetres is read with a note, and is as large as it was."""
    glb = read_glb(mixamo_glb(tmp_path / "a.glb"))
    document = json.loads(json.dumps(glb.document))
    next(one for one in document["nodes"] if one["name"] == "Armature")["scale"] = [1.0, 1.0, 1.0]
    write_glb(tmp_path / "b.glb", document, glb.binary)
    decoded, read, made = written(tmp_path / "b.glb", motion, tmp_path / "out.glb")
    assert read.metres == 0.01
    assert "centimetres" in read.notes()[0]
    assert errors(decoded, read.rig.skeleton.names, made.own.positions(), 30.0) < 1e-3
    assert 1.4 < made.shown.positions()[:, read.rig.roles["Head"], 1].mean() < 1.7
    with pytest.raises(InputError, match="comes back with its own mesh"):
        read_character(tmp_path / "b.glb", "m")
    assert read_character(tmp_path / "b.glb", "cm").metres == 0.01


def test_motions_that_are_refused(character, motion, tmp_path):
    read = read_character(character)
    made = Delivery(character=read).make(motion)
    with pytest.raises(InputError, match="not of the joints"):
        read.write(tmp_path / "x.glb", motion)
    with pytest.raises(InputError, match="no frames"):
        read.write(tmp_path / "x.glb", made.own.clip(0, 0))
    rotations = np.array(made.own.rotations)
    rotations[7, 3] = np.nan
    with pytest.raises(InputError, match="frame 7"):
        read.write(tmp_path / "x.glb", Motion(rotations, made.own.root, made.own.skeleton, 30.0))
    assert not (tmp_path / "x.glb").exists()


def test_the_mannequin_is_where_the_joints_are(motion, tmp_path):
    write_mannequin_glb(tmp_path / "a.glb", motion)
    decoded = Decoded(tmp_path / "a.glb")
    assert errors(decoded, motion.skeleton.names, motion.positions(), motion.fps) < 1e-5
    mesh = decoded.document["meshes"][0]
    for primitive in mesh["primitives"]:
        weights = decoded.accessor(primitive["attributes"]["WEIGHTS_0"])
        np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-6)
        assert decoded.accessor(primitive["attributes"]["JOINTS_0"]).max() < motion.skeleton.joints
        count = len(decoded.accessor(primitive["attributes"]["POSITION"]))
        assert decoded.accessor(primitive["indices"]).max() == count - 1


def test_the_mannequins_skin_stays_on_its_bones(motion, tmp_path):
    """Vertices of every part stay near the bones: no triangle is torn off by a wrong joint or matrix."""
    write_mannequin_glb(tmp_path / "a.glb", motion)
    decoded = Decoded(tmp_path / "a.glb")
    skin = decoded.document["skins"][0]
    inverse = np.swapaxes(decoded.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4), -1, -2)
    world = decoded.world(1.0, decoded.tracks())[skin["joints"]] @ inverse
    joints = motion.positions()[30]
    for primitive in decoded.document["meshes"][0]["primitives"]:
        attributes = {name: decoded.accessor(index) for name, index in primitive["attributes"].items()}
        points = np.c_[attributes["POSITION"], np.ones(len(attributes["POSITION"]))]
        moved = world[attributes["JOINTS_0"].astype(int)] * attributes["WEIGHTS_0"][:, :, None, None]
        moved = np.einsum("vjab,vb->va", moved, points)[:, :3]
        assert np.linalg.norm(moved[:, None] - joints, axis=-1).min(axis=1).max() < 0.32
    assert TALKER_SKELETON.same_tree(motion.skeleton)


VALIDATE = """
const validator = require("gltf-validator"), fs = require("fs");
Promise.all(process.argv.slice(1).map(async (path) => {
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(path)), { maxIssues: 0 });
  if (report.issues.numErrors) console.log(path, JSON.stringify(report.issues.messages.slice(0, 5)));
})).then(() => console.log("done"));
"""


def test_khronos_validator_finds_no_error(motion, tmp_path):
    node = shutil.which("node")
    here = Path(__file__).parents[3]
    probe = subprocess.run(
        [node or "false", "-e", 'require("gltf-validator")'], cwd=here, capture_output=True, check=False
    )
    if node is None or probe.returncode:
        pytest.skip("no gltf-validator here; install it with: npm install gltf-validator")
    write_mannequin_glb(tmp_path / "mannequin.glb", motion)
    files = [tmp_path / "mannequin.glb"]
    for name, make in SKINNED.items():
        files += [make(tmp_path / name), tmp_path / f"{name}.out.glb"]
        written(files[-2], motion, files[-1])
    shown = subprocess.run(
        [node, "-e", VALIDATE, *map(str, files)], cwd=here, capture_output=True, text=True, check=True
    )
    assert shown.stdout.split() == ["done"]
