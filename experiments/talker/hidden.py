"""Whether the corpus's hidden choices are absent from the audio.

    python -m experiments.talker.hidden [--takes 10] [--permutations 20] [--seed 0]

Hand, family, place and hold of each gesture unit are predicted from features of the audio around its strokes. One
classifier a speaker, on neutral speech, cross-validated by recording: speakers and emotions differ in their preferences
and are audible, so a pooled classifier gains by identifying the speaker. Chance is the most frequent choice of the
training folds. The same classifiers on features of the motion are the positive control.
"""

import argparse
import warnings
from functools import partial
from typing import Any

import numpy as np
from sklearn.dummy import DummyClassifier
from sklearn.ensemble import RandomForestClassifier
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import GroupKFold
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from experiments.talker import movement, sound
from experiments.talker.common import Part, cast_evenly, interval_of, parallel, run_part, table

TARGETS = ("hand", "family", "place", "holds")
MODELS = ("logistic", "forest")
FOLDS = 5


def units(role: dict[str, Any]) -> list[dict[str, Any]]:
    """Features and hidden choices of each gesture unit of one recording."""
    take = talk(**role)
    voice = sound.analyse(take.audio, take.sample_rate)
    moves = movement.paths(movement.body_positions(take.motion), take.motion.fps)
    speed = movement.derivative(moves.wrists, 1)
    truth = take.annotations["gestures"]
    syllables = take.annotations["speech"]["syllables"]
    rows = []
    for unit in truth["units"]:
        strokes = [truth["strokes"][index] for index in unit["strokes"]]
        # Audio is taken around its own syllables: apex times contain a hidden lead.
        peaks = np.array([syllables[stroke["syllable"]]["peak"] for stroke in strokes])
        apexes = np.array([stroke["apex"] for stroke in strokes])
        rows.append(
            {
                "audio": audio_features(voice, peaks),
                "motion": motion_features(moves, speed, apexes),
                "speaker": role["speaker"],
                "take": role["name"],
                **{target: str(unit[target]) for target in TARGETS},
            }
        )
    return rows


def audio_features(voice: sound.Voice, peaks: np.ndarray) -> np.ndarray:
    """Audio around the strokes of a unit: mean and spread of bands, levels and pitch, wide and near, and its rhythm."""
    wide = np.arange(peaks[0] - 0.6, peaks[-1] + 0.6, 0.02)
    near = (peaks[:, None] + np.arange(-0.2, 0.2, 0.02)).ravel()
    parts = []
    for times in (wide, near):
        rows = sound.frame_features(voice, times)
        parts += [rows.mean(axis=0), rows.std(axis=0)]
    gaps = np.diff(peaks) if len(peaks) > 1 else np.zeros(1)
    ends = sound.frame_features(voice, peaks[[0, -1]])
    # Unnormalised as well: voice, relative loudness, pitch.
    raw = voice.mel[np.clip(np.rint(wide * sound.RATE).astype(int), 0, len(voice.mel) - 1)]
    voiced = voice.f0[np.clip(np.rint(wide * sound.RATE).astype(int), 0, len(voice.f0) - 1)]
    pitch = 12 * np.log2(voiced[np.isfinite(voiced)] / 100.0)
    high = np.percentile(pitch, (10, 50, 90)) if len(pitch) else np.zeros(3)
    rhythm = [len(peaks), peaks[-1] - peaks[0], gaps.mean(), gaps.min()]
    return np.concatenate([*parts, *ends, raw.mean(axis=0).reshape(16, -1).mean(axis=1), high, rhythm])


def motion_features(moves: movement.Paths, speed: np.ndarray, apexes: np.ndarray) -> np.ndarray:
    """Motion around the strokes of a unit: speed and place of both hands."""
    at = lambda times: np.clip(np.rint(times * movement.RATE).astype(int), 0, len(speed) - 1)  # noqa: E731
    stroke = at((apexes[:, None] + np.arange(-0.3, 0.05, 1 / 60)).ravel())
    after = at((apexes[:, None] + np.arange(0.05, 0.35, 1 / 60)).ravel())
    later = at(apexes[:, None] + np.arange(0.05, 0.65, 1 / 60))
    still = (speed[later] < 0.15).mean(axis=1)
    travelled = moves.reach[at(apexes)] - moves.reach[at(apexes - 0.25)]
    return np.concatenate(
        [
            np.log(speed[stroke].mean(axis=0) + 0.01),
            np.log(np.percentile(speed[stroke], 90, axis=0) + 0.01),
            np.log(speed[after].mean(axis=0) + 0.01),
            np.log(speed[after].min(axis=0) + 0.001),
            still.mean(axis=0),
            still[-1],
            moves.reach[at(apexes)].mean(axis=0).ravel(),
            moves.reach[at(apexes)].std(axis=0).ravel(),
            travelled.mean(axis=0).ravel(),
        ]
    )


def model(name: str, seed: int) -> Any:
    """Small classifiers, strongly regularised: a speaker has some two hundred units."""
    if name == "forest":
        return RandomForestClassifier(50, min_samples_leaf=3, random_state=seed)
    if name == "majority":
        return DummyClassifier()
    return make_pipeline(StandardScaler(), LogisticRegression(C=0.02, max_iter=1000))


def hits(name: str, rows: np.ndarray, labels: np.ndarray, takes: np.ndarray, seed: int) -> np.ndarray:
    """Units that a classifier predicts correctly, on recordings outside its training folds."""
    found = np.zeros(len(labels), bool)
    for train, test in GroupKFold(min(FOLDS, len(set(takes)))).split(rows, groups=takes):
        # A single label in the training folds leaves only the majority.
        one = len(set(labels[train])) == 1
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)
            guess = model("majority" if one else name, seed).fit(rows[train], labels[train]).predict(rows[test])
        found[test] = guess == labels[test]
    return found


def _task(task: tuple[str, np.ndarray, np.ndarray, np.ndarray, int], permutations: int) -> dict[str, np.ndarray]:
    """One classifier of one speaker: its hits, the majority's, and mean hits with labels shuffled between units."""
    name, rows, labels, takes, seed = task
    rng = np.random.default_rng([seed, 61])
    shuffled = [hits(name, rows, rng.permutation(labels), takes, seed).mean() for _ in range(permutations)]
    return {
        "own": hits(name, rows, labels, takes, seed),
        "majority": hits("majority", rows, labels, takes, seed),
        "null": np.array(shuffled),
    }


def compare(found: list[dict[str, np.ndarray]], takes: list[np.ndarray]) -> dict[str, Any]:
    """All speakers' units together: accuracy, the majority's, their difference with its interval, and the null."""
    own, majority = (np.concatenate([f[name] for f in found]) for name in ("own", "majority"))
    take = np.concatenate(takes)
    names = sorted(set(take))
    gain = own.astype(float) - majority.astype(float)
    per_take = [(gain[take == name].sum(), int(np.sum(take == name))) for name in names]
    gains, counts = (np.array(part) for part in zip(*per_take, strict=True))
    sizes = np.array([len(f["own"]) for f in found])
    null = np.average(np.stack([f["null"] for f in found]), axis=0, weights=sizes) if len(found[0]["null"]) else None
    accuracy = float(own.mean())
    figures: dict[str, Any] = {
        "units": len(own),
        "accuracy": accuracy,
        "majority": float(majority.mean()),
        "gain": float(gain.mean()),
        "gain_95": interval_of(lambda index: gains[index].sum() / counts[index].sum(), len(names)),
    }
    if null is not None:
        figures["null_mean"] = float(null.mean())
        figures["null_95"] = np.percentile(null, (2.5, 97.5)).tolist()
        figures["p"] = float((1 + np.sum(null >= accuracy)) / (1 + len(null)))
    return figures


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the amount of talk and the number of shuffles."""
    parser.add_argument("--takes", type=int, default=10, help="recordings of a minute for each speaker")
    parser.add_argument("--permutations", type=int, default=20)


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Every hidden choice from audio and from motion, within speakers; and from audio pooled over them."""
    roles = cast_evenly(options.takes, 60.0, options.seed, emotions=("neutral",), rooms=False)
    rows = [unit for take in parallel(units, roles, options.workers) for unit in take]
    column = lambda name: np.array([row[name] for row in rows])  # noqa: E731
    data = {sense: np.stack([row[sense] for row in rows]) for sense in ("audio", "motion")}
    takes, speaker = column("take"), column("speaker")
    members = [np.flatnonzero(speaker == name) for name in SPEAKERS if np.any(speaker == name)]
    cells = [(target, sense, name) for target in TARGETS for sense in data for name in MODELS]
    tasks, owners = [], []
    for target, sense, name in cells:
        for group in members:
            owners.append((target, sense, name))
            tasks.append((name, data[sense][group], column(target)[group], takes[group], options.seed))
    # Only the audio needs a null; the motion's gain is far from chance.
    audio_only = [index for index, owner in enumerate(owners) if owner[1] == "audio"]
    found: list[Any] = [None] * len(tasks)
    for indices, permutations in (
        (audio_only, options.permutations),
        ([index for index in range(len(tasks)) if index not in set(audio_only)], 0),
    ):
        results = parallel(partial(_task, permutations=permutations), [tasks[i] for i in indices], options.workers)
        for index, result in zip(indices, results, strict=True):
            found[index] = result
    groups = [takes[group] for group in members]
    within = {
        "/".join(cell): compare([f for f, owner in zip(found, owners, strict=True) if owner == cell], groups)
        for cell in cells
    }
    pooled_tasks = [(name, data["audio"], column(t), takes, options.seed) for t in TARGETS for name in MODELS]
    pooled = parallel(partial(_task, permutations=0), pooled_tasks, options.workers)
    names = [f"{target}/audio/{name}" for target in TARGETS for name in MODELS]
    return {
        "units": len(rows),
        "recordings": len(roles),
        "folds": FOLDS,
        "permutations": options.permutations,
        "choices": {t: {v: float(np.mean(column(t) == v)) for v in sorted(set(column(t)))} for t in TARGETS},
        "within_speakers": within,
        "pooled": {name: compare([f], [takes]) for name, f in zip(names, pooled, strict=True)},
    }


def tables(result: dict[str, Any]) -> str:
    """Within speakers with null, then pooled."""
    rows, control = [], []
    for cell, value in result["within_speakers"].items():
        target, sense, name = cell.split("/")
        if sense == "audio":
            keys = ("accuracy", "majority", "gain", "gain_95", "null_mean", "null_95", "p")
            rows.append([target, name, *(value[key] for key in keys)])
        else:
            control.append([target, name, *(value[key] for key in ("accuracy", "majority", "gain", "gain_95"))])
    pooled = []
    for cell, value in result["pooled"].items():
        target, _, name = cell.split("/")
        pooled.append([target, name, *(value[key] for key in ("accuracy", "majority", "gain", "gain_95"))])
    short = ["choice", "classifier", "accuracy", "majority", "gain", "95 % interval of the gain"]
    long = [*short, "labels shuffled: mean", "95 % band", "p"]
    return (
        f"{result['units']} gesture units of {result['recordings']} neutral recordings of a minute; cross-validated by "
        f"recording, {result['folds']} folds; intervals by drawing recordings; {result['permutations']} shuffles.\n\n"
        f"From the audio, one classifier a speaker (should gain nothing):\n\n{table(rows, long)}\n"
        f"From the motion, one classifier a speaker (control):\n\n{table(control, short)}\n"
        "From the audio, one classifier for all speakers; its gain over the majority of all speakers comes from "
        f"identifying the speaker:\n\n{table(pooled, short)}"
    )


PART = Part("hidden", "Hidden choices from the audio", add_arguments, run, tables)

if __name__ == "__main__":
    run_part(PART)
