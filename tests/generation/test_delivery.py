"""Motions for the rigs of nine programs: names, axes, units and orders of each file, and the motion itself."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.data.datasets.smplx import smplx_motion
from a2g_jax.errors import InputError
from a2g_jax.generation.delivery import PLAIN, Delivery
from a2g_jax.generation.formats import MORE_FORMATS, MotionFiles, format_names, known_formats
from a2g_jax.generation.smplx import write_smplx_npz
from a2g_jax.geometry.retarget import find_rig
from a2g_jax.geometry.retarget.upright import facing, upright_motion
from a2g_jax.io.bvh import read_bvh, read_with_layout, write_bvh
from a2g_jax.io.character import read_character
from a2g_jax.talker.recordings import talk
from experiments.characters.rigs import EXPORTERS

pytestmark = pytest.mark.filterwarnings("ignore:.*lengths are in:a2g_jax.errors.InputWarning")
BONES = [("Shoulder", "Elbow"), ("Elbow", "Wrist"), ("Hip", "Knee"), ("Knee", "Ankle")]


@pytest.fixture(scope="module")
def motion():
    return talk(2.0, 1).motion.clip(5, 35)


@pytest.fixture(scope="module", params=EXPORTERS, ids=lambda make: make.__name__)
def rig_file(request, tmp_path_factory):
    return request.param().write(tmp_path_factory.mktemp("rig") / f"{request.param.__name__}.bvh")


def head(path):
    return path.read_text().split("MOTION")[0].strip()


def turns(ours, theirs, roles, skeleton):
    """Largest angle in degrees between the bones of two motions."""
    worst = 0.0
    for side in "LR":
        for first, second in BONES:
            a, b = f"{side}_{first}", f"{side}_{second}"
            one = ours[:, roles[b]] - ours[:, roles[a]]
            two = theirs[:, skeleton.index(b)] - theirs[:, skeleton.index(a)]
            cosine = np.sum(one * two, -1) / np.linalg.norm(one, axis=-1) / np.linalg.norm(two, axis=-1)
            worst = max(worst, float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).max()))
    return worst


@pytest.mark.parametrize("fps", [None, 24.0])
def test_the_file_is_the_rigs_own_and_has_the_motion(rig_file, motion, fps, tmp_path):
    delivery = Delivery(character=read_character(rig_file), fps=fps)
    made = delivery.make(motion)
    delivery.written(tmp_path / "out.bvh", made.own)
    assert delivery.lines() == []
    assert head(tmp_path / "out.bvh") == head(rig_file)
    back = read_bvh(tmp_path / "out.bvh")
    assert (back.fps, back.frames) == (fps or 30.0, round(30 * (fps or 30.0) / 30))
    np.testing.assert_allclose(back.positions(), made.own.positions(), atol=2e-5)


def test_arms_and_legs_point_where_the_motions_do(rig_file, motion):
    delivery = Delivery(character=read_character(rig_file))
    made = delivery.make(motion)
    roles = delivery.character.rig.roles
    assert turns(made.shown.positions(), motion.positions(), roles, motion.skeleton) < 6
    # Feet stand on the floor, and the figure faces forward.
    ankles = made.shown.positions()[:, [roles["L_Ankle"], roles["R_Ankle"]], 1]
    assert 0.02 < ankles.min() < ankles.max() < 0.25
    across = made.shown.positions()[:, roles["L_Hip"], 0] - made.shown.positions()[:, roles["R_Hip"], 0]
    assert across.min() > 0.05


def test_what_is_shown_is_the_rig_in_plain_axes(rig_file, motion):
    character = read_character(rig_file)
    made = Delivery(character=character).make(motion)
    rig = character.rig
    np.testing.assert_allclose(made.shown.positions(), made.own.positions() @ rig.world * character.metres, atol=1e-5)
    still = upright_motion(made.own.clip(0, 1), rig)
    rest = find_rig(still.skeleton, rest="zero")
    np.testing.assert_allclose(rest.world, np.eye(3), atol=1e-9)


@pytest.mark.parametrize(("scale", "metres"), [("cm", 0.01), ("m", 1.0)])
def test_another_unit(rig_file, motion, scale, metres, tmp_path):
    own, other = (Delivery(character=read_character(rig_file, one)) for one in ("auto", scale))
    own.written(tmp_path / "own.bvh", own.make(motion).own)
    other.written(tmp_path / "other.bvh", other.make(motion).own)
    found, layout = read_with_layout(tmp_path / "other.bvh")
    assert layout.scale == metres
    np.testing.assert_allclose(found.positions(), read_bvh(tmp_path / "own.bvh").positions(), atol=5e-5)
    skeleton = re.sub(r"OFFSET.*", "OFFSET", head(tmp_path / "other.bvh"))
    assert skeleton == re.sub(r"OFFSET.*", "OFFSET", head(rig_file))


@settings(max_examples=12, deadline=None)
@given(
    order=st.permutations("XYZ").map("".join),
    units=st.sampled_from([1.0, 10.0, 100.0, 39.37]),
    number=st.integers(0, len(EXPORTERS) - 1),
    fps=st.sampled_from([24.0, 25.0, 29.97, 30.0, 60.0]),
)
def test_any_order_unit_and_rate(order, units, number, fps, motion, tmp_path_factory):
    folder = tmp_path_factory.mktemp("any")
    still = read_bvh(EXPORTERS[number]().write(folder / "rig.bvh"))
    write_bvh(folder / "rig.bvh", still, order=order, scale=units)
    delivery = Delivery(character=read_character(folder / "rig.bvh"), fps=fps)
    made = delivery.make(motion)
    delivery.written(folder / "out.bvh", made.own)
    assert head(folder / "out.bvh") == head(folder / "rig.bvh")
    np.testing.assert_allclose(read_bvh(folder / "out.bvh").positions(), made.own.positions(), atol=2e-5)


def test_nothing_is_done_by_default(motion):
    assert PLAIN.make(motion).shown is motion
    assert PLAIN.writers() == {}
    assert PLAIN.match(motion.skeleton) is None


DIRECTIONS = {"+z": (0, 0, 1), "-z": (0, 0, -1), "+x": (1, 0, 0), "-x": (-1, 0, 0)}


@pytest.mark.parametrize(("direction", "axis"), DIRECTIONS.items())
def test_facing(motion, direction, axis):
    turned = facing(motion, direction)
    hips = [motion.skeleton.index(f"{side}_Hip") for side in "LR"]
    left = turned.positions()[:, hips[0]] - turned.positions()[:, hips[1]]
    forward = np.cross(left, (0, 1, 0)).mean(axis=0)
    assert forward @ axis / np.linalg.norm(forward) > 0.9
    np.testing.assert_allclose(turned.positions()[..., 1], motion.positions()[..., 1], atol=1e-5)


def test_units_of_plain_files(motion, tmp_path):
    delivery = Delivery(scale=1.0)
    with MotionFiles(tmp_path, ("sample",), ("bvh",), writers=delivery.writers()) as files:
        files.write(0, motion)
    assert (
        "OFFSET 0.090" in (tmp_path / "sample_00.bvh").read_text()
        or read_with_layout(tmp_path / "sample_00.bvh")[1].scale == 1.0
    )


def test_more_formats_are_written_on_request_only(motion, tmp_path):
    assert not set(MORE_FORMATS) & set(format_names())
    assert set(known_formats()) == {*MORE_FORMATS, *format_names()}
    with MotionFiles(tmp_path, ("sample",), ("glb", "smplx", "npz")) as files:
        files.write(0, motion)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["sample_00.glb", "sample_00.npz", "sample_00.smplx.npz"]
    with MotionFiles(tmp_path, ("sample",), ("bvh",)) as files:  # those of the earlier call go
        files.write(0, motion)
    assert [path.name for path in tmp_path.iterdir()] == ["sample_00.bvh"]


def test_smplx_parameters(motion, tmp_path):
    path = tmp_path / "a.smplx.npz"
    write_smplx_npz(path, motion)
    found = np.load(path)
    frames = motion.frames
    assert (found["poses"].shape, found["trans"].shape, found["betas"].shape) == ((frames, 165), (frames, 3), (300,))
    assert (found["gender"].item(), found["model"].item(), found["mocap_frame_rate"].item()) == (
        "neutral",
        "smplx2020",
        30,
    )
    poses = found["poses"].reshape(frames, 55, 3)
    body = smplx_motion(poses[:, :22], found["trans"], 30.0, "here")
    np.testing.assert_allclose(body.rotations, motion.rotations, atol=1e-5)
    np.testing.assert_allclose(body.positions(), motion.positions(), atol=1e-5)
    assert np.all(poses[:, 22:25] == 0)
    # Relaxed fingers: left ones bend about -z, right ones about +z, as in the model's mean hands.
    middle = {"L": 25 + 4, "R": 40 + 4}
    assert np.all(poses[:, middle["L"], 2] < -0.3)
    assert np.all(poses[:, middle["R"], 2] > 0.3)


def test_smplx_parameters_of_another_rig(rig_file, motion, tmp_path):
    made = Delivery(character=read_character(rig_file)).make(motion)
    write_smplx_npz(tmp_path / "a.smplx.npz", made.shown)
    found = np.load(tmp_path / "a.smplx.npz")
    body = smplx_motion(found["poses"].reshape(-1, 55, 3)[:, :22], found["trans"], 30.0, "here")
    roles = {name: joint for joint, name in enumerate(body.skeleton.names)}
    assert turns(body.positions(), motion.positions(), roles, motion.skeleton) < 6


def test_motions_that_smplx_cannot_hold(motion, tmp_path):
    with pytest.raises(InputError, match="no frames"):
        write_smplx_npz(tmp_path / "a.npz", motion.clip(0, 0))
