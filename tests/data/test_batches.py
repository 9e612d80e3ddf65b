"""Random clips: uniform over all valid starts, never across a border."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from a2g_jax.data.batch import FIELDS, Batch, clip_shape, gather, gather_clips, gather_from_disk
from a2g_jax.data.batches import BatchMaker, draw_others, draw_starts, find_crops, opposite_starts, tiled_starts
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.corpus_layout import Entry
from a2g_jax.data.splits import Segment
from a2g_jax.errors import InputError
from a2g_jax.features.mel import MelConfig
from a2g_jax.features.statistics import Statistics
from a2g_jax.geometry.pose_space import PoseSpace
from a2g_jax.geometry.skeleton import Skeleton

LENGTHS = (12, 5, 30, 9)


def corpus(**splits):
    """A corpus of four recordings that exists in memory only."""
    firsts = np.concatenate([[0], np.cumsum(LENGTHS)])
    return Corpus(
        path=Path("corpus"),
        fps=30.0,
        mel=MelConfig(),
        space=PoseSpace(Skeleton(np.zeros((1, 3), np.float32), ("a",), (-1,))),
        recordings=tuple(Entry(f"r{n}", int(firsts[n]), length, "", "", {}) for n, length in enumerate(LENGTHS)),
        splits={name: [Segment(*row) for row in rows] for name, rows in splits.items()},
        recipe={},
        fingerprint="",
    )


TRAIN = [(0, 0, 12), (1, 0, 5), (2, 10, 25), (3, 0, 9)]
#: Rows of the arrays at which a clip of six frames may start: recordings begin at rows 0, 12, 17 and 47.
VALID = [*range(0, 7), *range(27, 37), *range(47, 51)]

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


def recording_of(rows):
    return np.searchsorted([0, 12, 17, 47], rows, side="right")


def test_second_clips_are_of_the_same_recording_and_anywhere_in_it():
    crops = find_crops(corpus(train=TRAIN), "train", 6)
    starts = draw(jax.random.key(0), crops, 4200)
    others = np.asarray(jax.jit(lambda key, starts: draw_others(key, crops, starts))(jax.random.key(1), starts))
    np.testing.assert_array_equal(recording_of(others), recording_of(np.asarray(starts)))
    assert set(others.tolist()) == set(VALID)
    longest = others[recording_of(others) == 3]
    assert stats.chisquare(np.unique(longest, return_counts=True)[1]).pvalue > 0.01


def test_opposite_clips_are_half_a_recording_away():
    data = corpus(train=TRAIN)
    starts = tiled_starts(data, "train", 6)
    others = opposite_starts(data, "train", 6, starts)
    assert set(others.tolist()) <= set(VALID)
    np.testing.assert_array_equal(recording_of(others), recording_of(starts))
    # Recording 2 has 10 starts from row 27 on, recording 0 has 7 from row 0 on.
    assert others[starts == 27] == 32
    assert others[starts == 6] == 2


def test_other_poses_are_those_of_the_second_clips():
    arrays = {"audio": np.zeros((20, 2)), "pose": np.arange(20.0).reshape(20, 1, 1)}
    shape = clip_shape(("other_pose",), 4, 30.0, 16000)
    assert shape.paired
    assert shape.arrays == ("audio", "pose")
    clips = gather_clips(arrays, shape, np.array([0, 9]), gather_from_disk, np.array([5, 16]))
    np.testing.assert_array_equal(clips["other_pose"][:, 0, 0, 0], [5, 16])
    assert not clip_shape(("audio",), 4, 30.0, 16000).paired


def test_every_field_of_a_batch_has_its_arrays():
    assert {*FIELDS, "mirrored"} == set(Batch._fields)


@pytest.mark.parametrize("take", [gather, gather_from_disk])
def test_clips_have_the_declared_fields(take):
    """Slices of frames, labels at the first frame, and samples from where a frame's begin."""
    arrays = {
        "audio": np.arange(40.0).reshape(20, 2),
        "pose": np.arange(20.0).reshape(20, 1, 1),
        "emotion": np.arange(20) // 10,
        "waveform": np.arange(1000, dtype=np.int16),
        "waveform_start": np.round(np.arange(20) * 16000 / 320).astype(np.int32),
    }
    shape = clip_shape(("emotion", "waveform", "audio"), 4, 320.0, 16000)
    assert shape.fields == ("audio", "pose", "emotion", "waveform")
    starts = np.array([0, 9, 16], np.int32)
    clips = gather_clips(arrays, shape, starts, take)
    assert set(clips) == set(shape.fields)
    np.testing.assert_array_equal(clips["pose"][..., 0, 0], starts[:, None] + np.arange(4))
    np.testing.assert_array_equal(clips["emotion"], [0, 0, 1])
    np.testing.assert_array_equal(clips["waveform"], 50 * starts[:, None] + np.arange(200))
    batch = BatchMaker(Statistics(np.zeros(2, np.float32), np.ones(2, np.float32)), 0.0)(None, clips)
    assert batch.speaker is None
    np.testing.assert_allclose(batch.waveform[1, :2], np.array([450, 451]) / 32768)


def test_unknown_fields_are_refused():
    with pytest.raises(ValueError, match="got smell"):
        clip_shape(("audio", "smell"), 4, 30.0, 16000)


class TestBatchMaker:
    statistics = Statistics(np.full(8, -30.0, np.float32), np.full(8, 10.0, np.float32))
    audio = jnp.asarray(np.random.default_rng(1).uniform(-60, 0, (3, 7, 8)), jnp.float32)
    clips = {"audio": audio, "pose": jnp.ones((3, 7, 2, 6)), "emotion": jnp.array([0, 1, 0])}  # noqa: RUF012

    def test_without_a_key_it_only_normalises(self):
        batch = BatchMaker(self.statistics, 1.0)(None, self.clips)
        np.testing.assert_allclose(batch.audio, (np.asarray(self.audio) + 30) / 10, rtol=1e-5, atol=1e-5)
        assert batch.pose is self.clips["pose"]
        assert batch.emotion.tolist() == [0, 1, 0]

    def test_without_strength_the_key_does_not_matter(self):
        make = BatchMaker(self.statistics, 0.0)
        np.testing.assert_array_equal(make(jax.random.key(0), self.clips).audio, make(None, self.clips).audio)

    def test_every_clip_is_augmented_differently(self):
        same = {**self.clips, "audio": jnp.broadcast_to(self.audio[:1], self.audio.shape)}
        make = jax.jit(BatchMaker(self.statistics, 1.0))
        result = np.asarray(make(jax.random.key(0), same).audio)
        assert np.abs(result[0] - result[1]).max() > 0.01
        assert np.abs(result[1] - result[2]).max() > 0.01
        np.testing.assert_array_equal(result, make(jax.random.key(0), same).audio)

    def test_a_share_of_clips_is_mirrored_with_their_second_clips(self):
        make = jax.jit(BatchMaker(self.statistics, 0.0, 0.25, lambda pose: -pose))
        pose = np.ones((2000, 2, 1, 1), np.float32)
        clips = {"audio": np.zeros((2000, 2, 8), np.float32), "pose": pose, "other_pose": 2 * pose}
        batch = make(jax.random.key(0), clips)
        assert abs(float(batch.mirrored.mean()) - 0.25) < 0.03
        np.testing.assert_array_equal(batch.pose[:, 0, 0, 0], np.where(batch.mirrored, -1.0, 1.0))
        np.testing.assert_array_equal(batch.other_pose, 2 * batch.pose)
        plain = make(None, clips)
        assert not plain.mirrored.any()
        np.testing.assert_array_equal(plain.pose, pose)
