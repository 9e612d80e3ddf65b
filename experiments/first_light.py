"""Figures of a trained model on the generated corpus and, where given, on real speech.

    python -m experiments.first_light RUN [--corpus CORPUS] [--speech a.wav b.wav ...] [--samples 20] [--out FILE.json]

On the generated corpus (its test split, never trained on): reconstruction, compared with the mean pose; the distance
between samples for one audio, compared with other right motions; agreement of wrist-speed peaks with the audio's energy
peaks, compared with other recordings' audio. On real speech: the same agreement, compared with the motion shifted by 1
to 5 s, and the speed of the wrists in pauses and in speech. RUN may be 'demo' for the shipped weights.
"""

import argparse
import json
from itertools import combinations
from pathlib import Path

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.generation.generator import Generator
from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.audio import read_audio
from a2g_jax.metrics.rhythm import (
    agreement,
    agreement_with_null,
    energy_peaks,
    speech_envelope,
    speed_peaks,
    wrist_speed,
)
from a2g_jax.talker.recordings import resample_motion, talk
from a2g_jax.training.run import Run, demo_run, load_run
from a2g_jax.training.validation import Validator

#: Seconds from a stroke's fastest moment to its syllable's energy peak in the generated corpus.
LEAD = 0.15
SIGMA = 0.1


def local_positions(motion: Motion) -> np.ndarray:
    """Joint positions relative to the root, metres."""
    return motion.positions() - motion.root[:, None]


def multimodality(motions: list[Motion]) -> float:
    """Mean L1 distance of joints between pairs of motions for one audio, centimetres."""
    places = [local_positions(motion) for motion in motions]
    return float(np.mean([100 * np.abs(a - b).sum(axis=-1).mean() for a, b in combinations(places, 2)]))


def jerk(motion: Motion) -> float:
    """90th percentile of the wrists' jerk, m/s^3 (third differences)."""
    body = find_body_joints(motion.skeleton)
    joints = motion.positions() if body is None else motion.positions()[:, [body[20], body[21]]]
    third = np.diff(joints, n=3, axis=0) * motion.fps**3
    return float(np.percentile(np.linalg.norm(third, axis=-1), 90))


def on_corpus(run: Run, corpus: Corpus, samples: int, takes: int) -> dict[str, object]:
    """Figures on the held-out splits of a corpus; on a generated one the truth's as well."""
    generator = Generator(run)
    losses = held_out(run, corpus)
    if corpus.recipe.get("reader") != "talker":
        return losses  # a real recording has one take, and no truth to draw from
    roles = [corpus.recipe["roles"][segment.recording] for segment in corpus.splits["test"]][:takes]
    recordings = [talk(**role, fps=run.config.fps) for role in roles]
    speech = []
    for take in recordings:
        envelope = speech_envelope(take.audio, take.sample_rate, run.config.fps, take.motion.frames)
        speech.append(energy_peaks(envelope, run.config.fps))
    ours, truth, own, others, true_own, true_others, jerks, true_jerks = ([] for _ in range(8))
    for index, take in enumerate(recordings):
        motions = generator.generate(take.audio, samples, seed=index)
        right = [resample_motion(take, key)[0] for key in range(samples)]
        ours.append(multimodality(motions))
        truth.append(multimodality(right))
        for group, hit, miss in ((motions, own, others), (right, true_own, true_others)):
            for motion in group:
                moves = speed_peaks(wrist_speed(motion), motion.fps)
                scores = [agreement(moves, times, SIGMA, LEAD) for times in speech]
                hit.append(scores[index])
                miss += [score for other, score in enumerate(scores) if other != index]
        jerks += [jerk(motion) for motion in motions]
        true_jerks += [jerk(motion) for motion in right]
    return {
        "test recordings": len(recordings),
        "samples": samples,
        **losses,
        "multimodality_cm": float(np.mean(ours)),
        "true_multimodality_cm": float(np.mean(truth)),
        "agreement": _spread(own),
        "agreement_with_other_audio": _spread(others),
        "true_agreement": _spread(true_own),
        "true_agreement_with_other_audio": _spread(true_others),
        "jerk_p90": float(np.mean(jerks)),
        "true_jerk_p90": float(np.mean(true_jerks)),
    }


def held_out(run: Run, corpus: Corpus) -> dict[str, object]:
    """Reconstruction error on all held-out data, and that of the training data's mean pose."""
    model = run.config.build()
    validate = Validator(model, corpus, run.config)
    parts = {split: validate(run.params, split=split) for split in ("validation", "test")}
    return {
        split: {name: terms[name] for name in ("reconstruction_cm", "mean_pose_cm")}
        for split, terms in parts.items()
        if terms
    }


def _spread(values: list[float]) -> dict[str, float]:
    if not values:
        return {"n": 0}
    return {"mean": float(np.mean(values)), "std": float(np.std(values)), "n": len(values)}


def on_speech(run: Run, path: Path, samples: int) -> dict[str, object]:
    """Figures on one real recording's audio."""
    rate = run.config.mel.sample_rate
    audio = read_audio(path, rate)
    motions = Generator(run).generate(audio, samples, seed=0)
    scores = [agreement_with_null(motion, audio, rate, sigma=SIGMA, lead=LEAD) for motion in motions]
    envelope = speech_envelope(audio, rate, run.config.fps, motions[0].frames)
    quiet = envelope < envelope.max() - 30
    # The middle of a pause: hands need a moment to come down.
    pause = np.convolve(~quiet, np.ones(round(0.8 * run.config.fps)), "same") == 0
    speeds = np.stack([wrist_speed(motion) for motion in motions])
    return {
        "file": path.name,
        "seconds": len(audio) / rate,
        "agreement": _spread([score.value for score in scores]),
        "null": _spread([score.null_mean for score in scores]),
        "null_std_of_one": float(np.mean([score.null_std for score in scores])),
        "z_of_one": float(np.mean([score.z for score in scores])),
        "samples_above_null_mean": int(sum(score.value > score.null_mean for score in scores)),
        "samples": samples,
        "wrist_speed_in_speech": float(speeds[:, ~quiet].mean()),
        "wrist_speed_in_pauses": float(speeds[:, pause].mean()) if pause.any() else None,
        "pause_seconds": float(pause.sum() / run.config.fps),
        "jerk_p90": float(np.mean([jerk(motion) for motion in motions])),
    }


def main() -> None:
    """Print the figures as JSON, and write them with ``--out``."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run")
    parser.add_argument("--corpus", type=Path)
    parser.add_argument("--speech", type=Path, nargs="*", default=[])
    parser.add_argument("--samples", type=int, default=20)
    parser.add_argument("--takes", type=int, default=6, help="most recordings of the test split to use")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    run = demo_run() if options.run == "demo" else load_run(options.run)
    result: dict[str, object] = {"run": options.run, "steps": run.steps}
    if options.corpus is not None:
        result["corpus"] = on_corpus(run, Corpus.open(options.corpus), options.samples, options.takes)
    result["speech"] = [on_speech(run, path, options.samples) for path in options.speech]
    text = json.dumps(result, indent=2)
    print(text)
    if options.out is not None:
        options.out.write_text(text + "\n")


if __name__ == "__main__":
    main()
