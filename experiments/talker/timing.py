"""Arrival of strokes relative to their syllables.

    python -m experiments.talker.timing [--minutes 48] [--seed 0]

Three sources of time: the truth; the syllable's energy peak measured in the audio; the stroke's arrival measured in the
motion. Arrival is the first moment after a burst of the faster wrist at which it has slowed to 35 % of the burst, or
speeds up again: the speed at which a minimum-jerk step is where the truth puts the apex. A stroke's burst is the last
one until 0.06 s after its true apex; arrivals found in the motion alone are independent of the truth and include those
of preparations and retractions.
"""

import argparse
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from scipy import ndimage, signal

from a2g_jax.talker.gesture_plan import LEAD_MEAN, LEAD_RANGE, LEAD_SPREAD
from a2g_jax.talker.recordings import talk
from experiments.talker import movement
from experiments.talker.common import Part, cast_evenly, parallel, run_part, table

FPS = 60.0
#: Rate of the loudness curve that energy peaks are read from, and its Gaussian smoothing (standard deviation, s).
ENVELOPE_RATE, ENVELOPE_SMOOTHING = 200.0, 0.025
#: A measured peak belongs to a planned one if it lies this close, seconds.
NEAR = 0.12
TOLERANCE = 0.1
_SLOWED = 0.35


def energy_envelope(audio: np.ndarray, sample_rate: int) -> np.ndarray:
    """Loudness in dB at :data:`ENVELOPE_RATE`, 50 dB deep."""
    size = round(sample_rate / ENVELOPE_RATE)
    power = np.square(audio[: len(audio) // size * size], dtype=np.float64).reshape(-1, size).mean(axis=1)
    power = ndimage.gaussian_filter1d(power, ENVELOPE_SMOOTHING * ENVELOPE_RATE)
    decibels = 10 * np.log10(power + 1e-12)
    return np.maximum(decibels, decibels.max() - 50)


def arrival(speed: np.ndarray, peak: int) -> int:
    """Index at which a movement whose speed peaks at ``peak`` has slowed down, or speeds up again."""
    after = speed[peak:]
    slow = after <= _SLOWED * after[0]
    turns = np.append(np.diff(after) > 0, True)
    return peak + int(np.argmax(slow | turns))


def last_burst(speed: np.ndarray) -> int:
    """Index of the last peak of a stretch of speed that is at least 0.4 of its largest value.

    Before it lies the preparation, which may be the faster movement.
    """
    # The end counts as a peak: the stretch may be cut within the movement.
    padded = np.pad(speed, 1, constant_values=-1.0)
    peaks = np.flatnonzero((padded[1:-1] > padded[:-2]) & (padded[1:-1] >= padded[2:]))
    return int(peaks[speed[peaks] >= 0.4 * speed.max()][-1])


def measure(role: dict[str, Any], fps: float = FPS) -> dict[str, list[float]]:
    """Times of one recording, seconds: planned and measured ones of each stroke, and all peaks found blindly."""
    take = talk(**role, fps=fps)
    envelope = energy_envelope(take.audio, take.sample_rate)
    audible, traits = signal.find_peaks(envelope, prominence=2.0)
    audible_times = (audible + 0.5) / ENVELOPE_RATE
    hands = movement.body_positions(take.motion)[:, -2:]
    path = ndimage.gaussian_filter1d(np.asarray(hands, np.float64), 0.02 * fps, axis=0, mode="nearest")
    speed = np.linalg.norm(np.gradient(path, axis=0), axis=-1) * fps
    syllables = take.annotations["speech"]["syllables"]
    rows: dict[str, list[float]] = {name: [] for name in ("planned_peak", "planned_apex", "peak", "apex", "speed")}
    for stroke in take.annotations["gestures"]["strokes"]:
        planned = syllables[stroke["syllable"]]["peak"]
        near = np.flatnonzero(np.abs(audible_times - planned) <= NEAR)
        # The hand that moves most is taken as the leading one.
        begin, end = (round((stroke["apex"] + shift) * fps) for shift in (-0.35, 0.06))
        begin, end = max(begin, 0), max(end, 1)
        hand = int(np.argmax(speed[begin:end].max(axis=0)))
        fastest = begin + last_burst(speed[begin:end, hand])
        landed = arrival(speed[:, hand], fastest) / fps
        rows["planned_peak"].append(planned)
        rows["planned_apex"].append(stroke["apex"])
        rows["peak"].append(float(audible_times[near[np.argmax(envelope[audible[near]])]]) if len(near) else np.nan)
        rows["apex"].append(landed if abs(landed - stroke["apex"]) <= 2 * NEAR else np.nan)
        rows["speed"].append(fastest / fps)
    faster = speed.max(axis=1)
    moves = signal.find_peaks(faster, prominence=movement.STROKE_PROMINENCE, distance=round(0.15 * fps))[0]
    loud = envelope[audible] >= np.median(envelope[audible]) if len(audible) else np.zeros(0, bool)
    prominent = traits["prominences"] >= np.percentile(traits["prominences"], 67) if len(audible) else loud
    rows["blind_apexes"] = [arrival(faster, peak) / fps for peak in moves]
    rows["blind_syllables"] = audible_times.tolist()
    rows["blind_prominent"] = audible_times[loud & prominent].tolist()
    return {**rows, "seconds": [take.motion.seconds]}


def near_share(moves: np.ndarray, speech: np.ndarray, tolerance: float = TOLERANCE) -> float:
    """Share of ``moves`` with a time of ``speech`` within ``tolerance`` seconds."""
    if len(moves) == 0 or len(speech) == 0:
        return 0.0
    return float(np.mean(np.abs(moves[:, None] - speech[None]).min(axis=1) <= tolerance))


def against_shifts(recordings: list[dict[str, list[float]]], moves: str, speech: str, shifts: int, seed: int) -> dict:
    """Share of moves near speech over all recordings, and of moves shifted circularly by 1 s and more."""
    rng = np.random.default_rng([seed, 41])

    def share(shifted: bool) -> float:
        hits, count = 0.0, 0
        for rows in recordings:
            times, length = np.array(rows[moves]), rows["seconds"][0]
            if shifted:
                times = (times + rng.uniform(1.0, length - 1.0)) % length
            hits += near_share(times, np.array(rows[speech])) * len(times)
            count += len(times)
        return hits / max(count, 1)

    null = [share(True) for _ in range(shifts)]
    value = share(False)
    return {
        "moves": int(sum(len(rows[moves]) for rows in recordings)),
        "share": value,
        "null_mean": float(np.mean(null)),
        "null_95": np.percentile(null, (2.5, 97.5)).tolist(),
        "z": (value - float(np.mean(null))) / max(float(np.std(null)), 1e-9),
    }


def spread(values: np.ndarray) -> dict[str, Any]:
    """Mean, standard deviation and robust versions of the available measurements."""
    found = values[np.isfinite(values)]
    return {
        "n": len(found),
        "missed": int(len(values) - len(found)),
        "mean": float(np.mean(found)),
        "std": float(np.std(found)),
        "median": float(np.median(found)),
        "std_robust": float(1.4826 * np.median(np.abs(found - np.median(found)))),
        "p5_p95": np.percentile(found, (5, 95)).tolist(),
    }


def requested_leads(draws: int, seed: int) -> dict[str, float]:
    """Mean and standard deviation of the truncated normal distribution from which leads are drawn."""
    values = np.random.default_rng([seed, 42]).normal(LEAD_MEAN, LEAD_SPREAD, draws)
    values = values[(values >= LEAD_RANGE[0]) & (values <= LEAD_RANGE[1])]
    return {
        "normal_mean": LEAD_MEAN,
        "normal_std": LEAD_SPREAD,
        "from": LEAD_RANGE[0],
        "to": LEAD_RANGE[1],
        "mean": float(values.mean()),
        "std": float(values.std()),
    }


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the amount of talk and the number of shifts."""
    parser.add_argument("--minutes", type=float, default=48.0)
    parser.add_argument("--shifts", type=int, default=200, help="circular shifts of the null")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """All figures of timing."""
    roles = cast_evenly(1, options.minutes * 60 / 48, options.seed, rooms=False)
    recordings = parallel(partial(measure, fps=FPS), roles, options.workers)
    stacked = {name: np.concatenate([rows[name] for rows in recordings]) for name in ("planned_peak", "planned_apex")}
    stacked |= {name: np.concatenate([rows[name] for rows in recordings]) for name in ("peak", "apex", "speed")}
    leads = {
        "planned apex before planned peak": stacked["planned_peak"] - stacked["planned_apex"],
        "measured apex before measured peak": stacked["peak"] - stacked["apex"],
        "measured peak after planned peak (error of the voice and the measure)": stacked["peak"]
        - stacked["planned_peak"],
        "measured apex after planned apex (error of the motion and the measure)": stacked["apex"]
        - stacked["planned_apex"],
        "stroke's fastest moment before measured peak": stacked["peak"] - stacked["speed"],
    }
    edges = np.linspace(-0.2, 0.4, 61)
    shares = {}
    for moves, name in (("planned_apex", "true apexes"), ("blind_apexes", "arrivals found in the motion")):
        for speech, what in (
            ("planned_peak", "their own syllables, planned"),
            ("blind_prominent", "prominent energy peaks found in the audio"),
            ("blind_syllables", "all energy peaks found in the audio"),
        ):
            shares[f"{name} near {what}"] = against_shifts(recordings, moves, speech, options.shifts, options.seed)
    return {
        "strokes": len(stacked["peak"]),
        "recordings": len(roles),
        "requested": requested_leads(1_000_000, options.seed),
        "leads": {name: spread(values) for name, values in leads.items()},
        "tolerance": TOLERANCE,
        "shares": shares,
        "histogram": {
            "edges": edges,
            **{name: np.histogram(values[np.isfinite(values)], edges)[0].tolist() for name, values in leads.items()},
        },
    }


def tables(result: dict[str, Any]) -> str:
    """Leads, then shares with their null."""
    lead = result["requested"]
    rows = [["requested (truncated normal)", None, None, lead["mean"], lead["std"], None, None, None]]
    for name, value in result["leads"].items():
        keys = ("n", "missed", "mean", "std", "median", "std_robust", "p5_p95")
        rows.append([name, *(value[key] for key in keys)])
    first = table(
        rows, ["seconds", "strokes", "missed", "mean", "deviation", "median", "robust deviation", "5 to 95 %"]
    )
    keys = ("moves", "share", "null_mean", "null_95", "z")
    second = table(
        [[name, *(value[key] for key in keys)] for name, value in result["shares"].items()],
        [f"within {result['tolerance']:g} s", "moves", "share", "shifted: mean", "shifted: 95 % band", "z"],
    )
    return (
        f"{result['strokes']} strokes of {result['recordings']} recordings, all speakers and emotions. Requested: a "
        f"normal of mean {lead['normal_mean']:g} s and deviation {lead['normal_std']:g} s, cut to {lead['from']:g} to "
        f"{lead['to']:g} s.\n\n{first}\n{second}"
    )


def picture(result: dict[str, Any], path: Path) -> None:
    """Histograms of the requested and the measured lead."""
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    edges = np.array(result["histogram"]["edges"])
    middle, width = (edges[1:] + edges[:-1]) / 2, edges[1] - edges[0]
    figure, axes = plt.subplots(figsize=(6.4, 3.2), layout="constrained")
    for name, label in (
        ("planned apex before planned peak", "truth"),
        ("measured apex before measured peak", "measured from audio and motion"),
    ):
        counts = np.array(result["histogram"][name], float)
        axes.bar(middle, counts / counts.sum() / width, width, alpha=0.5, label=label)
    lead = result["requested"]
    inside = (middle >= lead["from"]) & (middle <= lead["to"])
    density = np.exp(-((middle - lead["normal_mean"]) ** 2) / (2 * lead["normal_std"] ** 2)) * inside
    axes.plot(middle, density / density.sum() / width, color="black", lw=1, label="requested")
    axes.axvline(0, color="grey", lw=0.8)
    axes.set(xlabel="stroke arrives before its syllable's energy peak, seconds", ylabel="density", xlim=(-0.2, 0.35))
    axes.legend(frameon=False)
    figure.savefig(path, dpi=110)
    plt.close(figure)


PART = Part("timing", "Strokes against syllables", add_arguments, run, tables, picture)

if __name__ == "__main__":
    run_part(PART)
