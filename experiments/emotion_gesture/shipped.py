"""Requested emotions of a run, such as the included one, as a classifier of other recordings sees them.

    python -m experiments.emotion_gesture.shipped demo-emotion --corpus CORPUS --judge JUDGE

Six test speeches of the corpus in every emotion, two samples each, 30 s, without a seed clip. The judge is a run of
``emotion_classifier --input motion --clip-frames 50``, trained on recordings that the corpus does not have. Writes
``results/shipped.md`` and ``results/shipped.json``: about a minute of one core.
"""

import argparse
from pathlib import Path
from typing import Any

from a2g_jax.data.corpus import Corpus
from a2g_jax.evaluation.emotion_judge import load_emotion_judge
from a2g_jax.io.files import atomic_path, write_json
from a2g_jax.training.run import open_run
from experiments.emotion_gesture.bench import Bench
from experiments.emotion_gesture.requests import requested, true_emotions
from experiments.tables.runs import Ruler

RESULTS = Path(__file__).parent / "results"


def main() -> None:
    """Measure and write both files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="a run folder, or 'demo-emotion'")
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--judge", type=Path, required=True, help="a run of emotion_classifier")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args()
    corpus = Corpus.open(options.corpus)
    bench = Bench(Ruler(corpus, None, 2, judge=load_emotion_judge(options.judge, corpus)))
    found = {
        "emotions": list(bench.ruler.judge.emotions) if bench.ruler.judge else [],
        "seed": options.seed,
        options.run: requested(open_run(options.run), bench, options.seed),
        "true motion": true_emotions(bench),
    }
    options.out.mkdir(parents=True, exist_ok=True)
    write_json(options.out / "shipped.json", found)
    with atomic_path(options.out / "shipped.md") as path:
        path.write_text(page(found, options.run), encoding="utf-8")
    print(page(found, options.run))


def page(found: dict[str, Any], run: str) -> str:
    """The tables as Markdown."""
    names = found["emotions"]
    lines = ["# Requested emotions", "", f"Made by `python -m experiments.emotion_gesture.shipped {run}`.", ""]
    for label in (run, "true motion"):
        scores, counts = found[label]["scores"], found[label]["requests"]
        lines += [
            f"## {label}",
            "",
            f"Classified as requested: **{scores['requested_accuracy']['mean']:.2f}** (chance {1 / len(names):.3f});"
            f" where the speech has another emotion: {scores['requested_other_accuracy']['mean']:.2f}.",
            "",
            f"| requested | {' | '.join(names)} | above neutral |",
            f"|{' --- |' * (len(names) + 2)}",
        ]
        for name, row in zip(names, counts, strict=True):
            above = scores.get(f"above_neutral {name}")
            shares = " | ".join(f"{count / max(1, sum(row)):.2f}" for count in row)
            lines.append(f"| {name} | {shares} | {'' if above is None else format(above['mean'], '.2f')} |")
        lines.append("")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
