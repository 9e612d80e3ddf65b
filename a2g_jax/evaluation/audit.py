"""Does a model listen? Its motion for true audio compared with its motion for shifted, exchanged or altered audio.

The seed is the same for all, so that differences are due to the audio; their scale is the distance of motions of
different seeds.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Shaped
from scipy import ndimage

from a2g_jax.metrics.intervals import difference_interval, mean_interval
from a2g_jax.metrics.rhythm import agreement, energy_peaks, speed_peaks

LogMel = Float[np.ndarray, "_ bands"]
Points = Float[np.ndarray, "_ J 3"]
Owners = Shaped[np.ndarray, " n"]

#: Circular shifts of the audio, seconds.
SHIFTS = (1.0, 2.0, 5.0)
#: Standard deviation of agreement, and time from a stroke's fastest moment to its syllable's peak, seconds.
SIGMA, LEAD = 0.1, 0.15
#: A model counts as deaf if no condition changes its motion by this share of the change by another seed.
DEAF = 0.1
#: It follows loudness alone if the level alone restores this share of what silence changes, and its rhythm is lost with
#: an even level.
LOUDNESS = 0.75


class AudioCondition(NamedTuple):
    """Audio features given to a model."""

    condition: str
    clip: int
    """Number of the clip whose audio it is."""
    shift: float
    """Delay of the audio, seconds."""
    features: LogMel


#: A model: positions of the wrists, or of all joints, for audio and a seed.
Generate = Callable[[AudioCondition, int], Points]


def conditions(clips: list[LogMel], number: int, fps: float, speakers: list[str]) -> list[AudioCondition]:
    """The true audio of a clip and its alterations.

    The last two separate level from spectrum: ``even loudness`` moves every row to the clip's mean level,
    ``loudness alone`` gives every row the clip's mean spectrum at its own level.
    """
    own = clips[number]
    made = [AudioCondition("true audio", number, 0.0, own)]
    for seconds in SHIFTS:
        made.append(AudioCondition(f"{seconds:g} s late", number, seconds, np.roll(own, round(seconds * fps), axis=0)))
    others = [index for index, name in enumerate(speakers) if name != speakers[number]] or [
        index for index in range(len(clips)) if index != number
    ]
    if others:
        other = others[number % len(others)]
        rows = np.arange(len(own)) % len(clips[other])
        made.append(AudioCondition("another speaker", other, 0.0, clips[other][rows]))
    made.append(AudioCondition("silence", number, 0.0, np.full_like(own, own.min())))
    level, spectrum = own.mean(axis=1, keepdims=True), own.mean(axis=0, keepdims=True)
    made.append(AudioCondition("even loudness", number, 0.0, own - level + level.mean()))
    made.append(
        AudioCondition("loudness alone", number, 0.0, np.broadcast_to(spectrum, own.shape) + level - level.mean())
    )
    return made


def listening_audit(
    generate: Generate,
    clips: list[LogMel],
    speakers: list[str],
    fps: float,
    samples: int = 4,
    recordings: Sequence[int] | None = None,
) -> dict[str, Any]:
    """Changes of motion and agreement with the audio under every condition, with verdicts; JSON-able.

    Args:
        generate: the model.
        clips: log-mel rows of each clip, in dB.
        speakers: the speaker of each clip.
        samples: number of seeds.
        recordings: the recording of each clip, since clips of one depend on each other; None if each is one of its own.

    Returns:
        ``conditions``: for each, the mean change of the motion in cm and as a share of the change by another seed, and
        the agreement of its wrist-speed peaks with the true audio's energy peaks, with its 95 % interval over
        recordings (None for too few); ``sampling_cm``, the mean distance of motions of two seeds; ``verdicts``.
    """
    owners = np.arange(len(clips)) if recordings is None else np.asarray(recordings)
    changes: dict[str, list[float]] = {}
    rhythm: dict[str, list[float]] = {}
    sampling = []
    for number, own in enumerate(clips):
        peaks = energy_peaks(own.mean(axis=1).astype(np.float64), fps)
        true: list[Points] = []
        for condition in conditions(clips, number, fps, speakers):
            motions = [generate(condition, seed) for seed in range(samples)]
            true = true or motions
            changes.setdefault(condition.condition, []).append(
                float(np.mean([_distance(a, b) for a, b in zip(true, motions, strict=True)]))
            )
            scores = [agreement(_strokes(motion, fps), peaks, SIGMA, LEAD) for motion in motions]
            rhythm.setdefault(condition.condition, []).append(float(np.mean(scores)))
        sampling += [_distance(true[a], true[b]) for a in range(samples) for b in range(a)]
    noise = float(np.mean(sampling)) if sampling else float("nan")
    table = {
        name: {
            "change_cm": float(np.mean(changes[name])),
            "change_of_sampling": float(np.mean(changes[name])) / max(noise, 1e-9),
            "agreement": float(np.mean(rhythm[name])),
            "agreement_interval": _interval(rhythm[name], owners),
        }
        for name in changes
    }
    about = {"sampling_cm": noise, "clips": len(clips), "recordings": len(np.unique(owners))}
    return {**about, "conditions": table, "verdicts": _verdicts(table, rhythm, noise, owners)}


def _interval(values: list[float], owners: Owners) -> list[float] | None:
    """95 % interval over recordings; None for too few."""
    interval = mean_interval(np.array(values), owners)
    return None if np.isnan(interval.low) else [interval.low, interval.high]


def _verdicts(
    table: dict[str, dict[str, Any]], rhythm: dict[str, list[float]], noise: float, owners: Owners
) -> list[str]:
    """Verdicts, worst first; ``"listens"`` without any other."""
    changed = {name: row["change_cm"] for name, row in table.items() if name != "true audio"}
    if max(changed.values()) < DEAF * noise:
        return ["deaf: no audio changes its motion"]
    late = [f"{seconds:g} s late" for seconds in SHIFTS]
    shifted = np.mean([rhythm[name] for name in late], axis=0)
    verdicts = []
    if not _significantly_more(np.array(rhythm["true audio"]), shifted, owners):
        verdicts.append("its motion agrees no more with its own audio than motion made for delayed audio")
    silence, level = table["silence"]["change_cm"], table["loudness alone"]["change_cm"]
    even = np.array(rhythm["even loudness"])
    if silence > DEAF * noise and level < (1.0 - LOUDNESS) * silence and not _significantly_more(even, shifted, owners):
        verdicts.append("follows loudness alone: the level without the speech gives nearly the same motion")
    return verdicts or ["listens"]


def _significantly_more(values: Float[np.ndarray, " n"], others: Float[np.ndarray, " n"], owners: Owners) -> bool:
    """Whether the 95 % interval of the paired difference is above zero; for a single recording, whether it is large."""
    difference = difference_interval(values, others, owners, least=2)
    if difference.clips < 2:
        return bool(difference.mean > 0.05)
    return bool(difference.low > 0.0 and difference.mean > 1e-3)


def _distance(first: Points, second: Points) -> float:
    """Mean L1 distance of joints, cm."""
    return float(100.0 * np.abs(first - second).sum(axis=-1).mean())


def _strokes(positions: Points, fps: float) -> Float[np.ndarray, " n"]:
    """Times of the peaks of the fastest joint's smoothed speed, seconds."""
    speed = np.linalg.norm(np.gradient(ndimage.gaussian_filter1d(positions, 0.05 * fps, axis=0), axis=0), axis=-1) * fps
    return speed_peaks(speed.max(axis=-1), fps)
