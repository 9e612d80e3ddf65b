"""Joints that are bent or turned too far are eased back; all else stays."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from a2g_jax.generation.checked import Checked
from a2g_jax.generation.drafts import Draft, recorded
from a2g_jax.generation.ease import _compressed, ease
from a2g_jax.metrics.body.bounds import bounds_of, extremes
from a2g_jax.metrics.body.check import Stretch, check_motion
from a2g_jax.metrics.body.figures import Reference
from a2g_jax.talker.recordings import talk

MOTION = talk(20.0, 1).motion
NAMES = MOTION.skeleton.names
POSE = Rotation.from_matrix(np.asarray(MOTION.rotations, np.float64).mean(axis=0)).as_matrix()
REFERENCE = Reference(MOTION.skeleton, POSE, float(MOTION.root[:, 1].mean()))
BOUNDS = bounds_of(REFERENCE, extremes([MOTION], REFERENCE))


def swung(joint, axis, degrees, begin=200, frames=60):
    """The motion with a joint that turns about an axis of its parent and back, smoothly, in two seconds."""
    amount = np.zeros(MOTION.frames)
    amount[begin : begin + frames] = degrees * np.sin(np.pi * np.arange(frames) / frames) ** 2
    turn = Rotation.from_rotvec(np.radians(amount)[:, None] * np.asarray(axis, np.float64))
    rotations = np.array(MOTION.rotations)
    rotations[:, NAMES.index(joint)] = (turn * Rotation.from_matrix(rotations[:, NAMES.index(joint)])).as_matrix()
    return replace(MOTION, rotations=rotations)


@pytest.mark.parametrize(
    ("joint", "axis", "degrees", "figure"),
    [
        ("R_Elbow", -REFERENCE.axes[1], 120.0, "backwards"),
        ("L_Elbow", REFERENCE.axes[0], 70.0, "bend"),
        ("Head", (0.0, 1.0, 0.0), 100.0, "range"),
        ("L_Wrist", (0.0, 1.0, 0.0), 100.0, "range"),
    ],
)
def test_within_the_bounds(joint, axis, degrees, figure):
    bad = swung(joint, axis, degrees)
    findings = check_motion(bad, BOUNDS)
    assert (figure, joint) in {(one.figure, one.joint) for one in findings}
    eased = ease(bad, findings, BOUNDS)
    assert check_motion(eased, BOUNDS) == ()
    others = [number for number, name in enumerate(NAMES) if name != joint]
    np.testing.assert_array_equal(eased.rotations[:, others], bad.rotations[:, others])
    np.testing.assert_array_equal(eased.root, bad.root)
    # Frames before, which come no nearer to the bounds than recorded motion, hardly change.
    np.testing.assert_allclose(eased.rotations[:190], bad.rotations[:190], atol=1e-3)
    jerk = REFERENCE.figures(eased)["wrist_jerk"].max()
    assert jerk < 1.5 * REFERENCE.figures(bad)["wrist_jerk"].max()


def test_flips_become_turns():
    """Of a hand that flips away and back, and of one that stays there; none where its frames have to stay."""
    wrist = NAMES.index("R_Wrist")
    for first, stop in ((200, 204), (200, MOTION.frames)):
        rotations = np.array(MOTION.rotations)
        rotations[first:stop, wrist] = rotations[first:stop, wrist] @ Rotation.from_rotvec([1.9, 0.0, 0.0]).as_matrix()
        bad = replace(MOTION, rotations=rotations.astype(np.float32))
        findings = check_motion(bad, BOUNDS)
        assert "turn" in {one.figure for one in findings}
        eased = ease(bad, findings, BOUNDS)
        assert "turn" not in {one.figure for one in check_motion(eased, BOUNDS)}
        np.testing.assert_array_equal(eased.rotations[:150], bad.rotations[:150])
        kept = ease(bad, findings, BOUNDS, [Stretch(190, 215, BOUNDS)])
        np.testing.assert_array_equal(kept.rotations[190:215], bad.rotations[190:215])


def test_hands_that_are_too_fast_are_slowed():
    """Only around the finding, and no more than needed."""
    shoulder = NAMES.index("R_Shoulder")
    amount = np.zeros(MOTION.frames)
    amount[200:206] = 75.0 * np.sin(np.pi * np.arange(6) / 6) ** 2
    turn = Rotation.from_rotvec(np.radians(amount)[:, None] * np.array([0.0, 0.0, 1.0]))
    rotations = np.array(MOTION.rotations)
    rotations[:, shoulder] = (turn * Rotation.from_matrix(rotations[:, shoulder])).as_matrix()
    bad = replace(MOTION, rotations=rotations.astype(np.float32))
    findings = [one for one in check_motion(bad, BOUNDS) if one.figure.startswith("wrist")]
    assert {one.joint for one in findings} == {"R_Wrist"}
    eased = ease(bad, findings, BOUNDS)
    assert not [one for one in check_motion(eased, BOUNDS) if one.figure.startswith("wrist")]
    np.testing.assert_array_equal(eased.rotations[:170], bad.rotations[:170])
    np.testing.assert_array_equal(eased.rotations[240:], bad.rotations[240:])
    kept = ease(bad, findings, BOUNDS, [Stretch(0, MOTION.frames, BOUNDS)])
    np.testing.assert_array_equal(kept.rotations, bad.rotations)


def test_legs_and_stretches_stay():
    knee = swung("L_Knee", (1.0, 0.0, 0.0), -70.0)
    findings = check_motion(knee, BOUNDS)
    assert any(one.joint == "L_Knee" for one in findings)
    np.testing.assert_array_equal(ease(knee, findings, BOUNDS).rotations, knee.rotations)
    head = swung("Head", (0.0, 1.0, 0.0), 100.0)
    joint = NAMES.index("Head")
    turns = REFERENCE.figures(head)["turn"][:, joint]
    for first, stop in ((200, 260), (215, 245), (100, 222), (238, 300)):
        findings = check_motion(head, BOUNDS)
        eased = ease(head, findings, BOUNDS, [Stretch(first, stop, BOUNDS)])
        np.testing.assert_array_equal(eased.rotations[first:stop], head.rotations[first:stop])
        # No jump at its borders, where the head is turned too far.
        after = REFERENCE.figures(eased)["turn"][:, joint]
        assert after.max() < 2.0 * turns.max()
        assert np.abs(np.diff(after)).max() < 100.0


def test_frames_far_from_findings_stay():
    """Also those that are near the bounds."""
    bad = swung("Head", (0.0, 1.0, 0.0), 100.0)
    findings = [one for one in check_motion(bad, BOUNDS) if one.figure == "range"]
    eased = ease(bad, findings, BOUNDS)
    first, stop = min(one.first for one in findings), max(one.stop for one in findings)
    for rows in (slice(0, first - 24), slice(stop + 24, None)):
        np.testing.assert_array_equal(eased.rotations[rows], bad.rotations[rows])
    twice = replace(bad, rotations=np.concatenate([bad.rotations, bad.rotations]), root=np.concatenate([bad.root] * 2))
    eased = ease(twice, findings, BOUNDS)
    np.testing.assert_array_equal(eased.rotations[MOTION.frames :], bad.rotations)


def test_easing_that_does_harm_is_refused(toy_run_config, monkeypatch):
    """One frame of a fast turn is worse than the many that are turned a little too far; other joints are eased."""
    from a2g_jax.training.run import Run

    head, both = swung("Head", (0.0, 1.0, 0.0), 100.0), np.array(swung("R_Elbow", -REFERENCE.axes[1], 120.0).rotations)
    both[:, NAMES.index("Head")] = head.rotations[:, NAMES.index("Head")]
    bad = replace(head, rotations=both)

    def jumping(motion, findings, bounds, stretches):
        eased = ease(motion, findings, bounds)
        rotations = np.array(eased.rotations)
        rotations[229:231, NAMES.index("Head")] = motion.rotations[229:231, NAMES.index("Head")]
        return replace(eased, rotations=rotations)

    monkeypatch.setattr("a2g_jax.generation.checked.ease", jumping)

    class Same:
        varies = False

        def stream(self, audio, samples, seed=0):
            yield bad

    run = Run(toy_run_config(), {}, {}, 0)
    run.config.__dict__["body_bounds"] = BOUNDS
    checked = Checked(run, Same())
    (kept,) = checked.stream(np.zeros(16000, np.float32), 1)
    found, before = (check_motion(one, BOUNDS) for one in (kept, bad))
    turns = lambda findings: [one for one in findings if (one.figure, one.joint) == ("turn", "Head")]  # noqa: E731
    assert len(turns(found)) == len(turns(before)) == 0
    assert any(one.joint == "R_Elbow" for one in before)
    assert not any(one.joint == "R_Elbow" for one in found)
    assert {one.joint for one in found} == {"Head"}


@settings(max_examples=50, deadline=None)
@given(st.floats(20.0, 170.0), st.lists(st.floats(-180.0, 180.0), min_size=2, max_size=20))
def test_compression(bound, values):
    """No angle passes the bound, order is kept, no step grows, and angles well inside stay."""
    values = np.sort(np.asarray(values))
    small = _compressed(values, bound)
    assert np.all(small <= bound - 1.9)
    assert np.all(np.diff(small) >= 0.0)
    assert np.all(np.diff(small) <= np.diff(values) + 1e-9)
    np.testing.assert_array_equal(small[values < bound - 17.0], values[values < bound - 17.0])


def test_a_bad_sample_is_eased_before_it_is_drawn_again(toy_run_config):
    from a2g_jax.training.run import Run

    class Bent:
        draws = 0

        def __init__(self):
            self.recorded = []

        def stream(self, audio, samples, seed=0):
            return recorded(self.drafts(audio, samples, seed))

        def drafts(self, audio, samples, seed=0):
            self.draws += 1
            record = lambda number, motion: self.recorded.append((number, motion))  # noqa: E731
            yield Draft(swung("R_Elbow", -REFERENCE.axes[1], 120.0), record)

    run, sampler = Run(toy_run_config(), {}, {}, 0), Bent()
    run.config.__dict__["body_bounds"] = BOUNDS  # a cached property
    checked = Checked(run, sampler)
    (motion,) = checked.stream(np.zeros(16000, np.float32), 1)
    assert sampler.draws == 1
    assert check_motion(motion, BOUNDS) == ()
    (report,) = checked.reports
    assert (report.eased, report.draws, report.findings) == (True, 1, ())
    assert sampler.recorded == [(0, motion)]
    assert report.before[0].figure == "backwards"
    first, second = checked.lines()
    assert first == "checked: 1 of 1 within the bounds of the training split with margins (1 eased back)"
    assert second.startswith("sample 0: joints eased back; before: ")
    assert "R_Elbow is bent backwards by" in second
