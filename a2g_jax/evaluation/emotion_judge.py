"""Labels in evaluation: a classifier of emotions, and semantic relevance."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from a2g_jax.data.batch import Batch
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.splits import Segment
from a2g_jax.errors import InputError
from a2g_jax.evaluation.arrays import Pose
from a2g_jax.io.files import sha256_file
from a2g_jax.metrics.labels import emotion_accuracy
from a2g_jax.training.perceptual import check_poses
from a2g_jax.training.run import Run, load_run
from a2g_jax.training.run_file import WEIGHTS_FILE


@dataclass(frozen=True, eq=False)
class EmotionJudge:
    """A trained classifier of emotions in motion."""

    run: Run
    fingerprint: str
    """SHA-256 of its weights."""

    @cached_property
    def _probabilities(self) -> Any:
        config = self.run.config
        classifier, bands = config.build().classifier, config.mel.width
        assert classifier is not None

        def probabilities(params: Any, pose: Any) -> Any:
            return jax.nn.softmax(classifier.logits(params, Batch(jnp.zeros((*pose.shape[:2], bands)), pose)))

        return jax.jit(probabilities)

    @property
    def emotions(self) -> tuple[str, ...]:
        """Its classes."""
        return tuple(self.run.config.corpus["emotions"])

    def probabilities(self, pose: Pose) -> Float[np.ndarray, "n K"]:
        """Probability of each emotion in the clips of a motion, one after another; a remainder is left out."""
        frames: int = self.run.config.model_config.clip_frames
        count = len(pose) // frames
        if count == 0:
            return np.zeros((0, len(self.emotions)), np.float32)
        clips = np.asarray(pose[: count * frames], np.float32).reshape(count, frames, *pose.shape[1:])
        return np.asarray(self._probabilities(self.run.params, clips))

    def accuracy(self, pose: Pose, emotion: str) -> float:
        """Share of the motion's clips that are classified as the emotion (EmotionGesture's EA); NaN for motion shorter
        than a clip and for emotions that the classifier lacks."""
        return float(self.shares(pose, (emotion,))[0])

    def shares(self, pose: Pose, emotions: Sequence[str]) -> Float[np.ndarray, " K"]:
        """Share of the motion's clips that are classified as each of the emotions; see :meth:`accuracy`."""
        rows = self.probabilities(pose)
        if len(rows) == 0:
            return np.full(len(emotions), np.nan)
        index = {name: number for number, name in enumerate(self.emotions)}
        return np.array(
            [emotion_accuracy(rows, np.full(len(rows), index[one])) if one in index else np.nan for one in emotions]
        )


def load_emotion_judge(folder: str | os.PathLike[str], corpus: Corpus) -> EmotionJudge:
    """Load a run of ``emotion_classifier`` for the motion of a corpus.

    Raises:
        InputError: another model, one with audio as input, one for other poses, frame rates or emotions, or one that
            was trained on motion with capture noise.
    """
    run = load_run(folder)
    config = run.config
    classifier = config.build().classifier
    if classifier is None or classifier.input != "motion":
        raise InputError(
            f"{folder}: is no classifier of emotions in motion; train one with 'a2g train"
            " emotion_classifier --input motion'."
        )
    check_poses(str(folder), config, corpus)
    if not set(corpus.emotions) & set(config.corpus["emotions"]):
        raise InputError(
            f"{folder}: has the emotions {', '.join(config.corpus['emotions'])}, none of which {corpus.path} has."
        )
    if jitter := config.corpus.get("recipe", {}).get("jitter"):
        raise InputError(
            f"{folder}: was trained on motion with capture noise of {jitter:g} degrees; train it on the same corpus"
            " prepared without --jitter, so that noise does not count as an emotion."
        )
    return EmotionJudge(run, sha256_file(Path(folder) / WEIGHTS_FILE))


def relevance(corpus: Corpus, segment: Segment) -> Float[np.ndarray, " T"] | None:
    """Semantic relevance of each frame, from the recording's labels; None without labels."""
    entry = corpus.recordings[segment.recording]
    labels = corpus.annotations(segment.recording).get("semantic")
    if not labels:
        return None
    values = np.zeros(entry.frames)
    for label in labels:
        first, stop = round(label["start"] * corpus.fps), round(label["end"] * corpus.fps)
        values[first:stop] = np.maximum(values[first:stop], max(label["score"], 0.0))
    cut: Float[np.ndarray, " T"] = values[segment.start - entry.first : segment.stop - entry.first]
    return cut if cut.any() else None
