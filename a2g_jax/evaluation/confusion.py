"""How well classifiers of emotions do on held-out clips: confusion matrices and accuracy (EmotionGesture, Table I)."""

from collections.abc import Mapping
from typing import Any

import jax
import numpy as np
from jaxtyping import Float, Int

from a2g_jax import __version__
from a2g_jax.data.batch import clip_shape, gather_clips, gather_from_disk
from a2g_jax.data.batches import BatchMaker, tiled_starts
from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.evaluation.likelihood_clips import recordings_of
from a2g_jax.evaluation.seeds import describe_run
from a2g_jax.metrics.intervals import share_interval
from a2g_jax.metrics.labels import confusion
from a2g_jax.training.perceptual import check_poses
from a2g_jax.training.run import Run

#: Clips that are classified at once.
_BATCH = 64


def is_classifier(run: Run) -> bool:
    """Whether a run is of a model that classifies clips."""
    return run.config.build().classifier is not None


def classify_split(
    runs: Mapping[str, Run], corpus: Corpus, *, split: str = "test", stride: int | None = None
) -> dict[str, Any]:
    """Confusion matrices of classifiers on the clips of a split; JSON-able.

    Args:
        runs: runs of models with a classifier, by name.
        corpus: with emotions.
        split: a split of it.
        stride: frames from one clip to the next; half a clip if None, as EmotionGesture cuts them.

    Returns:
        ``about``, and for each classifier in ``classifiers``: ``run`` (what the run is), ``input``, ``emotions``,
        ``confusion`` (clips by true and predicted emotion), ``accuracy`` with a 95 % interval over recordings,
        ``balanced`` (mean over the emotions of the split), ``recall`` and ``precision`` by emotion, ``chance`` (see
        :func:`chance_levels`), and the numbers of ``clips``, ``recordings`` and clips ``left_out`` for an emotion that
        it does not have.

    Raises:
        InputError: a run that is no classifier or takes other features, or a split without a clip for it.
    """
    found = {}
    for name, run in runs.items():
        if not is_classifier(run):
            raise InputError(f"{name}: is a run of {run.config.model}, which is no classifier.")
        _check(name, run, corpus)
        found[name] = _classified(name, run, corpus, split, stride)
    about: dict[str, Any] = {"package": __version__, "corpus": corpus.fingerprint, "split": split}
    about["recipe"] = {key: value for key, value in corpus.recipe.items() if key != "roles"}
    return {"about": about, "classifiers": found}


def _check(name: str, run: Run, corpus: Corpus) -> None:
    config = run.config
    classifier = config.build().classifier
    assert classifier is not None
    if classifier.input == "motion":
        check_poses(name, config, corpus)
    elif (config.fps, config.mel) != (corpus.fps, corpus.mel):
        raise InputError(
            f"{name}: takes {config.mel.width} audio values at {config.fps:g} fps, with other settings than the"
            f" {corpus.mel.width} at {corpus.fps:g} fps of {corpus.path}; prepare that with its features."
        )


def _classified(name: str, run: Run, corpus: Corpus, split: str, stride: int | None) -> dict[str, Any]:
    config, model = run.config, run.config.build()
    classifier, names = model.classifier, list(run.config.corpus["emotions"])
    assert classifier is not None
    frames = model.clip_frames
    starts = tiled_starts(corpus, split, frames, stride or max(1, frames // 2))
    own = np.array([names.index(emotion) if emotion in names else -1 for emotion in corpus.emotions])
    labels = own[corpus.labels[starts, 0]]
    starts, labels, every = starts[labels >= 0], labels[labels >= 0], len(starts)
    if len(starts) == 0:
        raise InputError(
            f"{corpus.path}: its {split} split has no clip of {frames} frames in an emotion of {name}"
            f" ({', '.join(names)})."
        )
    shape = clip_shape(model.batch_fields, frames, corpus.fps, corpus.mel.sample_rate)
    arrays = {array: corpus.array(array) for array in shape.arrays}
    maker = BatchMaker(config.statistics["audio"], 0.0)
    logits_of = jax.jit(classifier.logits)
    parts = []
    for first in range(0, len(starts), _BATCH):
        some = starts[first : first + _BATCH]
        # Batches of one shape, so that one program is compiled.
        padded = np.concatenate([some, np.repeat(some[:1], _BATCH - len(some))])
        clips = gather_clips(arrays, shape, padded, gather_from_disk)
        parts.append(np.asarray(logits_of(run.params, maker(None, clips)))[: len(some)])
    logits = np.concatenate(parts)
    recording = recordings_of(corpus, starts)
    return {
        "model": config.model,
        "run": describe_run(run),
        "input": classifier.input,
        "trained_on": config.corpus.get("fingerprint"),
        **scores(logits, labels, recording, len(names)),
        "emotions": names,
        "left_out": every - len(starts),
    }


def scores(
    logits: Float[np.ndarray, "N K"],
    labels: Int[np.ndarray, " N"],
    recordings: Int[np.ndarray, " N"],
    classes: int,
) -> dict[str, Any]:
    """Confusion matrix and accuracies of classified clips.

    Args:
        recordings: the recording of every clip, which the interval is over: clips of one are not independent.
    """
    counts = confusion(logits, labels)
    hits = np.argmax(logits, axis=-1) == labels
    groups = np.unique(recordings)
    own_hits = np.array([hits[recordings == one].sum() for one in groups])
    interval = share_interval(own_hits, np.array([np.sum(recordings == one) for one in groups])).to_json()
    true, predicted = counts.sum(axis=1), counts.sum(axis=0)
    recall = [float(counts[k, k] / true[k]) if true[k] else None for k in range(classes)]
    return {
        "confusion": counts.tolist(),
        "clips": len(labels),
        "recordings": len(groups),
        "accuracy": {key: interval[key] for key in ("mean", "low", "high")},
        "balanced": float(np.mean([value for value in recall if value is not None])),
        "recall": recall,
        "precision": [float(counts[k, k] / predicted[k]) if predicted[k] else None for k in range(classes)],
        "chance": chance_levels(counts),
    }


def chance_levels(counts: Int[np.ndarray, "K K"]) -> dict[str, float]:
    """Accuracies of classifiers that do not look.

    Returns:
        ``uniform``: a random one of the emotions of the split; ``commonest``: always the commonest one; ``shuffled``:
        this classifier's own answers in random order.
    """
    true, predicted = (counts.sum(axis=axis) / counts.sum() for axis in (1, 0))
    return {
        "uniform": 1.0 / int(np.count_nonzero(true)),
        "commonest": float(true.max()),
        "shuffled": float(true @ predicted),
    }
