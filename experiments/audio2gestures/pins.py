"""How closely clips pinned through their codes are followed, and how smooth the seams are (extended, Sec. 6.4).

    python -m experiments.audio2gestures.pins RUN --corpus CORPUS [--pins 40] [--seed 0]

Clips of one to three seconds of newly generated recordings are pinned at random moments of another speech by the same
speaker, each with a sample of its own; speakers take turns. Writes ``results/pins.json``.
"""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.generation.audio2gestures.latent_space import LatentSpace
from a2g_jax.generation.audio2gestures.pins import pin_codes
from a2g_jax.generation.pins.report import Ends, corpus_jerk, report_pins
from a2g_jax.generation.pins.request import Pin
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.onto import face
from a2g_jax.geometry.rotation import matrix_from_6d
from a2g_jax.io.files import write_json
from a2g_jax.metrics.intervals import mean_interval
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from a2g_jax.training.run import Run, demo_run, load_run
from experiments.tables.records import results

SECONDS = 12.0
#: Seconds of blending, and weight of the clip's own shared code.
SETTINGS = ((0.25, 1.0), (0.5, 1.0), (0.75, 1.0), (0.75, 0.0))
#: A pin counts as followed if its distance is below this share of the unpinned motion's.
FOLLOWED = 0.5
ERRORS = ("error_cm", "unpinned_error_cm", "wrist_error_cm", "unpinned_wrist_error_cm")


def measure(run: Run, corpus: Corpus, count: int, seed: int, blend: float, shared: float) -> dict[str, Any]:
    """Errors of pinned and unpinned samples, and jerk at the seams compared with the corpus's 99th percentile."""
    space, limit = LatentSpace(run), corpus_jerk(corpus)
    reach = round(blend * run.config.fps)
    ends = Ends(reach, reach, reach)
    facing = np.asarray(matrix_from_6d(np.asarray(run.config.statistics["pose"].mean[0])), np.float64)
    rng = np.random.default_rng(seed)
    rows, unpinned, recorded = [], [], []
    for number in range(count):
        speaker = tuple(SPEAKERS)[number % len(SPEAKERS)]
        own, other = (talk(SECONDS, seed + 100_000 + 2 * number + k, speaker=speaker) for k in (0, 1))
        frames = int(rng.integers(30, 91))
        first = int(rng.integers(0, other.motion.frames - frames))
        clip, turned = face(replace(part(other.motion, first, frames), skeleton=run.config.skeleton), facing)
        start = float(rng.uniform(1.0, SECONDS - 1.0 - frames / 30.0))
        pin = Pin(f"clip {number}", start, clip, turned)
        codes = space.from_audio(own.audio, seed, number)
        pinned = space.to_motion(pin_codes(space, codes, [pin], blend=blend, shared=shared))
        plain = space.to_motion(codes)
        rows += report_pins([pin], pinned, plain, limit, "99th percentile of the corpus", ends)
        unpinned += report_pins([pin], plain, plain, limit, "", ends)
        # The same measure of recorded motion over an equally long stretch.
        recorded += report_pins([Pin("", start, clip)], own.motion, own.motion, limit, "", ends)
    means = {name: mean_interval(np.array([row[name] for row in rows])).to_json() for name in ERRORS}
    share = {
        f"{kind}share": np.array([row[f"{kind}error_cm"] / row[f"unpinned_{kind}error_cm"] for row in rows])
        for kind in ("", "wrist_")
    }
    return {
        "pins": count,
        "speakers": min(count, len(SPEAKERS)),
        **means,
        **{name: mean_interval(values).to_json() for name, values in share.items()},
        "followed": float(np.mean(share["share"] < FOLLOWED)),
        "wrists_followed": float(np.mean(share["wrist_share"] < FOLLOWED)),
        "seam_jerk_median": float(np.median([row["seam_jerk"] for row in rows])),
        "jerk_limit": limit,
        "smooth": float(np.mean([row["smooth"] for row in rows])),
        "smooth_unpinned": float(np.mean([row["smooth"] for row in unpinned])),
        "smooth_recorded": float(np.mean([row["smooth"] for row in recorded])),
    }


def part(motion: Motion, first: int, frames: int) -> Motion:
    """Frames of a motion."""
    return replace(motion, rotations=motion.rotations[first : first + frames], root=motion.root[first : first + frames])


def main() -> None:
    """Measure and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="folder of a run, or 'demo'")
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--pins", type=int, default=60)
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
    write_json(
        results("audio2gestures") / "pins.json",
        {"corpus": corpus.fingerprint[:16], "seed": options.seed, "settings": figures},
    )


if __name__ == "__main__":
    main()
