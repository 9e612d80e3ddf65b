"""Channels of a recording compared: two speakers, a dead channel, channels that cancel out."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy import ndimage

from a2g_jax.io.reading import Note

#: Length of a block in which power is measured, seconds.
BLOCK = 0.025
#: Channels that are compared at most.
MOST = 64
#: A channel this many decibels below the loudest one is dead.
_DEAD = 40.0
#: Level of the mean below the loudest channel at which channels cancel out, dB; of equal ones it is 0, of unrelated
#: ones -3, beside a dead one -6.
_CANCELS = 10.0
#: Channels hold different speech if each is this many decibels louder than usual, relative to the other, for this share
#: of the time; blocks are averaged over 0.25 s.
_TURNS, _TURNS_SHARE = 6.0, 0.1
_ACTIVE = 25.0
_NAMES = {1: "left", 2: "right"}


@dataclass(frozen=True, eq=False)
class Channels:
    """Power of the channels of a recording."""

    power: Float[np.ndarray, "K C"]
    """Variance in blocks of 25 ms."""
    mixed: Float[np.ndarray, " K"]
    """The same of their mean."""
    clipped: tuple[float, ...]
    """Share of samples of each in runs of three or more at full scale."""


class Meter:
    """Collects :class:`Channels` from consecutive blocks of samples.

    Power is that of every few samples, 8000 a second: it is the same, since what is above folds down.
    """

    def __init__(self, channels: int, sample_rate: int) -> None:
        self._step = max(1, sample_rate // 8000)
        self._size = max(1, int(BLOCK * sample_rate / self._step))
        self._rest = np.zeros((0, channels + 1), np.float32)
        self._power: list[np.ndarray] = []
        self._clipped = np.zeros(channels)
        self._count = 0

    def add(self, block: Float[np.ndarray, "n C"], mixed: Float[np.ndarray, " n"], peak: float) -> None:
        """Measure further samples.

        Args:
            mixed: their mean.
            peak: the largest of them.
        """
        if peak >= _FULL:
            full = np.abs(block) >= _FULL
            self._clipped += (full[2:] & full[1:-1] & full[:-2]).sum(axis=0)
        first = -self._count % self._step
        self._count += len(block)
        some = np.concatenate([block[first :: self._step], mixed[first :: self._step, None]], axis=1)
        joined = np.concatenate([self._rest, some])
        count = len(joined) // self._size
        blocks = joined[: count * self._size].reshape(count, self._size, joined.shape[1])
        squares = np.einsum("ksc,ksc->kc", blocks, blocks) / self._size
        self._power.append(np.maximum(squares - np.einsum("ksc->kc", blocks) ** 2 / self._size**2, 0))
        self._rest = joined[count * self._size :].copy()

    def channels(self) -> Channels:
        """The measurement so far."""
        share = tuple(float(value) for value in self._clipped / max(self._count, 1))
        power = np.concatenate(self._power)
        return Channels(power[:, :-1], power[:, -1], share)


#: Samples from here on are at full scale.
_FULL = 0.9985


def channel_name(number: int, channels: int) -> str:
    """The name of a channel, from 1 on."""
    return _NAMES[number] if channels == 2 and number in _NAMES else f"channel {number}"


def _option(number: int, channels: int) -> str:
    return f"--channel {_NAMES[number] if channels == 2 else number}"


def channel_notes(found: Channels, clipping: float) -> list[Note]:
    """Remarks on channels that should not be averaged as they are.

    Args:
        clipping: share of clipped samples from which a channel is distorted.
    """
    count = found.power.shape[1]
    if count < 2 or len(found.power) < 2:
        return []
    levels = [_level(found.power[:, number]) for number in range(count)]
    loudest = int(np.argmax(levels))
    if levels[loudest] <= -190:
        return []
    best = _option(loudest + 1, count)
    notes = []
    dead = [number for number in range(count) if levels[number] < levels[loudest] - _DEAD]
    if dead:
        names = ", ".join(channel_name(number + 1, count) for number in dead)
        verb = "is" if len(dead) == 1 else "are"
        message = f"{names} {verb} dead (at least {_DEAD:.0f} dB below the {channel_name(loudest + 1, count)})."
        fix = f"Take the {channel_name(loudest + 1, count)} alone with {best}; now the mean of all is taken."
        notes.append(Note("dead-channel", message, fix, value=float(len(dead))))
    for number in range(count):
        if number != loudest and number not in dead and _turns(found.power[:, loudest], found.power[:, number]):
            first, second = sorted((loudest, number))
            names = f"{channel_name(first + 1, count)} and {channel_name(second + 1, count)}"
            fix = (
                f"Choose one with {_option(first + 1, count)} or {_option(second + 1, count)}; now the mean of all is"
                " taken."
            )
            notes.append(Note("channels", f"{names} differ: are they two speakers?", fix))
            break
    mixed = _level(found.mixed)
    if mixed < levels[loudest] - _CANCELS and count - len(dead) > 1:
        message = f"the channels cancel out: their mean is {levels[loudest] - mixed:.0f} dB below one of them."
        notes.append(Note("channels-cancel", message, f"Take one with {best}.", value=levels[loudest] - mixed))
    clipped = [number for number in range(count) if found.clipped[number] >= clipping]
    if clipped and len(clipped) < count:
        names = " and ".join(channel_name(number + 1, count) for number in clipped)
        message = f"{names}: {100 * max(found.clipped):.2f} % of the samples are clipped."
        good = next(number for number in range(count) if number not in clipped)
        fix = f"Take another channel, such as {_option(good + 1, count)}."
        notes.append(Note("clipped-channel", message, fix, value=max(found.clipped)))
    return notes


def _level(power: Float[np.ndarray, " K"]) -> float:
    """Level of the loud blocks, dB of full scale; -200 for digital silence."""
    loud = power[power >= np.percentile(power, 95) * 10**-2.5]
    return float(10 * np.log10(max(float(loud.mean()), 1e-20)))


def _turns(first: Float[np.ndarray, " K"], second: Float[np.ndarray, " K"]) -> bool:
    """Whether each of two channels is much louder than the other at times, beyond their usual difference."""
    smooth = [ndimage.uniform_filter1d(np.asarray(power, np.float64), 10, mode="nearest") for power in (first, second)]
    floors = [np.percentile(power, 95) * 1e-4 + 1e-20 for power in smooth]
    levels = [10 * np.log10(power / (1e4 * floor) + 1e-4) for power, floor in zip(smooth, floors, strict=True)]
    active = np.maximum(*levels) > -_ACTIVE
    difference = (levels[0] - levels[1])[active]
    return len(difference) > 0 and bool(
        np.mean(difference > _TURNS) > _TURNS_SHARE and np.mean(difference < -_TURNS) > _TURNS_SHARE
    )
