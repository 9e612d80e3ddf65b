"""Motions with what is reported on them, so that a report is on the motion that is kept.

A motion may be eased or drawn again after its sampler made it. Samplers with reports of their own therefore yield
drafts; whoever keeps a motion records it.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from a2g_jax.generation.generator import Audio, Sampler
from a2g_jax.geometry.motion import Motion

#: Reports on a motion as the sample of a number.
Record = Callable[[int, Motion], None]


def _nothing(sample: int, motion: Motion) -> None:
    """The record of a sampler without reports."""


@dataclass(frozen=True, eq=False)
class Draft:
    """A motion as it was drawn."""

    motion: Motion
    record: Record = _nothing
    """Adds the reports of all samplers that made it, on the motion that is kept of it."""
    transitions: tuple[tuple[int, int], ...] = ()
    """Frames from ``first`` to ``stop`` that lead to or from something given, such as a pinned clip."""


@runtime_checkable
class Drafting(Protocol):
    """A sampler with reports."""

    def drafts(self, audio: Audio, samples: int, seed: int = 0) -> Iterator[Draft]:
        """Yield the motions of ``stream``, without a change to any report before one is recorded."""
        ...


def drafts_of(sampler: Sampler, audio: Audio, samples: int, seed: int) -> Iterator[Draft]:
    """Drafts of any sampler."""
    if isinstance(sampler, Drafting):
        return sampler.drafts(audio, samples, seed)
    return map(Draft, sampler.stream(audio, samples, seed))


def recorded(drafts: Iterable[Draft]) -> Iterator[Motion]:
    """The motions of drafts as they were drawn, each recorded before it is yielded."""
    for sample, draft in enumerate(drafts):
        draft.record(sample, draft.motion)
        yield draft.motion


def enter(reports: list[Any], sample: int, report: Any) -> None:
    """Put the report on a sample into a list, in place of those of an earlier stream from there on."""
    reports[sample:] = [report]
