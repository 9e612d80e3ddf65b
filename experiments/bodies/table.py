"""The results of the experiment as Markdown."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

_COLUMNS = ("samples", "at_once", "eased", "drawn_again", "reported", "outside", "unreported")
#: Most lines of refusals and reports that are listed.
_MOST = 25


def render(found: Mapping[str, Any]) -> str:
    """Tables and lists of the records in ``bodies.json``."""
    rows = found["cases"]
    done = [row for row in rows if row["status"] == 0]
    total = sum(row["samples"] for row in done)
    every = found.get("every", 1)
    command = "python -m experiments.bodies" + (f" --every {every}" if every > 1 else "")
    lines = [
        "# No broken body leaves the house",
        "",
        f"`{command}`: {len(rows)} calls of `a2g generate`, {total} motions. Every motion is checked"
        " against the bounds of the run's training motion; joints that are bent or turned too far are eased back, and"
        " what is still outside is drawn again, then reported. A second implementation of the bounds judged the files:"
        f" **{sum(row['unreported'] for row in done)} frames outside the bounds were not reported.**",
        "",
        "| run | options | refused calls | motions | good at once | eased back | drawn again | reported"
        " | frames outside | not reported |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for run in found["runs"]:
        for group in dict.fromkeys(row["group"] for row in rows):
            if own := [row for row in rows if (row["run"], row["group"]) == (run, group)]:
                lines.append(_row(run, group, own))
    lines.append(_row("all", "", rows))
    lines += ["", "Samples that were drawn again are also among those that are good after easing, or reported."]
    lines += ["", "Figures outside the bounds in first draws (findings):", ""]
    for run in found["runs"]:
        before: Counter[str] = Counter()
        for row in done:
            if row["run"] == run:
                before.update(row["before"])
        most = ", ".join(f"{name} {count}" for name, count in before.most_common(12)) or "none"
        lines.append(f"- {run}: {most}")
    lines += ["", "## Reported", "", *_some(f"{row['case']}: {line}" for row in done for line in row["lines"])]
    lines += ["", "## Refused", "", *_some(f"{row['case']}: {row['refused']}" for row in rows if row["status"] != 0)]
    lines += ["", "## Motion that is not generated", ""]
    for run, truth in found["truth"].items():
        listed = f" ({'; '.join(truth['findings'])})" if truth["findings"] else ""
        count = len(truth["findings"])
        lines.append(f"- held-out talk, bounds of {run}: {count} findings in {truth['frames']} frames{listed}")
    for run, people in found["people"].items():
        for name, one in people.items():
            most = ", ".join(f"{figure} {count}" for figure, count in list(one["findings"].items())[:8]) or "none"
            lines.append(f"- {name} (on the body of {run}): {one['outside']} of {one['frames']} frames outside; {most}")
    lines += ["", "## Cost", ""]
    for run, cost in found["cost"].items():
        share = 100.0 * cost["check"] / cost["generate"]
        lines.append(
            f"- {run}: {1000 * cost['generate']:.0f} ms to generate one sample of 12 s, {1000 * cost['check']:.1f} ms"
            f" to check it ({share:.0f} %)"
        )
    return "\n".join(lines) + "\n"


def _row(run: str, group: str, rows: list[Mapping[str, Any]]) -> str:
    done = [row for row in rows if row["status"] == 0]
    sums = [sum(row[name] for row in done) for name in _COLUMNS]
    return f"| {run} | {group} | {len(rows) - len(done)} | " + " | ".join(str(value) for value in sums) + " |"


def _some(lines: Iterable[str]) -> list[str]:
    kept = [f"- {line}" for line in lines]
    rest = [f"- and {len(kept) - _MOST} more in `bodies.json`"] if len(kept) > _MOST else []
    return [*kept[:_MOST], *rest] or ["None."]
