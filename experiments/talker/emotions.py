"""Classification of emotions and speakers from audio alone and from motion alone.

    python -m experiments.talker.emotions [--repeats 6] [--seconds 20] [--seed 0]

One row of summary statistics a recording (audio at one level, every other one in a room), logistic regression and a
random forest, cross-validated by recording.
"""

import argparse
import warnings
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from sklearn.ensemble import RandomForestClassifier
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import StratifiedKFold, cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from a2g_jax.talker.emotions import VOICE_EMOTIONS
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from experiments.talker import movement, sound
from experiments.talker.common import Part, cast_evenly, parallel, run_part, table, wilson

FOLDS = 5
LABELS = {"emotion": tuple(VOICE_EMOTIONS), "speaker": tuple(SPEAKERS)}
MODELS = ("logistic", "forest")


def features(role: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Statistics of audio and of motion of one recording."""
    take = talk(**role)
    return sound.statistics(sound.analyse(take.audio, take.sample_rate)), movement.statistics(take.motion)


def model(name: str, seed: int) -> Any:
    """A logistic regression on standardised features, or 300 trees."""
    if name == "forest":
        return RandomForestClassifier(300, min_samples_leaf=2, random_state=seed)
    return make_pipeline(StandardScaler(), LogisticRegression(C=0.1, max_iter=2000))


def judge(rows: np.ndarray, labels: np.ndarray, classes: tuple[str, ...], name: str, seed: int) -> dict[str, Any]:
    """Cross-validated accuracy with its interval, and counts of (true, predicted)."""
    folds = StratifiedKFold(FOLDS, shuffle=True, random_state=seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        guesses = cross_val_predict(model(name, seed), rows, labels, cv=folds)
        shuffled = np.random.default_rng([seed, 51]).permutation(labels)
        blind = cross_val_predict(model("logistic", seed), rows, shuffled, cv=folds)
    counts = [[int(np.sum((labels == a) & (guesses == b))) for b in classes] for a in classes]
    hits = int(np.sum(guesses == labels))
    recall = {a: row[i] / max(sum(row), 1) for i, (a, row) in enumerate(zip(classes, counts, strict=True))}
    return {
        "accuracy": hits / len(labels),
        "interval": wilson(hits, len(labels)),
        "chance": 1 / len(classes),
        "shuffled_labels": float(np.mean(blind == shuffled)),
        "recall": recall,
        "confusion": counts,
        "n": len(labels),
    }


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the number and length of recordings."""
    parser.add_argument("--repeats", type=int, default=6, help="recordings of every speaker in every emotion")
    parser.add_argument("--seconds", type=float, default=20.0)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Emotions and speakers from audio and from motion."""
    roles = cast_evenly(options.repeats, options.seconds, options.seed)
    audio, motion = (np.stack(part) for part in zip(*parallel(features, roles, options.workers), strict=True))
    cells = [(what, sense, name) for what in LABELS for sense in ("audio", "motion") for name in MODELS]
    data = {"audio": audio, "motion": motion}
    truth = {what: np.array([role[what] for role in roles]) for what in LABELS}
    tasks = [(data[sense], truth[what], LABELS[what], name) for what, sense, name in cells]
    results = parallel(partial(_judge_task, seed=options.seed), tasks, options.workers)
    return {
        "recordings": len(roles),
        "seconds": options.seconds,
        "features": {sense: rows.shape[1] for sense, rows in data.items()},
        "folds": FOLDS,
        "classes": LABELS,
        **{"/".join(cell): result for cell, result in zip(cells, results, strict=True)},
    }


def _judge_task(task: tuple[np.ndarray, np.ndarray, tuple[str, ...], str], seed: int) -> dict[str, Any]:
    return judge(*task, seed)


def tables(result: dict[str, Any]) -> str:
    """Accuracies, then recall by class of the better classifier."""
    rows, recalls = [], []
    for what in LABELS:
        for sense in ("audio", "motion"):
            scores = [result[f"{what}/{sense}/{name}"] for name in MODELS]
            for name, score in zip(MODELS, scores, strict=True):
                cells = (score[key] for key in ("accuracy", "interval", "chance", "shuffled_labels"))
                rows.append([f"{what} from {sense}", name, *cells])
            best = max(scores, key=lambda score: score["accuracy"])
            shares = ", ".join(f"{key} {value:.2f}" for key, value in best["recall"].items())
            recalls.append(f"- {what} from {sense}, recall by class (better classifier): {shares}")
    size = f"{result['recordings']} recordings of {result['seconds']:g} s; {result['folds']}-fold by recording; "
    size += f"{result['features']['audio']} features of the audio, {result['features']['motion']} of the motion."
    headings = ["", "classifier", "accuracy", "95 % interval", "chance", "labels shuffled"]
    return f"{size}\n\n{table(rows, headings)}\n" + "\n".join(recalls) + "\n"


def picture(result: dict[str, Any], path: Path) -> None:
    """Four confusion matrices of the better classifier."""
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(8.6, 8.0), layout="constrained")
    for row, what in zip(axes, LABELS, strict=True):
        for panel, sense in zip(row, ("audio", "motion"), strict=True):
            best = max((result[f"{what}/{sense}/{name}"] for name in MODELS), key=lambda score: score["accuracy"])
            counts = np.array(best["confusion"], float)
            shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
            panel.imshow(shares, cmap="Blues", vmin=0, vmax=1)
            names = LABELS[what]
            panel.set_xticks(range(len(names)), names, rotation=45, ha="right", fontsize=8)
            panel.set_yticks(range(len(names)), names, fontsize=8)
            for i, j in np.ndindex(shares.shape):
                if shares[i, j] >= 0.005:
                    colour = "white" if shares[i, j] > 0.6 else "black"
                    text = f"{100 * shares[i, j]:.0f}"
                    panel.text(j, i, text, ha="center", va="center", fontsize=7, color=colour)
            panel.set_title(f"{what} from {sense}: {100 * best['accuracy']:.0f} %", fontsize=10)
            panel.set(xlabel="taken for", ylabel="is")
    figure.savefig(path, dpi=90)
    plt.close(figure)


PART = Part("emotions", "Emotions and speakers from audio and from motion", add_arguments, run, tables, picture)

if __name__ == "__main__":
    run_part(PART)
