"""The generated corpus's gestures: what the audio determines, what is drawn, and whether the motion is human."""

import math
from itertools import pairwise

import numpy as np
import pytest

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
from a2g_jax.talker.gesture_unit import ARRIVAL
from a2g_jax.talker.gestures import gesticulate
from a2g_jax.talker.ik import bend
from a2g_jax.talker.paths import Track, bump, draw_waves, minimum_jerk
from a2g_jax.talker.plan import plan_speech
from a2g_jax.talker.reach import torso_distance
from a2g_jax.talker.skeleton import PELVIS_HEIGHT, TALKER_SKELETON
from a2g_jax.talker.speech import Phrase, PlannedWord, SpeechPlan, Syllable
from a2g_jax.talker.styles import EMOTION_STYLES, FAMILIES, SPEAKER_STYLES, gesture_style

JOINT = {name: index for index, name in enumerate(TALKER_SKELETON.names)}
WRISTS = {"left": JOINT["L_Wrist"], "right": JOINT["R_Wrist"]}
SPEAKERS = tuple(SPEAKER_STYLES)


def make_plan(seconds=16.0, speaker="ada", emotion="neutral", seed=0, pause=None):
    """A small random plan: phrases of 1.5 to 3 s, an accent about every 0.8 s."""
    rng = np.random.default_rng(seed)
    now, phrases, words, syllables = 0.4, [], [], []
    while now < seconds - 2.5:
        start, accent_at = now, now + rng.uniform(0.2, 0.6)
        end = start + rng.uniform(1.5, 3.0)
        while now < min(end, seconds - 0.8):
            length = rng.uniform(0.14, 0.26)
            accent = 0.0
            if now >= accent_at:
                accent = float(rng.uniform(0.3, 1.0))
                accent_at = now + rng.uniform(0.45, 1.3)
            syllables.append(
                Syllable(now, now + 0.45 * length, now + length, ("a",), int(accent > 0), accent, len(words))
            )
            words.append(PlannedWord("ba", now, now + length, len(phrases)))
            now += length
        phrases.append(Phrase(start, now))
        now += pause if pause is not None else rng.choice([0.3, 0.5, 1.1])
    return SpeechPlan(seconds, speaker, emotion, tuple(phrases), tuple(words), tuple(syllables))


def draw(seed=0, fps=30.0, motion_seed=None, **kwargs):
    plan = make_plan(seed=seed, **kwargs)
    motion, truth = gesticulate(plan, np.random.default_rng(seed if motion_seed is None else motion_seed), fps)
    return plan, motion, truth


def fk(motion):
    """World rotations and positions in float64."""
    local = np.asarray(motion.rotations, np.float64)
    offsets = np.asarray(motion.skeleton.offsets, np.float64)
    world = np.empty_like(local)
    places = np.empty(local.shape[:3])
    world[:, 0], places[:, 0] = local[:, 0], motion.root
    for joint, parent in enumerate(motion.skeleton.parents[1:], start=1):
        world[:, joint] = world[:, parent] @ local[:, joint]
        places[:, joint] = places[:, parent] + world[:, parent] @ offsets[joint]
    return world, places


def everyone(seconds=16.0):
    """One draw for each speaker, each in another emotion."""
    emotions = tuple(EMOTION_STYLES)
    for number, speaker in enumerate(SPEAKERS):
        yield draw(seed=number, seconds=seconds, speaker=speaker, emotion=emotions[number])


# --- skeleton ---------------------------------------------------------------------------------------------------


def test_skeleton_is_an_adult_of_one_metre_seventy():
    skeleton = TALKER_SKELETON
    places = np.zeros((22, 3))
    places[0, 1] = PELVIS_HEIGHT
    for joint, parent in enumerate(skeleton.parents[1:], start=1):
        places[joint] = places[parent] + skeleton.offsets[joint]
    ends = {joint: places[joint] + end for joint, end in skeleton.ends}
    assert np.linalg.norm(places[WRISTS["left"]] - places[WRISTS["right"]]) == pytest.approx(1.364, abs=1e-4)
    assert ends[JOINT["Head"]][1] == pytest.approx(1.70, abs=1e-6)
    assert ends[JOINT["L_Foot"]][1] == pytest.approx(0.0, abs=1e-6)
    mirrored = places[WRISTS["right"]] * [-1, 1, 1]
    np.testing.assert_allclose(places[WRISTS["left"]], mirrored, atol=1e-7)


# --- paths and inverse kinematics -------------------------------------------------------------------------------


def test_steps_and_bumps_are_twice_continuous():
    x = np.linspace(-0.2, 1.2, 14001)
    for curve in (minimum_jerk(x), bump(x)):
        second = np.gradient(np.gradient(curve, x), x)
        assert np.abs(np.diff(second)).max() < 0.1
    assert minimum_jerk(np.array([0.0, 0.5, 1.0])) == pytest.approx([0.0, 0.5, 1.0])
    assert bump(np.array([0.0, 0.5, 1.0])) == pytest.approx([0.0, 1.0, 0.0])


def test_track_superposes_overlapping_steps():
    track = Track(np.zeros(1))
    track.step_to(np.ones(1), 0.0, 1.0)
    track.step_to(np.full(1, 3.0), 0.5, 1.5)
    track.add_pulse(np.full(1, 0.4), 2.0, 2.5, 3.0)
    times = np.array([-1.0, 0.4, 0.8, 1.7, 2.5, 4.0])
    expected = minimum_jerk(times) + 2.0 * minimum_jerk(times - 0.5)
    expected[4] += 0.4
    np.testing.assert_allclose(track.sample(times)[:, 0], expected, atol=1e-12)


def test_waves_have_the_size_asked_for():
    waves = draw_waves(np.random.default_rng(0), np.array([1.0, 0.2]), 0.1, 1.0)
    np.testing.assert_allclose(waves.sample(np.arange(0.0, 4000.0, 0.1)).std(axis=0), [1.0, 0.2], rtol=0.02)


def test_bend_reaches_its_end():
    rng = np.random.default_rng(0)
    start, direction = rng.normal(size=(200, 3)), rng.normal(size=(200, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    end = start + rng.uniform(0.2, 0.44, (200, 1)) * direction
    upper, inner, flexion = bend(start, end, rng.normal(size=(200, 3)), (0.25, 0.21), limit=False)
    lower = np.cos(flexion)[:, None] * upper + np.sin(flexion)[:, None] * inner
    np.testing.assert_allclose(start + 0.25 * upper + 0.21 * lower, end, atol=1e-9)


# --- what the audio decides, what is drawn ----------------------------------------------------------------------


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


# --- sampling ---------------------------------------------------------------------------------------------------


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


# --- the motion ---------------------------------------------------------------------------------------------------


def test_rotations_are_rotations():
    for _, motion, _ in everyone():
        rotations = np.asarray(motion.rotations, np.float64)
        np.testing.assert_allclose(
            rotations @ np.swapaxes(rotations, -1, -2), np.broadcast_to(np.eye(3), rotations.shape), atol=2e-6
        )
        np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=2e-6)


def test_feet_stay_planted():
    for _, motion, _ in everyone():
        world, places = fk(motion)
        for letter in "LR":
            for name in ("Ankle", "Foot"):
                assert np.ptp(places[:, JOINT[f"{letter}_{name}"]], axis=0).max() < 1e-3
            foot = JOINT[f"{letter}_Foot"]
            toe = dict(motion.skeleton.ends)[foot]
            assert np.abs((places[:, foot] + world[:, foot] @ np.array(toe))[:, 1]).max() < 1e-3


def test_wrists_stay_outside_the_torso_and_apart():
    for seed in range(24):
        emotion = tuple(EMOTION_STYLES)[seed % 8]
        _, motion, _ = draw(seed=seed, seconds=12.0, speaker=SPEAKERS[seed % 6], emotion=emotion)
        world, places = fk(motion)
        chest = world[:, JOINT["Spine3"]]
        yaw = np.arctan2(chest[:, 0, 2], chest[:, 2, 2])
        c, s, zero, one = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw), np.ones_like(yaw)
        facing = np.stack([c, zero, s, zero, one, zero, -s, zero, c], axis=1).reshape(-1, 3, 3)
        for wrist in WRISTS.values():
            scaled, _ = torso_distance(places[:, wrist], places[:, 0], places[:, JOINT["Neck"]], facing)
            assert np.linalg.norm(scaled, axis=1).min() > 0.97
        apart = np.einsum("ti,ti->t", places[:, WRISTS["left"]] - places[:, WRISTS["right"]], facing[:, :, 0])
        assert apart.min() > 0.06


def test_elbows_and_knees_bend_only_forward_within_limits():
    for _, motion, _ in everyone():
        world, _ = fk(motion)
        for letter, side in (("L", 1.0), ("R", -1.0)):
            upper, lower = world[:, JOINT[f"{letter}_Shoulder"]], world[:, JOINT[f"{letter}_Elbow"]]
            flexion = np.arccos(np.clip(np.einsum("ti,ti->t", upper[:, :, 0], lower[:, :, 0]), -1, 1))
            assert np.rad2deg(flexion).min() > 8.0
            assert np.rad2deg(flexion).max() < 140.0
            # The forearm bends to the upper arm's +z, never backward.
            assert (side * np.einsum("ti,ti->t", upper[:, :, 2], lower[:, :, 0])).min() > 0.0
            knee = np.asarray(motion.rotations)[:, JOINT[f"{letter}_Knee"]]
            bent = np.rad2deg(np.arctan2(knee[:, 2, 1], knee[:, 1, 1]))
            assert bent.min() > 2.0
            assert bent.max() < 35.0


def test_joints_never_pop():
    for _, motion, _ in everyone():
        local = np.asarray(motion.rotations, np.float64)
        change = np.swapaxes(local[:-1], -1, -2) @ local[1:]
        angle = np.arccos(np.clip((np.trace(change, axis1=-2, axis2=-1) - 1) / 2, -1, 1)) * motion.fps
        assert np.rad2deg(angle).max() < 1200.0
        assert np.rad2deg(angle[:, : JOINT["L_Collar"]]).max() < 120.0


def test_jerk_is_bounded():
    for _, motion, _ in everyone():
        assert motion.fps == 30.0
    for seed in range(3):
        _, motion, _ = draw(seed=seed, fps=120.0, speaker="felix", emotion="anger")
        _, places = fk(motion)
        # 1e-7 m of float32 rounding is 0.2 m/s^3 at 120 fps: far below the limit.
        jerk = np.linalg.norm(np.diff(places, n=3, axis=0), axis=2) * 120.0**3
        # Fast hands that pass each other move apart quickly; strokes alone stay below 6000.
        assert jerk.max() < 20000.0


def test_active_wrist_speed_peaks_shortly_before_the_apex():
    hits = strokes = 0
    for speaker in SPEAKERS:
        _, motion, truth = draw(seed=7, seconds=24.0, fps=120.0, speaker=speaker)
        _, places = fk(motion)
        for stroke in truth.strokes:
            dominant = "left" if speaker == "felix" else "right"
            hand = dominant if stroke.hand == "both" else stroke.hand
            speed = np.linalg.norm(np.diff(places[:, WRISTS[hand]], axis=0), axis=1) * 120.0
            near = np.arange(int((stroke.apex - 0.30) * 120), int((stroke.apex + 0.10) * 120))
            near = near[(near >= 1) & (near < len(speed) - 1)]
            peaks = near[(speed[near] > speed[near - 1]) & (speed[near] >= speed[near + 1])]
            last = [peak / 120.0 for peak in peaks if speed[peak] > 0.25]
            strokes += 1
            hits += any(stroke.apex - 0.16 <= time <= stroke.apex + 0.005 for time in last)
    assert strokes > 60
    assert hits / strokes > 0.95
    assert 0.5 < ARRIVAL < 1.0


def test_hands_rest_in_long_pauses():
    plan = make_plan(seconds=30.0, pause=3.0)
    motion, truth = gesticulate(plan, np.random.default_rng(3))
    _, places = fk(motion)
    quiet = 0
    for phrase, following in pairwise(plan.phrases):
        middle = phrase.end + 0.6 * (following.start - phrase.end)
        for hand, wrist in WRISTS.items():
            phases = [s.phase for s in truth.phases if s.hand == hand and s.start <= middle < s.end]
            assert phases == ["rest"]
            frame = round(middle * 30)
            speed = np.linalg.norm(np.diff(places[frame - 4 : frame + 5, wrist], axis=0), axis=1).max() * 30.0
            assert speed < 0.5
            quiet += 1
    assert quiet >= 8


def test_size_follows_the_accent():
    lengths = {}
    for accent in (0.6, 1.0):
        plan = make_plan(seconds=20.0, speaker="ada")
        syllables = tuple(
            Syllable(s.onset, s.peak, s.end, s.phones, s.stress, accent if s.accent > 0 else 0.0, s.word)
            for s in plan.syllables
        )
        plan = SpeechPlan(plan.seconds, "ada", "neutral", plan.phrases, plan.words, syllables)
        total = []
        for seed in range(6):
            motion, _ = gesticulate(plan, np.random.default_rng(seed))
            _, places = fk(motion)
            speed = np.linalg.norm(np.diff(places[:, list(WRISTS.values())], axis=0), axis=2) * 30.0
            total.append(np.percentile(speed.max(axis=1), 95))
        lengths[accent] = np.mean(total)
    assert lengths[1.0] > 1.15 * lengths[0.6]


def test_emotions_change_extent_and_posture():
    speeds, heads = {}, {}
    for emotion in ("anger", "neutral", "sadness"):
        values, pitch = [], []
        for seed in range(4):
            _, motion, _ = draw(seed=seed, speaker="ada", emotion=emotion)
            world, places = fk(motion)
            speed = np.linalg.norm(np.diff(places[:, list(WRISTS.values())], axis=0), axis=2) * 30.0
            values.append(np.percentile(speed.max(axis=1), 90))
            forward = world[:, JOINT["Head"], :, 2]
            pitch.append(np.rad2deg(np.arcsin(-forward[:, 1])).mean())
        speeds[emotion], heads[emotion] = np.mean(values), np.mean(pitch)
    assert speeds["anger"] > 1.15 * speeds["neutral"] > 1.3 * speeds["sadness"]
    assert heads["sadness"] > heads["neutral"] + 6.0


def test_real_plans_give_strokes_near_their_accents():
    plan = plan_speech(20.0, "felix", "happiness", np.random.default_rng(0))
    motion, truth = gesticulate(plan, np.random.default_rng(0))
    assert motion.frames == 600
    assert len(truth.strokes) >= 10
    for stroke in truth.strokes:
        assert -0.2 <= stroke.apex - plan.syllables[stroke.syllable].peak <= 0.03
