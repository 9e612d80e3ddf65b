"""Splits of recordings into training, validation and test segments."""

from collections.abc import Sequence
from itertools import chain
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


def split_recordings(
    frames: list[int],
    seed: int,
    shares: tuple[float, float, float] = (0.8, 0.1, 0.1),
    groups: Sequence[str] | None = None,
) -> Splits:
    """Train, validation and test segments, in those shares of the groups.

    Five groups or more are assigned whole, in an order shuffled by the seed, so no speech is in two splits. With fewer,
    each recording is cut in time: the first part is for training, the last for testing.

    Args:
        frames: length of every recording.
        groups: the group of every recording, such as the one that it is a piece of; None if each is one of its own.
    """
    names = [str(index) for index in range(len(frames))] if groups is None else groups
    members: dict[str, list[int]] = {}
    for index, name in enumerate(names):
        members.setdefault(name, []).append(index)
    if len(members) < _FEW:
        splits: Splits = {"train": [], "validation": [], "test": []}
        for index, count in enumerate(frames):
            first, second = round(count * shares[0]), round(count * (shares[0] + shares[1]))
            for name, start, stop in (("train", 0, first), ("validation", first, second), ("test", second, count)):
                if stop > start:
                    splits[name].append(Segment(index, start, stop))
        return splits
    order = np.random.default_rng(seed).permutation(len(members))
    sizes = [max(1, round(len(members) * share)) for share in shares[1:]]
    drawn = {
        "train": order[sum(sizes) :],
        "validation": order[: sizes[0]],
        "test": order[sizes[0] : sum(sizes)],
    }
    recordings = list(members.values())
    return {
        name: [Segment(index, 0, frames[index]) for index in sorted(chain.from_iterable(recordings[g] for g in chosen))]
        for name, chosen in drawn.items()
    }


def official_splits(frames: list[int], parts: Sequence[str], seed: int, groups: Sequence[str] | None = None) -> Splits:
    """A data set's official split, completed where it is silent.

    Recordings without a part are for training. Without a validation part, a tenth of the training recordings becomes
    one, by the seed (in time, as in :func:`split_recordings`, where there are fewer than five). Without any official
    part, :func:`split_recordings` splits.

    Args:
        frames: length of every recording.
        parts: ``"train"``, ``"validation"``, ``"test"`` or an empty string for each recording.
        groups: as of :func:`split_recordings`.
    """
    if not any(parts):
        return split_recordings(frames, seed, groups=groups)
    splits: Splits = {"train": [], "validation": [], "test": []}
    for index, (count, part) in enumerate(zip(frames, parts, strict=True)):
        splits[part or "train"].append(Segment(index, 0, count))
    if not splits["validation"] and splits["train"]:
        train = [segment.recording for segment in splits["train"]]
        chosen = None if groups is None else [groups[index] for index in train]
        drawn = split_recordings([frames[index] for index in train], seed, (0.9, 0.1, 0.0), chosen)
        # With five groups or more, each part gets at least one: the test part goes back to training.
        drawn["train"] = sorted(drawn["train"] + drawn.pop("test"))
        for name, segments in drawn.items():
            splits[name] = [Segment(train[number], start, stop) for number, start, stop in segments]
    return splits
