"""The table as Markdown: statistics by rows, targets marked."""

from collections.abc import Mapping, Sequence
from typing import Any

from experiments.motion.statistics import STATISTICS
from experiments.motion.targets import RIGHT, TARGETS, TRUTH, Rows, check

MET, MISSED = "✓", "✗"


def render(about: Mapping[str, Any], rows: Rows, references: Mapping[str, Rows]) -> str:
    """The page.

    Args:
        about: conditions of the measurement, and the ``default`` by rule.
        rows: statistics of every row by name.
        references: truth and right motions that a row is compared with, by the row's name.
    """
    judged = [name for name, reference in references.items() if reference]
    met = {name: check(rows[name], references[name]) for name in judged}
    lines = ["# Motion that is alive", "", *_conditions(about), ""]
    lines += ["| | target | " + " | ".join(rows) + " |", "|" + " --- |" * (len(rows) + 2)]
    for key, statistic in STATISTICS.items():
        if not any(key in row for row in rows.values()):
            continue
        unit = f", {statistic.unit}" if statistic.unit else ""
        target = TARGETS[key].describe() if key in TARGETS else "listens" if key == "listening" else ""
        cells = [_cell(key, row, met.get(name, {})) for name, row in rows.items()]
        lines.append(f"| {statistic.title}{unit} | {target} | {' | '.join(cells)} |")
    counts = [f"{sum(met[name].values())} of {len(met[name])}" if name in met else "" for name in rows]
    lines += [f"| **targets met** | | {' | '.join(counts)} |", ""]
    if about.get("default"):
        lines += [f"The default by rule (most must-haves, then most targets, then FGD): **{about['default']}**.", ""]
    lines += [f"- {name}: misses {', '.join(STATISTICS[key].title for key, hit in met[name].items() if not hit)}"
              for name in judged if "listening" in rows[name] and not all(met[name].values())]  # fmt: skip
    lines += ["", *_notes(rows), *_definitions(rows), ""]
    return "\n".join(lines + _intervals(rows, about.get("intervals", "bootstrap; FGD: jackknife")))


def _conditions(about: Mapping[str, Any]) -> list[str]:
    text = (
        f"{about['speeches']} held-out speeches of generated talk, {about['minutes']:.1f} minutes ({about['source']}),"
        f" no seed poses, every motion at {about['fps']:g} fps; {about['samples']} samples; FGD on {about['vectors']}"
        f" vectors for each motion, feature network {about['network']}."
    )
    return [text, "", f"Made by `{about['command']}` in {about['seconds']:.0f} s on {about['cores']}."]


def _cell(key: str, row: Mapping[str, Any], met: Mapping[str, bool]) -> str:
    found = row.get(key)
    if found is None:
        return "-"
    mark = f" {MET if met[key] else MISSED}" if key in met else ""
    if key == "listening":
        return f"{'; '.join(found.get('verdicts', [found.get('skipped', '-')]))}{mark}"
    if found["value"] is None:
        return "-"
    return f"{number(key, found['value'])}{mark}"


def number(key: str, value: float) -> str:
    """A value with the digits of its statistic."""
    text = f"{value:.{STATISTICS[key].digits}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def _notes(rows: Rows) -> list[str]:
    return [f"- {name}: {row['note']}" for name, row in rows.items() if "note" in row]


def _definitions(rows: Rows) -> list[str]:
    shown = [key for key in STATISTICS if any(key in row for row in rows.values())]
    return [
        "",
        f"Targets are relative to the {TRUTH}, or to {RIGHT} (the talker draws another valid motion for the same"
        " audio).",
        "",
        "FGD is as good as its network: compare with `--features experiments/features/talker_20fps`, at 20 fps and on"
        " exponential maps. On the 6D network, the flow of 0.2.0 was 400 to 500 from the truth, on the other 12; with"
        " the truth's left elbow in its place, the former fell from 394 to 93.",
        "",
        "Definitions:",
        "",
        *(f"- **{STATISTICS[key].title}**: {STATISTICS[key].definition}." for key in shown),
    ]


def _intervals(rows: Rows, kind: str) -> list[str]:
    lines = [f"95 % intervals over speeches ({kind}):", "", "| | " + " | ".join(rows) + " |"]
    lines.append("|" + " --- |" * (len(rows) + 1))
    for key, statistic in STATISTICS.items():
        cells = [_ends(key, row.get(key)) for row in rows.values()]
        if any(cell != "-" for cell in cells):
            lines.append(f"| {statistic.title} | {' | '.join(cells)} |")
    return [*lines, ""]


def _ends(key: str, found: Mapping[str, Any] | None) -> str:
    if not found or found.get("low") is None:
        return "-"
    return f"{number(key, found['low'])} to {number(key, found['high'])}"


def real_section(takes: Mapping[str, Mapping[str, Any]], skipped: str) -> str:
    """The same statistics on real speech, one table for each take.

    Args:
        takes: by name: ``seconds`` and ``rows``.
        skipped: why there are none; empty where there are some.
    """
    lines = ["## Real speech", ""]
    if skipped:
        return "\n".join([*lines, f"Skipped: {skipped}", ""])
    lines += [
        "The person's own motion is retargeted to the talker's body. Intervals in the JSON are over samples. Agreement"
        " is above the shifted null where the mean over samples exceeds the null's mean by two of its standard errors"
        " (standard deviation over shifts / root of the number of samples).",
        "",
    ]
    for name, take in takes.items():
        rows: Rows = take["rows"]
        lines += [f"### {name}, {take['seconds']:.0f} s", "", "| | " + " | ".join(rows) + " |"]
        lines.append("|" + " --- |" * (len(rows) + 1))
        for key, statistic in STATISTICS.items():
            cells = [_cell(key, row, {}) for row in rows.values()]
            if any(cell != "-" for cell in cells):
                unit = f", {statistic.unit}" if statistic.unit else ""
                lines.append(f"| {statistic.title}{unit} | {' | '.join(cells)} |")
        above = [_above(row.get("above_null")) for row in rows.values()]
        lines += [f"| above the shifted null | {' | '.join(above)} |", ""]
    return "\n".join(lines)


def _above(found: Mapping[str, Any] | None) -> str:
    if found is None:
        return "-"
    count = f"{found['samples_above']} of {found['samples']}"
    return f"{MET if found['above'] else MISSED} {found['z']:.1f} standard errors, {count}"


def rows_in_order(rows: Rows, names: Sequence[str]) -> dict[str, Mapping[str, Any]]:
    """The rows of these names, in their order."""
    return {name: rows[name] for name in names if name in rows}
