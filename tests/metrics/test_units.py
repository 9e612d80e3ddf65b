"""A paper's units: its own figures come out where they depend on nothing but the metric."""

from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.evaluation.baselines import with_noise
from a2g_jax.evaluation.scores import Scorer, Target
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.pose_track import represent
from a2g_jax.geometry.skeleton import BODY_JOINTS
from a2g_jax.metrics.catalogue import METRICS
from a2g_jax.metrics.units import OURS, UNITS, find_units, smplx_weights
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.skeleton import TALKER_HANDS_SKELETON, TALKER_SKELETON

PAPER = UNITS["audio2gestures"]


@pytest.fixture(scope="module")
def truth():
    """Poses of a generated recording and their space."""
    pose, body = represent(talk(20.0, 0).motion, "6d", "truth")
    return pose, PoseSpace(body)


def scored(truth, made, units):
    """Scores of a motion, with the units' weights."""
    pose, space = truth
    scorer = Scorer(space, 30.0, None, units=units)
    return scorer.sample(made, Target(pose, space.positions(pose), np.arange(1.0, 19.0)))


@pytest.mark.parametrize(
    ("degrees", "published"),
    [
        # The paper's position L1 of 1 degree, 1.16, is more than a fifth of that of 5 degrees, 4.44: it is left out.
        (1.0, {"speed_l1": 1.2352, "acceleration_l1": 2.1369}),
        (5.0, {"position_l1": 4.4406, "speed_l1": 6.0598, "acceleration_l1": 10.503}),
    ],
)
def test_noise_scores_what_table_4_prints(truth, degrees, published):
    """Rows of Table 4 that depend on no model: noise on every joint of the truth, 30 frames a second."""
    noisy = with_noise(truth[1], truth[0], degrees, np.random.default_rng(0))
    found = scored(truth, noisy, PAPER)
    for name, value in published.items():
        assert found[name] == pytest.approx(value, rel=0.05), name
    ours = scored(truth, noisy, OURS)
    # In our units the sum over coordinates is more than twice as large, a body of 136.4 cm included.
    assert ours["position_l1"] > 2.0 * found["position_l1"]


def test_weights_are_those_of_the_55_joints_of_smplx():
    weights = smplx_weights(TALKER_SKELETON)
    assert weights.sum() == pytest.approx(1.0)
    counts = dict(zip(BODY_JOINTS, 55 * weights, strict=True))
    assert counts.pop("Head") == pytest.approx(4)
    assert [counts.pop(f"{side}_Wrist") for side in "LR"] == pytest.approx([16, 16])
    assert list(counts.values()) == pytest.approx([1.0] * 19)
    with_fingers = smplx_weights(TALKER_HANDS_SKELETON)
    assert with_fingers.sum() == pytest.approx(1.0)
    assert np.count_nonzero(with_fingers) == 22
    assert smplx_weights(replace(TALKER_SKELETON, names=tuple(f"joint{n}" for n in range(22)))) is None
    assert OURS.weights(TALKER_SKELETON) is None


def test_units_are_averages_of_the_same_distances(truth):
    """Against loops over coordinates and joints that are repeated as often as their weights say."""
    pose, space = truth
    other = np.roll(pose, 200, axis=0)
    found = scored(truth, other, PAPER)
    often = np.repeat(np.arange(22), [4 if n == "Head" else 16 if n.endswith("Wrist") else 1 for n in BODY_JOINTS])
    size = 1.2064 / 1.364
    ours, theirs = (100 * size * space.positions(each)[:, often] for each in (other, pose))
    for order, name in enumerate(("position_l1", "speed_l1", "acceleration_l1")):
        expected = np.abs(np.diff(ours - theirs, n=order, axis=0) if order else ours - theirs).mean()
        assert found[name] == pytest.approx(expected, rel=1e-4), name
    assert found["position_l1_star"] == pytest.approx(found["position_l1"], rel=1e-5)
    near = (np.linalg.norm(ours - theirs, axis=-1) < 20.0).mean()
    assert found["pck"] == pytest.approx(near, abs=1e-5)
    clips = ours[:600].reshape(12, 50, 55, 3)
    total = sum(np.abs(clips[a] - clips[b]).mean() for a in range(12) for b in range(a))
    assert found["diversity"] == pytest.approx(total / (12 * 6), rel=1e-4)
    flow = scored(truth, other, UNITS["stylized-flow"])
    plain = scored(truth, other, OURS)
    assert flow["diversity"] == pytest.approx(plain["diversity"] / 3, rel=1e-5)
    assert plain["position_l1_star"] == pytest.approx(size * plain["position_l1"], rel=1e-5)


def test_a_column_says_its_unit():
    assert (PAPER.shown(METRICS["speed_l1"]).unit, OURS.shown(METRICS["speed_l1"]).unit) == ("cm/frame", "cm/s")
    assert PAPER.shown(METRICS["fgd"]) == METRICS["fgd"]
    assert all(units.describe for key, units in UNITS.items() if key != "ours")
    with pytest.raises(InputError, match="--units: there are no 'metric'; there are: ours, audio2gestures"):
        find_units("metric")
