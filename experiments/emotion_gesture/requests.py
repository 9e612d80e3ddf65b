"""Requested emotions: every speech in every emotion, as a classifier of other recordings sees them."""

from dataclasses import replace
from typing import Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.evaluation.emotion_judge import EmotionJudge
from a2g_jax.generation.controls import control_rows
from a2g_jax.generation.generator import Generator
from a2g_jax.geometry.pose_track import represent
from a2g_jax.metrics.labels import confusion
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from a2g_jax.training.run import Run
from experiments.emotion_gesture.bench import Bench
from experiments.emotion_gesture.scores import Cell, cell

#: Speeches, the seconds of each that are generated, and samples of each in each emotion.
SPEECHES, SECONDS, SAMPLES = 6, 30.0, 2
#: Frames of a window of generation: as long as the speeches at 15 frames a second.
_WINDOW = 512
#: Seed of the talk that the truth is measured on; no corpus of the tables has it.
TRUE_SEED = 4077


def takes_requests(run: Run) -> bool:
    """Whether a run can be given an emotion other than the speech's: by a label, or by sampled emotion features."""
    return run.config.model == "emotion_gesture" and (
        run.config.model_config.branches == "label" or run.params.get("vae") is not None
    )


def requested(run: Run, bench: Bench, seed: int, control: bool = False) -> dict[str, Any]:
    """Scores and counts of test speeches in every emotion that the run and the judge have; no seed clip is given.

    Args:
        control: whether emotions are requested by ``--control emotion=X`` in place of weights of the emotions.
    """
    judge, corpus = bench.ruler.judge, bench.corpus
    assert judge is not None
    plain = run if control else replace(run, config=run.config.with_sampling(emotion="label"))
    generator = Generator(plain, _WINDOW)
    names = list(run.config.corpus["emotions"])
    segments = corpus.segments("test")
    chosen = segments[:: max(1, len(segments) // SPEECHES)][:SPEECHES]
    tally, others, each = _Tally(judge), _Tally(judge), []
    for number, segment in enumerate(chosen):
        alone = _Tally(judge)
        stop = min(segment.stop, segment.start + round(SECONDS * corpus.fps))
        audio = np.asarray(corpus.audio[segment.start : stop])
        for emotion in judge.emotions:
            if emotion not in names:
                continue
            weights = np.tile(np.eye(len(names), dtype=np.float32)[names.index(emotion)], (len(audio), 1))
            given: dict[str, Any] = {"emotion": weights}
            if control:
                given = {"controls": control_rows(run, [f"emotion={emotion}"], len(audio))}
            for rows in generator.rows(audio, SAMPLES, (seed + 7919 * (number + 1)) % 2**31, **given):
                tally.add(rows, emotion)
                alone.add(rows, emotion)
                if emotion != corpus.recordings[segment.recording].emotion:
                    others.add(rows, emotion)
        each.append(alone.accuracy)
    if not tally.counts.any():
        raise InputError("--judge: has none of the emotions of the run.")
    scores = {"requested_accuracy": cell(tally.accuracy), "requested_other_accuracy": cell(others.accuracy)}
    return {"scores": scores | tally.above(), "requests": tally.counts.tolist(), "by_speech": each}


def true_emotions(bench: Bench) -> dict[str, Any]:
    """The same of talk in each emotion by every speaker, which is what a run can reach at most."""
    judge, corpus = bench.ruler.judge, bench.corpus
    assert judge is not None
    tally = _Tally(judge)
    for emotion in judge.emotions:
        for who, speaker in enumerate(SPEAKERS):
            take = talk(SECONDS, TRUE_SEED + who, speaker=speaker, emotion=emotion, fps=corpus.fps)
            tally.add(represent(take.motion, corpus.space.kind, take.name)[0], emotion)
    scores = {"requested_accuracy": cell(tally.accuracy), "requested_other_accuracy": cell(tally.accuracy)}
    return {"scores": scores | tally.above(), "requests": tally.counts.tolist()}


class _Tally:
    """Counts of clips by requested and classified emotion, and of those more like the requested one than neutral."""

    def __init__(self, judge: EmotionJudge) -> None:
        self.judge, self.names = judge, judge.emotions
        self.counts = np.zeros((len(self.names),) * 2, int)
        #: Clips of a requested emotion (rows) where an emotion (columns) is more probable than neutral.
        self.over = np.zeros_like(self.counts)

    def add(self, pose, emotion: str) -> None:
        rows, own = self.judge.probabilities(pose), self.names.index(emotion)
        self.counts += confusion(rows, np.full(len(rows), own))
        if "neutral" in self.names:
            self.over[own] += np.sum(rows > rows[:, [self.names.index("neutral")]], axis=0)

    @property
    def accuracy(self) -> float:
        """Mean over emotions of the share of clips that are classified as requested."""
        totals = self.counts.sum(axis=1)
        return float(np.mean(np.diag(self.counts)[totals > 0] / totals[totals > 0]))

    def above(self) -> dict[str, Cell]:
        """By emotion the share of its clips where it is more probable than neutral, with the same share of the clips of
        neutral as ``null``; of neutral the share that is classified as neutral."""
        if "neutral" not in self.names:
            return {}
        neutral, totals, found = self.names.index("neutral"), self.counts.sum(axis=1), {}
        for own, name in enumerate(self.names):
            if own != neutral and totals[own] and totals[neutral]:
                null = self.over[neutral, own] / totals[neutral]
                found[f"above_neutral {name}"] = cell(self.over[own, own] / totals[own], null=float(null))
        if totals[neutral]:
            found["kept neutral"] = cell(self.counts[neutral, neutral] / totals[neutral])
        return found
