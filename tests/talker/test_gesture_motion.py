"""Whether the generated corpus's motion is human, and follows accents and emotions."""

from itertools import pairwise

import numpy as np
from gestures_for_tests import JOINT, SPEAKERS, WRISTS, draw, everyone, fk, make_plan

from a2g_jax.talker.gesture_unit import ARRIVAL
from a2g_jax.talker.gestures import gesticulate
from a2g_jax.talker.reach import torso_distance
from a2g_jax.talker.speech import SpeechPlan, Syllable
from a2g_jax.talker.styles import EMOTION_STYLES


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
