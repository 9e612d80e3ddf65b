"""The motion-smooth loss on motion with capture noise, scored against the clean motion of the same recordings.

    a2g prepare talker --minutes 300 --seed 5 --jitter 2 --features emotion-gesture --out JITTERED
    python -m experiments.emotion_gesture.jitter --corpus JITTERED --clean CORPUS [--budget MINUTES]

``CORPUS`` has the same recipe without ``--jitter``. Seeds of generation are the clean poses.
"""

from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.training.run import Run
from experiments.emotion_gesture.bench import FIRST, TRUTH, Bench, Made
from experiments.emotion_gesture.page import show
from experiments.emotion_gesture.scores import cell, scores_of
from experiments.emotion_gesture.settings import TINY, paper, scaled
from experiments.emotion_gesture.table import Table, parser, setting_of
from experiments.tables.claims import Claim
from experiments.tables.records import append, records
from experiments.tables.ruler import Ruler, measure
from experiments.tables.runs import run_table
from experiments.tables.setting import Setting

WITHOUT, WITH, STRONG = "without L_smooth", "with L_smooth", "with ten times L_smooth"
JITTERED = "the jittered motion itself"

VARIANTS = {
    WITHOUT: paper(smooth_weight=0.0),
    WITH: paper(),
    STRONG: paper(smooth_weight=10 * TINY.smooth_weight),
}

CLAIMS = tuple(
    Claim(f"{text} is closer to the clean motion's: {name}", name, null, metric, -1, name)
    for name, null in ((WITH, WITHOUT), (STRONG, WITHOUT))
    for text, metric in (("jerk", "jerk_error"), ("the motion (L2)", "position_l2"))
)

TABLE = Table(
    "jitter",
    "The motion-smooth loss on motion with capture noise",
    VARIANTS,
    ("jerk_ratio", "jerk", "position_l2", "wrist_speed"),
    CLAIMS,
    notes=(
        "Trained on motion whose joints have noise; scored on test clips against the clean motion of the same"
        " recordings. The ratio of jerks is that of the wrists, mean over clips.",
    ),
)


def main() -> None:
    """Train and score what is missing, and render the table."""
    made = parser(TABLE.title)
    made.add_argument("--clean", type=Path, help="the corpus of the same recordings without jitter")
    options = made.parse_args()
    if options.corpus is not None:
        if options.clean is None:
            raise InputError("--corpus: is scored against clean motion; give its corpus with --clean.")
        compute(setting_of(options), Corpus.open(options.clean), options.only.split(",") if options.only else None)
    show(TABLE)


def compute(where: Setting, clean: Corpus, only: list[str] | None) -> None:
    """Train and score what is missing.

    Raises:
        InputError: the corpora are not of the same recordings.
    """
    ruler, measured = measure(TABLE.name, where)
    check_same(ruler.corpus, clean)
    bench = Bench(Ruler(clean, None, ruler.samples, ruler.units))

    def score(name: str, run: Run, ruler: Ruler, seed: int) -> dict[str, Any]:
        del name
        return against_clean(bench.generate(run, ruler.samples, seed), bench, seed)

    noisy = Bench(ruler)
    for seed in where.seeds:
        for name, motion in ((TRUTH, bench.pose), (JITTERED, noisy.pose)):
            fields = {"variant": name, "seed": seed, **measured, "steps": 0}
            if not any(all(one.get(key) == value for key, value in fields.items()) for one in records(TABLE.name)):
                append(TABLE.name, {**fields, **against_clean(motion[:, None, FIRST:], bench, seed)})
    run_table(TABLE.name, scaled(VARIANTS, where.steps), where, only, score, "clean motion")


def against_clean(made: Made, bench: Bench, seed: int) -> dict[str, Any]:
    """Scores with the jerk relative to the clean motion's; ``jerk_error`` is the distance of the ratio from 1."""
    found = scores_of(made, bench, seed)
    clean = scores_of(bench.pose[:, None, FIRST:], bench, seed)["scores"]["jerk"]["mean"]
    ratio = found["scores"]["jerk"]["mean"] / clean
    found["scores"] |= {"jerk_ratio": cell(ratio), "jerk_error": cell(abs(np.log(max(ratio, 1e-9))))}
    return found


def check_same(corpus: Corpus, clean: Corpus) -> None:
    """Refuse corpora of different recordings, a clean one with noise, and a jittered one without.

    Raises:
        InputError: they are.
    """
    about = lambda one: {key: value for key, value in one.recipe.items() if key != "jitter"}  # noqa: E731
    if about(corpus) != about(clean) or corpus.splits != clean.splits:
        raise InputError(f"--clean {clean.path}: is not of the recordings of {corpus.path}; use the same options.")
    if clean.recipe.get("jitter") or not corpus.recipe.get("jitter"):
        raise InputError(f"--corpus {corpus.path}: needs motion prepared with --jitter, and --clean one without.")


if __name__ == "__main__":
    main()
