"""Damaged, foreign and hostile GLB files: one error that names the file, the place and the remedy."""

import contextlib
import json
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.errors import InputError
from a2g_jax.io.character import character_suffix, read_character
from a2g_jax.io.gltf import container
from a2g_jax.io.gltf.container import read_glb, write_glb
from experiments.characters.skinned import SKINNED


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The three skinned characters."""
    folder = tmp_path_factory.mktemp("characters")
    return {name: write(folder / name) for name, write in SKINNED.items()}


def refused(path, *words):
    with pytest.raises(InputError) as error:
        read_character(path)
    message = str(error.value)
    assert "\n" not in message
    assert str(path) in message
    for word in words:
        assert word in message, message
    return message


def test_what_is_written_is_read_back(tmp_path):
    document = {"asset": {"version": "2.0"}, "buffers": [{"byteLength": 5}], "extras": {"名前": "é"}}
    write_glb(tmp_path / "a.glb", document, b"12345")
    found = read_glb(tmp_path / "a.glb")
    assert found.document == document
    assert found.binary == b"12345\0\0\0"
    assert (tmp_path / "a.glb").stat().st_size % 4 == 0


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", ("is empty",)),
        (b"HIERARCHY\nROOT a\n" * 3, ("not a GLB file", "glTF Binary")),
        (b'{"asset": {"version": "2.0"}}' * 3, ("glTF as text", "one binary file")),
        (struct.pack("<4sII", b"glTF", 1, 40) + b"\0" * 28, ("version 1", "glTF 2.0")),
        (struct.pack("<4sII", b"glTF", 2, 4_000_000) + b"\0" * 28, ("header", "cut short")),
        (struct.pack("<4sIIII", b"glTF", 2, 40, 4_000_000, 0x4E4F534A) + b"\0" * 20, ("chunk 0", "damaged")),
        (struct.pack("<4sIIII", b"glTF", 2, 24, 4, 0x004E4942) + b"\0" * 4, ("chunk 0", "JSON")),
        (struct.pack("<4sIIII", b"glTF", 2, 24, 4, 0x4E4F534A) + b"[1,]", ("JSON", "export it again")),
        (struct.pack("<4sIIII", b"glTF", 2, 24, 4, 0x4E4F534A) + b"\xff\xfe{}", ("JSON",)),
        (struct.pack("<4sIIII", b"glTF", 2, 24, 4, 0x4E4F534A) + b"[  ]", ("JSON", "object")),
    ],
)
def test_files_that_are_none(content, words, tmp_path):
    path = tmp_path / "x.glb"
    path.write_bytes(content)
    refused(path, *words)


def test_deep_and_large_files(tmp_path, monkeypatch):
    path = tmp_path / "deep.glb"
    text = b'{"nodes":' + b"[" * 200_000 + b"]" * 200_000 + b"}"
    text += b" " * (-len(text) % 4)
    path.write_bytes(struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text)
    refused(path, "JSON", "too deeply")
    monkeypatch.setattr(container, "LARGEST_JSON", 1000)
    refused(path, "JSON", "MB")
    monkeypatch.setattr(container, "LARGEST", 1000)
    refused(path, "GB", "smaller textures")


def test_other_kinds_of_files_name_the_way(tmp_path):
    ways = {"x.fbx": "Blender", "x.gltf": "glTF Binary", "x.blend": "export", "x": "BVH, GLB or VRM"}
    for name, word in ways.items():
        with pytest.raises(InputError, match=word):
            character_suffix(tmp_path / name)
    assert [character_suffix(name) for name in ("A.BVH", "b.GLB", "c.vrm")] == [".bvh", ".glb", ".glb"]


def edited(path, target, change):
    """A copy of a file with its JSON changed."""
    glb = read_glb(path)
    document = json.loads(json.dumps(glb.document))
    change(document)
    write_glb(target, document, glb.binary)
    return target


def node(document, name):
    return next(index for index, one in enumerate(document["nodes"]) if one.get("name") == name)


def circle(document):
    hips, hand = node(document, "mixamorig:Hips"), node(document, "mixamorig:LeftHandIndex4")
    document["nodes"][node(document, "Armature")]["children"] = []
    document["nodes"][hand]["children"] = [hips]


def two_parents(document):
    document["nodes"][node(document, "mixamorig:Head")]["children"] = [node(document, "mixamorig:LeftHand")]


def setting(name, **values):
    def change(document):
        document["nodes"][node(document, f"mixamorig:{name}")].update(values)

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (circle, ("own parent", "nodes[")),
        (two_parents, ("LeftHand", "two parents")),
        (setting("LeftArm", children=[10_000]), ("LeftArm", "nodes[10000]", "does not exist")),
        (setting("LeftArm", children=[-1]), ("LeftArm", "does not exist")),
        (setting("LeftArm", children=["a"]), ("LeftArm", "does not exist")),
        (setting("LeftArm", rotation=[0, 0, 0, 0]), ("LeftArm", "rotation")),
        (setting("LeftArm", rotation=[0, 0, 1]), ("LeftArm", "rotation", "4 numbers")),
        (setting("LeftArm", translation=[1e30, 0, 0]), ("LeftArm", "translation")),
        (setting("LeftArm", translation=[True, 0, 0]), ("LeftArm", "translation")),
        (setting("LeftArm", scale=[1, 2, 1]), ("LeftArm", "scales (1, 2, 1)", "apply the scale")),
        (setting("LeftArm", scale=[-1, -1, -1]), ("LeftArm", "scales", "positive")),
        (setting("LeftArm", scale=[0, 0, 0]), ("LeftArm", "scales")),
        (setting("LeftArm", matrix=[1] * 15), ("LeftArm", "matrix", "16 numbers")),
        (lambda d: d["skins"].clear(), ("skins", "no skin")),
        (lambda d: d["skins"][0].update(joints=[]), ("skins", "no skin")),
        (lambda d: d["skins"][0].update(joints=[5000]), ("skins[0], joints", "does not exist")),
        (lambda d: d["skins"][0].update(inverseBindMatrices=5000), ("inverseBindMatrices", "does not exist")),
        (lambda d: d["skins"][0].update(inverseBindMatrices=1), ("inverseBindMatrices", "matrices")),
        (lambda d: d["bufferViews"][0].update(byteOffset=10**9), ("inverseBindMatrices", "outside")),
        (lambda d: d["bufferViews"][0].update(byteOffset=-4), ("inverseBindMatrices", "whole number")),
        (lambda d: d["buffers"][0].update(uri="body.bin"), ("another file", "one binary file")),
        (lambda d: d.update(nodes={}), ("nodes", "list of objects")),
        (lambda d: d.update(nodes=[1]), ("nodes", "list of objects")),
    ],
)
def test_damaged_characters(files, change, words, tmp_path):
    # The matrices are the last buffer view of the writer here.
    def with_matrices_first(document):
        place = document["accessors"][document["skins"][0]["inverseBindMatrices"]]["bufferView"]
        document["bufferViews"][0], document["bufferViews"][place] = (
            document["bufferViews"][place],
            document["bufferViews"][0],
        )
        for accessor in document["accessors"]:
            accessor["bufferView"] = {0: place, place: 0}.get(accessor["bufferView"], accessor["bufferView"])
        change(document)

    refused(edited(files["mixamo.glb"], tmp_path / "x.glb", with_matrices_first), *words)


@pytest.mark.parametrize(
    ("bones", "words"),
    [
        ({"hips": {"node": 9999}}, ("'hips'", "does not exist")),
        ({"hips": {"node": 1}, "head": {"node": 1}}, ("named twice",)),
        ({"hips": {}}, ("damaged",)),
        ([1, 2], ("damaged",)),
    ],
)
def test_damaged_humanoids(files, bones, words, tmp_path):
    def change(document):
        document["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"] = bones

    refused(edited(files["vrm_1.vrm"], tmp_path / "x.vrm", change), "VRMC_vrm.humanoid", *words)


def test_a_table_is_no_character(files, tmp_path):
    def change(document):
        for index, one in enumerate(document["nodes"]):
            one["name"] = f"part_{index}"
            one.pop("children", None)
        joints = document["skins"][0]["joints"]
        document["nodes"][joints[0]]["children"] = joints[1:5]
        document["skins"][0].pop("inverseBindMatrices")
        document["skins"][0]["joints"] = joints[:5]

    refused(edited(files["mixamo.glb"], tmp_path / "x.glb", change), "no human body")


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_flipped_bytes_are_read_or_refused(data, files, tmp_path_factory):
    """Never another error than the one line; textures and meshes are not looked at."""
    content = bytearray(files["mixamo.glb"].read_bytes())
    size = 20 + struct.unpack_from("<I", content, 12)[0]
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, size))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("flipped") / "x.glb"
    path.write_bytes(content[: data.draw(st.sampled_from([len(content), size + 100, size // 2]))])
    with contextlib.suppress(InputError):
        assert np.all(np.isfinite(read_character(path).rig.skeleton.offsets))
