"""Table I: classifiers of emotions in audio and in gestures, on held-out recordings.

    python -m experiments.emotion_gesture.table1 --corpus CORPUS [--budget MINUTES]

Also draws ``results/table1.png``, the confusion matrices of all seeds together. Without a corpus the table is rendered
from the existing records.
"""

from typing import Any

import numpy as np

from a2g_jax.evaluation.confusion import classify_split
from a2g_jax.training.run import Run
from experiments.emotion_gesture.page import render
from experiments.emotion_gesture.scores import cell
from experiments.emotion_gesture.table import Table, parser, setting_of
from experiments.tables.records import current, path_of
from experiments.tables.ruler import Ruler
from experiments.tables.runs import run_table
from experiments.tables.setting import Variant

AUDIO, GESTURE = "audio", "gesture"
#: Clips of a batch, as by ``a2g train emotion_classifier`` with ``--batch-size 32``.
_TRAINING = {"batch_size": 32}

VARIANTS = {
    AUDIO: Variant({"input": "audio"}, model="emotion_classifier", training=_TRAINING),
    GESTURE: Variant({"input": "motion"}, model="emotion_classifier", training=_TRAINING),
}
EMOTIONS = ("neutral", "anger", "happiness", "fear", "disgust", "sadness", "contempt", "surprise")
PAPER = {
    "audio (the paper's only one)": "neutral 99.91, anger 98.80, happiness 99.84, fear 99.60, disgust 100.00, sadness"
    " 99.67, contempt 99.75, surprise 98.30; average 99.70 %"
}
TABLE = Table(
    "table1",
    "Table I: classifiers of emotions",
    VARIANTS,
    ("accuracy", "balanced", *EMOTIONS, "chance, commonest", "chance, shuffled answers"),
    paper=PAPER,
    notes=(
        "Clips of 60 frames, half a clip apart, of recordings that no classifier was trained on; columns of emotions"
        " are the shares of their clips that are classified as them.",
    ),
)


def confused(name: str, run: Run, ruler: Ruler, seed: int) -> dict[str, Any]:
    """Accuracies and confusion matrix on the test split."""
    del seed  # nothing is drawn
    found = classify_split({name: run}, ruler.corpus, split=ruler.split)["classifiers"][name]
    shares = dict(zip(found["emotions"], found["recall"], strict=True))
    return {
        "clips": found["clips"],
        "recordings": found["recordings"],
        "emotions": found["emotions"],
        "confusion": found["confusion"],
        "scores": {
            "accuracy": {**found["accuracy"], "best": None},
            "balanced": cell(found["balanced"]),
            **{emotion: cell(share) for emotion, share in shares.items() if share is not None},
            "chance, commonest": cell(found["chance"]["commonest"]),
            "chance, shuffled answers": cell(found["chance"]["shuffled"]),
        },
    }


def picture() -> None:
    """Draw the confusion matrices, summed over seeds."""
    from a2g_jax.viz.confusion import Panel, save_confusion

    panels = []
    for name in VARIANTS:
        found = [record for record in current(TABLE.name) if record["variant"] == name]
        if found:
            counts = np.sum([record["confusion"] for record in found], axis=0)
            seeds = ", ".join(str(record["seed"]) for record in found)
            accuracy = 100 * np.trace(counts) / counts.sum()
            panels.append(Panel(f"{name}: {accuracy:.1f} %, seeds {seeds}", found[-1]["emotions"], counts))
    if panels:
        save_confusion(path_of(TABLE.name, ".png"), panels)


def main() -> None:
    """Train and score what is missing, and render the table and its picture."""
    options = parser(TABLE.title).parse_args()
    if options.corpus is not None:
        only = options.only.split(",") if options.only else None
        run_table(TABLE.name, VARIANTS, setting_of(options), only, confused, "confusion")
    if not current(TABLE.name):
        print(f"{TABLE.name}: there are no records yet; give a corpus with --corpus.")
        return
    text = render(TABLE)
    path_of(TABLE.name, ".md").write_text(text + "\n", encoding="utf-8")
    picture()
    print(text)


if __name__ == "__main__":
    main()
