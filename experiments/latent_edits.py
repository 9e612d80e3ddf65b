"""What the named edits of latent codes do to the motion: size, speed and jerk of the hands.

    python -m experiments.latent_edits --run demo --speeches 8 --seed 1

Motions for held-out generated speech, one sample each, with every named edit and with none. Speed is the mean of both
wrists relative to the pelvis; the box is the mean side of the box that a wrist's places between the 5th and the 95th
percentile fill; jerk is its 90th percentile. Intervals are of the mean over speeches.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy import stats

from a2g_jax.generation.generator import Generator
from a2g_jax.io.files import atomic_path, write_json
from a2g_jax.metrics.liveliness import body_of, wrist_jerk, wrist_speeds
from a2g_jax.models.audio2gestures.edit_presets import EDIT_PRESETS
from a2g_jax.progress import counted_steps
from a2g_jax.talker.recordings import cast, talk
from a2g_jax.training.run import open_run

RESULTS = Path(__file__).parent / "results"
#: Seed of the cast of the first seed; no training corpus has a seed this high.
_CAST = 2000
_SECONDS = 16.0
_FIGURES = ("wrist speed, m/s", "box, m", "jerk, m/s3")


def figures(motion: Any) -> Float[np.ndarray, "3"]:
    """Speed, box and jerk of the hands of a motion, as in the table."""
    body = body_of(motion)
    low, high = np.percentile(body.wrists, [5.0, 95.0], axis=0)
    return np.array([wrist_speeds(body).mean(), (high - low).mean(), np.percentile(wrist_jerk(body), 90.0)])


def measure(name: str, speeches: int, seed: int) -> dict[str, Any]:
    """Figures of every edit: their means, and the half widths of their 95 % intervals over speeches."""
    generator = Generator(open_run(name))
    roles = cast(speeches, _CAST + seed)
    talks = [talk(**{**role, "seconds": _SECONDS}).audio for role in roles]
    edits: dict[str, tuple[str, ...]] = {"none": (), **{preset: (preset,) for preset in EDIT_PRESETS}}
    rows: dict[str, Any] = {}
    with counted_steps(len(edits) * speeches, "edits", "motion") as step:
        for edit, lines in edits.items():
            sampler, found = generator.with_sampling(edits=lines), []
            for number, audio in enumerate(talks):
                found.append(figures(sampler.generate(audio, 1, seed=seed + number)[0]))
                step()
            values = np.array(found)
            half = stats.t.ppf(0.975, speeches - 1) * values.std(axis=0, ddof=1) / np.sqrt(speeches)
            rows[edit] = {
                figure: [float(f"{mean:.3g}"), float(f"{width:.2g}")]
                for figure, mean, width in zip(_FIGURES, values.mean(axis=0), half, strict=True)
            }
    command = f"python -m experiments.latent_edits --run {name} --speeches {speeches} --seed {seed}"
    return {"command": command, "run": name, "speeches": speeches, "seed": seed, "edits": rows}


def table(record: dict[str, Any]) -> str:
    """The record as Markdown."""
    lines = [f"`{record['command']}`", "", f"| edit | lines | {' | '.join(_FIGURES)} |", "|" + " --- |" * 5]
    for edit, row in record["edits"].items():
        cells = [f"{mean:.3g} +- {half:.2g}" for mean, half in row.values()]
        text = ", ".join(f"`{line}`" for line in EDIT_PRESETS.get(edit, ())) or "-"
        lines.append(f"| {edit} | {text} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", default="demo", help="a run of Audio2Gestures (default: demo)")
    parser.add_argument("--speeches", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    made = measure(options.run, options.speeches, options.seed)
    write_json(RESULTS / "latent_edits.json", made)
    with atomic_path(RESULTS / "latent_edits.md") as path:
        path.write_text(table(made), encoding="utf-8")
    print(table(made))
