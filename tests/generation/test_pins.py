"""Clips performed in a generated motion: transitions, feet, places, and clips that are adapted or refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2g_jax.cli import main
from a2g_jax.errors import InputError
from a2g_jax.generation.generator import Generator, plant_rotations
from a2g_jax.generation.pins.offsets import Shape, decay, offset_vectors, turned
from a2g_jax.generation.pins.perform import perform
from a2g_jax.generation.pins.pinned import ClipPins, PinnedClips, check_gaps
from a2g_jax.generation.pins.repair import repair_flips
from a2g_jax.generation.pins.report import Ends, report_pins
from a2g_jax.generation.pins.request import Pin, pin_of
from a2g_jax.generation.pins.smooth import resample_smoothly
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.metrics.hands import hand_jerk, hand_joints, local_places
from a2g_jax.metrics.liveliness import body_of, feet_slide
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.skeleton import TALKER_SKELETON
from a2g_jax.training.run import demo_run

LIMIT = 860.0


@pytest.fixture(scope="module")
def run():
    return demo_run()


@pytest.fixture(scope="module")
def speech():
    return talk(8.0, 5)


@pytest.fixture(scope="module")
def plain(run, speech):
    return next(Generator(run).stream(speech.audio, 1, 0))


@pytest.fixture(scope="module")
def take():
    return talk(20.0, 77, speaker="felix").motion


def put(plain, run, *pins, length=None):
    standing = [plant_rotations(run, np.asarray(pin.motion.rotations)) for pin in pins]
    return perform(plain, pins, standing, LIMIT, length)


def smooth_turns(rng, frames, scale, apart=60):
    """Random local rotations that change smoothly, up to long ways round."""
    knots = rng.normal(0.0, scale, (frames // apart + 3, 22, 3))
    times = np.linspace(0, len(knots) - 1, frames)
    rows = np.floor(times).astype(int).clip(0, len(knots) - 2)
    share = (times - rows)[:, None, None]
    share = share**2 * (3 - 2 * share)
    vectors = (1 - share) * knots[rows] + share * knots[rows + 1]
    return Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(frames, 22, 3, 3)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("scale", [0.3, 1.5])
def test_rotation_velocity_and_acceleration_are_continuous_at_both_ends_of_a_transition(seed, scale):
    rng = np.random.default_rng(seed)
    # Time steps so fine that differences are derivatives.
    steps, settle = int(rng.integers(3000, 4000)), int(rng.integers(2000, 3000))
    clip, motion = (smooth_turns(rng, 400, scale) for _ in range(2))
    near = offset_vectors(clip[:3], motion[:3])
    offsets = decay(near, Shape(steps, settle))
    across = np.concatenate([near[::-1], offsets[:3]])
    third = np.diff(across, n=3, axis=0)
    assert np.abs(third).max() < 0.02 * np.abs(np.diff(near, n=2, axis=0)).max()
    # At the other end the motion is the generated one, with its velocity and acceleration.
    for order in (0, 1, 2):
        assert np.abs(np.diff(offsets, n=order, axis=0)[-1]).max() < 1e-5
    result = turned(motion[:50], offsets[-50:])
    np.testing.assert_allclose(result[-1], motion[49], atol=1e-9)


def test_offsets_take_the_short_way_and_keep_it(run):
    still = np.tile(np.eye(3), (3, 22, 1, 1))
    angles = np.deg2rad([179.0, 183.0, 187.0])
    clip = np.tile(Rotation.from_euler("x", angles[:, None]).as_matrix()[:, None], (1, 22, 1, 1))
    np.testing.assert_allclose(np.rad2deg(offset_vectors(clip, still)[:, 0, 0]), [179.0, 183.0, 187.0], atol=1e-6)
    assert np.linalg.norm(offset_vectors(clip[1:], still[1:])[0, 0]) < np.pi


@pytest.mark.parametrize("seed", range(4))
def test_a_pin_is_the_clip_and_everything_beyond_its_transitions_is_as_it_was(run, plain, take, seed):
    rng = np.random.default_rng(seed)
    frames = int(rng.integers(20, 80))
    at = int(rng.integers(0, take.frames - frames))
    pin = pin_of(take.clip(at, at + frames), run, "clip", float(rng.uniform(2.2, 3.0)))
    motion, (placed,) = put(plain, run, pin)
    trunk_and_arms = [joint for joint, name in enumerate(TALKER_SKELETON.names) if name[2:] not in LEGS]
    np.testing.assert_allclose(
        motion.rotations[pin.first : pin.stop, trunk_and_arms], pin.motion.rotations[:, trunk_and_arms], atol=1e-5
    )
    for outside in (slice(0, placed.start), slice(placed.stop, None)):
        np.testing.assert_array_equal(motion.rotations[outside], plain.rotations[outside])
        np.testing.assert_array_equal(motion.root[outside], plain.root[outside])
    (row,) = report_pins([pin], motion, plain, LIMIT, "test", [placed.ends])
    assert row["followed"]
    assert row["wrist_worst_cm"] < 0.01
    assert not row["rough"]
    # Steps of rotations and of the root are as small in the transitions as elsewhere, and feet stand.
    turns = rotation_angle(motion.rotations[1:], motion.rotations[:-1])
    usual = max(rotation_angle(one.rotations[1:], one.rotations[:-1]).max() for one in (plain, pin.motion))
    assert turns.max() < 1.5 * usual
    assert np.linalg.norm(np.diff(motion.root, axis=0), axis=1).max() < 0.03
    assert feet_slide(body_of(motion.clip(placed.start, placed.stop))) < 5.0


LEGS = ("Hip", "Knee", "Ankle", "Foot")


def test_a_cut_has_a_jerk_that_transitions_have_not(run, plain, take):
    pin = pin_of(take.clip(100, 160), run, "clip", 3.0)
    hard, (cut,) = put(plain, run, pin, length=0.0)
    soft, (placed,) = put(plain, run, pin)
    assert (cut.ends.before, placed.ends.before >= 9) == (1, True)
    most = [hand_jerk(local_places(motion), motion.skeleton, motion.fps).max() for motion in (hard, soft)]
    assert most[0] > 3 * most[1]
    (row,) = report_pins([pin], hard, plain, LIMIT, "test", [cut.ends])
    assert row["rough"]


def test_pins_at_the_beginning_the_end_and_beside_each_other(run, plain, take):
    whole = pin_of(take, run, "whole", 0.0, plain.seconds)
    filled, (placed,) = put(plain, run, whole)
    assert placed.ends == Ends(0, 0)
    np.testing.assert_allclose(filled.rotations[:, 13:], whole.motion.rotations[:, 13:], atol=1e-5)
    first, last = (
        pin_of(take.clip(0, 45), run, "first", 0.0),
        pin_of(take.clip(50, 95), run, "last", plain.seconds - 1.5),
    )
    middle = pin_of(take.clip(200, 230), run, "middle", 2.1)
    motion, (one, two, three) = put(plain, run, first, middle, last)
    assert (one.ends.before, three.ends.after) == (0, 0)
    assert one.stop <= middle.first
    assert two.start >= first.stop
    for pin in (first, middle, last):
        np.testing.assert_allclose(motion.rotations[pin.first : pin.stop, 13:], pin.motion.rotations[:, 13:], atol=1e-5)
    turns = rotation_angle(motion.rotations[1:], motion.rotations[:-1])
    assert turns.max() < 60.0


def test_near_the_beginning_the_motion_starts_beside_where_it_would(run, plain, take):
    pin = pin_of(take.clip(300, 360), run, "clip", 0.2)
    motion, (placed,) = put(plain, run, pin)
    assert placed.start == 0
    assert hand_jerk(local_places(motion), motion.skeleton, 30.0)[:20].max() < 1.5 * LIMIT


def test_clips_without_time_between_them_are_refused(run, take):
    up = np.array(take.rotations[:30])
    up[:, TALKER_SKELETON.names.index("L_Shoulder")] = Rotation.from_euler("z", 80, degrees=True).as_matrix()
    raised = replace(take.clip(0, 30), rotations=up)
    pins = [Pin("down", 1.0, take.clip(0, 30)), Pin("up", 2.0, raised)]
    with pytest.raises(InputError, match=r"up@2: begins 0\.00 s after down ends, with hands \d+ cm"):
        check_gaps(pins)
    check_gaps([pins[0], Pin("up", 2.5, raised)])
    check_gaps([Pin("one", 1.0, take.clip(0, 30)), Pin("two", 2.0, take.clip(30, 60))])


def test_a_sample_depends_on_its_number_alone(run, speech, take):
    pin = pin_of(take.clip(100, 160), run, "clip", 3.0)
    pinned = PinnedClips(run, Generator(run), (pin,))
    two = list(pinned.stream(speech.audio, 2, seed=3))
    (one,) = pinned.stream(speech.audio, 1, seed=3)
    np.testing.assert_array_equal(two[0].rotations, one.rotations)
    assert not np.array_equal(two[0].rotations, two[1].rotations)
    assert len(pinned.reports) == 1


def test_bounds_of_pins_are_those_of_the_clip_as_it_is_performed(run, speech, take):
    """The root and the height of the clip's file, which are not performed, widen no bound."""
    clip = take.clip(100, 160)
    root = np.array(clip.root)
    root[:, 1] += np.where(np.arange(60) % 20 < 10, -0.6, 0.4)
    root[:, 0] += 0.2 * np.arange(60)
    (high,), (own,) = (
        PinnedClips(run, Generator(run), (pin_of(motion, run, "clip", 3.0),)).stretches
        for motion in (replace(clip, root=root), clip)
    )
    for name, values in own.bounds.high.items():
        np.testing.assert_allclose(high.bounds.high[name], values, rtol=1e-5)


def test_a_crouch_lowers_the_body_over_standing_feet(run, plain, take):
    clip = take.clip(0, 60)
    rotations = np.array(clip.rotations)
    bend = np.deg2rad(45.0)
    for joint, angle in (("Hip", -bend), ("Knee", 2 * bend), ("Ankle", -bend)):
        for side in "LR":
            index = TALKER_SKELETON.names.index(f"{side}_{joint}")
            rotations[:, index] = rotations[:, index] @ Rotation.from_euler("x", angle).as_matrix()
    motion, (placed,) = put(plain, run, pin_of(replace(clip, rotations=rotations), run, "crouch", 3.0))
    down = plain.root[placed.pin.first : placed.pin.stop, 1] - motion.root[placed.pin.first : placed.pin.stop, 1]
    assert 0.1 < np.median(down) < 0.4
    assert feet_slide(body_of(motion)) < 5.0


def leg_figures(run, motion):
    """Fastest turn of hips, knees and ankles (degrees/s), and the most that knees are bent backwards (degrees)."""
    reference = run.config.body_bounds.reference
    figures = reference.figures(motion)
    legs = [reference.joints[f"{side}_{part}"] for side in "LR" for part in ("Hip", "Knee", "Ankle")]
    return figures["turn"][:, legs].max(), figures["backwards"][:, 2:].max()


def test_legs_take_their_time_into_a_crouch(run, plain, take):
    """The hands of a clip that only crouches would allow the shortest transition, in which knees turn by 90 degrees."""
    clip = replace(plain.clip(80, 140), root=plain.root[80:140])
    rotations = np.array(clip.rotations)
    for joint, angle in (("Hip", -45.0), ("Knee", 90.0), ("Ankle", -45.0)):
        for side in "LR":
            index = TALKER_SKELETON.names.index(f"{side}_{joint}")
            rotations[:, index] = rotations[:, index] @ Rotation.from_euler("x", angle, degrees=True).as_matrix()
    pin = pin_of(replace(clip, rotations=rotations), run, "crouch", 80 / 30)
    motion, (placed,) = put(plain, run, pin)
    assert leg_figures(run, motion)[0] < 180.0
    assert max(placed.ends) < 60
    # A length that is requested is taken as it is.
    motion, (placed,) = put(plain, run, pin, length=0.3)
    assert leg_figures(run, motion)[0] > 300.0


def test_knees_bend_forwards_around_a_clip_whose_knees_are_bent_backwards(run, plain):
    """As by a few degrees in recordings; a knee that reaches for a foothold must not bend further that way."""
    reference = run.config.body_bounds.reference
    clip = plain.clip(60, 160)
    rotations = np.array(clip.rotations)
    flexion = reference.figures(clip)["bend"]
    for number in (2, 3):
        knee = reference.joints[reference.hinges[number]]
        turn = np.radians(-8.0 - flexion[:, number])[:, None] * reference.axes[number]
        rotations[:, knee] = (Rotation.from_rotvec(turn) * Rotation.from_matrix(rotations[:, knee])).as_matrix()
    motion, _ = put(plain, run, pin_of(replace(clip, rotations=rotations), run, "clip", 2.0))
    turn, backwards = leg_figures(run, motion)
    assert turn < 180.0
    assert backwards < 10.0


def test_a_flip_is_replaced_and_named_and_a_motion_of_flips_is_refused(run, take):
    clip = take.clip(100, 160)
    rotations = np.array(clip.rotations)
    wrist = TALKER_SKELETON.names.index("R_Wrist")
    rotations[30:] = clip.rotations[30:]
    rotations[30, wrist] = rotations[30, wrist] @ Rotation.from_euler("x", 170, degrees=True).as_matrix()
    pin = pin_of(replace(clip, rotations=rotations), run, "clip", 1.0)
    assert any("R_Wrist turns by 1" in note for note in pin.notes)
    assert rotation_angle(pin.motion.rotations[1:], pin.motion.rotations[:-1]).max() < 60.0
    untouched, notes = repair_flips(clip)
    assert notes == []
    np.testing.assert_array_equal(untouched.rotations, clip.rotations)
    rotations[::2, wrist] = rotations[::2, wrist] @ Rotation.from_euler("x", 170, degrees=True).as_matrix()
    with pytest.raises(InputError, match=r"clip: turns R_Wrist by 1\d\d degrees from frame \d+ to the next"):
        pin_of(replace(clip, rotations=rotations), run, "clip", 1.0)


def test_a_calibration_pose_before_a_clip_is_left_out(run, take):
    pose = np.tile(np.eye(3, dtype=np.float32), (5, 22, 1, 1))
    clip = take.clip(100, 160)
    longer = Motion(np.concatenate([pose, clip.rotations]), np.zeros((65, 3), np.float32), clip.skeleton, 30.0)
    pin = pin_of(longer, run, "clip", 1.0)
    assert pin.motion.frames == 60
    assert "frames 0 to 4 (0.17 s), a calibration pose" in pin.notes[0]


def test_the_paths_of_a_root_that_jumps_are_not_kept_and_named(run, plain, take):
    clip = take.clip(100, 160)
    root = np.array(clip.root)
    root[30:] += [3.0, 0.0, 1.0]
    pin, still = (pin_of(one, run, "clip", 3.0) for one in (replace(clip, root=root), clip))
    assert any("m along the floor is not kept" in note for note in pin.notes)
    moved, stayed = (put(plain, run, one)[0] for one in (pin, still))
    np.testing.assert_array_equal(moved.root, stayed.root)


def test_resampling_has_no_corners(take):
    slow = Motion(take.rotations[::2], take.root[::2], take.skeleton, 15.0)
    smooth = resample_smoothly(slow, 30.0, take.frames)
    wrists = hand_joints(take.skeleton)
    error = np.linalg.norm((local_places(smooth) - local_places(take))[:-2, wrists], axis=-1)
    assert error.mean() < 0.002
    assert np.percentile(hand_jerk(local_places(smooth), take.skeleton, 30.0), 50) < 2 * np.percentile(
        hand_jerk(local_places(take), take.skeleton, 30.0), 50
    )


def test_from_the_command_line(take, speech, tmp_path, capsys):
    write_audio(tmp_path / "speech.wav", speech.audio, 16000)
    write_bvh(tmp_path / "wave.bvh", take.clip(100, 160))
    out, clip = tmp_path / "out", f"{tmp_path / 'wave.bvh'}@3"
    command = ["generate", "demo", "--audio", str(tmp_path / "speech.wav"), "--samples", "2", "--out", str(out)]
    assert main([*command, "--pin", clip, "--control", "energy=0.9", "--edit", "specific scale 0:10 1.1"]) == 0
    assert capsys.readouterr().out.count("wrists 0.0 cm from the clip") == 2
    rows = json.loads((out / "pins.json").read_text())
    assert [[row["followed"] for row in sample] for sample in rows] == [[True], [True]]
    page = (out / "index.html").read_text()
    assert "; energy=0.9; edit specific scale 0:10 1.1; pinned wave.bvh at 3 s</p>" in page
    assert main([*command, "--pin", clip, "--pin-shared", "1"]) == 2
    assert "--pin-shared is for --pin-mode latent" in capsys.readouterr().err
    assert main([*command, "--pin", f"{tmp_path / 'wave.bvh'}@7"]) == 2
    assert "or only its beginning: " in capsys.readouterr().err


def test_real_takes_are_performed(run, plain, speech, shared):
    from a2g_jax.generation.clips import read_motion

    for path, first in (("beat/2_scott_0_1_1.bvh", 100), ("zeggs/067_Speech_2_x_1_0.bvh", 200)):
        motion = read_motion(shared / path)
        pin = pin_of(motion.clip(first, first + round(2 * motion.fps)), run, path, 3.0)
        pinned = PinnedClips(run, Generator(run), (pin,), limit=LIMIT)
        list(pinned.stream(speech.audio, 1))
        ((row,),) = pinned.reports
        assert row["followed"]
        assert row["smooth"]


def test_options_place_pins(run, speech, take, tmp_path):
    write_bvh(tmp_path / "wave.bvh", take.clip(100, 160))
    pins = ClipPins((f"{tmp_path / 'wave.bvh'}@3+1",), length=0.5)
    placed = pins.place(run, Generator(run), 240)
    assert placed.pins[0].motion.frames == 30
    list(placed.stream(speech.audio, 1))
    assert (placed.reports[0][0]["before"], placed.reports[0][0]["after"]) == (0.5, 0.5)
