"""``python -m experiments.integrity``: flips, cuts and kills, with a table of the counts. Resumable."""

import argparse
import sys
from pathlib import Path
from typing import Any

from experiments.integrity import damage, kills
from experiments.integrity.commands import make_inputs
from experiments.integrity.damage import CRASH, KINDS, NAMED, SILENT, UNNAMED

RESULTS = Path(__file__).parent / "results"


def main(arguments: list[str]) -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m experiments.integrity", description=__doc__)
    parser.add_argument("--cache", type=Path, default=Path(".cache/integrity"), help="folder for what is done so far")
    parser.add_argument("--damages", type=int, default=200, help="changes of corpora, runs and checkpoints each")
    parser.add_argument("--kills", type=int, default=100, help="SIGKILLs over all commands")
    parser.add_argument("--commands", nargs="*", default=[], help="names of those that are killed (default: all)")
    parser.add_argument("--seconds", type=float, default=900.0, help="after which no further chain of kills begins")
    parser.add_argument("--seed", type=int, default=0, help="of places and moments")
    options = parser.parse_args(arguments)
    inputs = make_inputs(options.cache / "inputs")
    found = damage.campaign(inputs, options.cache, options.damages, options.seed)
    rows = kills.campaign(inputs, options.cache, options.kills, options.seed, options.seconds, tuple(options.commands))
    text = table(found, rows, options.seed)
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "integrity.md").write_text(text, encoding="utf-8")
    print(text)


def table(found: dict[str, dict[str, dict[str, int]]], rows: list[dict[str, Any]], seed: int) -> str:
    """The counts as Markdown."""
    outcomes = (NAMED, UNNAMED, SILENT, CRASH)
    lines = [
        f"Random changes of one file each (seed {seed}): a bit, a block of up to 4096 zeros, or a cut.",
        "",
        "| | changes | " + " | ".join(outcomes) + " |",
        "|" + " --- |" * (len(outcomes) + 2),
    ]
    for subject, kinds in found.items():
        for kind in KINDS:
            counts = kinds[kind]
            cells = " | ".join(str(counts.get(outcome, 0)) for outcome in outcomes)
            lines.append(f"| {subject}, {kind} | {sum(counts.values())} | {cells} |")
    if not rows:
        return "\n".join([*lines, ""])
    lines += [
        "",
        "SIGKILL at random moments; the same command is repeated until it finishes, and its files are compared with"
        " those of a command that was not killed.",
        "",
        "| command | kills | finished | same result | checkpoints lost | left behind | faults |",
        "|" + " --- |" * 7,
    ]
    for name in dict.fromkeys(row["command"] for row in rows):
        own = [row for row in rows if row["command"] == name]
        cells = (
            sum(row["kills"] for row in own),
            len(own),
            sum(row["same result"] for row in own),
            sum(row["checkpoints lost"] for row in own),
            sum(len(row["left behind"]) for row in own),
            sum(len(row["faults"]) for row in own),
        )
        lines.append(f"| {name} | " + " | ".join(map(str, cells)) + " |")
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    main(sys.argv[1:])
