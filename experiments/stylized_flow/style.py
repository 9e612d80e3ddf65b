"""Transfer of a clip's style, and agreement of the rhythm with the new speech (Sec. 4.5, Fig. 8).

    python -m experiments.stylized_flow.style RUN --corpus CORPUS [--pairs 12] [--samples 3]

Motion is generated for speech of one speaker of the generated corpus, plainly and with the latents of a clip of another
speaker, both newly generated; runs trained for it also take the clip's style code and controls. Measured: the way of
mean height, speed and radius of the hands from plain motion to the clip's (a projection, in units of the spread over
speakers); the probability of the clip's speaker by a classifier trained on the corpus's own motion; and agreement of
the wrists' speed with the speech, also of shifted motion.
Writes ``results/style.json``.
"""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from a2g_jax.data.corpus import Corpus
from a2g_jax.generation.stylized_flow.latent_space import FlowSpace
from a2g_jax.geometry.pose_track import represent
from a2g_jax.io.files import write_json
from a2g_jax.metrics.intervals import mean_interval
from a2g_jax.metrics.rhythm import agreement_with_null
from a2g_jax.metrics.style import HandStyle, hand_style
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from a2g_jax.training.run import open_run
from experiments.tables.records import results

SECONDS = 20.0
#: Mode, share of style, and whether motion continues from the clip's last poses instead of the mean pose.
SETTINGS = (
    *(("repeat", 0.7, False), ("repeat", 0.9, False), ("repeat", 1.0, False), ("repeat", 0.9, True)),
    *(("repeat", 1.0, True), ("statistics", 0.9, False)),
)


def clip_features(pose: Float[np.ndarray, "T R D"]) -> Float[np.ndarray, " F"]:
    """Features for the classifier: mean and standard deviation of every value, standard deviation of its steps."""
    flat = pose.reshape(len(pose), -1)
    steps = np.diff(flat, axis=0)
    return np.concatenate([flat.mean(axis=0), flat.std(axis=0), 10.0 * steps.std(axis=0)])


def speaker_classifier(corpus: Corpus) -> tuple[Any, float, dict[str, HandStyle]]:
    """Classifier trained on the training split, its accuracy on the test split, and each speaker's hand style."""
    frames = round(SECONDS * corpus.fps)
    space = corpus.space

    def pieces(split: str) -> list[tuple[str, np.ndarray]]:
        return [
            (corpus.recordings[segment.recording].speaker, np.asarray(corpus.pose[row : row + frames]))
            for segment in corpus.segments(split)
            for row in range(segment.start, segment.stop - frames + 1, frames)
        ]

    train, test = pieces("train"), pieces("test")
    model = make_pipeline(StandardScaler(), LogisticRegression(C=0.1, max_iter=2000))
    model.fit([clip_features(pose) for _, pose in train], [name for name, _ in train])
    accuracy = model.score([clip_features(pose) for _, pose in test], [name for name, _ in test])
    styles = {
        name: HandStyle(
            *np.mean([hand_style(space.positions(pose), corpus.fps) for who, pose in train if who == name], axis=0)
        )
        for name in sorted({who for who, _ in train})
    }
    return model, float(accuracy), styles


def projection(source: HandStyle, target: HandStyle, made: HandStyle, unit: Float[np.ndarray, " 3"]) -> float:
    """Share of the way from source to target that the generated style covers, in units of the speakers' spread."""
    way, went = (np.array(target) - source) / unit, (np.array(made) - source) / unit
    return float(way @ went / (way @ way))


def mean_style(motions: Any) -> HandStyle:
    """Mean hand style of several motions."""
    return HandStyle(*np.mean([hand_style(one.positions(), one.fps) for one in motions], axis=0))


def measure(run_name: str, corpus: Corpus, pairs: int, samples: int, seed: int) -> dict[str, Any]:
    """All measures for each setting."""
    run = open_run(run_name)
    space, fps = FlowSpace(run, window=512), run.config.fps
    model, accuracy, styles = speaker_classifier(corpus)
    unit = np.std([np.array(style) for style in styles.values()], axis=0)
    names = list(SPEAKERS)
    kind = run.config.space.kind

    def likelihood(motions: Any, speaker: str) -> float:
        rows = [clip_features(represent(one, kind, "motion")[0]) for one in motions]
        return float(model.predict_proba(rows)[:, list(model.classes_).index(speaker)].mean())

    rows: dict[str, list[dict[str, float]]] = {}
    for number in range(pairs):
        ours, theirs = names[number % 6], names[(number + 1 + number // 6) % 6]
        if ours == theirs:
            theirs = names[(number + 2) % 6]
        speech = talk(SECONDS, seed + 300_000 + 2 * number, speaker=ours, fps=fps)
        clip = talk(SECONDS, seed + 300_001 + 2 * number, speaker=theirs, fps=fps)
        whole = space.style(clip.motion, clip.audio)
        plain = space.generate(speech.audio, samples, seed=number)
        source, target = mean_style(plain), hand_style(clip.motion.positions(), fps)
        conditions = {"plain": plain, "the clip itself": [clip.motion]}
        for mode, share, seeded in SETTINGS:
            style = replace(whole, mode=mode, share=share)
            before = clip.motion if seeded else None
            name = f"{mode}, share {share:g}" + (", after the clip" if seeded else "")
            conditions[name] = space.generate(speech.audio, samples, number, style, before)
        for name, motions in conditions.items():
            audio = clip.audio if name == "the clip itself" else speech.audio
            found = [agreement_with_null(one, audio, 16000) for one in motions]
            rows.setdefault(name, []).append(
                {
                    "way": projection(source, target, mean_style(motions), unit),
                    "target_speaker": likelihood(motions, theirs),
                    "agreement": float(np.mean([one.value for one in found])),
                    "agreement_shifted": float(np.mean([one.null_mean for one in found])),
                    "speed": mean_style(motions).speed,
                }
            )
    table = {
        name: {key: mean_interval(np.array([row[key] for row in many])).to_json() for key in many[0]}
        for name, many in rows.items()
    }
    about = {"run_steps": run.steps, "pairs": pairs, "samples": samples, "seconds": SECONDS}
    return {**about, "classifier_accuracy_on_test_motion": accuracy, "settings": table}


def main() -> None:
    """Measure a run and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="a run folder, or 'demo-flow'")
    parser.add_argument("--corpus", type=Path, required=True, help="generated, as the run's own")
    parser.add_argument("--pairs", type=int, default=12)
    parser.add_argument("--samples", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    corpus = Corpus.open(options.corpus)
    figures = measure(options.run, corpus, options.pairs, options.samples, options.seed)
    for name, row in figures["settings"].items():
        print(
            name,
            {
                key: tuple(None if value[end] is None else round(value[end], 3) for end in ("mean", "low", "high"))
                for key, value in row.items()
            },
        )
    about = {"corpus": corpus.fingerprint[:16], "seed": options.seed, "run": Path(options.run).name}
    write_json(results("stylized_flow") / "style.json", {**about, **figures})


if __name__ == "__main__":
    main()
