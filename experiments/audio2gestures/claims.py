"""What the method is said to do, checked on runs of Table 2 with several seeds and put on one page.

    python -m experiments.audio2gestures.table2 --corpus CORPUS --features RUN
    python -m experiments.audio2gestures.long --corpus CORPUS --features RUN --steps 3000
    python -m experiments.audio2gestures.codes --corpus CORPUS RUN [RUN ...]
    python -m experiments.audio2gestures.claims

Multimodality beside the generator's own, agreement of the wrists' speed with the speech beside audio that comes late,
and what the two codes carry when they are exchanged between motions.
"""

import json
from typing import Any

from experiments.tables.records import records, results

BASELINE, FULL = "baseline", "+ diversity loss"
#: Rows that show what keeps the shared code alive.
LISTENING = (
    "baseline",
    "+ diversity loss",
    "full, paper's losses on samples",
    "full, no loss on samples",
)


def of(variant: str, steps: int) -> list[dict[str, Any]]:
    """Records of a row of Table 2."""
    return [
        record
        for record in records("audio2gestures/table2")
        if record["variant"] == variant and record["steps"] == steps
    ]


def listening(record: dict[str, Any]) -> str:
    """Agreement with its own audio and with audio that comes late, with intervals over clips."""
    found = record["audit"]["conditions"]
    own, late = found["true audio"], [value for name, value in found.items() if name.endswith("late")]
    highest = max(late, key=lambda value: value["agreement"])
    apart = own["agreement_interval"][0] > max(value["agreement_interval"][1] for value in late)
    return (
        f"{own['agreement']:.3f} {_interval(own)} | {highest['agreement']:.3f} {_interval(highest)} |"
        f" {'apart' if apart else 'not apart'}"
    )


def _interval(value: dict[str, Any]) -> str:
    low, high = value["agreement_interval"]
    return f"[{low:.3f}, {high:.3f}]"


def page() -> str:
    """Markdown."""
    steps = max(
        (record["steps"] for record in records("audio2gestures/table2") if record["variant"] == FULL), default=0
    )
    truth = next(
        (
            record["scores"]["multimodality"]["mean"]
            for record in records("audio2gestures/table2")
            if record["variant"] == "another right motion"
        ),
        None,
    )
    lines = [f"# What the method does on the generated corpus ({steps} steps a run)", "", "## Multimodality, cm", ""]
    lines += ["| row | seed | multimodality | share of the truth's |", "| --- | --- | --- | --- |"]
    for name in (BASELINE, FULL):
        for record in of(name, steps):
            value = record["scores"]["multimodality"]["mean"]
            share = "-" if truth is None else f"{value / truth:.2f}"
            lines.append(f"| {name} | {record['seed']} | {value:.2f} | {share} |")
    if truth is not None:
        lines += ["", f"True motions drawn again for the same speech: {truth:.2f} cm."]
    lines += ["", "## Rhythm: agreement of the wrists' speed peaks with the speech's energy peaks", ""]
    lines += ["| row | seed | its own audio | the best of audio 1, 2, 5 s late | intervals |", "|" + " --- |" * 5]
    for name in LISTENING:
        for record in of(name, steps):
            if record.get("audit"):
                lines.append(f"| {name} | {record['seed']} | {listening(record)} |")
    for record in records("audio2gestures/long"):
        if record.get("audit"):
            title = f"{record['variant']}, {record['steps']} steps"
            lines.append(f"| {title} | {record['seed']} | {listening(record)} |")
    path = results("audio2gestures") / "codes.json"
    if path.exists():
        lines += ["", "## Codes exchanged between two motions", ""]
        lines += ["| run | pairs | the hand is I's | strokes are S's | strokes are I's | a stranger's |"]
        lines += ["|" + " --- |" * 6]
        for name, found in json.loads(path.read_text(encoding="utf-8"))["runs"].items():
            keys = (
                "hand_follows_specific",
                "strokes_follow_shared",
                "strokes_follow_specific",
                "strokes_of_a_stranger",
            )
            cells = [f"{found[key]['mean']:.2f} [{found[key]['low']:.2f}, {found[key]['high']:.2f}]" for key in keys]
            lines.append(f"| {name} | {found['pairs']} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    text = page()
    (results("audio2gestures") / "claims.md").write_text(text, encoding="utf-8")
    print(text)
