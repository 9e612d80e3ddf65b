"""Which stretches of which recordings are for training, validation and testing."""

from typing import NamedTuple

import numpy as np

#: Fewer recordings than this are split in time instead of among them.
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
    """Train, validation and test parts, in those shares.

    With five recordings or more, whole recordings are dealt out in an order shuffled by the seed, so no speech is in
    two splits. With fewer, each is cut in time: its first part trains, its last tests.

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
    held = [max(1, round(len(frames) * share)) for share in shares[1:]]
    validation, test = sorted(order[: held[0]]), sorted(order[held[0] : sum(held)])
    train = sorted(order[sum(held) :])
    return {
        name: [Segment(int(index), 0, frames[index]) for index in indices]
        for name, indices in (("train", train), ("validation", validation), ("test", test))
    }
