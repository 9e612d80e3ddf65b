"""The picture of the guide: every statistic relative to the person's; and film strips, not for publication."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np

from a2g_jax.generation.generator import Generator
from a2g_jax.io.files import atomic_path
from a2g_jax.training.run import Run
from experiments.fine_tuning.measure import STATISTICS
from experiments.fine_tuning.records import HELD_OUT, Campaign, Record
from experiments.fine_tuning.takes import Fold
from experiments.motion.resampling import smooth_resample
from experiments.motion.rows import Row
from experiments.motion.strips import film_strips

matplotlib.use("Agg")
from matplotlib import pyplot as plt

_SHOWN = {"shipped": "#8d97a5", "from scratch": "#d98a29", "fine-tuned": "#2f6fe0"}
#: Compared by differences, of which there is no ratio.
_LEFT_OUT = ("rest", "posture")


def draw(path: Path, records: Sequence[Record]) -> None:
    """Write the ratio of every statistic of all parts together to the person's, a panel for each take."""
    takes = list(dict.fromkeys(record["take"] for record in records))
    names = [name for name in STATISTICS if name not in _LEFT_OUT]
    figure, axes = plt.subplots(1, len(takes), figsize=(10.5, 3.6), sharey=True, squeeze=False)
    for axis, take in zip(axes[0], takes, strict=True):
        own = [record for record in records if record["take"] == take]
        person = next(record["pooled"] for record in own if record["method"] == HELD_OUT)
        axis.axvline(1.0, color="#1d2530", linewidth=1.2)
        for shift, (method, colour) in enumerate(_SHOWN.items()):
            rows = [record["pooled"] for record in own if record["method"] == method]
            for number, name in enumerate(names if rows else ()):
                ratios = np.array([row[name] / person[name] for row in rows])
                y = number + 0.22 * (shift - 1)
                axis.plot([ratios.min(), ratios.max()], [y, y], color=colour, linewidth=2.0, alpha=0.6)
                label = method if number == 0 else None
                axis.plot(ratios.mean(), y, "o", color=colour, markersize=5.5, label=label)
        axis.set_xscale("log", base=2)
        axis.set_xticks([0.25, 0.5, 1, 2, 4], ["1/4", "1/2", "the person", "2", "4"])
        axis.set_xlim(0.2, 5.0)
        axis.set_title(take, fontsize=11)
        axis.grid(axis="x", color="#e3e8ee")
        axis.set_yticks(range(len(names)), [name.replace("_", " ") for name in names])
        axis.spines[["top", "right"]].set_visible(False)
    axes[0][0].invert_yaxis()
    axes[0][0].legend(frameon=False, fontsize=9, loc="upper right")
    figure.tight_layout()
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format="png", dpi=110)
    plt.close(figure)


def strips(path: Path, fold: Fold, campaign: Campaign, seed: int) -> None:
    """Write film strips of the person, the shipped weights and the fine-tuned ones for a held-out part, the latter also
    without the person's dynamics.

    The person's motion is research-only data: keep the file to yourself.
    """

    def row(name: str, run: Run) -> Row:
        made = Generator(run).generate(fold.held_out.audio, 1, seed=0)
        return Row(name, lambda number: [smooth_resample(made[0], fold.corpus.fps)])

    runs = {method: campaign.made(fold, method, seed).run for method in ("shipped", "fine-tuned")}
    plain = replace(runs["fine-tuned"], dynamics=None)
    rows = [row(name, run) for name, run in ({"shipped": runs["shipped"], "without dynamics": plain} | runs).items()]
    film_strips(path, fold.held_out, rows)
