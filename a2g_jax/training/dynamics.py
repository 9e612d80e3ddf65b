"""The dynamics of a fine-tuned run: gains from its motion for the speech of the recordings, and from these."""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.splits import Segment
from a2g_jax.features.dynamics import Dynamics, Values, values_of
from a2g_jax.features.dynamics_fit import fit_dynamics, moved_by
from a2g_jax.models.base import Condition, Model, Params, Summary
from a2g_jax.nn.blocks import BLOCK
from a2g_jax.training.run_config import RunConfig

#: Motions for each stretch of speech, and the length that stretches are filled up to: few lengths are compiled.
_SAMPLES, _FILLED = 4, 1024
#: Frames of recordings that count: of a longer corpus every n-th stretch.
_MOST_FRAMES = 18_000
#: Shortest stretch, seconds; a second of motion has no slow band.
_LEAST_SECONDS = 2.0


def corpus_dynamics(
    model: Model, config: RunConfig, params: Params, summary: Summary, corpus: Corpus
) -> Dynamics | None:
    """Gains that bring a run's motion to the dynamics of a corpus's training split.

    Args:
        corpus: with the whole training split, also what is held out of it for early stopping.

    Returns:
        The gains; None where the run did not start from another one, its model wants none, or all recordings are
        shorter than two seconds.
    """
    if config.source is None or not config.source.dynamics:
        return None
    segments = [one for one in corpus.segments("train") if one.stop - one.start >= _LEAST_SECONDS * corpus.fps]
    if not segments:
        return None
    segments = segments[:: -(-sum(one.stop - one.start for one in segments) // _MOST_FRAMES)]
    draw = _drawing(model, config)
    space, drawn, recorded = config.space, [], []
    for number, segment in enumerate(segments):
        audio, pose = (np.asarray(corpus.array(name)[segment.start : segment.stop]) for name in ("audio", "pose"))
        recorded.append(values_of(space, np.asarray(pose, np.float32)))
        keys = jax.random.split(jax.random.fold_in(jax.random.key(2), number), _SAMPLES)
        drawn += [draw(params, summary, key, np.asarray(audio, np.float32)) for key in keys]
    return fit_dynamics(drawn, recorded, moved_by(space), config.fps, recorded_fps(corpus, segments))


def recorded_fps(corpus: Corpus, segments: Sequence[Segment]) -> float | None:
    """Lowest frame rate of the recordings of segments before they were prepared; None where a corpus of an earlier
    version does not have one of them."""
    rates = [corpus.annotations(number).get("motion_fps") for number in {one.recording for one in segments}]
    known = [float(rate) for rate in rates if rate is not None]
    return min(known) if len(known) == len(rates) else None


def _drawing(model: Model, config: RunConfig) -> Any:
    """``draw(params, summary, key, audio) -> values`` of a whole stretch, as generation in one window gives them."""
    condition, sample, space = model.condition, model.sample, config.space
    assert condition is not None
    assert sample is not None
    halo = -(-model.halo // BLOCK) * BLOCK

    @jax.jit
    def motion(params, summary, key, audio):
        given = condition(params, summary, Condition(audio))
        return space.valid(sample(params, summary, key, given, jnp.int32(-halo)))

    def draw(params: Params, summary: Summary, key: Any, audio: np.ndarray) -> Values:
        frames = len(audio)
        around = ((halo, -frames % _FILLED + halo), (0, 0))
        padded = np.pad(audio, around, constant_values=float(audio.min()))
        normalised = np.asarray(config.statistics["audio"].normalise(padded), np.float32)
        return values_of(space, np.asarray(motion(params, summary, key, normalised))[halo : halo + frames])

    return draw
