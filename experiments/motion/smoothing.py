"""How fast a value must change to be smoothed less (``--rest-speed``), chosen on other talk than the table's.

    python -m experiments.motion.smoothing [--minutes 8] [--seed 78]

Statistics of `demo` relative to the truth's by setting, and the share of fast frames in which a wrist stutters: a
speed above 0.4 m/s that is more than 10 % below those one or two frames before and after. Writes
``results/smoothing.md``.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from a2g_jax.generation.generator import Generator
from a2g_jax.geometry.motion import Motion
from a2g_jax.progress import progress_bar
from a2g_jax.training.run import demo_run
from experiments.motion.__main__ import RESULTS
from experiments.motion.speeches import held_out_talk
from experiments.motion.statistics import statistics

FPS = 30.0
#: Filters and speeds that are compared; no filters are the smoothing of training.
SETTINGS = ((0, 2.4), (4, 1.2), (4, 1.8), (4, 2.4), (4, 3.6), (6, 1.8))
KEYS = ("speed_p50", "speed_p90", "speed_p99", "jerk_p50", "jerk_p90", "rest", "agreement_excess")
#: Least speed of a stutter, m/s, and how far it falls.
_FAST, _FALLS = 0.4, 1.1


def stutters(motions: Sequence[Motion]) -> float:
    """Share of fast frames of both wrists in which the speed falls and rises again within two frames."""
    found = fast = 0
    for motion in motions:
        places = np.asarray(motion.positions())
        wrists = [number for number, name in enumerate(motion.skeleton.names) if "wrist" in name.lower()]
        speed = np.linalg.norm(np.diff(places[:, wrists] - places[:, :1], axis=0), axis=-1) * motion.fps
        own, before, after = speed[2:-2], (speed[:-4], speed[1:-3]), (speed[4:], speed[3:-1])
        lowest = (own < before[1]) & (own < after[1])
        falls = (np.maximum(*before) > _FALLS * own) & (np.maximum(*after) > _FALLS * own)
        found += int(np.sum(lowest & falls & (own > _FAST)))
        fast += int(np.sum(own > _FAST))
    return found / max(fast, 1)


def main() -> None:
    """Generate with every setting and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=8.0)
    parser.add_argument("--seed", type=int, default=78)
    options = parser.parse_args()
    speeches = held_out_talk(options.minutes, options.seed, FPS).speeches
    truth = [[speech.truth] for speech in speeches if speech.truth is not None]
    run = demo_run()
    reference = statistics(speeches, truth)
    own = " | ".join(f"{reference[key]['value']:.3g}" for key in KEYS)
    lines = [
        "# Smoothing of quiet frames",
        "",
        f"`demo` on {options.minutes:g} minutes of talk (seed {options.seed}), relative to the truth; one sample each.",
        "",
        f"| `--rest-smoothing` | `--rest-speed` | {' | '.join(KEYS)} | stutters, % |",
        "|" + " --- |" * (len(KEYS) + 3),
        f"| truth | | {own} | {100 * stutters(_flat(truth)):.1f} |",
    ]
    with progress_bar(len(SETTINGS), "settings", "setting") as bar:
        for passes, speed in SETTINGS:
            sampling = {"rest_smoothing": passes, "rest_speed": speed}
            generator = Generator(replace(run, config=run.config.with_sampling(**sampling)))
            made = [generator.generate(speech.audio, 1, 7919 * (n + 1)) for n, speech in enumerate(speeches)]
            found = statistics(speeches, made)
            cells = [f"{found[key]['value'] / reference[key]['value']:.2f}" for key in KEYS]
            lines.append(f"| {passes} | {speed:g} | {' | '.join(cells)} | {100 * stutters(_flat(made)):.1f} |")
            bar.update()
    text = "\n".join(lines) + "\n"
    (RESULTS / "smoothing.md").write_text(text, encoding="utf-8")
    print(text)


def _flat(groups: Sequence[Sequence[Motion]]) -> list[Motion]:
    return [motion for group in groups for motion in group]


if __name__ == "__main__":
    main()
