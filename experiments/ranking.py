"""What ``--order best`` is worth: the best sample beside a random one, by a measure that the score does not use.

    python -m experiments.ranking --speeches 24 --samples 8 --seed 1

The score compares peaks of wrist speed with peaks of the sound's energy. The measure compares what it does not use:
the accented syllables of the speech plan, which the corpus knows, and moments at which both hands together slow down
most. It is the F1 of two averages of ``exp(-d^2 / 2 (0.1 s)^2)``, over accents, weighted by their prominence, and over
these moments, in standard deviations of its null (the motion shifted against the speech by 1 to 5 s).
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy import ndimage, signal, stats

from a2g_jax.generation.checked import Checked
from a2g_jax.generation.generator import Generator
from a2g_jax.generation.ranking import Scorer, best_first
from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import BODY_JOINTS
from a2g_jax.io.files import write_json
from a2g_jax.talker.languages import LANGUAGE_NAMES
from a2g_jax.talker.recordings import cast, talk
from a2g_jax.training.run import open_run

RESULT = Path(__file__).parent / "results" / "ranking.json"
_SECONDS, _SIGMA = 16.0, 0.1
_SHIFTS = np.concatenate([np.linspace(-5, -1, 17), np.linspace(1, 5, 17)])


def stops(motion: Motion) -> Float[np.ndarray, " N"]:
    """Times at which both hands together slow down most, seconds."""
    body = find_body_joints(motion.skeleton)
    assert body is not None
    positions = motion.positions()
    hands = positions[:, [body[BODY_JOINTS.index(f"{side}_Wrist")] for side in "LR"]] - positions[:, :1]
    smooth = ndimage.gaussian_filter1d(hands, 0.07 * motion.fps, axis=0)
    speed = np.linalg.norm(np.gradient(smooth, axis=0).reshape(len(hands), -1), axis=1) * motion.fps
    found, _ = signal.find_peaks(-np.gradient(speed) * motion.fps, prominence=1.0)
    return found / motion.fps


def answered(motion: Motion, accents: Float[np.ndarray, "A 2"]) -> float:
    """F1 of accents and stops in standard deviations of its null."""
    times = stops(motion)

    def f1(moved: Float[np.ndarray, " N"]) -> float:
        if not len(moved):
            return 0.0
        near = np.exp(-np.square(moved[:, None] - accents[None, :, 0]) / (2 * _SIGMA**2))
        there, back = float(near.max(axis=1).mean()), float(np.average(near.max(axis=0), weights=accents[:, 1]))
        return 2 * there * back / max(there + back, 1e-9)

    null = [f1((times + shift) % motion.seconds) for shift in _SHIFTS]
    return (f1(times) - float(np.mean(null))) / max(float(np.std(null)), 1e-6)


def measure(name: str, speeches: int, samples: int, seed: int) -> dict[str, Any]:
    """Mean measure of random and best samples of a run, and the difference with its 95 % interval over speeches."""
    run = open_run(name)
    sampler, rows = Checked(run, Generator(run)), []
    for number, role in enumerate(cast(speeches, 1000 + seed, languages=LANGUAGE_NAMES)):
        speech = talk(**{**role, "seconds": _SECONDS})
        syllables = speech.annotations["speech"]["syllables"]
        accents = np.array([(one["peak"], one["accent"]) for one in syllables if one["accent"] >= 0.25])
        motions = list(sampler.stream(speech.audio, samples, seed=seed + number))
        scorer = Scorer(run, speech.audio)
        ranked = best_first(
            scorer.score(index, motion, report.findings)
            for index, (motion, report) in enumerate(zip(motions, sampler.reports, strict=True))
        )
        values = np.array([answered(motion, accents) for motion in motions])
        rows.append((values.mean(), values[ranked[0].sample], values[ranked[-1].sample], values.max()))
    random, best, worst, most = np.array(rows).T
    gain = best - random
    half = float(stats.t.ppf(0.975, len(gain) - 1) * gain.std(ddof=1) / np.sqrt(len(gain)))
    return {
        "run": name,
        "speeches": speeches,
        "samples": samples,
        "seed": seed,
        "random": round(float(random.mean()), 3),
        "best": round(float(best.mean()), 3),
        "worst": round(float(worst.mean()), 3),
        "highest possible": round(float(most.mean()), 3),
        "gain": round(float(gain.mean()), 3),
        "interval": [round(float(gain.mean()) - half, 3), round(float(gain.mean()) + half, 3)],
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", nargs="+", default=["demo", "demo-flow"])
    parser.add_argument("--speeches", type=int, default=24)
    parser.add_argument("--samples", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    found = [measure(name, options.speeches, options.samples, options.seed) for name in options.runs]
    write_json(RESULT, found)
    for one in found:
        print(one)
