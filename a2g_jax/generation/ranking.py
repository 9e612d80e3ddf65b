"""The order of samples by a score: how well a motion's strokes meet the speech, less penalties for odd motion.

    score = agreement + correlation / 2 - body - usual

- ``agreement``: harmonic mean of two beat alignments (:func:`~a2g_jax.metrics.rhythm.agreement`, 0.1 s): of peaks of
  wrist speed to the nearest peak of the speech's energy 0.1 s later, and of these peaks to the nearest peak of speed;
  from 0 to 1.
- ``correlation``: between wrist speed and the speech's level, above 40 dB below its loudest, 0.1 s later.
- ``body``: nothing for a motion within the bounds of a body; else a half, and the share of frames outside.
- ``usual``: by how much the size of the motion differs from that of the training motion by more than a factor of 1.5,
  in octaves, a quarter of it. The size is the root mean square of the z-scores of the poses.

Weights were chosen on 36 speeches of 16 s with 8 samples of ``demo`` and of ``demo-flow`` each; none of them is among
those on which ``python -m experiments.ranking`` measures what the order is worth.
"""

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import ndimage

from a2g_jax.errors import InputError
from a2g_jax.generation.generator import speech_at_rate
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.files import read_json
from a2g_jax.metrics.body.check import BodyFinding, check_motion, frames_outside
from a2g_jax.metrics.rhythm import agreement, energy_peaks, speech_envelope, speed_peaks, wrist_speed
from a2g_jax.training.run import Run

_LEAD, _SIGMA = 0.1, 0.1
_QUIET = 40.0
_CORRELATION, _OUTSIDE, _USUAL, _FREE = 0.5, 0.5, 0.25, float(np.log2(1.5))


class Score(NamedTuple):
    """The score of a sample, and its parts."""

    sample: int
    score: float
    agreement: float
    correlation: float
    body: float
    usual: float

    def to_json(self) -> dict[str, Any]:
        """The score as JSON values."""
        return {name: value if name == "sample" else round(value, 4) for name, value in self._asdict().items()}


def read_scores(folder: str | os.PathLike[str]) -> list[Score]:
    """The scores in the ``checks.json`` of a folder of samples, best first; none where samples were not ranked.

    Raises:
        InputError: there is no such file, or it is damaged.
    """
    path = Path(folder) / "checks.json"
    checks = read_json(path)
    rows = checks.get("scores", []) if isinstance(checks, dict) else None
    if not isinstance(rows, list):
        raise InputError(f"{path}: not the checks of samples; generate them again with --order best.")
    return [_read_score(path, number, row) for number, row in enumerate(rows)]


def _read_score(path: Path, number: int, row: Any) -> Score:
    kinds = Score.__annotations__
    if (
        not isinstance(row, dict)
        or set(row) != set(kinds)
        or any(not _is_number(row[name], kinds[name]) for name in row)
    ):
        expected = f"expected numbers {', '.join(kinds)}"
        raise InputError(f"{path}: scores[{number}]: {expected}; generate the samples again with --order best.")
    return Score(**row)


def _is_number(value: object, kind: type) -> bool:
    return isinstance(value, int if kind is int else (int, float)) and not isinstance(value, bool)


class Scorer:
    """Scores motions of one speech."""

    def __init__(self, run: Run, audio: Any, sample_rate: int | None = None) -> None:
        """
        Args:
            run: whose training motion is the usual one.
            audio: (N,), mono.
            sample_rate: of the audio, Hz; None for the run's own.

        Raises:
            InputError: audio that cannot be used.
        """
        self._run, self._audio = run, speech_at_rate(run, audio, sample_rate)

    def score(self, sample: int, motion: Motion, findings: Sequence[BodyFinding] | None = None) -> Score:
        """The score of a motion of the run.

        Args:
            sample: its number.
            findings: on it; None to look for them.
        """
        if findings is None:
            findings = check_motion(motion, self._run.config.body_bounds)
        rate = self._run.config.mel.sample_rate
        level = speech_envelope(self._audio, rate, motion.fps, motion.frames)
        speed = wrist_speed(motion)
        strokes, beats = speed_peaks(speed, motion.fps), energy_peaks(level, motion.fps)
        there = agreement(strokes, beats, _SIGMA, _LEAD)
        back = agreement(beats, strokes, _SIGMA, -_LEAD)
        both = 2 * there * back / max(there + back, 1e-9)
        together = _correlation(speed, level, motion.fps)
        outside = frames_outside(tuple(findings), motion.frames)
        body = _OUTSIDE + outside / max(motion.frames, 1) if findings else 0.0
        usual = _USUAL * max(self._octaves(motion) - _FREE, 0.0)
        return Score(sample, both + _CORRELATION * together - body - usual, both, together, body, usual)

    def _octaves(self, motion: Motion) -> float:
        """How far the size of a motion is from that of the training motion."""
        config = self._run.config
        z = np.asarray(config.statistics["pose"].normalise(config.space.write(np.asarray(motion.rotations))))
        size = float(np.sqrt(np.mean(np.square(z))))
        return abs(float(np.log2(max(size, 1e-3))))


def best_first(scores: Iterable[Score]) -> list[Score]:
    """Scores from the highest to the lowest; of equal ones, the lower number first."""
    return sorted(scores, key=lambda one: (-one.score, one.sample))


def rank_samples(run: Run, motions: Sequence[Motion], audio: Any, sample_rate: int | None = None) -> list[Score]:
    """Scores of the motions of one speech, best first; ``score.sample`` is the index of the motion.

    Example:
        >>> import a2g_jax
        >>> run, talk = a2g_jax.demo_run(), a2g_jax.talk(4.0, seed=1)
        >>> motions = a2g_jax.Generator(run).generate(talk.audio, 2)
        >>> ranked = a2g_jax.rank_samples(run, motions, talk.audio)
        >>> best = motions[ranked[0].sample]

    Args:
        run: that generated them.
        motions: of the run's skeleton.
        audio: (N,), mono.
        sample_rate: of the audio, Hz; None for the run's own.

    Raises:
        InputError: audio that cannot be used.
    """
    scorer = Scorer(run, audio, sample_rate)
    return best_first(scorer.score(number, motion) for number, motion in enumerate(motions))


def _correlation(speed: Float[np.ndarray, " T"], level: Float[np.ndarray, " T"], fps: float) -> float:
    """Correlation of the speed with the level of the speech shortly after it."""
    smooth = ndimage.gaussian_filter1d(speed, fps / 15)
    loud = np.maximum(level - level.max() + _QUIET, 0.0)
    lead = round(_LEAD * fps)
    one, other = smooth[: len(smooth) - lead], loud[lead:]
    if len(one) < 2 or one.std() < 1e-9 or other.std() < 1e-9:
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])
