"""How closely pinned clips are followed, and how smooth their seams are (Audio2Gestures, extended, Sec. 6.4).

    python -m experiments.audio2gestures.pins RUN --corpus CORPUS [--pins 40] [--seed 0]

Clips of one to three seconds of newly generated recordings are pinned at random moments of the speech of others by the
same speaker, each with a sample of its own. Writes ``results/pins.json``.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.talker.recordings import talk
from a2g_jax.generation.latent import LatentSpace
from a2g_jax.generation.pin_report import corpus_jerk, report_pins
from a2g_jax.generation.timeline import Pin, pin_codes
from a2g_jax.io.files import write_json
from a2g_jax.metrics.intervals import bootstrap_mean
from a2g_jax.training.run import Run, demo_run, load_run
from experiments.audio2gestures.common import RESULTS

SECONDS = 12.0
#: Seconds of blending, and share of the clip's own shared code.
SETTINGS = ((0.25, 0.0), (0.5, 0.0), (0.75, 0.0), (0.5, 1.0))


def measure(run: Run, corpus: Corpus, count: int, seed: int, blend: float, shared: float) -> dict[str, Any]:
    """Errors of pinned and unpinned samples, and jerk at the seams against the corpus's 99th percentile."""
    space, limit = LatentSpace(run), corpus_jerk(corpus)
    rng = np.random.default_rng(seed)
    rows, unpinned, recorded = [], [], []
    for number in range(count):
        own, other = (talk(SECONDS, seed + 100_000 + 2 * number + k) for k in (0, 1))
        frames = int(rng.integers(30, 91))
        first = int(rng.integers(0, other.motion.frames - frames))
        clip = part(other.motion, first, frames)
        start = float(rng.uniform(1.0, SECONDS - 1.0 - frames / 30.0))
        pin = Pin(f"clip {number}", start, clip)
        codes = space.from_audio(own.audio, seed, number)
        pinned = space.to_motion(pin_codes(space, codes, [pin], blend=blend, shared=shared))
        plain = space.to_motion(codes)
        rows += report_pins([pin], pinned, plain, limit, "99th percentile of the corpus")
        unpinned += report_pins([pin], plain, plain, limit, "")
        # What a recorded motion itself has in as long a stretch.
        recorded += report_pins([Pin("", start, clip)], own.motion, own.motion, limit, "")
    ratio = np.array([row["error_cm"] / row["unpinned_error_cm"] for row in rows])
    return {
        "pins": count,
        "error_cm": bootstrap_mean(np.array([row["error_cm"] for row in rows]), rng)._asdict(),
        "unpinned_error_cm": bootstrap_mean(np.array([row["unpinned_error_cm"] for row in rows]), rng)._asdict(),
        "share": bootstrap_mean(ratio, rng)._asdict(),
        "followed": float(np.mean([row["followed"] for row in rows])),
        "seam_jerk_median": float(np.median([row["seam_jerk"] for row in rows])),
        "jerk_limit": limit,
        "smooth": float(np.mean([row["smooth"] for row in rows])),
        "smooth_unpinned": float(np.mean([row["smooth"] for row in unpinned])),
        "smooth_recorded": float(np.mean([row["smooth"] for row in recorded])),
    }


def part(motion: Any, first: int, frames: int) -> Any:
    """Frames of a motion."""
    from dataclasses import replace

    return replace(motion, rotations=motion.rotations[first : first + frames], root=motion.root[first : first + frames])


def main() -> None:
    """Measure and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="folder of a run, or 'demo'")
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--pins", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    run = demo_run() if options.run == "demo" else load_run(options.run)
    corpus = Corpus.open(options.corpus)
    figures = {
        f"blend {blend:g} s, shared {share:g}": measure(run, corpus, options.pins, options.seed, blend, share)
        for blend, share in SETTINGS
    }
    for name, row in figures.items():
        print(name, row)
    write_json(RESULTS / "pins.json", {"corpus": corpus.fingerprint[:16], "seed": options.seed, "settings": figures})


if __name__ == "__main__":
    main()
