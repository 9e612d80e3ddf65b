"""Whether long motions of a flow stay finite and lively: 5000 frames, drift and freezing.

    python -m experiments.stylized_flow.long_runs RUN [RUN ...] --corpus CORPUS [--frames 5000] [--samples 8]

The speech is that of test recordings one after another. For every stretch of ten seconds: the wrists' mean speed, the
share of frozen frames (no wrist faster than 1 cm/s), the distance of the mean pose from the corpus's, and the spread of
poses; each compared with equally long stretches of the corpus. Writes ``results/long_runs.json``.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.data.corpus import Corpus
from a2g_jax.generation.generator import Generator
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.io.files import write_json
from a2g_jax.training.run import Run, open_run
from experiments.tables.records import results

STRETCH = 10.0
FROZEN = 0.01


def liveliness(space: PoseSpace, pose: Float[np.ndarray, "T R D"], mean: Float[np.ndarray, "P _"], fps: float) -> Any:
    """For every stretch of ten seconds: speed (m/s), frozen share, drift (cm) and spread (cm)."""
    places, frames = space.positions(pose), round(STRETCH * fps)
    count = len(places) // frames
    rows = []
    for part in np.split(places[: count * frames], count):
        speed = np.linalg.norm(np.diff(space.wrists(part), axis=0), axis=-1) * fps
        middle = part.mean(axis=0)
        rows.append(
            (
                speed.mean(),
                (speed.max(axis=1) < FROZEN).mean(),
                100 * np.linalg.norm(middle - mean, axis=-1).mean(),
                100 * np.linalg.norm(part - middle, axis=-1).mean(),
            )
        )
    return np.array(rows)


def measure(run: Run, corpus: Corpus, frames: int, samples: int, seed: int) -> dict[str, Any]:
    """The first and the last quarter of generated motion, and the corpus's own stretches."""
    space, fps = corpus.space, corpus.fps
    speech = np.concatenate([corpus.audio[s.start : s.stop] for s in corpus.segments("test")])
    speech = np.tile(speech, (-(-frames // len(speech)), 1))[:frames]
    truth = [np.asarray(corpus.pose[s.start : s.stop]) for s in corpus.segments("test")]
    mean = np.concatenate([space.positions(one) for one in truth]).mean(axis=0)
    made = list(Generator(run).rows(np.asarray(speech, np.float32), samples, seed))
    finite = all(np.isfinite(one).all() for one in made)
    names = ("speed_m_s", "frozen_share", "drift_cm", "spread_cm")
    if not finite:
        return {"frames": frames, "samples": samples, "finite": False}
    ours = np.stack([liveliness(space, one, mean, fps) for one in made])
    quarter = max(1, ours.shape[1] // 4)
    theirs = np.concatenate([liveliness(space, one, mean, fps) for one in truth])
    summary = lambda rows: dict(zip(names, np.round(rows.reshape(-1, 4).mean(axis=0), 4).tolist(), strict=True))  # noqa: E731
    limit = np.percentile(theirs[:, 2], 99)
    return {
        "frames": frames,
        "samples": samples,
        "finite": True,
        "first_quarter": summary(ours[:, :quarter]),
        "last_quarter": summary(ours[:, -quarter:]),
        "corpus": summary(theirs),
        "stretches_farther_than_the_corpus_99th": float((ours[..., 2] > limit).mean()),
        "samples_frozen_at_the_end": float((ours[:, -1, 1] > 0.5).mean()),
    }


def main() -> None:
    """Measure runs and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", help="folders of runs, or 'demo-flow'")
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--frames", type=int, default=5000)
    parser.add_argument("--samples", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    corpus, figures = Corpus.open(options.corpus), {}
    for name in options.runs:
        run = open_run(name)
        figures[Path(name).name] = {
            "steps": run.steps,
            **measure(run, corpus, options.frames, options.samples, options.seed),
        }
        print(Path(name).name, figures[Path(name).name], flush=True)
    about = {"corpus": corpus.fingerprint[:16], "seed": options.seed}
    write_json(results("stylized_flow") / "long_runs.json", {**about, "runs": figures})


if __name__ == "__main__":
    main()
