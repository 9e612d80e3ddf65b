"""Paths that are analytic in time: superposed minimum-jerk steps, bumps and slow waves.

A minimum-jerk step (Flash & Hogan 1985) goes from 0 to 1 as ``10 x^3 - 15 x^4 + 6 x^5``. Movements that begin before
the last one has ended are superposed, as people do (Flash & Henis 1991), so a track stays C2 with a bounded third
derivative however its steps overlap.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float


def minimum_jerk(x: Float[np.ndarray, "*any"]) -> Float[np.ndarray, "*any"]:
    """Minimum-jerk step from 0 to 1 over ``x`` from 0 to 1; constant outside."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


def bump(x: Float[np.ndarray, "*any"]) -> Float[np.ndarray, "*any"]:
    """A C2 bump: 0 at ``x`` <= 0, 1 at 0.5, 0 at ``x`` >= 1."""
    x = np.clip(x, 0.0, 1.0)
    return (4.0 * x * (1.0 - x)) ** 3


def softplus(x: Float[np.ndarray, "*any"], width: float) -> Float[np.ndarray, "*any"]:
    """A smooth ``max(x, 0)``: above it by ``width * log 2`` at 0, equal to it a few ``width`` away."""
    return width * np.logaddexp(0.0, x / width)


def soft_clip(
    values: Float[np.ndarray, "T C"], limits: Float[np.ndarray, "C 2"], width: float
) -> Float[np.ndarray, "T C"]:
    """Channels kept smoothly and strictly between their ``limits`` (least, most); unchanged a few ``width`` inside."""
    low, high = limits.T
    return high - softplus(high - (low + softplus(values - low, width)), width)


@dataclass
class Track:
    """A path of C channels, the sum of steps and bumps, that can be sampled at any time."""

    start: Float[np.ndarray, " C"]
    """Value before the first step."""
    _steps: list[tuple[float, float, np.ndarray]] = field(default_factory=list)
    _bumps: list[tuple[float, float, np.ndarray]] = field(default_factory=list)
    _goal: np.ndarray | None = None

    @property
    def goal(self) -> Float[np.ndarray, " C"]:
        """Value after the last step."""
        return self.start if self._goal is None else self._goal

    def step_to(self, goal: Float[np.ndarray, " C"], begin: float, end: float) -> None:
        """Add a minimum-jerk step from the goal of the last one to ``goal`` between two times (seconds)."""
        self._steps.append((begin, end, goal - self.goal))
        self._goal = goal

    def add_bump(self, height: Float[np.ndarray, " C"], begin: float, end: float) -> None:
        """Add ``height`` in the middle of an interval (seconds), fading to nothing at its ends."""
        self._bumps.append((begin, end, height))

    def add_pulse(self, height: Float[np.ndarray, " C"], begin: float, top: float, end: float) -> None:
        """Add a rise by ``height`` from ``begin`` to ``top`` and a fall back from ``top`` to ``end`` (seconds)."""
        self._steps.append((begin, top, height))
        self._steps.append((top, end, -height))

    def sample(self, times: Float[np.ndarray, " T"]) -> Float[np.ndarray, "T C"]:
        """The path at increasing ``times`` in seconds."""
        count = len(times)
        # A finished step is a constant from its end on: one entry here, one running sum for all.
        finished = np.zeros((count + 1, len(self.start)))
        finished[0] = self.start
        moving = np.zeros((count, len(self.start)))
        for begin, end, change in self._steps:
            low, high = np.searchsorted(times, (begin, end))
            moving[low:high] += minimum_jerk((times[low:high] - begin) / (end - begin))[:, None] * change
            finished[high] += change
        for begin, end, height in self._bumps:
            low, high = np.searchsorted(times, (begin, end))
            moving[low:high] += bump((times[low:high] - begin) / (end - begin))[:, None] * height
        return np.cumsum(finished[:-1], axis=0) + moving


@dataclass(frozen=True, eq=False)
class Waves:
    """Slow irregular motion of C channels: a sum of sines whose size falls with frequency."""

    amplitudes: Float[np.ndarray, "C K"]
    frequencies: Float[np.ndarray, "C K"]
    phases: Float[np.ndarray, "C K"]

    def sample(self, times: Float[np.ndarray, " T"]) -> Float[np.ndarray, "T C"]:
        """The waves at ``times`` in seconds."""
        total = np.zeros((len(times), len(self.amplitudes)))
        for a, f, p in zip(self.amplitudes.T, self.frequencies.T, self.phases.T, strict=True):
            total += a * np.sin(2.0 * np.pi * times[:, None] * f + p)
        return total


def draw_waves(
    rng: np.random.Generator, sizes: Float[np.ndarray, " C"], low: float, high: float, count: int = 6
) -> Waves:
    """Waves of standard deviation ``sizes`` (one a channel) with frequencies from ``low`` to ``high`` Hz."""
    edges = np.geomspace(low, high, count + 1)
    frequencies = rng.uniform(edges[:-1], edges[1:], (len(sizes), count))
    amplitudes = frequencies**-0.75
    amplitudes *= sizes[:, None] * np.sqrt(2.0 / np.sum(amplitudes**2, axis=1, keepdims=True))
    return Waves(amplitudes, frequencies, rng.uniform(0.0, 2.0 * np.pi, (len(sizes), count)))
