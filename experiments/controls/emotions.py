"""Requested emotions, classified by a network that was trained on other true motion."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.evaluation.emotion_judge import EmotionJudge
from a2g_jax.geometry.pose_track import represent
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from experiments.controls.subject import SECONDS, Subject

#: Seed of the true motion that is classified for comparison.
SEED = 78


def confusion(
    subject: Subject, judge: EmotionJudge, emotions: Sequence[str], report: Callable[[], None] = lambda: None
) -> dict[str, Any]:
    """Shares of clips of each requested emotion that are classified as each, and agreement with the speech."""
    table, correct, agreement = [], [], []
    for emotion in emotions:
        made = list(subject.rows([f"emotion={emotion}"]))
        shares = np.array([judge.shares(rows, emotions) for _, rows in made])
        agreement.append(float(np.mean([subject.figures(speech, rows).agreement for speech, rows in made])))
        table.append(shares.mean(axis=0))
        correct.append(shares[:, emotions.index(emotion)].reshape(len(subject.speeches), -1).mean(axis=1))
        report()
    return _summary(np.array(table), np.array(correct)) | {"agreement": agreement}


def true_confusion(judge: EmotionJudge, emotions: Sequence[str]) -> dict[str, Any]:
    """The same of the talker's own motion: each emotion by every speaker."""
    kind, fps = judge.run.config.space.kind, judge.run.config.fps
    shares = np.array(
        [
            [
                judge.shares(represent(take.motion, kind, take.name)[0], emotions)
                for who, speaker in enumerate(SPEAKERS)
                for take in [talk(SECONDS, SEED + who, speaker=speaker, emotion=emotion, fps=fps)]
            ]
            for emotion in emotions
        ]
    )
    correct = np.array([one[:, number] for number, one in enumerate(shares)])
    return _summary(shares.mean(axis=1), correct)


def _summary(table: Float[np.ndarray, "K K"], correct: Float[np.ndarray, "K S"]) -> dict[str, Any]:
    """Accuracy over emotions, with its interval over speeches or speakers."""
    from a2g_jax.metrics.intervals import mean_interval

    found = mean_interval(correct.mean(axis=0)).to_json()
    return {
        "table": table.tolist(),
        "accuracy": {"mean": found["mean"], "low": found["low"], "high": found["high"]},
    }
