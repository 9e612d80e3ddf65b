"""The figures of pinned clips as Markdown."""

from typing import Any

_COLUMNS = (
    "run",
    "clips of",
    "pins (refused)",
    "wrists from the clip, cm (worst)",
    "unpinned",
    "transitions, s",
    "jerk below the limit",
    "recorded motion below it",
    "hands within 1.5 times the clip's top speed",
    "or the unpinned sample's",
    "rough",
    "largest turn, degrees a frame",
    "feet that stand, mm/s",
)


def markdown(figures: dict[str, Any]) -> str:
    """The tables, with the command that makes them."""
    lines = [
        "# Clips pinned in samples of the shipped runs",
        "",
        f"`python -m experiments.pins`, seed {figures['seed']}. Clips of 1 to 3 s at random moments of 12 s of speech."
        f" Limit of jerk: {figures['jerk_limit']:.0f} m/s3, the 99th percentile of the wrists in generated talk. Shares"
        " with 95 % intervals over pins.",
        "",
        f"| {' | '.join(_COLUMNS)} |",
        "|" + "---|" * len(_COLUMNS),
    ]
    for name, run in figures["runs"].items():
        for source, row in run["sources"].items():
            cells = [
                name,
                source,
                f"{row['pins']} ({len(row['refused'])})",
                f"{row['wrist_error_cm']['mean']:.2f} ({row['wrist_worst_cm']:.2f})",
                f"{row['unpinned_wrist_error_cm']['mean']:.1f}",
                f"{row['transition_s']['mean']:.2f}",
                *(_share(row[key]) for key in ("smooth", "smooth_recorded", "within_speed", "within_speed_of_both")),
                _share(row["rough"]),
                f"{row['largest_turn']:.0f}",
                f"{row['slide_mm_s']['mean']:.1f}",
            ]
            lines.append(f"| {' | '.join(cells)} |")
    lines += ["", "## Clips and places made absurd on purpose", ""]
    for name, run in figures["runs"].items():
        lines += [
            f"On `{name}`:",
            "",
            "| clip | outcome | message | largest turn, degrees a frame | fastest hand, m/s |",
            "|---|---|---|---|---|",
        ]
        for row in run["absurd"]:
            outcome = row["outcome"] + (", rough" if row.get("rough") else "")
            numbers = [f"{row['turn']:.0f}", f"{row['speed']:.1f}"] if "turn" in row else ["", ""]
            lines.append(f"| {' | '.join([row['case'], outcome, row['message'], *numbers])} |")
        lines.append("")
    refused = {text for run in figures["runs"].values() for row in run["sources"].values() for text in row["refused"]}
    if refused:
        lines += ["Clips of takes that were refused:", "", *(f"- {text}" for text in sorted(refused)), ""]
    return "\n".join(lines)


def _share(value: dict[str, Any]) -> str:
    if value["low"] is None:
        return f"{value['mean']:.0%} (-)".replace("%", " %")
    return f"{value['mean']:.0%} ({value['low']:.0%} to {value['high']:.0%})".replace("%", " %")
