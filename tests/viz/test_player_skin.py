"""The mesh of a character on the page."""

import re
from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.generation.delivery import Delivery
from a2g_jax.io.character import read_character
from a2g_jax.io.gltf import mesh
from a2g_jax.io.gltf.buffers import read_values
from a2g_jax.io.gltf.container import read_glb, write_glb
from a2g_jax.io.gltf.figure import Surface
from a2g_jax.talker.recordings import talk
from a2g_jax.viz.player import Figure, write_page
from a2g_jax.viz.player.page import moved_points
from a2g_jax.viz.player.skin import bind, make_skin
from a2g_jax.viz.player.stage import shape_points
from experiments.characters.decoded import Decoded
from experiments.characters.rigs import mixamo
from experiments.characters.skinned import SKINNED, mixamo_glb
from tests.browser_for_tests import chromium
from tests.viz.test_player_browser import opened
from tests.viz.test_player_page import page_data


@pytest.fixture(scope="module")
def motion():
    return talk(2.0, 1).motion.clip(5, 45)


def moved(bound, motion):
    """Vertices in every frame, from the points that the page has, as the page places them."""
    points = shape_points(motion, bound.shape()).astype(np.float64)
    bones = points[:, : 3 * len(bound.joints)].reshape(len(points), -1, 3, 3)
    origin, x, y = bones[:, :, 0], bones[:, :, 1] - bones[:, :, 0], bones[:, :, 2] - bones[:, :, 0]
    x, y = (axis / np.linalg.norm(axis, axis=-1, keepdims=True) for axis in (x, y))
    turns = np.stack([x, y, np.cross(x, y)], axis=-1)
    skin = bound.skin
    offsets = skin.places[:, None] - bound.centres[skin.joints]
    placed = origin[:, skin.joints] + (turns[:, skin.joints] @ offsets[..., None])[..., 0]
    return (placed * skin.weights[..., None]).sum(axis=2)


def in_the_file(path, rig, metres, frames, fps):
    """Vertices of a written file in every frame, by another decoder, in the axes of the page."""
    decoded = Decoded(path)
    skin, tracks = decoded.document["skins"][0], decoded.tracks()
    inverse = np.swapaxes(decoded.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4), -1, -2)
    rows = []
    for frame in range(frames):
        world = decoded.world(frame / fps, tracks)[skin["joints"]] @ inverse
        parts = []
        for primitive in decoded.document["meshes"][0]["primitives"]:
            values = {name: decoded.accessor(index) for name, index in primitive["attributes"].items()}
            points = np.c_[values["POSITION"], np.ones(len(values["POSITION"]))]
            blended = np.einsum("vkab,vk->vab", world[values["JOINTS_0"].astype(int)], values["WEIGHTS_0"])
            parts.append(np.einsum("vab,vb->va", blended, points)[:, :3])
        rows.append(np.concatenate(parts) @ rig.world * metres)
    return np.array(rows)


@pytest.mark.parametrize("name", sorted(SKINNED))
def test_the_page_moves_the_mesh_as_the_file_does(name, motion, tmp_path):
    character = read_character(SKINNED[name](tmp_path / name))
    delivery = Delivery(character=character)
    made = delivery.make(motion)
    delivery.written(tmp_path / "out.glb", made.own)
    skin = make_skin(made.shown.skeleton, character.surfaces(), most=100_000)
    expected = in_the_file(tmp_path / "out.glb", character.rig, character.metres, motion.frames, motion.fps)
    assert skin.places.shape == expected[0].shape
    away = np.linalg.norm(moved(bind(skin), made.shown) - expected, axis=-1)
    assert away.max() < 1e-4
    fewer = bind(skin, [made.shown])  # fingers do not move, and need no bones
    assert len(fewer.joints) < 25 < len(bind(skin).joints)
    away = np.linalg.norm(moved(fewer, made.shown) - expected, axis=-1)
    assert np.percentile(away, 99) < 1e-3
    assert away.max() < 0.02
    light = delivery.skin(made.shown.skeleton)
    assert len(light.places) <= 4000 < len(skin.places)
    far = np.linalg.norm(moved(bind(light), made.shown)[::20, :, None] - expected[::20, None, ::40], axis=-1)
    assert far.min(axis=1).max() < 0.06  # nothing of the mesh is lost
    assert delivery.skin(made.shown.skeleton) is light


def test_a_page_has_the_mesh_once(motion, tmp_path):
    delivery = Delivery(character=read_character(mixamo_glb(tmp_path / "mixamo.glb")))
    shown = delivery.make(motion).shown
    figures = [Figure(shown, f"sample {k}", skin=delivery.skin(shown.skeleton)) for k in range(3)]
    write_page(tmp_path / "page.html", [*figures, Figure(shown, "without")], np.zeros(0), 16000, title="mesh")
    page = (tmp_path / "page.html").read_text()
    data = page_data(page)
    assert len(data["meshes"]) == 1
    assert [figure.get("mesh") for figure in data["figures"]] == [0, 0, 0, None]
    assert len(data["meshes"][0]["data"]) < 200_000


def test_a_page_has_the_mesh_of_two_readings_once(motion, tmp_path):
    path = mixamo_glb(tmp_path / "mixamo.glb")
    deliveries = [Delivery(character=read_character(path)) for _ in range(2)]
    figures = []
    for delivery in deliveries:  # as of two takes of the studio
        shown = delivery.make(motion).shown
        figures.append(Figure(shown, "sample", skin=delivery.skin(shown.skeleton)))
    assert figures[0].skin is not figures[1].skin
    other = replace(figures[0], skin=replace(figures[0].skin, two_sided=True))
    write_page(tmp_path / "page.html", [*figures, other], np.zeros(0), 16000, title="mesh")
    data = page_data((tmp_path / "page.html").read_text())
    assert [figure["mesh"] for figure in data["figures"]] == [0, 0, 1]
    points = {figure["points"] for figure in data["figures"][:2]}
    assert points == {moved_points(figures) + 2}  # and the two wrists
    # What is checked before anything is generated is enough, and less than of all joints.
    most = deliveries[0].page_points(motion.skeleton)
    assert moved_points(figures) <= most < 3 * shown.skeleton.joints
    assert moved_points([Figure(shown, "without")]) == shown.skeleton.joints


@pytest.mark.browser
def test_the_browser_places_the_vertices(motion, tmp_path):
    delivery = Delivery(character=read_character(mixamo_glb(tmp_path / "mixamo.glb")))
    shown = delivery.make(motion).shown
    figure = Figure(shown, "mesh", skin=delivery.skin(shown.skeleton))
    write_page(tmp_path / "page.html", [figure], np.zeros(0), 16000, title="mesh")
    expected = moved(bind(figure.skin, [shown]), shown)[20]
    with chromium() as browser, opened(browser, tmp_path / "page.html") as page:
        page.evaluate(f"a2gPlayer.seek({20 / shown.fps})")
        page.evaluate("a2gPlayer.still()")
        found = np.array(page.evaluate("a2gPlayer.vertices()")).reshape(-1, 3)
    # The stage turns and moves the figure: distances within it stay.
    for values in (found, expected):
        values -= values.mean(axis=0)
    assert np.abs(np.linalg.norm(found, axis=1) - np.linalg.norm(expected, axis=1)).max() < 2e-3
    np.testing.assert_allclose(found[:, 1], expected[:, 1], atol=2e-3)


def _draco(document):
    for part in document["meshes"][0]["primitives"]:
        part["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}}


def _position(document):
    return document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]


def _meshopt(document):
    document["bufferViews"][_position(document)["bufferView"]]["extensions"] = {"EXT_meshopt_compression": {}}


def _elsewhere(document):
    document["buffers"].append({"uri": "mesh.bin", "byteLength": 4})
    document["bufferViews"][_position(document)["bufferView"]]["buffer"] = 1


def _lines(document):
    for part in document["meshes"][0]["primitives"]:
        part["mode"] = 1


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (_draco, r"primitives\[0\]: is compressed \(Draco\)"),
        (_meshopt, r"primitives\[0\], POSITION: is compressed \(EXT_meshopt_compression\)"),
        (lambda document: _position(document).update(sparse={}), "POSITION: is a sparse accessor"),
        (lambda document: _position(document).pop("bufferView"), "POSITION: has no data in the file"),
        (_elsewhere, "POSITION: is in another file"),
        (_lines, "meshes: no triangles that move with the joints"),
    ],
)
def test_meshes_that_are_not_read_are_named_with_the_reason(change, reason, tmp_path):
    glb = read_glb(mixamo_glb(tmp_path / "mixamo.glb"))
    change(glb.document)
    write_glb(tmp_path / "other.glb", glb.document, glb.binary)
    delivery = Delivery(character=read_character(tmp_path / "other.glb"))
    assert delivery.skin(delivery.character.rig.skeleton) is None
    (line,) = delivery.lines()
    assert re.search(rf"other\.glb, .*{reason}.*; export .*; the page shows our figure in its place$", line)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda part, accessors: accessors[part["indices"]].update(count=10**6), "lies outside the binary data"),
        (
            lambda part, accessors: accessors[part["indices"]].update(count=10**9),
            "500000 vertices or 1000000 triangles",
        ),
        (lambda part, accessors: accessors[part["attributes"]["JOINTS_0"]].update(count=1), "vertices are damaged"),
        (lambda part, accessors: accessors[part["attributes"]["POSITION"]].update(type="VEC2"), "expected VEC3"),
        (lambda part, accessors: part["attributes"].update(POSITION="a"), "does not exist"),
        (lambda part, accessors: part.update(indices=part["attributes"]["POSITION"]), "expected SCALAR"),
        (lambda part, accessors: part.update(material=99), re.escape("materials[99]")),
        (lambda part, accessors: accessors[part["attributes"]["POSITION"]].update(componentType=[]), "expected VEC3"),
        (lambda part, accessors: part["attributes"].update(JOINTS_0=part["attributes"]["WEIGHTS_0"]), None),
        (lambda part, accessors: part.update(extensions=None), None),
    ],
)
def test_damaged_meshes_are_refused_and_odd_ones_read(change, message, tmp_path):
    glb = read_glb(mixamo_glb(tmp_path / "mixamo.glb"))
    change(glb.document["meshes"][0]["primitives"][0], glb.document["accessors"])
    write_glb(tmp_path / "damaged.glb", glb.document, glb.binary)
    character = read_character(tmp_path / "damaged.glb")
    if message is None:
        assert len(character.surfaces()) > 3
        return
    with pytest.raises(InputError, match=message):
        character.surfaces()


@pytest.mark.parametrize("limit", ["MOST_VERTICES", "MOST_CORNERS", None])
def test_triangles_are_counted_before_they_are_read(limit, tmp_path, monkeypatch):
    glb = read_glb(mixamo_glb(tmp_path / "mixamo.glb"))
    parts = glb.document["meshes"][0]["primitives"]
    parts[:] = [parts[0]] * 40  # one accessor for all, as a small file can have
    write_glb(tmp_path / "many.glb", glb.document, glb.binary)
    character, read = read_character(tmp_path / "many.glb"), []
    one = glb.document["accessors"][parts[0]["attributes"]["POSITION"]]["count"]
    corners = glb.document["accessors"][parts[0]["indices"]]["count"]
    if limit is not None:
        monkeypatch.setattr(mesh, limit, 3 * {"MOST_VERTICES": one, "MOST_CORNERS": corners}[limit])
    monkeypatch.setattr(mesh, "read_values", lambda *given: read.append(given[-1]) or read_values(*given))
    if limit is None:
        assert len(character.surfaces()) == 40
        return
    with pytest.raises(
        InputError, match=r"many\.glb, meshes: have more than \d+ vertices or \d+ triangles; export fewer"
    ):
        character.surfaces()
    assert not any("primitives[3]" in place for place in read)


def test_merged_vertices_keep_colours_and_joints_apart():
    rng = np.random.default_rng(0)
    skeleton = talk(2.0, 1).motion.skeleton
    surfaces = []
    for colour, joint in (((1.0, 0.0, 0.0), 3), ((0.0, 1.0, 0.0), 5)):
        places = rng.normal(size=(6000, 3)) * 0.1
        normals = places / np.linalg.norm(places, axis=1, keepdims=True)
        joints, weights = np.tile([joint, 0, 0, 0], (6000, 1)), np.tile([1.0, 0, 0, 0], (6000, 1))
        surfaces.append(Surface(colour, places, normals, joints, weights, rng.integers(0, 6000, (9000, 3))))
    skin = make_skin(skeleton, surfaces, most=500)
    assert 200 < len(skin.places) <= 500
    assert skin.triangles.max() < len(skin.places)
    red = skin.colours[:, 0] == 1
    assert np.all(skin.joints[red, 0] == 3)
    assert np.all(skin.joints[~red, 0] == 5)
    assert len({*red[skin.triangles].sum(axis=1)} - {0, 3}) == 0


@pytest.mark.parametrize(
    ("count", "joints", "colours", "most"), [(6000, 3, 700, 500), (6000, 60, 700, 500), (70_000, 1, 1, 10**6)]
)
def test_parts_of_many_colours_and_directions_fit_too(count, joints, colours, most):
    rng = np.random.default_rng(0)
    skeleton = mixamo().skeleton()[0]
    places = rng.normal(size=(count, 3)) * 0.01
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    weights = np.tile([1.0, 0, 0, 0], (count, 1))
    owner = np.zeros((count, 4), int)
    owner[:, 0] = rng.integers(0, joints, count)
    surfaces = [
        Surface(
            tuple(rng.random(3)),
            places[part],
            normals[part],
            owner[part],
            weights[part],
            np.arange(len(part) // 3 * 3).reshape(-1, 3),
        )
        for part in np.array_split(np.arange(count), colours)
    ]
    skin = make_skin(skeleton, surfaces, most=most)
    assert len(skin.places) <= min(most, 65_536)
    assert skin.triangles.max() < len(skin.places)
    assert np.allclose(np.linalg.norm(skin.normals, axis=1), 1)
    assert skin.joints[:, 0].max() == joints - 1


def test_parts_of_too_many_joints_are_refused():
    skeleton, count = mixamo().skeleton()[0], 600
    owner = np.zeros((count, 4), int)
    owner[:, 0] = np.arange(count) % 60
    one = Surface(
        (1.0, 1.0, 1.0),
        np.zeros((count, 3)),
        np.tile([0.0, 1, 0], (count, 1)),
        owner,
        np.tile([1.0, 0, 0, 0], (count, 1)),
        np.arange(count).reshape(-1, 3),
    )
    with pytest.raises(InputError, match="too many parts for a page, which shows 50 vertices; export fewer"):
        make_skin(skeleton, [one], most=50)
