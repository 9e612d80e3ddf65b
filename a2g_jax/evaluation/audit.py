"""Does a model listen? Its motion for true audio beside its motion for audio that was shifted, exchanged or spoilt.

The same seed is used throughout, so that whatever changes was changed by the audio; how far motions for different seeds
are apart says how much a change is worth.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import ndimage

from a2g_jax.metrics.intervals import bootstrap_mean
from a2g_jax.metrics.rhythm import agreement, energy_peaks, speed_peaks

LogMel = Float[np.ndarray, "_ bands"]
Places = Float[np.ndarray, "_ J 3"]

#: Seconds by which audio is moved, in a circle.
SHIFTS = (1.0, 2.0, 5.0)
#: Width of agreement, and from a stroke's fastest moment to its syllable's peak, seconds.
SIGMA, LEAD = 0.1, 0.15
#: A model is called deaf if no condition changes its motion by this share of what another seed does.
DEAF = 0.1
#: It follows loudness alone if the level alone gives back this share of what silence takes away, and its rhythm is gone
#: where the level is even.
LOUDNESS = 0.75
#: Standard errors that a difference must have to count.
SURE = 2.0


class Heard(NamedTuple):
    """What a model is given to hear."""

    condition: str
    clip: int
    """Whose audio it is."""
    shift: float
    """Seconds that it is late by."""
    features: LogMel


#: Positions of the wrists or of all joints for what is heard, with a seed.
Listener = Callable[[Heard, int], Places]


def conditions(clips: list[LogMel], number: int, fps: float, speakers: list[str]) -> list[Heard]:
    """The true audio of a clip, and what is made of it.

    The last two take the level apart from the spectrum: ``even loudness`` moves every row to the clip's mean level,
    ``loudness alone`` gives every row the clip's mean spectrum at its own level.
    """
    own = clips[number]
    heard = [Heard("true audio", number, 0.0, own)]
    for seconds in SHIFTS:
        heard.append(Heard(f"{seconds:g} s late", number, seconds, np.roll(own, round(seconds * fps), axis=0)))
    others = [index for index, name in enumerate(speakers) if name != speakers[number]] or [
        index for index in range(len(clips)) if index != number
    ]
    if others:
        other = others[number % len(others)]
        rows = np.arange(len(own)) % len(clips[other])
        heard.append(Heard("another speaker", other, 0.0, clips[other][rows]))
    heard.append(Heard("silence", number, 0.0, np.full_like(own, own.min())))
    level, spectrum = own.mean(axis=1, keepdims=True), own.mean(axis=0, keepdims=True)
    heard.append(Heard("even loudness", number, 0.0, own - level + level.mean()))
    heard.append(Heard("loudness alone", number, 0.0, np.broadcast_to(spectrum, own.shape) + level - level.mean()))
    return heard


def listening_audit(
    listen: Listener, clips: list[LogMel], speakers: list[str], fps: float, samples: int = 4
) -> dict[str, Any]:
    """Changes and agreement for every condition, and what is to be thought of them; JSON-able.

    Args:
        clips: log-mel rows of each clip, in dB.
        speakers: of each clip.
        samples: seeds.

    Returns:
        ``conditions``: for each, the mean change of the motion in cm and as a share of what another seed changes, and
        the agreement of its wrist-speed peaks with the true audio's energy peaks, with its 95 % interval over clips;
        ``sampling_cm``; ``verdicts``.
    """
    changes: dict[str, list[float]] = {}
    rhythm: dict[str, list[float]] = {}
    sampling = []
    for number, own in enumerate(clips):
        peaks = energy_peaks(own.mean(axis=1).astype(np.float64), fps)
        true: list[Places] = []
        for heard in conditions(clips, number, fps, speakers):
            motions = [listen(heard, seed) for seed in range(samples)]
            true = true or motions
            changes.setdefault(heard.condition, []).append(
                float(np.mean([_distance(a, b) for a, b in zip(true, motions, strict=True)]))
            )
            scores = [agreement(_strokes(motion, fps), peaks, SIGMA, LEAD) for motion in motions]
            rhythm.setdefault(heard.condition, []).append(float(np.mean(scores)))
        sampling += [_distance(true[a], true[b]) for a in range(samples) for b in range(a)]
    noise = float(np.mean(sampling)) if sampling else float("nan")
    table = {
        name: {
            "change_cm": float(np.mean(changes[name])),
            "change_of_sampling": float(np.mean(changes[name])) / max(noise, 1e-9),
            "agreement": float(np.mean(rhythm[name])),
            "agreement_interval": _interval(rhythm[name]),
        }
        for name in changes
    }
    return {"sampling_cm": noise, "clips": len(clips), "conditions": table, "verdicts": _verdicts(table, rhythm, noise)}


def _interval(values: list[float]) -> list[float] | None:
    """95 % over clips, by bootstrap; None of a single one."""
    if len(values) < 2:
        return None
    found = bootstrap_mean(np.array(values), np.random.default_rng(0))
    return [found.low, found.high]


def _verdicts(table: dict[str, dict[str, Any]], rhythm: dict[str, list[float]], noise: float) -> list[str]:
    """What stands out, worst first; ``"listens"`` where nothing does."""
    changed = {name: row["change_cm"] for name, row in table.items() if name != "true audio"}
    if max(changed.values()) < DEAF * noise:
        return ["deaf: no audio changes its motion"]
    late = [f"{seconds:g} s late" for seconds in SHIFTS]
    shifted = np.mean([rhythm[name] for name in late], axis=0)
    verdicts = []
    if not _surely_more(np.array(rhythm["true audio"]), shifted):
        verdicts.append("its motion agrees no more with its own audio than motion made for audio that comes late")
    silence, level = table["silence"]["change_cm"], table["loudness alone"]["change_cm"]
    even = np.array(rhythm["even loudness"])
    if silence > DEAF * noise and level < (1.0 - LOUDNESS) * silence and not _surely_more(even, shifted):
        verdicts.append("follows loudness alone: the level without the speech gives nearly the same motion")
    return verdicts or ["listens"]


def _surely_more(values: Float[np.ndarray, " n"], others: Float[np.ndarray, " n"]) -> bool:
    """Whether the paired difference over clips is above zero by more than chance; of one clip, whether it is large."""
    difference = values - others
    if len(difference) < 2:
        return bool(difference.mean() > 0.05)
    error = difference.std(ddof=1) / np.sqrt(len(difference))
    return bool(difference.mean() > max(SURE * error, 1e-3))


def _distance(first: Places, second: Places) -> float:
    """Mean L1 distance of joints, cm."""
    return float(100.0 * np.abs(first - second).sum(axis=-1).mean())


def _strokes(places: Places, fps: float) -> Float[np.ndarray, " n"]:
    """Seconds of peaks of the fastest joint's smoothed speed."""
    speed = np.linalg.norm(np.gradient(ndimage.gaussian_filter1d(places, 0.05 * fps, axis=0), axis=0), axis=-1) * fps
    return speed_peaks(speed.max(axis=-1), fps)
