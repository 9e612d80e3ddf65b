"""Scores of models and baselines on a split."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from a2g_jax import __version__
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_integrity import verify_corpus
from a2g_jax.data.splits import Segment
from a2g_jax.errors import InputError
from a2g_jax.evaluation.audit import AudioCondition, listening_audit
from a2g_jax.evaluation.candidates import candidates
from a2g_jax.evaluation.emotion_judge import EmotionJudge, relevance
from a2g_jax.evaluation.emotion_tables import EmotionTally, accuracy_by_chance
from a2g_jax.evaluation.feature_network import FeatureNetwork, check_separate, vectors_of
from a2g_jax.evaluation.report_cells import describe_metrics
from a2g_jax.evaluation.row_names import HALVES, MOTIONS
from a2g_jax.evaluation.scores import METRICS, Metric, Scorer, Target
from a2g_jax.evaluation.seeds import describe_run, group_seeds
from a2g_jax.evaluation.set_scores import Reference, halves_cell, set_cells
from a2g_jax.evaluation.summary import sample_cells
from a2g_jax.generation.conditions import corpus_condition
from a2g_jax.generation.generator import Generator
from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.metrics.beats import mel_onsets
from a2g_jax.metrics.units import OURS, Units
from a2g_jax.training.run import Run

#: Longest stretch that is scored, frames (Audio2Gestures, Sec. 5.3.1).
MOST_FRAMES = 5000
#: Shortest stretch that is scored: two clips of 50 frames, for diversity. Fewer than three stretches are cut into
#: pieces of that length, for more clips than recordings.
_LEAST_FRAMES, _FEW = 100, 3
#: Clips of an audit, and their length in seconds.
_AUDIT_CLIPS, _AUDIT_SECONDS = 8, 30.0


@dataclass(frozen=True)
class Row:
    """Scores of one candidate."""

    name: str
    samples: int
    """Number of motions for each clip."""
    scores: dict[str, dict[str, Any]]
    """For each metric ``mean``, ``low``, ``high`` (95 % over recordings), ``best`` (of the samples, mean over clips),
    ``clips`` (independent recordings), and what :func:`~a2g_jax.evaluation.set_scores.set_cells` adds; None where there
    is no value or interval, with the ``reason``."""
    emotions: dict[str, Any] | None = None
    """With a classifier of emotions: counts of clips by their own and their classified emotion."""
    run: dict[str, Any] | None = None
    """What a run is (:func:`~a2g_jax.evaluation.seeds.describe_run`); None for baselines."""


def check_runs(runs: dict[str, Run], corpus: Corpus) -> None:
    """Refuse runs that do not fit a corpus.

    Raises:
        InputError: another representation, skeleton, frame rate or audio feature.
    """
    for name, run in runs.items():
        config = run.config
        if config.space.kind != corpus.space.kind:
            raise InputError(
                f"{name}: generates {config.space.kind}, but {corpus.path} holds {corpus.space.kind};"
                f" prepare that with --pose {config.space.kind}."
            )
        if not config.space.same_as(corpus.space):
            raise InputError(f"{name}: has another skeleton than {corpus.path}; train on such a corpus.")
        if config.fps != corpus.fps or config.mel != corpus.mel:
            raise InputError(
                f"{name}: takes {config.mel.width} audio values at {config.fps:g} fps, with other settings than the"
                f" {corpus.mel.width} at {corpus.fps:g} fps of {corpus.path}; prepare that with its features."
            )


def evaluate(
    runs: dict[str, Run],
    corpus: Corpus,
    *,
    split: str = "test",
    samples: int = 20,
    seed: int = 0,
    network: FeatureNetwork | None = None,
    judge: EmotionJudge | None = None,
    audit: bool = False,
    baselines: bool = True,
    extra_metrics: Sequence[Metric] = (),
    units: Units = OURS,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> dict[str, Any]:
    """Score runs and baselines; JSON-able. Runs that differ only in their seed are one row.

    Args:
        runs: runs by name.
        split: a split of the corpus.
        samples: motions of each run for each clip.
        seed: seed of samples, noise and halves of the truth.
        network: for FGD, LPIPS and the grouping of speakers; left out without one.
        judge: for emotion accuracy; left out without one.
        audit: whether to audit each run (:mod:`a2g_jax.evaluation.audit`).
        baselines: whether to score the baselines too.
        extra_metrics: metrics of other packages (:func:`~a2g_jax.metrics.registry.find_metrics`).
        units: of distances and speeds (:data:`~a2g_jax.metrics.units.UNITS`).
        report: called with the number of (candidate, clip) pairs done, and their total.

    Raises:
        InputError: a file of the corpus was damaged or changed, runs that do not fit the corpus or that were trained
            with a loss on the feature network, or a split without a stretch long enough.
    """
    verify_corpus(corpus)
    check_runs(runs, corpus)
    check_separate(runs, network)
    segments = [_cut(segment) for segment in corpus.segments(split) if segment.frames >= _LEAST_FRAMES]
    stretches = len(segments)
    if stretches < _FEW:
        # Long enough for the feature network too.
        least = _LEAST_FRAMES if network is None else max(_LEAST_FRAMES, network.clip_frames)
        segments = [piece for segment in segments for piece in _pieces(segment, least)]
    if not segments:
        raise InputError(f"{corpus.path}: its {split} split has no stretch of 100 frames; prepare longer recordings.")
    short = 0
    if network is not None:
        _, short = vectors_of(
            [segment.frames for segment in segments], network.clip_frames, f"{corpus.path}, {split} split"
        )
    scorer = Scorer(corpus.space, corpus.fps, network, judge, tuple(extra_metrics), units)
    targets = [_target(corpus, scorer, segment) for segment in segments]
    owners = np.array([segment.recording for segment in segments])
    speakers = [corpus.recordings[segment.recording].speaker for segment in segments]
    reference = Reference.of([scorer.features(target.pose) for target in targets], owners.tolist(), speakers, seed)
    total, done, rows = (len(runs) + baselines * len(MOTIONS)) * len(segments), 0, []
    for name, draw in candidates(runs, corpus, segments, samples, seed):
        if not baselines and name in MOTIONS and name not in runs:
            continue
        per_clip: list[list[dict[str, float]]] = []
        per_group: list[dict[str, float]] = []
        features, count = [], 0
        tally = None if judge is None else EmotionTally(judge.emotions)
        for number, target in enumerate(targets):
            poses = draw(number)
            done += 1
            report(done, total)
            if poses is None:
                continue
            count = len(poses)
            motions = [scorer.context(pose, target) for pose in poses]
            per_clip.append([scorer.motion_scores(motion) for motion in motions])
            per_group.append(scorer.clip_scores(motions))
            features.append([scorer.features(pose) for pose in poses])
            if judge is not None and tally is not None:
                for pose in poses:
                    tally.add(judge.probabilities(pose), target.emotion)
        if per_clip:
            cells = sample_cells(scorer, per_clip, per_group, owners) | set_cells(scorer, features, reference)
            emotions = None if tally is None else tally.to_json()
            rows.append(Row(name, count, cells, emotions, describe_run(runs[name]) if name in runs else None))
    halves = None if network is None else halves_cell(METRICS["fgd"], reference)
    if baselines and halves is not None:
        rows.append(Row(HALVES, 1, {"fgd": halves}))
    about = {
        "package": __version__,
        "corpus": corpus.fingerprint,
        "recipe": {key: value for key, value in corpus.recipe.items() if key != "roles"},
        "split": split,
        "clips": len(segments),
        "stretches": stretches,
        "recordings": len(np.unique(owners)),
        "seconds": sum(segment.frames for segment in segments) / corpus.fps,
        "samples": samples,
        "seed": seed,
        "skeleton": _fingerprint(corpus),
        "feature_network": None if network is None else network.fingerprint,
        "emotion_classifier": None if judge is None else judge.fingerprint,
        "unit": scorer.space.unit,
        "feature_vectors": len(reference.vectors),
        "own_features": network is None or network.run.config.corpus["fingerprint"] == corpus.fingerprint,
        "floor": None if halves is None else halves["mean"],
        "feature_width": None if network is None else network.features,
        "short_clips": short,
        "units": units.key,
        "beat_sigma": units.beat_tolerance(corpus.fps),
        "wrist_to_wrist": scorer.wrist_to_wrist,
    }
    if judge is not None:
        about["emotions"] = list(judge.emotions)
        judged = [target.emotion for target in targets if target.emotion in judge.emotions]
        about["emotion_chance"] = accuracy_by_chance(judged) if judged else None
    if extra_metrics:
        about["extra_metrics"] = describe_metrics(extra_metrics)
    audits = {name: _audit(run, corpus, scorer, segments, seed) for name, run in runs.items()} if audit else {}
    return {"about": about, "rows": group_seeds([asdict(row) for row in rows]), "audits": audits}


def _audit(run: Run, corpus: Corpus, scorer: Scorer, segments: list[Segment], seed: int) -> dict[str, Any]:
    """The audit on the first half minute of a few clips."""
    generator, chosen = Generator(run), segments[:_AUDIT_CLIPS]
    frames = [min(segment.frames, round(_AUDIT_SECONDS * corpus.fps)) for segment in chosen]
    clips = [
        np.asarray(corpus.audio[segment.start : segment.start + count])
        for segment, count in zip(chosen, frames, strict=True)
    ]
    speakers = [corpus.recordings[segment.recording].speaker for segment in chosen]
    fields = generator.engine.model.condition_fields
    if "waveform" in fields:
        raise InputError(f"{run.config.model}: takes waveforms, but the audit alters audio features; omit --audit.")

    def generate(audio: AudioCondition, number: int) -> np.ndarray:
        # Labels and words are those of the audio, also where it is late or repeated.
        order = np.roll(np.arange(len(audio.features)) % frames[audio.clip], round(audio.shift * corpus.fps))
        start = chosen[audio.clip].start
        given = corpus_condition(run.config, fields, corpus, start, start + frames[audio.clip])
        given = {name: value[order] if np.ndim(value) else value for name, value in given.items()}
        rows = next(generator.rows(np.asarray(audio.features, np.float32), 1, (seed + number) % 2**31, **given))
        return scorer.space.wrists(scorer.space.positions(rows))

    recordings = [segment.recording for segment in chosen]
    return listening_audit(generate, clips, speakers, corpus.fps, recordings=recordings)


def _pieces(segment: Segment, frames: int) -> list[Segment]:
    """A stretch cut into clips of a number of frames, the last one longer by the remainder."""
    starts = range(segment.start, segment.stop - 2 * frames + 1, frames)
    bounds = [*starts, segment.start + len(starts) * frames, segment.stop]
    return [Segment(segment.recording, start, stop) for start, stop in zip(bounds, bounds[1:], strict=False)]


def _cut(segment: Segment) -> Segment:
    return Segment(segment.recording, segment.start, min(segment.stop, segment.start + MOST_FRAMES))


def _target(corpus: Corpus, scorer: Scorer, segment: Segment) -> Target:
    pose = np.asarray(corpus.pose[segment.start : segment.stop])
    onsets = mel_onsets(np.asarray(corpus.audio[segment.start : segment.stop]), corpus.fps)
    emotion = corpus.recordings[segment.recording].emotion
    return Target(pose, scorer.space.positions(pose), onsets, emotion, relevance(corpus, segment))


def _fingerprint(corpus: Corpus) -> str:
    body = corpus.body
    if isinstance(body, Skeleton):
        value = [list(body.names), list(body.parents), np.round(np.asarray(body.offsets), 4).tolist()]
    else:
        value = [corpus.space.kind, list(body.names), [list(bone) for bone in body.bones]]
    return hashlib.sha256(json.dumps(value).encode()).hexdigest()[:16]
