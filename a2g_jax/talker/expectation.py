"""Expectations over all valid motions of a generated recording, by sampling, with standard errors.

The true conditional distribution of motion given audio can be sampled for a generated recording. A score's expected
value, the true multimodality, and a metric's best and worst reachable value (its ceiling and floor) are therefore
estimated with a standard error that falls with the number of draws. For exact values see
:mod:`a2g_jax.talker.hidden_choices`.
"""

import math
import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from itertools import combinations
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.recording import Recording
from a2g_jax.talker.hidden_choices import speech_plan
from a2g_jax.talker.recordings import resample_motion

Score = Callable[[Motion, Recording], float]
"""A metric of one motion for one recording's audio (and, where the metric uses it, its recorded motion)."""
Distance = Callable[[Motion, Motion], float]


class Estimate(NamedTuple):
    """A mean over draws."""

    mean: float
    standard_error: float
    draws: int
    """Number of independent motions."""


class Bounds(NamedTuple):
    """A metric's values for valid and for unrelated motion."""

    ceiling: Estimate
    """Of another valid motion of the same recording: a perfect model's expected value."""
    floor: Estimate
    """Of valid motions of another recording of the same speaker: the value of a model that ignores the audio."""


def sample_mean(values: Float[np.ndarray, " n"]) -> Estimate:
    """Mean of independent values; its standard error is their standard deviation over the square root of their number.

    Raises:
        ValueError: fewer than two values, which have no estimate of spread.
    """
    count = len(values)
    if count < 2:
        raise ValueError(f"Expected two draws or more; got {count}.")
    return Estimate(float(np.mean(values)), float(np.std(values, ddof=1) / math.sqrt(count)), count)


def pair_mean(distances: Float[np.ndarray, "n n"]) -> Estimate:
    """Mean distance between two independent draws, from all pairs of ``n`` draws.

    The pairs share draws, so they are not independent: their mean is a U-statistic (Hoeffding 1948), without bias. The
    standard error is the jackknife's: from the ``n`` means that leave one draw out, times ``(n - 1) / n``. It takes the
    shared draws into account, and exceeds the truth a little on average where ``n`` is small (Efron & Stein 1981).

    Args:
        distances: symmetric; the diagonal is not used.

    Raises:
        ValueError: fewer than three draws.
    """
    count = len(distances)
    if count < 3:
        raise ValueError(f"Expected three draws or more; got {count}.")
    off = np.where(np.eye(count, dtype=bool), 0.0, distances)
    total, rows = float(np.sum(off)), np.sum(off, axis=1)
    without = (total - 2.0 * rows) / ((count - 1) * (count - 2))
    variance = (count - 1) / count * float(np.sum((without - np.mean(without)) ** 2))
    return Estimate(total / (count * (count - 1)), math.sqrt(variance), count)


def expect(recording: Recording, score: Score, draws: int, key: Any, *, workers: int = 1) -> Estimate:
    """Expectation of ``score(motion, recording)`` over the valid motions of a generated recording.

    Args:
        score: any function of a motion and the recording; with several workers one that can be pickled.
        draws: independent motions, 2 or more.
        key: an integer or a typed JAX key; the same key draws the same motions, with any number of workers.
        workers: processes.

    Raises:
        InputError: the recording is not a generated one.
    """
    return sample_mean(_scores(recording, recording, score, draws, key, workers))


def expected_multimodality(recording: Recording, distance: Distance, draws: int, key: Any) -> Estimate:
    """The true multimodality: expected distance between two independent valid motions of one recording.

    All ``draws * (draws - 1) / 2`` pairs of ``draws`` motions are compared; see :func:`pair_mean` for the standard
    error. The motions are held in memory together: 1.1 MB for every second of 20 of them, of 52 joints at 30 frames
    per second.

    Args:
        distance: any symmetric function of two motions.
        draws: independent motions, 3 or more.

    Raises:
        InputError: the recording is not a generated one.
    """
    motions = [resample_motion(recording, draw_key(key, index))[0] for index in range(draws)]
    distances = np.zeros((draws, draws))
    for first, second in combinations(range(draws), 2):
        distances[first, second] = distances[second, first] = distance(motions[first], motions[second])
    return pair_mean(distances)


def bounds(recording: Recording, other: Recording, score: Score, draws: int, key: Any, *, workers: int = 1) -> Bounds:
    """Ceiling and floor of a metric: valid motions of this recording, and of another one, scored against this one.

    Args:
        other: of the same speaker, at the same rate, on the same skeleton, at least as long; its motions are cut to
            the length of this recording's.

    Raises:
        InputError: the other recording is the same one, or does not fit, or one of them is not a generated one.
    """
    ours, theirs = recording.motion, other.motion
    for wrong, what in (
        (speech_plan(other) == speech_plan(recording), "says the same as"),
        (other.speaker != recording.speaker, "has another speaker than"),
        (theirs.fps != ours.fps, "has another frame rate than"),
        (not theirs.skeleton.same_tree(ours.skeleton), "has other joints than"),
        (theirs.frames < ours.frames, "is shorter than"),
    ):
        if wrong:
            raise InputError(f"{other.name}: {what} {recording.name}; a floor needs another one of the same kind.")
    return Bounds(
        expect(recording, score, draws, key, workers=workers),
        sample_mean(_scores(other, recording, score, draws, key, workers)),
    )


def draw_key(key: Any, index: int) -> int:
    """The key for :func:`~a2g_jax.talker.recordings.resample_motion` of the draw with this number."""
    if isinstance(key, int | np.integer):
        words = [0, int(key)]
    else:
        words = [1, *(int(word) for word in jax.random.key_data(key).ravel())]
    low, high = np.random.SeedSequence([*words, index]).generate_state(2, np.uint64)
    return int(low) | int(high) << 64


def _scores(
    source: Recording, target: Recording, score: Score, draws: int, key: Any, workers: int
) -> Float[np.ndarray, " n"]:
    """Scores against ``target`` of valid motions of ``source``."""
    keys = [draw_key(key, index) for index in range(draws)]
    if workers <= 1:
        return np.array([_score(source, target, score, each) for each in keys])
    # JAX has threads, which do not survive a fork.
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        jobs = [pool.submit(_score, source, target, score, each) for each in keys]
        return np.array([job.result() for job in jobs])


def _score(source: Recording, target: Recording, score: Score, key: int) -> float:
    motion, _ = resample_motion(source, key)
    return float(score(motion.clip(0, target.motion.frames), target))
