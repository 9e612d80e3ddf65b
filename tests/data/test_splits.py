"""Dealing recordings out to splits."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.data.splits import Segment, official_splits, split_recordings

NAMES = ("train", "validation", "test")
frame_counts = st.lists(st.integers(1, 500), min_size=1, max_size=40)


@settings(max_examples=80, deadline=None)
@given(frame_counts, st.integers(0, 5))
def test_every_frame_is_in_exactly_one_split(frames, seed):
    splits = split_recordings(frames, seed)
    assert tuple(splits) == NAMES
    covered = [[0] * count for count in frames]
    for segment in (segment for name in NAMES for segment in splits[name]):
        assert segment.frames == segment.stop - segment.start > 0
        for frame in range(segment.start, segment.stop):
            covered[segment.recording][frame] += 1
    assert all(count == 1 for recording in covered for count in recording)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.integers(1, 500), min_size=5, max_size=60), st.integers(0, 5))
def test_many_recordings_stay_whole(frames, seed):
    splits = split_recordings(frames, seed)
    for name in NAMES:
        assert splits[name] == [Segment(s.recording, 0, frames[s.recording]) for s in splits[name]]
        assert [s.recording for s in splits[name]] == sorted(s.recording for s in splits[name])
    held = max(1, round(len(frames) * 0.1))
    assert len(splits["validation"]) == len(splits["test"]) == held


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.integers(1, 500), st.integers(0, 12)), min_size=1, max_size=40), st.integers(0, 5))
def test_a_group_is_in_one_split(recordings, seed):
    frames, groups = [count for count, _ in recordings], [str(group) for _, group in recordings]
    for splits in (
        split_recordings(frames, seed, groups=groups),
        official_splits(frames, ["train"] * len(frames), seed, groups),
    ):
        assert sum(s.frames for name in NAMES for s in splits[name]) == sum(frames)
        if len(set(groups)) >= 5:
            parts = [{groups[s.recording] for s in splits[name]} for name in NAMES]
            assert sum(len(part) for part in parts) == len(set(groups))
            assert parts[1]


def test_groups_of_one_change_nothing():
    frames = list(range(10, 40))
    assert split_recordings(frames, 3, groups=[f"take{n}" for n in frames]) == split_recordings(frames, 3)


def test_shares():
    assert [len(part) for part in split_recordings([7] * 50, 0).values()] == [40, 5, 5]
    assert [len(part) for part in split_recordings([7] * 50, 0, (0.5, 0.3, 0.2)).values()] == [25, 15, 10]


def test_the_seed_decides_and_nothing_else():
    first, again, other = (split_recordings([9] * 30, seed) for seed in (1, 1, 2))
    assert first == again
    assert first != other


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_few_recordings_are_cut_in_time(count):
    splits = split_recordings([100] * count, 0)
    assert splits["train"] == [Segment(n, 0, 80) for n in range(count)]
    assert splits["validation"] == [Segment(n, 80, 90) for n in range(count)]
    assert splits["test"] == [Segment(n, 90, 100) for n in range(count)]


def test_parts_of_no_frames_are_left_out():
    splits = split_recordings([1, 100], 0)
    assert [segment.recording for segment in splits["train"]] == [0, 1]
    assert [segment.recording for segment in splits["validation"]] == [1]
