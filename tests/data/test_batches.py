"""Random clips: uniform over all valid starts, never across a border."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from a2g_jax.data.batches import Dressing, draw_starts, find_crops, gather, gather_from_disk, tiled_starts
from a2g_jax.data.corpus import Corpus, Entry
from a2g_jax.data.splits import Segment
from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.skeleton import Skeleton

LENGTHS = (12, 5, 30, 9)


def corpus(**splits):
    """A corpus of four recordings that exists in memory only."""
    firsts = np.concatenate([[0], np.cumsum(LENGTHS)])
    return Corpus(
        path=Path("corpus"),
        fps=30.0,
        mel=MelConfig(),
        body=Skeleton(np.zeros((1, 3), np.float32), ("a",), (-1,)),
        representation="6d",
        recordings=tuple(Entry(f"r{n}", int(firsts[n]), length, "", "", {}) for n, length in enumerate(LENGTHS)),
        splits={name: [Segment(*row) for row in rows] for name, rows in splits.items()},
        recipe={},
        fingerprint="",
    )


TRAIN = [(0, 0, 12), (1, 0, 5), (2, 10, 25), (3, 0, 9)]
#: Rows of the arrays at which a clip of six frames may start: recordings begin at rows 0, 12, 17 and 47.
VALID = [*range(0, 7), *range(27, 37), *range(47, 51)]

LABELS = jnp.array([[0, 2], [1, 0], [0, 1]], jnp.int32)

draw = jax.jit(draw_starts, static_argnums=2)


def test_crops_are_all_the_valid_starts():
    crops = find_crops(corpus(train=TRAIN), "train", 6)
    counts = np.diff(crops.cumulative, prepend=0)
    starts = [first + n for first, count in zip(crops.first, counts, strict=True) for n in range(count)]
    assert starts == VALID


def test_every_valid_start_is_drawn_equally_often():
    crops = find_crops(corpus(train=TRAIN), "train", 6)
    starts = np.asarray(draw(jax.random.key(0), crops, 4200))
    values, counts = np.unique(starts, return_counts=True)
    assert values.tolist() == VALID
    assert stats.chisquare(counts).pvalue > 0.01


def test_draws_are_a_function_of_the_key():
    crops = find_crops(corpus(train=TRAIN), "train", 6)
    first, again, other = (np.asarray(draw(jax.random.key(n), crops, 4200)) for n in (0, 0, 1))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_a_clip_as_long_as_the_only_stretch():
    crops = find_crops(corpus(train=[(2, 3, 9)]), "train", 6)
    assert set(np.asarray(draw(jax.random.key(0), crops, 4200)).tolist()) == {20}


def test_clips_longer_than_recordings_are_refused():
    with pytest.raises(InputError, match=r"longest train recording has 15 frames, a clip has 16.*--clip-frames"):
        find_crops(corpus(train=TRAIN), "train", 16)
    assert len(find_crops(corpus(train=TRAIN), "train", 15).first) == 1


def test_a_split_that_is_not_there_is_refused():
    with pytest.raises(InputError, match="no split 'test'; there are: train"):
        find_crops(corpus(train=TRAIN, test=[]), "test", 6)


@pytest.mark.parametrize("shape", [(56, 3), (56, 4, 6)])
def test_gather_is_slicing(shape):
    array = np.random.default_rng(0).normal(size=shape).astype(np.float32)
    starts = np.array([0, 50, 17, 17], np.int32)
    expected = np.stack([array[start : start + 6] for start in starts])
    np.testing.assert_array_equal(gather_from_disk(array, starts, 6), expected)
    np.testing.assert_array_equal(jax.jit(gather, static_argnums=2)(array, starts, 6), expected)


def test_tiles_cover_without_overlap():
    assert tiled_starts(corpus(train=TRAIN), "train", 6).tolist() == [0, 6, 27, 33, 47]
    assert tiled_starts(corpus(train=TRAIN), "train", 100).tolist() == []


class TestDressing:
    statistics = Statistics(np.full(8, -30.0, np.float32), np.full(8, 10.0, np.float32))
    audio = jnp.asarray(np.random.default_rng(1).uniform(-60, 0, (3, 7, 8)), jnp.float32)
    pose = jnp.ones((3, 7, 2, 6))

    def test_without_a_key_it_only_normalises(self):
        dressed = Dressing(self.statistics, 1.0)(None, self.audio, self.pose, LABELS)
        np.testing.assert_allclose(dressed.audio, (np.asarray(self.audio) + 30) / 10, rtol=1e-5, atol=1e-5)
        assert dressed.pose is self.pose
        assert (dressed.emotion.tolist(), dressed.speaker.tolist()) == ([0, 1, 0], [2, 0, 1])

    def test_without_strength_the_key_does_not_matter(self):
        dress = Dressing(self.statistics, 0.0)
        np.testing.assert_array_equal(
            dress(jax.random.key(0), self.audio, self.pose, LABELS).audio,
            dress(None, self.audio, self.pose, LABELS).audio,
        )

    def test_every_clip_is_augmented_differently(self):
        same = jnp.broadcast_to(self.audio[:1], self.audio.shape)
        dress = jax.jit(Dressing(self.statistics, 1.0))
        result = np.asarray(dress(jax.random.key(0), same, self.pose, LABELS).audio)
        assert np.abs(result[0] - result[1]).max() > 0.01
        assert np.abs(result[1] - result[2]).max() > 0.01
        np.testing.assert_array_equal(result, dress(jax.random.key(0), same, self.pose, LABELS).audio)
