"""Splits of recordings into training, validation and test segments."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

#: Fewer recordings than this are split in time instead of by recording.
_FEW = 5


class Segment(NamedTuple):
    """Frames ``start`` to ``stop`` (exclusive) of one recording."""

    recording: int
    start: int
    stop: int

    @property
    def frames(self) -> int:
        """Length."""
        return self.stop - self.start


Splits = dict[str, list[Segment]]


def split_recordings(frames: list[int], seed: int, shares: tuple[float, float, float] = (0.8, 0.1, 0.1)) -> Splits:
    """Train, validation and test segments, in those shares.

    Five recordings or more are assigned whole, in an order shuffled by the seed, so no speech is in two splits. With
    fewer, each is cut in time: the first part is for training, the last for testing.

    Args:
        frames: length of every recording.
    """
    if len(frames) < _FEW:
        splits: Splits = {"train": [], "validation": [], "test": []}
        for index, count in enumerate(frames):
            first, second = round(count * shares[0]), round(count * (shares[0] + shares[1]))
            for name, start, stop in (("train", 0, first), ("validation", first, second), ("test", second, count)):
                if stop > start:
                    splits[name].append(Segment(index, start, stop))
        return splits
    order = np.random.default_rng(seed).permutation(len(frames))
    sizes = [max(1, round(len(frames) * share)) for share in shares[1:]]
    validation, test = sorted(order[: sizes[0]]), sorted(order[sizes[0] : sum(sizes)])
    train = sorted(order[sum(sizes) :])
    return {
        name: [Segment(int(index), 0, frames[index]) for index in indices]
        for name, indices in (("train", train), ("validation", validation), ("test", test))
    }


def official_splits(frames: list[int], parts: Sequence[str], seed: int) -> Splits:
    """A data set's official split, completed where it is silent.

    Recordings without a part are for training. Without a validation part, a tenth of the training recordings becomes
    one, by the seed (in time, as in :func:`split_recordings`, where there are fewer than five). Without any official
    part, :func:`split_recordings` splits.

    Args:
        frames: length of every recording.
        parts: ``"train"``, ``"validation"``, ``"test"`` or an empty string for each recording.
    """
    if not any(parts):
        return split_recordings(frames, seed)
    splits: Splits = {"train": [], "validation": [], "test": []}
    for index, (count, part) in enumerate(zip(frames, parts, strict=True)):
        splits[part or "train"].append(Segment(index, 0, count))
    if not splits["validation"] and splits["train"]:
        train = [segment.recording for segment in splits["train"]]
        drawn = split_recordings([frames[index] for index in train], seed, (0.9, 0.1, 0.0))
        # With five recordings or more, each part gets at least one: the test part goes back to training.
        drawn["train"] = sorted(drawn["train"] + drawn.pop("test"))
        for name, segments in drawn.items():
            splits[name] = [Segment(train[number], start, stop) for number, start, stop in segments]
    return splits
