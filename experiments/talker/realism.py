"""Figures of the generated corpus compared with real takes.

    python -m experiments.talker.realism [--repeats 1] [--seconds 60] [--shared ../shared] [--seed 0]

All paths are splined to 60 Hz and smoothed by a Gaussian of 50 ms before they are differentiated; all detectors are the
same for all. Derivatives are relative to the pelvis (TED: to its lowest spine joint), ranges to the shoulders' middle.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.talker.recordings import talk
from experiments.talker import movement, sound
from experiments.talker.common import ROOT, Part, cast_evenly, parallel, run_part, table
from experiments.talker.takes import Take, generated_take, real_takes

#: Name and unit of each figure, in the order of the table.
ROWS: dict[str, str] = {
    **{
        f"{part}_{what}_p{p}": f"{part} {what} p{p}, {unit}"
        for part in ("wrist", "head")
        for what, unit in (("speed", "m/s"), ("acceleration", "m/s^2"), ("jerk", "m/s^3"))
        for p in (50, 90, 95)
    },
    **{
        f"range_{axis}_{unit}": f"wrist range {axis} (5 to 95 %), {'m' if unit == 'm' else 'arm lengths'}"
        for unit in ("m", "arms")
        for axis in ("side", "up", "forward")
    },
    "rest_share": "share of time at rest",
    "strokes_per_minute": "wrist speed peaks a minute",
    "f0_median_hz": "F0 median, Hz",
    "f0_spread_semitones": "F0 spread (half of p16 to p84), semitones",
    "voiced_share": "voiced share of time",
    "log_mel_mean_db": "log-mel mean at -23 dBFS, dB",
    "log_mel_std_db": "log-mel deviation, dB",
    "log_mel_std_in_time_db": "log-mel deviation in time, dB",
    "modulation_peak_hz": "peak of the modulation spectrum, Hz",
    "syllable_rate_hz": "syllable peaks a second of speech (detector)",
    "transcript_rate_hz": "syllables a second of speech (transcript)",
    "pause_share": "share of pauses (-25 dB, 0.2 s)",
}
FACTOR = 2.0
#: Widening of the real range on scales without a zero, where a ratio has no meaning.
_DIFFERENCES = {"log_mel_mean_db": 6.0}


def describe(take: Take) -> dict[str, float]:
    """All figures available for a take."""
    figures: dict[str, float] = {}
    if take.moves is not None:
        figures |= movement.summary(take.moves)
    if take.audio is not None:
        figures |= sound.summary(sound.analyse(take.audio, 16000))
    if take.syllable_rate is not None:
        figures["transcript_rate_hz"] = take.syllable_rate
    return figures


def describe_role(role: dict[str, Any]) -> dict[str, float]:
    """All figures of one generated recording."""
    return describe(generated_take(role["name"], talk(**role)))


def average(figures: list[dict[str, float]]) -> dict[str, float]:
    """Mean of each figure over recordings."""
    return {key: float(np.nanmean([row[key] for row in figures])) for key in figures[0]}


def compare(key: str, value: float, real: list[float]) -> dict[str, Any]:
    """A figure compared with the range of the real ones: factor beyond its nearer end (1 inside)."""
    low, high = min(real), max(real)
    row: dict[str, Any] = {"generated": value, "real": [low, high]}
    if key in _DIFFERENCES:
        row["beyond"] = max(low - value, value - high, 0.0)
        row["far"] = row["beyond"] > _DIFFERENCES[key]
        return row
    ratio = value / high if value > high else value / low if value < low else 1.0
    return {**row, "ratio": ratio, "far": not 1 / FACTOR <= ratio <= FACTOR}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the amount of talk and the folder of real recordings."""
    parser.add_argument("--repeats", type=int, default=1, help="recordings of every speaker in every emotion")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared", help="folder with data/ of real takes")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """The table of all takes, and of speakers and emotions."""
    roles = cast_evenly(options.repeats, options.seconds, options.seed, rooms=False)
    figures = parallel(describe_role, roles, options.workers)
    takes, missing = real_takes(options.shared)
    real = {take.name: describe(take) for take in takes}
    # A corpus of `a2g prepare talker` is neutral half of the time.
    weights = [7.0 if role["emotion"] == "neutral" else 1.0 for role in roles]
    overall = {key: float(np.average([row[key] for row in figures], weights=weights)) for key in figures[0]}
    spread = {key: np.percentile([row[key] for row in figures], (5, 95)).tolist() for key in figures[0]}
    groups = {
        what: {
            name: average([row for row, role in zip(figures, roles, strict=True) if role[what] == name])
            for name in dict.fromkeys(role[what] for role in roles)
        }
        for what in ("speaker", "emotion")
    }
    rows = {}
    for key in ROWS:
        real_values = [take[key] for take in real.values() if key in take]
        rows[key] = compare(key, overall[key], real_values) if real_values else {"generated": overall[key]}
    return {
        "recordings": len(roles),
        "seconds": options.seconds,
        "smoothing_s": movement.SMOOTHING,
        "rate_hz": movement.RATE,
        "real": real,
        "missing": missing,
        "spread": spread,
        "rows": rows,
        "groups": groups,
    }


def tables(result: dict[str, Any]) -> str:
    """Generated and real takes, then speakers and emotions."""
    names = list(result["real"])
    lines = []
    for key, title in ROWS.items():
        row = result["rows"][key]
        verdict = "-"
        if "ratio" in row:
            verdict = "inside" if row["ratio"] == 1.0 else f"x {row['ratio']:.2f}"
        elif "beyond" in row:
            verdict = "inside" if row["beyond"] == 0.0 else f"{row['beyond']:.1f} beyond"
        verdict += " **!**" if row.get("far") else ""
        real = [result["real"][name].get(key) for name in names]
        lines.append([title, row["generated"], result["spread"][key], *real, verdict])
    first = table(lines, ["", "talker", "its recordings, 5 to 95 %", *names, "against the real range"])
    shown = (
        "wrist_speed_p50", "wrist_speed_p90", "wrist_acceleration_p90", "wrist_jerk_p90", "head_speed_p90",
        "range_up_m", "range_forward_m", "rest_share", "strokes_per_minute", "f0_median_hz", "f0_spread_semitones",
        "syllable_rate_hz", "pause_share",
    )  # fmt: skip
    parts = [
        f"{result['recordings']} recordings of {result['seconds']:g} s, every speaker in every emotion, neutral "
        f"weighted as in a corpus. Paths at {result['rate_hz']:g} Hz, smoothed by {1000 * result['smoothing_s']:g} ms. "
        f"**!** marks what lies outside the real range by more than a factor of {FACTOR:g} (the log-mel mean: by more "
        "than 6 dB).\n",
        first,
    ]
    parts += [f"Skipped: {reason}.\n" for reason in result["missing"]]
    for what, groups in result["groups"].items():
        rows = [[ROWS[key], *(group[key] for group in groups.values())] for key in shown]
        parts.append(table(rows, [f"by {what}", *groups]))
    return "\n".join(parts)


PART = Part("realism", "Compared with real takes", add_arguments, run, tables)

if __name__ == "__main__":
    run_part(PART)
