"""Requested emotions of several trainings of one preset: what depends on the seed of the training.

    python -m experiments.emotion_gesture.shipped RUN_seed0 --corpus CORPUS --judge JUDGE --out judged0   # for each
    python -m experiments.emotion_gesture.trainings judged0 judged1 judged2

Writes ``results/trainings.md`` and ``results/trainings.json``; intervals are over trainings (Student's t).
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from a2g_jax.io.files import atomic_path, read_json, write_json
from experiments.emotion_gesture.shipped import RESULTS
from experiments.tables.claims import interval

TRUTH = "true motion"


def main() -> None:
    """Read what was judged, and write both files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("judged", nargs="+", type=Path, help="folders of experiments.emotion_gesture.shipped")
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args()
    found = [scores_of(read_json(folder / "shipped.json")) for folder in options.judged]
    truth = scores_of(read_json(options.judged[0] / "shipped.json"), TRUTH)
    write_json(options.out / "trainings.json", {"trainings": found, TRUTH: truth})
    with atomic_path(options.out / "trainings.md") as path:
        path.write_text(page(found, truth), encoding="utf-8")
    print(page(found, truth))


def scores_of(judged: Mapping[str, Any], label: str | None = None) -> dict[str, float]:
    """Mean scores of the run that was judged, or of the true motion."""
    name = label or next(name for name in judged if name not in ("emotions", "seeds", TRUTH))
    return {key: float(score["mean"]) for key, score in judged[name]["scores"].items()}


def page(found: Sequence[Mapping[str, float]], truth: Mapping[str, float]) -> str:
    """The table as Markdown."""
    numbers = [str(number) for number in range(len(found))]
    lines = [
        "# Requested emotions of several trainings",
        "",
        "Made by `python -m experiments.emotion_gesture.trainings`: one preset and corpus, other seeds of training."
        " Shares of clips that the classifier finds as requested, or more probable than neutral.",
        "",
        f"| | {' | '.join(f'training {number}' for number in numbers)} | mean, 95 % interval | true motion |",
        f"|{' --- |' * (len(numbers) + 3)}",
    ]
    for key in found[0]:
        values = [one[key] for one in found]
        between = interval(values)
        assert between is not None
        mean, half, _ = between
        cells = [
            *(f"{value:.2f}" for value in values),
            f"{mean:.2f} ± {half:.2f}",
            f"{truth.get(key, float('nan')):.2f}",
        ]
        lines.append(f"| {key.replace('_', ' ')} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
