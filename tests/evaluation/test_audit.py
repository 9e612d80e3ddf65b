"""The audit flags planted models that do not listen, or listen to loudness alone, and passes the true generator."""

import dataclasses

import jax
import numpy as np
import pytest
from scipy import ndimage

from a2g_jax.evaluation.audit import conditions, listening_audit
from a2g_jax.features.mel import MelConfig, log_mel
from a2g_jax.talker.recordings import resample_motion, talk

FPS, SECONDS = 30.0, 20.0
SPEAKERS = ["ada", "bruno", "chiara", "felix"]


@pytest.fixture(scope="module")
def takes():
    """Four speakers' recordings."""
    return [talk(SECONDS, 30 + n, speaker=name, fps=FPS) for n, name in enumerate(SPEAKERS)]


@pytest.fixture(scope="module")
def clips(takes):
    """Their log-mel rows."""
    return [log_mel(take.audio, MelConfig(), FPS, take.motion.frames) for take in takes]


def wrists(motion):
    """Both wrists, the root at the origin."""
    places = motion.positions() - np.asarray(motion.root)[:, None]
    return places[:, [motion.skeleton.index("L_Wrist"), motion.skeleton.index("R_Wrist")]]


@pytest.fixture(scope="module")
def true_generator(takes):
    """Right motions for whatever speech can be understood; rest where there is none."""
    known = {}

    def listen(audio, seed):
        if audio.condition in ("silence", "loudness alone"):
            return np.zeros((takes[0].motion.frames, 2, 3), np.float32) + 0.01 * seed
        if (audio.clip, seed) not in known:
            motion, _ = resample_motion(takes[audio.clip], jax.random.key(seed))
            known[audio.clip, seed] = wrists(dataclasses.replace(motion))
        return np.roll(known[audio.clip, seed], round(audio.shift * FPS), axis=0)

    return listen


def deaf(audio, seed):
    """Lively motion that is a function of the seed alone."""
    noise = np.random.default_rng(seed).normal(size=(len(audio.features), 2, 3))
    return 0.3 * ndimage.gaussian_filter1d(noise, 5.0, axis=0)


def amplitude(audio, seed):
    """Hands that rise and fall with the level, with a tremor of their own."""
    level = ndimage.gaussian_filter1d(audio.features.mean(axis=1), 2.0)
    places = 0.3 * deaf(audio, seed)
    places[:, :, 1] += 0.01 * level[:, None]
    return places


def test_the_true_generator_listens(true_generator, clips):
    result = listening_audit(true_generator, clips, SPEAKERS, FPS)
    assert result["verdicts"] == ["listens"]
    table = result["conditions"]
    assert table["true audio"]["change_cm"] == 0.0 < table["1 s late"]["change_cm"]
    assert table["true audio"]["agreement"] == table["even loudness"]["agreement"]
    assert table["true audio"]["agreement"] > table["5 s late"]["agreement"] + 0.1


def test_a_deaf_model_is_flagged(clips):
    result = listening_audit(deaf, clips, SPEAKERS, FPS)
    assert result["verdicts"] == ["deaf: no audio changes its motion"]
    assert result["sampling_cm"] > 1.0


def test_an_amplitude_follower_is_flagged(clips):
    result = listening_audit(amplitude, clips, SPEAKERS, FPS)
    assert any("follows loudness alone" in verdict for verdict in result["verdicts"])


def test_clips_of_one_recording_count_together(true_generator, clips):
    """Twice the same clips are no more evidence than once, and a single recording has no interval."""
    twice, names = [*clips, *clips], [*SPEAKERS, *SPEAKERS]

    def again(audio, seed):
        return true_generator(audio._replace(clip=audio.clip % 4), seed)

    def interval(recordings):
        found = listening_audit(again, twice, names, FPS, samples=1, recordings=recordings)
        assert found["recordings"] == len(set(recordings or range(8)))
        return found["conditions"]["true audio"]["agreement_interval"]

    low, high = interval(None)
    # As many clips in each of six recordings as in each of eight, but for two; fewer of them say less.
    fewer = interval([0, 1, 2, 3, 0, 1, 4, 5])
    assert fewer[1] - fewer[0] > high - low
    assert interval([0, 1, 2, 3, 0, 1, 2, 3]) is None


def test_a_motion_for_somebody_elses_audio_is_flagged(true_generator, clips):
    """It responds, but what it does is late by half a second to two."""

    def late(audio, seed):
        return np.roll(true_generator(audio, seed), 17 + 11 * audio.clip, axis=0)

    (verdict,) = listening_audit(late, clips, SPEAKERS, FPS)["verdicts"]
    assert "agrees no more with its own audio" in verdict


def test_conditions_take_level_and_spectrum_apart(clips):
    audio = {each.condition: each.features for each in conditions(clips, 1, FPS, SPEAKERS)}
    own = clips[1]
    np.testing.assert_allclose(audio["even loudness"].mean(axis=1), own.mean(), atol=1e-3)
    np.testing.assert_allclose(audio["loudness alone"].mean(axis=1), own.mean(axis=1), atol=1e-3)
    assert np.ptp(audio["loudness alone"] - audio["loudness alone"].mean(axis=1, keepdims=True), axis=0).max() < 1e-3
    np.testing.assert_array_equal(audio["1 s late"][30:60], own[:30])
    assert np.ptp(audio["silence"]) == 0.0
    assert not np.array_equal(audio["another speaker"], own)
