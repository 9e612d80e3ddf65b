"""Requested emotions of a run, such as the included one, as a classifier of other recordings sees them.

    python -m experiments.emotion_gesture.shipped demo-emotion --corpus CORPUS --judge JUDGE

Six test speeches of the corpus in every emotion by ``--control emotion=X``, two samples each for every seed, 30 s,
without a seed clip; intervals are over speeches. The judge is a run of
``emotion_classifier --input motion --clip-frames 50``, trained on recordings that the corpus does not have. Writes
``results/shipped.md`` and ``results/shipped.json``: about a minute of one core for each seed.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.evaluation.emotion_judge import load_emotion_judge
from a2g_jax.io.files import atomic_path, write_json
from a2g_jax.metrics.intervals import mean_interval
from a2g_jax.training.run import open_run
from experiments.emotion_gesture.bench import Bench
from experiments.emotion_gesture.requests import requested, true_emotions
from experiments.tables.ruler import Ruler

RESULTS = Path(__file__).parent / "results"


def main() -> None:
    """Measure and write both files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="a run folder, or 'demo-emotion'")
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--judge", type=Path, required=True, help="a run of emotion_classifier")
    parser.add_argument("--seeds", default="0,1,2", help="comma-separated (default: %(default)s)")
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args()
    corpus = Corpus.open(options.corpus)
    bench = Bench(Ruler(corpus, None, 2, judge=load_emotion_judge(options.judge, corpus)))
    seeds, run = list(map(int, options.seeds.split(","))), open_run(options.run)
    found = {
        "emotions": list(bench.ruler.judge.emotions) if bench.ruler.judge else [],
        "seeds": seeds,
        options.run: together([requested(run, bench, seed, control=True) for seed in seeds]),
        "true motion": together([true_emotions(bench)]),
    }
    options.out.mkdir(parents=True, exist_ok=True)
    write_json(options.out / "shipped.json", found)
    with atomic_path(options.out / "shipped.md") as path:
        path.write_text(page(found, options.run), encoding="utf-8")
    print(page(found, options.run))


def together(each: list[dict[str, Any]]) -> dict[str, Any]:
    """Requests of several seeds: scores on average, counts in all, and the interval of the accuracy over speeches."""
    names = each[0]["scores"]
    scores = {name: {"mean": float(np.mean([one["scores"][name]["mean"] for one in each]))} for name in names}
    found = {
        "scores": scores,
        "by_seed": [one["scores"]["requested_accuracy"]["mean"] for one in each],
        "requests": np.sum([one["requests"] for one in each], axis=0).tolist(),
    }
    if "by_speech" in each[0]:
        found["interval"] = mean_interval(np.mean([one["by_speech"] for one in each], axis=0)).to_json()
    return found


def page(found: dict[str, Any], run: str) -> str:
    """The tables as Markdown."""
    names = found["emotions"]
    lines = ["# Requested emotions", "", f"Made by `python -m experiments.emotion_gesture.shipped {run}`.", ""]
    for label in (run, "true motion"):
        scores, counts = found[label]["scores"], found[label]["requests"]
        between = found[label].get("interval")
        ends = f" [{between['low']:.2f}, {between['high']:.2f}] over speeches" if between else ""
        if len(found[label]["by_seed"]) > 1:
            ends += f"; by seed {', '.join(format(one, '.2f') for one in found[label]['by_seed'])}"
        lines += [
            f"## {label}",
            "",
            f"Classified as requested: **{scores['requested_accuracy']['mean']:.2f}**{ends}"
            f" (chance {1 / len(names):.3f});"
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
