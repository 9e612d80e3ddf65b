"""Whether Audio2Gestures stands still or ignores the speech, for any seed, backbone and pose representation.

    python -m experiments.audio2gestures.collapse --corpora FOLDER [--steps 1000] [--seeds 0,1,2]

FOLDER holds generated corpora of the same talk by representation, made by

    for each of  6d: (no flag)   exponential: --pose exponential   directions: --view ted   keypoints: --view s2g
    a2g prepare talker --minutes 90 --seed 6 [flag] --out FOLDER/NAME

Each run is the ``tiny`` preset with one set of loss weights, two thirds of the steps in its first stage. A run
stands still if the wrists of its samples (all points, where there are no wrists) move less than half as fast as
people's, and is deaf by the listening audit of ``a2g evaluate``. Spreads are standard deviations of the codes' means
over the validation clips. Writes ``results/collapse.jsonl`` and ``results/collapse.md``.
"""

import argparse
from pathlib import Path
from typing import Any

import jax
import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.evaluation.evaluate import evaluate
from a2g_jax.generation.engine import Engine
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.models.audio2gestures.codec import Codec
from a2g_jax.models.base import Condition
from a2g_jax.training.run import Run
from experiments.tables.records import append, name_of, path_of, records
from experiments.tables.setting import Setting, Variant
from experiments.tables.training import described, trained

TABLE = "audio2gestures/collapse"
REPRESENTATIONS = ("6d", "exponential", "directions", "keypoints")
BACKBONES = ("tcn", "gru", "transformer")
#: Smallest share of the truth's speed of a motion that does not stand still.
STILL = 0.5
_SAMPLES, _CLIPS, _FRAMES = 3, 24, 256


def cases() -> list[tuple[str, str]]:
    """Representation and backbone of every run: all backbones on 6D, one on the others."""
    return [("6d", backbone) for backbone in BACKBONES] + [(name, "tcn") for name in REPRESENTATIONS[1:]]


def spreads(run: Run, corpus: Corpus) -> dict[str, float]:
    """Standard deviations of the means of S_A, S_M and I_M over validation clips, mean over channels."""
    codec = Codec(run.config.model_config, run.config.data())
    rows = [
        row
        for segment in corpus.segments("validation")
        for row in range(segment.start, segment.stop - _FRAMES + 1, _FRAMES)
    ][:_CLIPS]
    audio, pose = (np.stack([array[row : row + _FRAMES] for row in rows]) for array in (corpus.audio, corpus.pose))
    audio = np.asarray(corpus.statistics["audio"].normalise(audio), np.float32)

    @jax.jit
    def means(params, audio, pose):
        shared, specific = codec.encode_motion(params, pose)
        assert specific is not None
        return codec.encode_audio(params, audio).mean, shared.mean, specific.mean

    found = means(run.params, audio, np.asarray(pose, np.float32))
    names = ("spread_s_audio", "spread_s_motion", "spread_i_motion")
    return {name: float(np.asarray(code).std((0, 1)).mean()) for name, code in zip(names, found, strict=True)}


def speed(space: PoseSpace, pose: np.ndarray, fps: float) -> float:
    """Mean speed of the wrists, or of every point without wrists, units a second."""
    places = space.wrists(space.positions(pose))
    return float(np.linalg.norm(np.diff(places, axis=0), axis=-1).mean() * fps)


def measured(run: Run, corpus: Corpus, seed: int) -> dict[str, Any]:
    """Speed of samples and of the truth, the audit's verdicts, and the spreads of the codes."""
    space, fps = corpus.space, corpus.fps
    segments = corpus.segments("test")
    engine = Engine(run)
    speeds = [
        speed(space, pose, fps)
        for segment in segments
        for pose in engine.rows(Condition(np.asarray(corpus.audio[segment.start : segment.stop])), _SAMPLES, seed)
    ]
    truths = [speed(space, np.asarray(corpus.pose[segment.start : segment.stop]), fps) for segment in segments]
    audits = evaluate({"run": run}, corpus, samples=_SAMPLES, seed=seed, audit=True, baselines=False)["audits"]
    return {
        "speed": float(np.mean(speeds)),
        "true_speed": float(np.mean(truths)),
        "sampling_cm": audits["run"]["sampling_cm"],
        "verdicts": audits["run"]["verdicts"],
        **spreads(run, corpus),
    }


def page() -> str:
    """The records as a table."""
    lines = [
        "# Does Audio2Gestures collapse?",
        "",
        "Samples of `tiny`, test split of 90 minutes of generated talk; see the docstring of"
        " `experiments/audio2gestures/collapse.py`.",
        "",
        "| poses | backbone | seed | steps | speed, of the truth's | listening audit | S_A | S_M | I_M |",
        "|" + " --- |" * 9,
    ]
    for one in sorted(records(TABLE), key=lambda r: (cases().index((r["poses"], r["backbone"])), r["seed"])):
        ratio = one["speed"] / one["true_speed"]
        values = (f"{one[name]:.2f}" for name in ("spread_s_audio", "spread_s_motion", "spread_i_motion"))
        state = "" if ratio >= STILL else " (stands still)"
        verdict = "; ".join(one["verdicts"])
        cells = (one["poses"], one["backbone"], str(one["seed"]), str(one["steps"]), f"{ratio:.2f}{state}", verdict)
        lines.append("| " + " | ".join((*cells, *values)) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Train and measure what is missing, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--corpora", type=Path, help="without it, the page is written from the records")
    parser.add_argument("--runs", type=Path, default=Path("runs"))
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--seeds", default="0,1,2")
    parser.add_argument("--only", help="representation, or representation/backbone")
    options = parser.parse_args()
    seeds = [int(seed) for seed in options.seeds.split(",")] if options.corpora else []
    for seed in seeds:
        for poses, backbone in cases():
            if options.only and options.only not in (poses, f"{poses}/{backbone}"):
                continue
            corpus = Corpus.open(options.corpora / poses)
            adversarial = options.steps // 3
            first = options.steps - adversarial
            where = Setting(options.corpora / poses, None, options.runs, first, _SAMPLES, (seed,), 1e9)
            variant = Variant(
                {"backbone": backbone, "adversarial_steps": adversarial, "rest_smoothing": 0},
                training={"batch_size": 4},
            )
            digest, config = described("run", variant, {}, seed, corpus, where)
            key: dict[str, Any] = {"variant": f"{poses}, {backbone}", "seed": seed, "steps": options.steps}
            key |= {"poses": poses, "backbone": backbone, "corpus": name_of(corpus), "settings": digest}
            if any(all(record.get(name) == value for name, value in key.items()) for record in records(TABLE)):
                continue
            run, seconds, computing = trained(config, variant, corpus, where)
            figures = measured(run, corpus, seed)
            append(TABLE, {**key, "seconds": seconds, "cpu_seconds": computing, **figures})
            print(f"{poses}, {backbone}, seed {seed}: {figures}", flush=True)
    path_of(TABLE, ".md").write_text(page(), encoding="utf-8")
    print(page())


if __name__ == "__main__":
    main()
