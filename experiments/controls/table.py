"""The figures of controls as Markdown."""

from collections.abc import Sequence
from typing import Any

from a2g_jax.features.hand_properties import PROPERTIES


def render(figures: dict[str, Any]) -> str:
    """The page of results."""
    lines = [
        "# Response to named controls",
        "",
        "Intervals are 95 %, over speeches.",
        "",
    ]
    for name, run in figures["runs"].items():
        about = run["about"]
        lines += [
            f"## {name}",
            "",
            f"`{about['command']}`: {about['speeches']} held-out speeches (seed {about['talk_seed']}) of"
            f" {about['seconds']:g} s, {about['draws']} motions each, seeds from {about['seed']} on; intervals by"
            f" {about.get('intervals', 'the percentile bootstrap')}{_of_emotions(about)}; gains"
            f" {', '.join(about['gains']) or 'none'}.",
            "",
            *([*_slopes(run), "", *_side_effects(run), ""] if run["controls"] else []),
        ]
    if "true_emotions" in figures:
        lines += ["## Emotions", "", *_emotions(figures)]
    return "\n".join(lines).rstrip() + "\n"


def _of_emotions(about: dict[str, Any]) -> str:
    """The kind of the intervals of emotions, where it is another one."""
    kind = about.get("emotion_intervals")
    return f", of emotions by {kind}" if kind not in (None, about.get("intervals")) else ""


def _slopes(run: dict[str, Any]) -> list[str]:
    free = run["free"]
    rows = []
    for name, found in run["controls"].items():
        ends = (0, -1)
        kept = [found["agreement"][end]["mean"] / free["agreement"]["mean"] - 1 for end in ends]
        excess = [_relative(found["excess_change"][end], free["agreement_excess"]["mean"]) for end in ends]
        curve = found["curve"]
        rows.append(
            [
                name,
                f"{found['requested'][0]:.2f}, {found['requested'][-1]:.2f}",
                f"{found['arrived'][0]['mean']:.2f}, {found['arrived'][-1]['mean']:.2f}",
                _with_interval(found["slope"]),
                ", ".join(f"{one:.2f}" for one in found["slope_by_draw"]),
                _with_interval(curve["slope"]),
                ", ".join(f"{100 * one:+.0f}" for one in kept),
                "; ".join(excess),
                f"{curve['jerk_p99']:.0f} ({curve['constant_jerk_p99']:.0f})",
                f"{curve['jerk_p999']:.0f} ({curve['constant_jerk_p999']:.0f})",
            ]
        )
    heads = ["control", "requested 0.1, 0.9", "arrived", "slope", "each draw", "slope in a curve"]
    heads += ["agreement at 0.1, 0.9, %", "its excess, %", "jerk p99", "jerk p99.9"]
    agreement, excess = free["agreement"]["mean"], free["agreement_excess"]["mean"]
    return [
        "Slope: change of the property between requests at the 10th and the 90th percentile, over the requested change."
        " Slope in a curve: the same between peaks and valleys of a curve that rises and falls every 15 s, within 4 s."
        f" Agreement with the speech against that of motion without controls ({agreement:.3f}), and its excess over"
        f" that of shifted motion ({excess:.3f} without controls). Jerk of the wrists in that curve, m/s3, in brackets"
        f" the highest of constant requests (without controls p99 {free['jerk_p99']:.0f}, p99.9"
        f" {free['jerk_p999']:.0f}).",
        "",
        *_table(heads, rows),
    ]


def _side_effects(run: dict[str, Any]) -> list[str]:
    rows = []
    for name, found in run["controls"].items():
        rows.append([name, *(f"{found['side_effects'][other]:+.2f}" for other in PROPERTIES)])
    return [
        "Change of each property from a request of 0.1 to one of 0.9, in distances between the 10th and the 90th"
        " percentile of true motion:",
        "",
        *_table(["control", *PROPERTIES], rows),
    ]


def _emotions(figures: dict[str, Any]) -> list[str]:
    names, truth = figures["emotions"], figures["true_emotions"]
    lines = [
        "Share of clips of eight seconds that are classified as the requested emotion; chance is"
        f" {1 / len(names):.3f}. True motion: {_with_interval(truth['accuracy'])}.",
        "",
    ]
    for run, found in figures["runs"].items():
        if "emotions" in found:
            lines += [
                f"{run}: {_with_interval(found['emotions']['accuracy'])}.{_kept(found)} Rows are requested, columns"
                " classified:",
                "",
            ]
            rows = [
                [name, *(f"{share:.2f}" for share in row), f"{truth['table'][number][number]:.2f}"]
                for number, (name, row) in enumerate(zip(names, found["emotions"]["table"], strict=True))
            ]
            lines += [*_table(["", *names, "true motion, right"], rows), ""]
    return lines


def _kept(run: dict[str, Any]) -> str:
    """Agreement with the speech with each emotion, in per cent of that of motion without controls."""
    free, found = run["free"]["agreement"]["mean"], run["emotions"].get("agreement")
    if not found:
        return ""
    changes = [100.0 * (one / free - 1.0) for one in found]
    return f" Agreement with the speech changes by {min(changes):+.0f} to {max(changes):+.0f} %."


def _with_interval(found: dict[str, Any], digits: int = 2) -> str:
    if found["low"] is None:
        return f"{found['mean']:.{digits}f} [-]"
    return f"{found['mean']:.{digits}f} [{found['low']:.{digits}f}, {found['high']:.{digits}f}]"


def _relative(found: dict[str, float], whole: float) -> str:
    mean, low, high = (100 * found[key] / whole for key in ("mean", "low", "high"))
    return f"{mean:+.0f} [{low:+.0f}, {high:+.0f}]"


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(line)} |" for line in (heads, ["---"] * len(heads), *rows)]
