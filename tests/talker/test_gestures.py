"""The generated corpus's gestures: what the audio determines, what is drawn, and how it is sampled."""

import math
from itertools import pairwise

import numpy as np
import pytest
from gestures_for_tests import SPEAKERS, WRISTS, draw, fk, make_plan

from a2g_jax.errors import InputError
from a2g_jax.talker.gesture_plan import (
    FAMILY_CHANGE,
    LEAD_RANGE,
    accented_syllables,
    draw_lead,
    family_probabilities,
    group_units,
    hand_probabilities,
)
from a2g_jax.talker.gestures import gesticulate
from a2g_jax.talker.plan import plan_speech
from a2g_jax.talker.speech import SpeechPlan
from a2g_jax.talker.styles import EMOTION_STYLES, FAMILIES, gesture_style


def test_strokes_fall_on_accents_and_keep_their_distance():
    for speaker in SPEAKERS:
        style = gesture_style(speaker, "neutral")
        plan, _, truth = draw(seed=3, seconds=30.0, speaker=speaker)
        taken = [stroke.syllable for stroke in truth.strokes]
        assert taken == accented_syllables(plan, style.threshold, style.spacing)
        assert taken
        peaks = np.array([plan.syllables[index].peak for index in taken])
        assert np.all(np.diff(peaks) >= style.spacing)
        assert style.spacing >= 0.35
        for stroke in truth.strokes:
            lead = plan.syllables[stroke.syllable].peak - stroke.apex
            assert LEAD_RANGE[0] <= lead <= LEAD_RANGE[1]
            assert plan.syllables[stroke.syllable].accent >= style.threshold
            assert stroke.size == plan.syllables[stroke.syllable].accent


def test_lead_distribution():
    rng = np.random.default_rng(1)
    leads = np.array([draw_lead(rng) for _ in range(4000)])
    assert leads.min() >= -0.03
    assert leads.max() <= 0.20
    # Truncation below moves the mean a little above 0.06 s and narrows the spread a little.
    assert leads.mean() == pytest.approx(0.061, abs=0.004)
    assert leads.std() == pytest.approx(0.038, abs=0.003)


def test_hands_vary_and_stroke_times_do_not():
    plan = make_plan(seconds=12.0)
    truths = [gesticulate(plan, np.random.default_rng(seed), 10.0)[1] for seed in range(25)]
    apexes = np.array([[stroke.apex for stroke in truth.strokes] for truth in truths])
    assert apexes.std(axis=0).max() < 0.07
    assert {truth.units[0].hand for truth in truths} == {"left", "right", "both"}
    assert len({truth.units[0].family for truth in truths}) >= 4
    assert len({truth.rest_pose for truth in truths}) >= 2
    assert len({tuple(stroke.syllable for stroke in truth.strokes) for truth in truths}) == 1


def test_units_split_at_long_pauses_and_stay_short():
    plan = make_plan(seconds=40.0, pause=1.2)
    syllables = accented_syllables(plan, 0.3, 0.4)
    units = group_units(plan, syllables)
    assert [position for unit in units for position in unit] == list(range(len(syllables)))
    assert max(map(len, units)) <= 5
    for unit in units:
        assert len({plan.words[plan.syllables[syllables[position]].word].phrase for position in unit}) == 1


def test_log_probability_sums_the_drawn_choices():
    _, _, truth = draw(seed=5, speaker="chiara")
    style = gesture_style("chiara", "neutral")
    total = math.log(dict(zip(("sides", "belly", "clasped"), style.rest_poses, strict=True))[truth.rest_pose])
    total += math.log({"even": 0.5, "left": 0.25, "right": 0.25}[truth.posture])
    for unit in truth.units:
        hands = dict(zip(("left", "right", "both"), hand_probabilities(style), strict=True))
        total += math.log(hands[unit.hand])
        total += math.log(dict(zip(FAMILIES, family_probabilities(style, unit.hand), strict=True))[unit.family])
        total += math.log(dict(zip(("center", "low", "high", "wide"), style.places, strict=True))[unit.place])
        total += math.log(style.hold if unit.holds else 1 - style.hold)
        own = dict(zip(FAMILIES, family_probabilities(style, unit.hand), strict=True))
        for index in unit.strokes[1:]:
            family = truth.strokes[index].family
            changed = FAMILY_CHANGE * own[family] / (1 - own[unit.family])
            total += math.log(1 - FAMILY_CHANGE if family == unit.family else changed)
    assert truth.log_probability == pytest.approx(total)
    assert truth.log_probability < 0


def test_families_change_within_units_as_often_as_said():
    changed = later = 0
    for seed in range(30):
        _, _, truth = draw(seed=seed, fps=2.0, seconds=40.0, speaker=SPEAKERS[seed % 6])
        for unit in truth.units:
            families = [truth.strokes[index].family for index in unit.strokes]
            assert families[0] == unit.family
            changed += sum(family != unit.family for family in families[1:])
            later += len(families) - 1
    assert later > 300
    assert abs(changed / later - FAMILY_CHANGE) < 3.5 * math.sqrt(FAMILY_CHANGE * (1 - FAMILY_CHANGE) / later)


def test_probabilities_sum_to_one_for_every_style():
    for speaker in SPEAKERS:
        for emotion in EMOTION_STYLES:
            style = gesture_style(speaker, emotion)
            assert sum(style.rest_poses) == pytest.approx(1.0)
            assert sum(style.places) == pytest.approx(1.0)
            assert sum(hand_probabilities(style)) == pytest.approx(1.0)
            for hand in ("left", "right", "both"):
                assert sum(family_probabilities(style, hand)) == pytest.approx(1.0)
            assert 0.0 < style.hold < 1.0


def test_unknown_names_are_input_errors():
    with pytest.raises(InputError, match="ada"):
        gesture_style("nobody", "neutral")
    with pytest.raises(InputError, match="sadness"):
        gesture_style("ada", "boredom")


def test_phases_cover_the_recording_without_overlap():
    for seed in range(24):
        plan, _, truth = draw(seed=seed, fps=5.0, seconds=30.0, speaker=SPEAKERS[seed % 6])
        for hand in ("left", "right"):
            spans = [span for span in truth.phases if span.hand == hand]
            assert spans[-1].end >= plan.seconds
            assert spans[0].start <= 0.0
            for before, after in pairwise(spans):
                assert after.start == pytest.approx(before.end, abs=1e-9)
        strokes = [span for span in truth.phases if span.phase == "stroke"]
        expected = sum(2 if stroke.hand == "both" else 1 for stroke in truth.strokes)
        assert len(strokes) == expected


@pytest.mark.parametrize("fps", [15.0, 20.0, 25.0, 29.97, 30.0, 60.0, 120.0])
def test_frame_count_is_exact(fps):
    plan = make_plan(seconds=5.03)
    motion, _ = gesticulate(plan, np.random.default_rng(0), fps)
    assert motion.frames == round(5.03 * fps)
    assert motion.fps == fps
    assert motion.rotations.dtype == np.float32
    assert motion.root.dtype == np.float32


def test_frame_rates_sample_the_same_motion():
    _, fast, truth = draw(seed=2, fps=120.0)
    for fps in (15.0, 20.0, 30.0, 60.0):
        _, slow, same = draw(seed=2, fps=fps)
        step = int(120 / fps)
        np.testing.assert_allclose(fast.rotations[::step][: slow.frames], slow.rotations, atol=2e-6)
        np.testing.assert_allclose(fast.root[::step][: slow.frames], slow.root, atol=2e-6)
        assert same == truth


def test_same_seed_same_motion():
    _, first, truth = draw(seed=4)
    _, second, same = draw(seed=4)
    np.testing.assert_array_equal(first.rotations, second.rotations)
    np.testing.assert_array_equal(first.root, second.root)
    assert truth == same
    _, other, _ = draw(seed=4, motion_seed=5)
    assert np.abs(np.asarray(other.rotations) - first.rotations).max() > 0.1


def test_plan_without_accents_keeps_the_hands_at_rest():
    plan = SpeechPlan(6.0, "elif", "neutral", (), (), ())
    motion, truth = gesticulate(plan, np.random.default_rng(0))
    assert truth.strokes == ()
    assert {span.phase for span in truth.phases} == {"rest"}
    speed = np.linalg.norm(np.diff(fk(motion)[1][:, WRISTS["left"]], axis=0), axis=1) * 30.0
    # Resting hands shift now and then.
    assert 0.0 < np.median(speed) < 0.12
    assert speed.max() < 0.5


def test_real_plans_give_strokes_near_their_accents():
    plan = plan_speech(20.0, "felix", "happiness", np.random.default_rng(0))
    motion, truth = gesticulate(plan, np.random.default_rng(0))
    assert motion.frames == 600
    assert len(truth.strokes) >= 10
    for stroke in truth.strokes:
        assert -0.2 <= stroke.apex - plan.syllables[stroke.syllable].peak <= 0.03
