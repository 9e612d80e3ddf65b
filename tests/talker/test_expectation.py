"""Expectations over true motions: sampled ones against known truth, exact ones against sampling."""

import math
from collections import Counter
from dataclasses import replace
from itertools import combinations

import jax
import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.talker.expectation import bounds, draw_key, expect, expected_multimodality, pair_mean, sample_mean
from a2g_jax.talker.gesture_plan import draw_gestures
from a2g_jax.talker.hidden_choices import entropy, hidden_choices, hidden_entropy, speech_plan
from a2g_jax.talker.recordings import resample_motion, talk
from a2g_jax.talker.styles import gesture_style


def wrist_height(motion, recording):
    return float(motion.root[:, 1].mean())


def rotation_distance(first, second):
    return float(np.abs(first.rotations - second.rotations).mean())


@pytest.fixture(scope="module")
def take():
    return talk(12.0, 3, speaker="chiara", fps=15.0)


@pytest.fixture(scope="module")
def drawn():
    """A plan with many draws of its discrete choices."""
    recording = talk(25.0, 5, speaker="ada", emotion="anger", fps=5.0)
    plan = speech_plan(recording)
    style = gesture_style("ada", "anger")
    rng = np.random.default_rng(0)
    return recording, style, [draw_gestures(plan, style, rng) for _ in range(2000)]


def test_mean_and_its_error():
    estimate = sample_mean(np.array([1.0, 2.0, 3.0, 6.0]))
    assert estimate.mean == 3.0
    assert estimate.standard_error == pytest.approx(math.sqrt((4 + 1 + 0 + 9) / 3 / 4))
    assert estimate.draws == 4
    with pytest.raises(ValueError, match="two draws"):
        sample_mean(np.array([1.0]))


@pytest.mark.parametrize("count", [6, 20])
def test_pair_mean_is_unbiased_and_its_error_is_right(count):
    # |x - y| of two standard normals has mean 2 / sqrt(pi).
    rng = np.random.default_rng(1)
    estimates = []
    for _ in range(3000):
        x = rng.standard_normal(count)
        estimates.append(pair_mean(np.abs(x[:, None] - x)))
    means = np.array([estimate.mean for estimate in estimates])
    actual = means.std(ddof=1)
    assert means.mean() == pytest.approx(2 / math.sqrt(math.pi), abs=4 * actual / math.sqrt(len(means)))
    stated = math.sqrt(np.mean([estimate.standard_error**2 for estimate in estimates]))
    # As if the pairs were independent it would be too small by a factor of about sqrt(count / 4) or so.
    assert 0.97 * actual < stated < (1.0 + 0.6 / count + 0.04) * actual
    with pytest.raises(ValueError, match="three draws"):
        pair_mean(np.zeros((2, 2)))


def test_expect_is_the_mean_over_resamples(take):
    estimate = expect(take, wrist_height, 6, key=4)
    values = [wrist_height(resample_motion(take, draw_key(4, index))[0], take) for index in range(6)]
    assert estimate.mean == pytest.approx(np.mean(values), abs=1e-12)
    assert len(set(values)) == 6
    assert expect(take, wrist_height, 6, key=4) == estimate
    assert expect(take, wrist_height, 6, key=5) != estimate


def test_keys_are_ints_or_jax_keys():
    keys = [draw_key(key, index) for key in (0, 1, jax.random.key(0), jax.random.key(1)) for index in range(3)]
    assert len(set(keys)) == len(keys)
    assert draw_key(jax.random.key(1), 2) == draw_key(jax.random.key(1), 2)
    assert draw_key(np.int64(1), 2) == draw_key(1, 2)


def test_multimodality_is_over_all_pairs(take):
    estimate = expected_multimodality(take, rotation_distance, 4, key=1)
    motions = [resample_motion(take, draw_key(1, index))[0] for index in range(4)]
    distances = [rotation_distance(a, b) for a, b in combinations(motions, 2)]
    assert estimate.mean == pytest.approx(np.mean(distances), rel=1e-6)
    assert 0 < estimate.standard_error < estimate.mean


def test_bounds_tell_right_from_unrelated(take):
    other = talk(14.0, 4, speaker="chiara", fps=15.0)

    def follows(motion, recording):
        """Does the head nod where this recording's accents are? Nods are determined by the plan."""
        pitch = np.gradient(motion.rotations[:, [12, 15], 2, 1].sum(axis=1))
        times = [s["peak"] for s in recording.annotations["speech"]["syllables"] if s["accent"] > 0.5]
        frames = np.rint(np.array(times) * motion.fps).astype(int) - 1
        return float(pitch[frames].mean() - pitch.mean())

    result = bounds(take, other, follows, 24, key=0)
    assert result.ceiling.draws == result.floor.draws == 24
    gap = result.ceiling.mean - result.floor.mean
    assert gap > 4 * math.hypot(result.ceiling.standard_error, result.floor.standard_error)


def test_bounds_refuse_what_does_not_fit(take):
    longer = talk(14.0, 4, speaker="chiara", fps=15.0, name="longer")
    with pytest.raises(InputError, match="says the same as"):
        bounds(take, take, wrist_height, 2, key=0)
    with pytest.raises(InputError, match="another speaker"):
        bounds(take, talk(14.0, 4, speaker="ada", fps=15.0), wrist_height, 2, key=0)
    with pytest.raises(InputError, match="another frame rate"):
        bounds(take, talk(14.0, 4, speaker="chiara", fps=30.0), wrist_height, 2, key=0)
    with pytest.raises(InputError, match="longer: has other joints"):
        bounds(talk(12.0, 3, speaker="chiara", fps=15.0, fingers=True), longer, wrist_height, 2, key=0)
    with pytest.raises(InputError, match="is shorter than longer"):
        bounds(longer, take, wrist_height, 2, key=0)
    with pytest.raises(InputError, match="not a generated recording"):
        bounds(replace(take, annotations={}), take, wrist_height, 2, key=0)


def test_entropy_of_known_distributions():
    assert entropy(np.array([0.25] * 4)) == pytest.approx(math.log(4))
    assert entropy(np.array([1.0, 0.0])) == 0.0


def test_entropy_is_minus_the_expected_log_probability(drawn):
    recording, style, draws = drawn
    surprise = sample_mean(np.array([-draw.log_probability(style) for draw in draws]))
    assert hidden_entropy(recording) == pytest.approx(surprise.mean, abs=4 * surprise.standard_error)
    assert surprise.standard_error < 0.01 * surprise.mean


def test_agreement_is_what_pairs_of_draws_show(drawn):
    recording, _, draws = drawn
    first, second = draws[::2], draws[1::2]
    agreements = {
        "rest_pose": [[a.rest_pose == b.rest_pose] for a, b in zip(first, second, strict=True)],
        "posture": [[a.posture == b.posture] for a, b in zip(first, second, strict=True)],
        "stroke_family": [
            [s.family == t.family for unit in a.units for s, t in _strokes(a, b, unit.strokes[1:])]
            for a, b in zip(first, second, strict=True)
        ],
    }
    for name, field in (("hand", "hand"), ("place", "place"), ("hold", "holds"), ("family", "family")):
        agreements[name] = [
            [getattr(u, field) == getattr(v, field) for u, v in zip(a.units, b.units, strict=True)]
            for a, b in zip(first, second, strict=True)
        ]
    choices = hidden_choices(recording)
    assert set(choices) == set(agreements)
    for name, alike in agreements.items():
        assert len(alike[0]) == choices[name].times, name
        estimate = sample_mean(np.mean(alike, axis=1))
        assert estimate.mean == pytest.approx(choices[name].agreement, abs=4 * estimate.standard_error), name


def _strokes(first, second, indices):
    return [(first.strokes[index], second.strokes[index]) for index in indices]


def test_full_agreement_in_a_short_recording():
    recording = next(
        take
        for take in (talk(5.0, seed, speaker="felix", fps=5.0) for seed in range(40))
        if hidden_choices(take)["hand"].times == 2 and hidden_choices(take)["stroke_family"].times >= 2
    )
    choices, plan = hidden_choices(recording), speech_plan(recording)
    rng = np.random.default_rng(2)
    draws = [draw_gestures(plan, gesture_style("felix", "neutral"), rng) for _ in range(4000)]
    count = len(draws)
    for name, of in (
        ("hand", lambda draw: tuple(unit.hand for unit in draw.units)),
        ("family", lambda draw: tuple(unit.family for unit in draw.units)),
        ("stroke_family", lambda draw: tuple(stroke.family for stroke in draw.strokes)),
    ):
        # The share of alike pairs among all pairs of draws, and its variance's leading term.
        times = np.array(list(Counter(of(draw) for draw in draws).values()))
        share = np.sum(times * (times - 1)) / (count * (count - 1))
        error = 2.0 * np.sqrt((np.sum((times / count) ** 3) - share**2) / count)
        assert error < 0.06 * share
        assert choices[name].full_agreement == pytest.approx(share, abs=4 * error), name
    assert choices["hand"].full_agreement == pytest.approx(choices["hand"].agreement ** 2)


def test_only_generated_recordings_are_known(take):
    foreign = replace(take, annotations={}, name="beat_take")
    for function in (hidden_choices, hidden_entropy, lambda r: expect(r, wrist_height, 2, 0)):
        with pytest.raises(InputError, match="beat_take: is not a generated recording"):
            function(foreign)


@pytest.mark.slow
def test_workers_change_nothing(take):
    assert expect(take, wrist_height, 5, key=4, workers=2) == expect(take, wrist_height, 5, key=4)
