"""The motions that a report scores: those of runs, and those of baselines."""

from collections.abc import Callable, Iterator

import numpy as np

from a2g_jax.data.corpus import Corpus
from a2g_jax.data.splits import Segment
from a2g_jax.evaluation.arrays import Pose
from a2g_jax.evaluation.baselines import (
    first_pose,
    mean_pose,
    nearest_neighbour,
    other_clip,
    right_motions,
    with_noise,
)
from a2g_jax.evaluation.row_names import MOTIONS
from a2g_jax.generation.conditions import corpus_condition
from a2g_jax.generation.generator import Generator
from a2g_jax.training.run import Run

Draw = Callable[[int], list[Pose] | None]


def candidates(
    runs: dict[str, Run], corpus: Corpus, segments: list[Segment], samples: int, seed: int
) -> Iterator[tuple[str, Draw]]:
    """Each candidate's name, and a function from a clip to its motions (None if there are none)."""
    for name, run in runs.items():
        generator = Generator(run)

        fields = generator.engine.model.condition_fields

        def model(number: int, generator: Generator = generator, fields: tuple[str, ...] = fields) -> list[Pose]:
            segment = segments[number]
            audio = np.asarray(corpus.audio[segment.start : segment.stop])
            given = corpus_condition(generator.run.config, fields, corpus, segment.start, segment.stop)
            # A seed of its own for every clip, so that clips are independent draws.
            return list(generator.rows(audio, samples, (seed + 7919 * (number + 1)) % 2**31, **given))

        yield name, model
    truth = lambda number: np.asarray(corpus.pose[segments[number].start : segments[number].stop])  # noqa: E731

    def noise(number: int, degrees: float) -> list[Pose] | None:
        if not corpus.space.has_rotations:
            return None
        rng = np.random.default_rng([seed, number])
        return [with_noise(corpus.space, truth(number), degrees, rng)]

    rows: tuple[Draw, ...] = (
        lambda number: [truth(number)],
        lambda number: right_motions(corpus, segments[number], samples, seed),
        lambda number: noise(number, 1.0),
        lambda number: noise(number, 5.0),
        lambda number: [nearest_neighbour(corpus, segments[number])],
        lambda number: [other_clip(corpus, segments, number)],
        lambda number: [first_pose(truth(number))],
        lambda number: [mean_pose(corpus, segments[number])],
    )
    yield from zip(MOTIONS, rows, strict=True)
