"""Response of the hands to style controls (MoGlow as in StyleGestures, Alexanderson et al. 2020).

    a2g train stylized_flow --corpus CORPUS --out RUN --style-controls height,speed,radius
    python -m experiments.stylized_flow.steering RUN --corpus CORPUS [--speeches 6] [--samples 2]

Each control is set to the 10th, 50th and 90th percentile of the training clips, the others to their medians, for the
same test speeches and seeds. Measured: mean height, speed and radius of the generated hands, compared with the request.
:mod:`experiments.controls` measures the shipped runs in more detail.
Writes ``results/steering.json`` and a picture.
"""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.generation.generator import Generator
from a2g_jax.io.files import write_json
from a2g_jax.metrics.intervals import mean_interval
from a2g_jax.metrics.style import HandStyle, hand_style
from a2g_jax.training.run import Run, open_run
from experiments.tables.records import name_of, results

PERCENTILES = (10.0, 50.0, 90.0)
UNITS = {"height": "m", "speed": "m/s", "radius": "m"}
SECONDS = 20.0


def measure(run: Run, corpus: Corpus, speeches: int, samples: int, seed: int) -> dict[str, Any]:
    """Requested and measured values, control by control."""
    config = run.config.model_config
    names = [name for name in config.style_controls if name in HandStyle._fields]
    if not names:
        raise InputError("the run has no style controls; train one with --style-controls height,speed,radius.")
    training = np.asarray(run.summary["control_mean"])
    frames = round(SECONDS * corpus.fps)
    segments = [s for s in corpus.segments("test") if s.frames >= frames][:speeches]
    features = [np.asarray(corpus.audio[s.start : s.start + frames], np.float32) for s in segments]
    controls: dict[str, Any] = {}
    for name in names:
        rows = []
        for percentile in PERCENTILES:
            curves = (f"{name}={percentile / 100:g}",)
            made = replace(run, config=run.config.with_sampling(controls=curves))
            styles = styles_of(made, corpus, features, samples, seed)
            column = config.style_controls.index(name)
            rows.append(
                {
                    "percentile": percentile,
                    "requested": float(np.percentile(training[:, column], percentile)),
                    # One value for each speech: its samples are not independent.
                    **{
                        field: mean_interval(styles[:, :, HandStyle._fields.index(field)].mean(1)).to_json()
                        for field in HandStyle._fields
                    },
                }
            )
        controls[name] = {"rows": rows, **_response(name, rows)}
    return {"steps": run.steps, "speeches": len(features), "samples": samples, "controls": controls}


def styles_of(
    run: Run, corpus: Corpus, features: list[Float[np.ndarray, "T bands"]], samples: int, seed: int
) -> Float[np.ndarray, "N samples 3"]:
    """Hand style of every motion."""
    space, generator = corpus.space, Generator(run)
    return np.array(
        [
            [hand_style(space.positions(rows), corpus.fps) for rows in generator.rows(one, samples, seed)]
            for one in features
        ]
    )


def _response(name: str, rows: list[dict[str, Any]]) -> dict[str, float]:
    """Rise of the measured value from the first percentile to the last, over that of the requested one."""
    measured = rows[-1][name]["mean"] - rows[0][name]["mean"]
    requested = rows[-1]["requested"] - rows[0]["requested"]
    return {"response": measured / requested}


def picture(figures: dict[str, Any], path: Path) -> None:
    """Plot requested and measured values, a panel for each control."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    controls = figures["controls"]
    figure, axes = pyplot.subplots(1, len(controls), figsize=(4 * len(controls), 3.6), squeeze=False)
    for axis, (name, found) in zip(axes[0], controls.items(), strict=True):
        requested = [row["requested"] for row in found["rows"]]
        values = [row[name] for row in found["rows"]]
        means = [value["mean"] for value in values]
        spread = np.abs(np.array([[value["low"], value["high"]] for value in values], float).T - means)
        axis.plot(requested, requested, color="0.7", linestyle="--", label="requested")
        axis.errorbar(requested, means, yerr=spread, marker="o", capsize=3, label="generated")
        axis.set_title(f"{name}: response {found['response']:.2f}", fontsize=10)
        axis.set_xlabel(f"requested, {UNITS[name]} (10th, 50th, 90th percentile)")
        axis.set_ylabel(f"generated, {UNITS[name]}")
    axes[0, 0].legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main() -> None:
    """Measure a run; write the figures and the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="a folder of a run that was trained with --style-controls")
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--speeches", type=int, default=6)
    parser.add_argument("--samples", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    corpus = Corpus.open(options.corpus)
    figures = measure(open_run(options.run), corpus, options.speeches, options.samples, options.seed)
    for name, found in figures["controls"].items():
        print(
            name, f"response {found['response']:.2f}", [(row["requested"], row[name]["mean"]) for row in found["rows"]]
        )
    folder = results("stylized_flow")
    write_json(folder / "steering.json", {"corpus": name_of(corpus), "seed": options.seed, **figures})
    picture(figures, folder / "steering.png")


if __name__ == "__main__":
    main()
