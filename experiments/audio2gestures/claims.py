"""Claims about the method, checked on runs of Table 2 with several seeds; writes one page.

    python -m experiments.audio2gestures.table2 --corpus CORPUS --features RUN
    python -m experiments.audio2gestures.long --corpus CORPUS --features RUN --steps 3000
    python -m experiments.audio2gestures.codes --corpus CORPUS RUN [RUN ...]
    python -m experiments.audio2gestures.claims

Multimodality compared with the truth's, agreement of the wrists' speed with the speech compared with delayed audio, and
the content of the two codes when they are exchanged between motions.
"""

import json
from typing import Any

from experiments.tables.records import current, results

BASELINE, FULL = "baseline", "+ diversity loss"
#: Rows that show which losses keep the shared code informative.
RHYTHM_ROWS = (
    "baseline",
    "+ diversity loss",
    "full, authors' losses on samples",
    "full, no loss on samples",
)


def of(variant: str, steps: int) -> list[dict[str, Any]]:
    """Records of a row of Table 2."""
    return [
        record
        for record in current("audio2gestures/table2")
        if record["variant"] == variant and record["steps"] == steps
    ]


def rhythm_cells(record: dict[str, Any]) -> str:
    """Agreement with its own audio and with delayed audio, with intervals over clips."""
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
    """Return the page as Markdown."""
    steps = max(
        (record["steps"] for record in current("audio2gestures/table2") if record["variant"] == FULL), default=0
    )
    truth = next(
        (
            record["scores"]["multimodality"]["mean"]
            for record in current("audio2gestures/table2")
            if record["variant"] == "another right motion"
        ),
        None,
    )
    lines = [f"# Claims on the generated corpus ({steps} steps a run)", "", "## Multimodality, cm", ""]
    lines += ["| row | seed | multimodality | share of the truth's |", "| --- | --- | --- | --- |"]
    for name in (BASELINE, FULL):
        for record in of(name, steps):
            value = record["scores"]["multimodality"]["mean"]
            share = "-" if truth is None else f"{value / truth:.2f}"
            lines.append(f"| {name} | {record['seed']} | {value:.2f} | {share} |")
    if truth is not None:
        lines += ["", f"Other true motions for the same speech: {truth:.2f} cm."]
    lines += ["", "## Rhythm: agreement of the wrists' speed peaks with the speech's energy peaks", ""]
    lines += ["| row | seed | its own audio | the best of audio delayed by 1, 2, 5 s | intervals |", "|" + " --- |" * 5]
    for name in RHYTHM_ROWS:
        for record in of(name, steps):
            if record.get("audit"):
                lines.append(f"| {name} | {record['seed']} | {rhythm_cells(record)} |")
    for record in current("audio2gestures/long"):
        if record.get("audit"):
            title = f"{record['variant']}, {record['steps']} steps"
            lines.append(f"| {title} | {record['seed']} | {rhythm_cells(record)} |")
    path = results("audio2gestures") / "codes.json"
    if path.exists():
        lines += ["", "## Codes exchanged between two motions", ""]
        found = json.loads(path.read_text(encoding="utf-8"))["runs"]
        lines += ["S_M of one, I_M of the other:", "", *_exchanged(found, "", "S's", "I's")]
        lines += ["", "S_A of one's speech, I_M of the other:", "", *_exchanged(found, "audio_", "the speech's", "I's")]
        lines += ["", "The same with an I_R of the mapping net, of noise with the other's mean and deviation:"]
        lines += ["", *_exchanged(found, "drawn_", "the speech's", "I's")]
    return "\n".join(lines) + "\n"


def _exchanged(runs: dict[str, Any], kind: str, first: str, second: str) -> list[str]:
    """Rows with the origin of the hand and of the strokes."""
    keys = ("hand_follows_specific", "strokes_follow_shared", "strokes_follow_specific", "strokes_of_a_stranger")
    head = f"| run | pairs | the hand is {second} | strokes are {first} | strokes are {second} | an unrelated clip's |"
    lines = [head, "|" + " --- |" * 6]
    for name, found in runs.items():
        if kind + keys[0] not in found:
            continue
        values = [found[kind + key] for key in keys]
        ends = ["-" if one["low"] is None else f"{one['low']:.2f}, {one['high']:.2f}" for one in values]
        cells = [f"{one['mean']:.2f} [{end}]" for one, end in zip(values, ends, strict=True)]
        lines.append(f"| {name} | {found['pairs']} | {' | '.join(cells)} |")
    return lines


if __name__ == "__main__":
    text = page()
    (results("audio2gestures") / "claims.md").write_text(text, encoding="utf-8")
    print(text)
