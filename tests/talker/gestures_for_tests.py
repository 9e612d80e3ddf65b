"""Plans of speech with random accents, motions drawn for them, and their joints in space."""

import numpy as np

from a2g_jax.talker.gestures import gesticulate
from a2g_jax.talker.skeleton import TALKER_SKELETON
from a2g_jax.talker.speech import Phrase, PlannedWord, SpeechPlan, Syllable
from a2g_jax.talker.styles import EMOTION_STYLES, SPEAKER_STYLES

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
