"""Clips of styles and seed poses: brought into the range of training, matched by requests, continued, reported."""

from dataclasses import replace
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from flows_for_tests import MODELS, clip, run_of
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from a2g_jax.cli import main
from a2g_jax.errors import InputError
from a2g_jax.generation.stylized_flow.fit import fit
from a2g_jax.generation.stylized_flow.into_range import Ranges, into_range
from a2g_jax.generation.stylized_flow.latent_space import FlowSpace
from a2g_jax.generation.stylized_flow.report import StyleTarget
from a2g_jax.generation.stylized_flow.requests import as_quantiles, matching_requests
from a2g_jax.generation.stylized_flow.seam import continued
from a2g_jax.generation.stylized_flow.style import within_training
from a2g_jax.generation.stylized_flow.turning import without_turning
from a2g_jax.geometry.euler import continuous_yxz
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.onto import face
from a2g_jax.geometry.rotation import matrix_from_yxz, yxz_from_matrix
from a2g_jax.metrics.style import HandStyle
from a2g_jax.training.run import save_run

FORWARD = np.eye(3)


def waves(frames=360, channels=4, size=1.0, seed=0):
    """Channels that move within about ``size``."""
    rng = np.random.default_rng(seed)
    time = np.arange(frames)[:, None]
    return size * np.sin(time / rng.uniform(5, 15, channels) + rng.uniform(0, 6, channels))


def ranges_of(clips, frames=180):
    low, high = (np.stack([edge(one, axis=0) for one in clips]) for edge in (np.min, np.max))
    return Ranges(np.arange(clips[0].shape[1]), low, high, frames)


TRAINING = ranges_of([waves(180, size=1.5, seed=seed) + 0.2 * np.sin(seed) for seed in range(40)])


def test_a_clip_like_those_of_training_is_unchanged():
    own = waves(size=1.2)
    moved = into_range(own, TRAINING)
    np.testing.assert_allclose(moved.z, own, atol=1e-6)
    assert np.abs(moved.offset).max() < 1e-6
    assert moved.amplitude.min() == 1.0
    assert moved.clipped == 0.0


@given(st.floats(-60.0, 60.0), st.floats(0.1, 40.0))
def test_posture_and_amplitude_end_within_the_range_of_training(offset, size):
    own = waves(size=size) + offset
    moved = into_range(own, TRAINING)
    assert np.all(moved.z >= TRAINING.low.min(axis=0) - 1e-6)
    assert np.all(moved.z <= TRAINING.high.max(axis=0) + 1e-6)
    # The order of movements stays, where nothing is clipped.
    for ours, theirs in zip(moved.z.T, own.T, strict=True):
        assert np.corrcoef(ours, theirs)[0, 1] > 0.98


@given(st.floats(0.1, 30.0), st.floats(0.0, 20.0), st.integers(0, 5))
def test_latents_are_no_larger_than_draws_and_keep_their_order(size, mean, seed):
    rng = np.random.default_rng(seed)
    own = (size * rng.normal(size=(300, 50)) + mean * rng.normal(size=50)).astype(np.float32)
    means = 0.15 * rng.normal(size=(100, 50))
    kept = within_training(own, means)
    around = kept - kept.mean(axis=0)
    assert np.square(around).mean() <= 1.01
    assert np.linalg.norm(kept.mean(axis=0)) < 1.1 * np.percentile(np.linalg.norm(means, axis=1), 99) + 0.5
    assert np.corrcoef(around.ravel(), (own - own.mean(axis=0)).ravel())[0, 1] > 0.9


def spinning(frames, rate):
    """A body that turns about by ``rate`` radians a frame and sways a little."""
    sway = Rotation.from_euler("z", 0.05 * np.sin(np.arange(frames)[:, None] / 4.0))
    turns = (Rotation.from_euler("y", rate * np.arange(frames)[:, None]) * sway).as_matrix().astype(np.float32)
    skeleton = clip().motion.skeleton
    rotations = np.tile(np.eye(3, dtype=np.float32), (frames, skeleton.joints, 1, 1))
    rotations[:, 0] = turns
    return Motion(rotations, np.zeros((frames, 3), np.float32), skeleton, 30.0), sway.as_matrix()


def test_turning_about_is_removed_and_sway_is_kept():
    motion, sway = spinning(200, 0.2)
    still, turned = without_turning(motion, FORWARD)
    assert turned == pytest.approx(np.degrees(0.2 * 199), rel=1e-3)
    np.testing.assert_allclose(still.rotations[:, 0], sway, atol=2e-2)
    steady, none = without_turning(spinning(200, 0.002)[0], FORWARD)
    assert none == 0.0
    np.testing.assert_array_equal(steady.rotations, spinning(200, 0.002)[0].rotations)


def test_requests_make_up_for_a_weak_response():
    training = np.random.default_rng(0).normal(size=(500, 3)) * 0.1 + 0.4
    response = np.array([[0.5, 0.1, 0.0], [0.0, 0.4, -0.1], [0.1, 0.0, 0.6]])

    median = np.median(training, axis=0)

    def draw(quantiles, gains=(1.0, 1.0, 1.0)):
        columns = zip(training.T, quantiles, strict=True)
        sent = median + np.array(gains) * (np.array([np.quantile(*column) for column in columns]) - median)
        return 0.4 + response @ (sent - 0.4)

    goal = 0.4 + np.array([0.05, -0.05, 0.05])
    at_once = np.abs(draw(as_quantiles(goal, training)) - goal).max()
    found = matching_requests(draw, goal, training)
    assert np.abs(draw(found) - goal).max() < 0.35 * at_once
    beyond = matching_requests(draw, np.full(3, 9.0), training)
    np.testing.assert_array_equal(beyond, 1.0)
    # Gains of the run make up for the response, too; the result is the same, and does not overshoot.
    gains = (2.0, 2.5, 2.5)
    again = matching_requests(lambda quantiles: draw(quantiles, gains), goal, training, gains)
    np.testing.assert_allclose(draw(again, gains), draw(found), atol=2e-3)


def test_a_motion_begins_in_the_clips_last_pose_with_its_velocity():
    own, made = clip().motion, clip(seed=2).motion
    rotations = np.asarray(made.rotations)
    begun = continued(rotations, own)
    joined = np.concatenate([own.rotations[-3:], begun[:3]])
    steps = [Rotation.from_matrix(b @ a.T).magnitude() for a, b in zip(joined[:-1, 18], joined[1:, 18], strict=True)]
    assert abs(steps[2] - steps[1]) < 0.3 * max(steps[1], 0.01) + 2e-3
    jump = Rotation.from_matrix(rotations[0, 18] @ own.rotations[-1, 18].T).magnitude()
    assert jump > 5 * steps[2]
    np.testing.assert_array_equal(begun[45:], rotations[45:])
    np.testing.assert_array_equal(continued(rotations, own.clip(0, 1)), rotations)


def test_angles_without_jumps_are_the_same_rotations():
    time = np.linspace(0.0, 4.0 * np.pi, 400)
    smooth = np.stack([time, 0.5 * np.sin(time), -time], axis=-1)[:, None]
    found = continuous_yxz(
        np.asarray(yxz_from_matrix(matrix_from_yxz(jnp.asarray(smooth, jnp.float32)))), np.zeros((1, 3))
    )
    np.testing.assert_allclose(found, smooth, atol=1e-3)


def test_verdicts_have_absolute_bounds():
    target = StyleTarget(HandStyle(0.30, 0.80, 0.40), HandStyle(0.10, 0.40, 0.35), 3.0)
    assert target.way(target.plain) == 0.0
    assert target.way(target.clip) == pytest.approx(1.0)
    assert target.verdict(HandStyle(0.26, 0.72, 0.44)) == "followed"
    assert target.verdict(HandStyle(0.22, 0.62, 0.37)) == "followed in part"
    assert target.verdict(HandStyle(0.10, 0.78, 0.38)) == "followed in part"
    assert target.verdict(HandStyle(0.60, 1.30, 0.40)) == "NOT FOLLOWED"
    assert target.verdict(HandStyle(0.12, 0.42, 0.30)) == "NOT FOLLOWED"
    # Where plain motion is near the clip already, near is followed, whatever the way.
    close = replace(target, plain=HandStyle(0.31, 0.82, 0.40))
    assert close.verdict(HandStyle(0.32, 0.85, 0.40)) == "followed"


def test_a_style_is_judged_by_what_controls_request_in_its_place():
    clip_hands = HandStyle(0.30, 0.80, 0.40)
    target = StyleTarget(clip_hands, HandStyle(0.10, 0.40, 0.35), 3.0)
    low = replace(target, requested=clip_hands._replace(height=-0.10))
    made = HandStyle(-0.09, 0.78, 0.40)
    assert target.verdict(made) != "followed"
    assert low.verdict(made) == "followed"
    assert low.verdict(clip_hands) != "followed"
    assert low.to_json()["requested"]["height"] == -0.10
    assert "requested" not in target.to_json()


def test_hands_that_controls_and_a_clip_request_together():
    own = FlowSpace.__new__(FlowSpace)
    means = np.stack([np.linspace(0.0, 1.0, 101), np.linspace(1.0, 3.0, 101)], axis=1)
    own._names = ("height", "speed")
    for lines, height, speed in (
        ((), 0.3, 0.8),
        (("height=0.9",), 0.9, 0.8),
        (("energy=0.5",), 0.3, 2.0),
        (("height=0.2@0,0.8@2",), 0.5, 0.8),
    ):
        settings = SimpleNamespace(controls=lines)
        config = SimpleNamespace(sampling_settings=settings, fps=30.0)
        own.run = SimpleNamespace(config=config, summary={"control_mean": means})
        found = own.requested_hands(HandStyle(0.3, 0.8, 0.4), 61)
        np.testing.assert_allclose(found, (height, speed, 0.4), atol=1e-6)
    own._names = ("left_height", "right_height")
    own.run.config.sampling_settings.controls = ("left_height=0.9",)
    assert own.requested_hands(HandStyle(0.3, 0.8, 0.4), 61).height == pytest.approx(0.9)


def test_clips_are_refused_by_name_with_the_figure():
    run, own = run_of(), clip().motion
    fitted = fit(own, run, "a clip")
    facing = run.config.space.mean_rotations(run.config.statistics["pose"].mean)[0]
    np.testing.assert_allclose(fitted.motion.rotations, face(own, facing.astype(np.float64))[0].rotations, atol=1e-5)
    with pytest.raises(InputError, match=r"a clip: its hands move at 0\.00 m/s on average"):
        fit(replace(own, rotations=np.repeat(own.rotations[:1], 90, axis=0)), run, "a clip")
    with pytest.raises(InputError, match=r"a clip: lasts 0\.50 s; give a clip of 1 s or more"):
        fit(own.clip(0, 15), run, "a clip")
    lying = np.array(own.rotations)
    lying[:, 0] = Rotation.from_euler("x", -90, degrees=True).as_matrix() @ lying[:, 0]
    with pytest.raises(InputError, match="a clip: tilts the trunk by 9"):
        fit(replace(own, rotations=lying), run, "a clip")
    fast = replace(own, rotations=own.rotations.repeat(2, axis=0), root=own.root.repeat(2, axis=0), fps=600.0)
    with pytest.raises(InputError, match="a clip: "):
        fit(fast, run, "a clip")


@pytest.mark.parametrize(("flag", "needs"), [("--style-gain", "--style-controls"), ("--style-guidance", "--style-ch")])
def test_settings_without_effect_are_refused(tmp_path, capsys, flag, needs):
    save_run(tmp_path / "run", run_of())
    assert not MODELS["6d"].style_controls
    command = ["generate", str(tmp_path / "run"), "--audio", "speech.wav", "--out", str(tmp_path / "out")]
    assert main([*command, "--style", "clip.bvh", flag, "1.5"]) == 2
    assert f"{flag}: has no effect on this run, which was trained without {needs}" in capsys.readouterr().err
    with pytest.raises(InputError, match="has no effect on this run"):
        run_of().config.with_sampling(**{flag[2:].replace("-", "_"): 1.5})
    assert main(["generate", "demo-flow", "--audio", "speech.wav", "--out", "out", flag, "1.5"]) == 2
    assert f"{flag} is for --style; name a clip." in capsys.readouterr().err


@pytest.mark.slow
def test_the_style_of_a_real_person_leaves_the_body_whole(shared):
    """The included flow with a take of ZeroEGGS: in 0.1, wrists at 22 m/s and elbows that flip."""
    from a2g_jax.generation.stylized_flow.latent_space import FlowSpace
    from a2g_jax.io.bvh import read_bvh
    from a2g_jax.metrics.hands import hand_speeds, local_places
    from a2g_jax.talker.recordings import talk
    from a2g_jax.training.run import open_run

    take = read_bvh(shared / "zeggs" / "067_Speech_2_x_1_0.bvh")
    space = FlowSpace(open_run("demo-flow"), window=512)
    style, fitted = space.fitted_style(fit(take.clip(900, 1500), space.run, "a take"), share=0.9)
    assert fitted.code > 3.0
    assert style.trust < 0.5
    for motion in space.generate(talk(8.0, 3).audio, 2, style=style):
        speeds = hand_speeds(local_places(motion), motion.skeleton, motion.fps)
        assert speeds.max() < 1.5 * 4.6
