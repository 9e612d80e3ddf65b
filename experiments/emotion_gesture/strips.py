"""Film strips as in the paper's Fig. 4: systems on one speech, and one speech in eight emotions.

    python -m experiments.emotion_gesture.strips --corpus CORPUS --runs RUNS [--steps 600] [--speech NUMBER]

Draws the first seed's runs of Table II to ``results/strips_systems.png`` and ``results/strips_emotions.png``; needs
Playwright with Chromium.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.generation.generator import Generator
from a2g_jax.geometry.motion import Motion
from a2g_jax.training.run import Run, load_run
from experiments.emotion_gesture import table2
from experiments.emotion_gesture.settings import scaled
from experiments.emotion_gesture.table import setting_of
from experiments.emotion_gesture.table1 import EMOTIONS
from experiments.motion.rows import Row
from experiments.motion.speeches import Speech, talk_of_corpus
from experiments.motion.strips import film_strips
from experiments.tables.records import results
from experiments.tables.setting import Setting
from experiments.tables.training import folder_of


def main() -> None:
    """Draw both pictures."""
    from experiments.emotion_gesture.table import parser

    made: argparse.ArgumentParser = parser("Film strips of Table II's systems and of eight emotions")
    made.add_argument("--speech", type=int, default=0, help="number of the test recording (default: 0)")
    options = made.parse_args()
    if options.corpus is None:
        raise InputError("--corpus: is needed, since nothing is kept to draw from.")
    corpus, where = Corpus.open(options.corpus), setting_of(options)
    speech = talk_of_corpus(corpus, corpus.fps).speeches[options.speech]
    runs = {name: run_of(name, where, corpus) for name in table2.VARIANTS}
    rows = [Row(name, _draw(run, speech)) for name, run in runs.items()]
    folder = results("emotion_gesture")
    folder.mkdir(parents=True, exist_ok=True)
    film_strips(folder / "strips_systems.png", speech, rows)
    ours = runs[table2.CONSTANT]
    names = ours.config.corpus["emotions"]
    shown = [Row(name, _draw(ours, speech, name)) for name in EMOTIONS if name in names]
    film_strips(folder / "strips_emotions.png", speech, shown)


def run_of(name: str, where: Setting, corpus: Corpus) -> Run:
    """The trained run of a row of Table II.

    Raises:
        InputError: it is not trained yet.
    """
    folder: Path = folder_of(name, scaled(table2.VARIANTS, where.steps), where.seeds[0], corpus, where)
    if not folder.is_dir():
        raise InputError(
            f"{folder}: there is no run of {name!r}; run table2 with the same --corpus, --runs and --steps."
        )
    run, generation = load_run(folder), table2.VARIANTS[name].generation
    return replace(run, config=run.config.with_sampling(**generation)) if generation else run


def _draw(run: Run, speech: Speech, emotion: str = "") -> Callable[[int], list[Motion]]:
    """Draws a run's motion for the speech, with the emotion of the speech or another one."""

    def draw(number: int) -> list[Motion]:
        del number
        used = replace(run, config=run.config.with_sampling(emotion=emotion)) if emotion else run
        return Generator(used).generate(np.asarray(speech.audio), 1, 0)

    return draw


if __name__ == "__main__":
    main()
