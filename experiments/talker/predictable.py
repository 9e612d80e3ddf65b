"""Whether a simple regressor finds in the audio what the audio determines.

    python -m experiments.talker.predictable [--repeats 1] [--seed 0]

A logistic regression on a window of features (16 mel bands, two levels, pitch, voicing at nine times within +-0.4 s)
predicts for every frame whether a stroke arrives there; a ridge regression on the same window predicts its size. Folds
by recording. For comparison: the same predictions shifted against the strokes, and peaks of the energy alone.
"""

import argparse
import warnings
from functools import partial
from typing import Any

import numpy as np
from scipy import ndimage, signal, stats
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import LogisticRegression, RidgeCV
from sklearn.model_selection import GroupKFold, cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from a2g_jax.talker.recordings import talk
from experiments.talker import movement, sound
from experiments.talker.common import Part, cast_evenly, interval_of, parallel, run_part, table

FPS = 30.0
FOLDS = 5
TOLERANCE = 0.1
#: A frame counts as a stroke's if it lies this close to the apex, seconds.
_HALF = 0.05
_OFFSETS = np.arange(-0.4, 0.41, 0.1)
_THRESHOLDS = np.linspace(50, 98, 17)


def window(voice: sound.Voice, times: np.ndarray) -> np.ndarray:
    """(T, 9 * 20) features around each time."""
    return np.concatenate([sound.frame_features(voice, times + offset) for offset in _OFFSETS], axis=1)


def read(role: dict[str, Any]) -> dict[str, Any]:
    """Features and strokes of one recording."""
    take = talk(**role, fps=FPS)
    voice = sound.analyse(take.audio, take.sample_rate)
    times = np.arange(take.motion.frames) / FPS
    moves = movement.paths(movement.body_positions(take.motion), FPS)
    speed = movement.derivative(moves.wrists, 1).max(axis=1)
    strokes = take.annotations["gestures"]["strokes"]
    peaks = np.array([take.annotations["speech"]["syllables"][stroke["syllable"]]["peak"] for stroke in strokes])
    apexes = np.array([stroke["apex"] for stroke in strokes])
    fastest = [
        speed[max(0, round((apex - 0.35) * movement.RATE)) : max(1, round((apex + 0.05) * movement.RATE))].max()
        for apex in apexes
    ]
    return {
        "features": window(voice, times).astype(np.float32),
        "energy": np.interp(times, np.arange(len(voice.syllabic)) / sound.RATE, voice.syllabic),
        "apexes": apexes,
        "detected": movement.stroke_peaks(speed) / movement.RATE,
        "sizes": np.array([stroke["size"] for stroke in strokes]),
        "speeds": np.array(fastest),
        "at_strokes": window(voice, peaks) if len(peaks) else np.zeros((0, len(_OFFSETS) * 20)),
        "seconds": take.motion.seconds,
        "speaker": role["speaker"],
    }


def pick(curve: np.ndarray, threshold: float) -> np.ndarray:
    """Times (s) of the peaks of a curve above a threshold, 0.3 s and more apart."""
    peaks, _ = signal.find_peaks(curve, height=threshold, distance=round(0.3 * FPS))
    return peaks / FPS


def matches(guesses: np.ndarray, strokes: np.ndarray) -> int:
    """Number of one-to-one pairs of predictions and strokes within the tolerance, nearest first."""
    if len(guesses) == 0 or len(strokes) == 0:
        return 0
    distance = np.abs(guesses[:, None] - strokes[None])
    near = np.argwhere(distance <= TOLERANCE)
    taken_guesses: set[int] = set()
    taken_strokes: set[int] = set()
    for guess, stroke in near[np.argsort(distance[tuple(near.T)])].tolist():
        if guess not in taken_guesses and stroke not in taken_strokes:
            taken_guesses.add(guess)
            taken_strokes.add(stroke)
    return len(taken_guesses)


def counts(guesses: list[np.ndarray], strokes: list[np.ndarray]) -> np.ndarray:
    """(recordings, 2): pairs, and guesses and strokes together."""
    return np.array([[matches(g, s), len(g) + len(s)] for g, s in zip(guesses, strokes, strict=True)])


def f1(guesses: list[np.ndarray], strokes: list[np.ndarray]) -> float:
    """F1 over recordings."""
    return f1_of(counts(guesses, strokes))


def f1_of(rows: np.ndarray) -> float:
    """F1 from the counts of recordings."""
    hits, total = rows.sum(axis=0)
    return float(2 * hits / max(total, 1))


def auc(curves: list[np.ndarray], labels: list[np.ndarray]) -> float:
    """Probability that a stroke's frame has the higher value than another frame (Mann and Whitney)."""
    values, truth = np.concatenate(curves), np.concatenate(labels)
    ranks = stats.rankdata(values)
    hits, rest = int(truth.sum()), int((~truth).sum())
    return float((ranks[truth].sum() - hits * (hits + 1) / 2) / max(hits * rest, 1))


def best_threshold(curves: list[np.ndarray], strokes: list[np.ndarray]) -> float:
    """The threshold with the highest F1 among percentiles of the curves."""
    candidates = np.percentile(np.concatenate(curves), _THRESHOLDS)
    return float(max(candidates, key=lambda height: f1([pick(c, height) for c in curves], strokes)))


def judge(takes: list[dict[str, Any]], target: str, shifts: int, seed: int) -> dict[str, Any]:
    """AUC and F1 of stroke times out of fold, of the energy alone, and of both shifted."""
    strokes = [take[target] for take in takes]
    labels = []
    for take, times in zip(takes, strokes, strict=True):
        grid = np.arange(len(take["energy"])) / FPS
        near = np.abs(grid[:, None] - times[None]).min(axis=1) if len(times) else np.full(len(grid), np.inf)
        labels.append(near <= _HALF)
    curves: dict[str, list[Any]] = {"regressor": [None] * len(takes), "energy alone": [None] * len(takes)}
    guesses = {name: list(values) for name, values in curves.items()}
    folds = GroupKFold(min(FOLDS, len(takes))).split(takes, groups=np.arange(len(takes)))
    for train, test in folds:
        model = make_pipeline(StandardScaler(), LogisticRegression(C=0.01, max_iter=100))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)
            # Every second frame: neighbours are redundant.
            model.fit(
                np.concatenate([takes[i]["features"][::2] for i in train]),
                np.concatenate([labels[i][::2] for i in train]),
            )
        likely = lambda i: ndimage.gaussian_filter1d(model.decision_function(takes[i]["features"]), 1.0)  # noqa: B023, E731
        # The best lag of the energy against strokes is learned as well.
        lag = max(
            range(8), key=lambda k: auc([np.roll(takes[i]["energy"], -k) for i in train], [labels[i] for i in train])
        )
        loud = lambda i: np.roll(takes[i]["energy"], -lag)  # noqa: B023, E731
        for name, curve in (("regressor", likely), ("energy alone", loud)):
            train_curves = [curve(i) for i in train]
            height = best_threshold(train_curves, [strokes[i] for i in train])
            for i in test:
                curves[name][i] = curve(i)
                guesses[name][i] = pick(curves[name][i], height)
    rng = np.random.default_rng([seed, 71])
    figures: dict[str, Any] = {"strokes": sum(map(len, strokes)), "minutes": sum(t["seconds"] for t in takes) / 60}
    for name in curves:
        value = {"auc": auc(curves[name], labels), "f1": f1(guesses[name], strokes)}
        null_auc, null_f1 = [], []
        for _ in range(shifts):
            moved = [rng.uniform(1.0, take["seconds"] - 1.0) for take in takes]
            null_f1.append(
                f1([(g + m) % t["seconds"] for g, m, t in zip(guesses[name], moved, takes, strict=True)], strokes)
            )
            null_auc.append(auc([np.roll(c, round(m * FPS)) for c, m in zip(curves[name], moved, strict=True)], labels))
        found = counts(guesses[name], strokes)
        value["f1_95"] = interval_of(lambda index, found=found: f1_of(found[index]), len(takes))
        pick_auc = lambda index, name=name: auc([curves[name][i] for i in index], [labels[i] for i in index])  # noqa: E731
        value["auc_95"] = interval_of(pick_auc, len(takes))
        value |= {"auc_null": float(np.mean(null_auc)), "auc_null_95": np.percentile(null_auc, (2.5, 97.5)).tolist()}
        value |= {"f1_null": float(np.mean(null_f1)), "f1_null_95": np.percentile(null_f1, (2.5, 97.5)).tolist()}
        figures[name] = value
    return figures


def size_score(takes: list[dict[str, Any]], target: str, shuffles: int, seed: int) -> dict[str, Any]:
    """R^2 of stroke sizes out of fold, with those of sizes shuffled between strokes."""
    rows = np.concatenate([take["at_strokes"] for take in takes])
    sizes = np.concatenate([take[target] for take in takes])
    groups = np.concatenate([np.full(len(take[target]), index) for index, take in enumerate(takes)])
    folds = GroupKFold(min(FOLDS, len(takes)))
    model = make_pipeline(StandardScaler(), RidgeCV(np.logspace(1, 5, 9)))
    guess = lambda values: cross_val_predict(model, rows, values, groups=groups, cv=folds)  # noqa: E731
    score = lambda values, guesses: 1 - np.sum((values - guesses) ** 2) / np.sum((values - values.mean()) ** 2)  # noqa: E731
    found = guess(sizes)
    rng = np.random.default_rng([seed, 72])
    null = []
    for _ in range(shuffles):
        values = rng.permutation(sizes)
        null.append(score(values, guess(values)))
    members = [np.flatnonzero(groups == index) for index in range(len(takes))]

    def of_takes(index: np.ndarray) -> float:
        chosen = np.concatenate([members[i] for i in index])
        return float(score(sizes[chosen], found[chosen]))

    return {
        "strokes": len(sizes),
        "r2": float(score(sizes, found)),
        "r2_95": interval_of(of_takes, len(takes)),
        "correlation": float(np.corrcoef(sizes, found)[0, 1]),
        "r2_null_95": np.percentile(null, (2.5, 97.5)).tolist() if null else None,
    }


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the amount of talk."""
    parser.add_argument("--repeats", type=int, default=1, help="recordings of every speaker in every emotion")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--shifts", type=int, default=30, help="shifts and shuffles of the nulls")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Times and sizes of strokes, over all speakers and within each."""
    roles = cast_evenly(options.repeats, options.seconds, options.seed)
    takes = parallel(read, roles, options.workers)
    speakers = sorted({take["speaker"] for take in takes})
    own = [[take for take in takes if take["speaker"] == name] for name in speakers]
    tasks = [(takes, "apexes"), (takes, "detected"), *((group, "apexes") for group in own)]
    times = parallel(partial(_judge_task, shifts=options.shifts, seed=options.seed), tasks, options.workers)
    sizes = {
        "size from the truth": size_score(takes, "sizes", min(options.shifts, 20), options.seed),
        "fastest wrist speed in the motion": size_score(takes, "speeds", min(options.shifts, 20), options.seed),
    }
    return {
        "recordings": len(roles),
        "seconds": options.seconds,
        "folds": FOLDS,
        "tolerance": TOLERANCE,
        "times": {"true apexes, all speakers": times[0], "strokes found in the motion, all speakers": times[1]}
        | {f"true apexes, {name} alone": value for name, value in zip(speakers, times[2:], strict=True)},
        "sizes": sizes,
    }


def _judge_task(task: tuple[list[dict[str, Any]], str], shifts: int, seed: int) -> dict[str, Any]:
    return judge(*task, shifts, seed)


def tables(result: dict[str, Any]) -> str:
    """Times, then sizes."""
    rows = []
    for what, value in result["times"].items():
        for name in ("regressor", "energy alone"):
            keys = ("auc", "auc_95", "auc_null_95", "f1", "f1_95", "f1_null_95")
            rows.append([what, name, value["strokes"], *(value[name][key] for key in keys)])
    headings = ["", "by", "strokes", "AUC", "95 %", "shifted, 95 % band", f"F1 within {result['tolerance']:g} s"]
    first = table(rows, [*headings, "95 %", "shifted, 95 % band"])
    keys = ("strokes", "r2", "r2_95", "correlation", "r2_null_95")
    second = table(
        [[name, *(value[key] for key in keys)] for name, value in result["sizes"].items()],
        ["size of strokes", "strokes", "R^2", "95 %", "correlation", "R^2 of shuffled sizes, 95 % band"],
    )
    size = f"{result['recordings']} recordings of {result['seconds']:g} s, every other one in a room; folds by "
    return f"{size}recording ({result['folds']}); intervals by drawing recordings.\n\n{first}\n{second}"


PART = Part("predictable", "Strokes from the audio", add_arguments, run, tables)

if __name__ == "__main__":
    run_part(PART)
