"""Generation that checks every motion, and eases or draws it again where a body could not do it."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.generation.drafts import Draft, drafts_of
from a2g_jax.generation.ease import ease
from a2g_jax.generation.generator import Audio, Sampler
from a2g_jax.geometry.motion import Motion
from a2g_jax.metrics.body.bounds import BodyBounds
from a2g_jax.metrics.body.check import BodyFinding, Stretch, check_motion, frames_outside
from a2g_jax.progress import checkpoint
from a2g_jax.training.run import Run

#: Draws in place of a bad one. If a fifth of the samples is bad, one in 600 is still bad after three more.
REDRAWS = 3


@dataclass(frozen=True)
class SampleReport:
    """The check of one sample."""

    sample: int
    draws: int
    """1 for a sample that was good at once."""
    findings: tuple[BodyFinding, ...]
    """On the motion that was kept; none if it is good."""
    before: tuple[BodyFinding, ...] = ()
    """On the first draw as it was drawn, where something else was kept."""
    eased: bool = False
    """Whether joints of the motion that was kept were eased back (:func:`~a2g_jax.generation.ease.ease`)."""

    def lines(self) -> list[str]:
        """What a person wants to know: nothing on a sample that was good at once."""
        if self.findings:
            worst, more = self.findings[0], len(self.findings) - 1
            rest = f", and {more} more" if more else ""
            return [f"sample {self.sample}: OUTSIDE THE BOUNDS OF A BODY after {_times(self.draws)}: {worst}{rest}"]
        if self.before:
            how = "joints eased back" if self.eased else ""
            how += (" in " if how else "good after ") + _times(self.draws) if self.draws > 1 else ""
            return [f"sample {self.sample}: {how}; before: {self.before[0]}"]
        return []

    def to_json(self) -> dict[str, Any]:
        """The report as JSON values."""
        return {
            "sample": self.sample,
            "draws": self.draws,
            "eased": self.eased,
            "findings": [finding.to_json() for finding in self.findings],
            "first_draw": [finding.to_json() for finding in self.before],
        }


@dataclass(frozen=True, eq=False)
class Checked:
    """A sampler whose motions are checked against the bounds of the run's training motion.

    Joints of a bad sample that are bent or turned too far are eased back; if that is not enough, it is drawn again, up
    to :data:`REDRAWS` times, and the draw with the fewest frames outside is kept. A good sample is the wrapped
    sampler's own, bit for bit; sample k depends on the audio, the run, the seed and k alone.

    The wrapped sampler may have these attributes: ``stretches``, frames with bounds of their own
    (:class:`~a2g_jax.metrics.body.check.Stretch`), such as those of pinned clips; ``varies``, false if another seed
    gives the same motion; ``remedy``, what a user can change about frames that are given. The reports of one that
    yields drafts (:class:`~a2g_jax.generation.drafts.Drafting`) are on the motions that are kept.
    """

    run: Run
    sampler: Sampler
    strict: bool = False
    """Whether a sample that stays bad is an error."""
    reports: list[SampleReport] = field(default_factory=list)
    """Reports on the samples of :meth:`stream` so far."""

    @property
    def bounds(self) -> BodyBounds:
        """Bounds of the run."""
        return self.run.config.body_bounds

    @cached_property
    def stretches(self) -> Sequence[Stretch]:
        """Frames with other bounds."""
        return tuple(getattr(self.sampler, "stretches", ()))

    def stream(self, audio: Audio, samples: int, seed: int = 0) -> Iterator[Motion]:
        """Yield checked motions.

        Raises:
            InputError: a motion holds NaN after all draws, or with ``strict``, is outside the bounds.
        """
        self.reports.clear()
        for sample, draft in enumerate(drafts_of(self.sampler, audio, samples, seed)):
            kept, report = self._check(audio, seed, sample, draft)
            self.reports.append(report)
            if report.findings and (self.strict or report.findings[0].figure == "finite"):
                remedy = self._remedy(kept, report.findings) + (", or leave --strict out" if self.strict else "")
                what = f"a body cannot do it, after {_times(report.draws)}: {report.findings[0]}"
                raise InputError(f"sample {sample}: {what}; {remedy}.")
            kept.record(sample, kept.motion)
            yield kept.motion

    def to_json(self) -> dict[str, Any]:
        """Bounds, and the reports so far."""
        return {
            "format": "a2g_jax checks",
            "source": self.bounds.source,
            "fps": self.run.config.fps,
            "bounds": self.bounds.to_json(),
            "stretches": [
                {"first": one.first, "stop": one.stop, "source": one.bounds.source, "bounds": one.bounds.to_json()}
                for one in self.stretches
            ],
            "samples": [report.to_json() for report in self.reports],
        }

    def lines(self) -> list[str]:
        """Summary of the reports for the terminal."""
        good = sum(not report.findings for report in self.reports)
        again = sum(report.draws > 1 for report in self.reports)
        eased = sum(report.eased for report in self.reports)
        parts = [f"{eased} eased back" if eased else "", f"{again} drawn again" if again else ""]
        note = f" ({', '.join(part for part in parts if part)})" if eased or again else ""
        first = f"checked: {good} of {len(self.reports)} within the bounds of {self.bounds.source}{note}"
        return [first, *(line for report in self.reports for line in report.lines())]

    def plain(self) -> str:
        """The first of :meth:`lines` for people who do not program."""
        good, every = sum(not report.findings for report in self.reports), len(self.reports)
        if every == 1:
            return f"checked: it {'looks' if good else 'does not look'} physically possible"
        return f"checked: {'all' if good == every else f'{good} of'} {every} look physically possible"

    def _check(self, audio: Audio, seed: int, sample: int, draft: Draft) -> tuple[Draft, SampleReport]:
        first = check_motion(draft.motion, self.bounds, self.stretches)
        kept, draws = self._eased(draft, first), 1
        while kept.findings and draws <= REDRAWS and self._helps(kept.findings):
            checkpoint()
            (again,) = drafts_of(self.sampler, audio, 1, redrawn_seed(seed, sample, draws))
            draws += 1
            if _same(again.motion, draft.motion):
                break
            other = self._eased(again, check_motion(again.motion, self.bounds, self.stretches))
            if other.badness < kept.badness:
                kept = other
        before = first if kept.draft is not draft else ()
        return kept.draft, SampleReport(sample, draws, kept.findings, before, kept.eased)

    def _eased(self, draft: Draft, findings: tuple[BodyFinding, ...]) -> "_Draw":
        """The motion with its joints eased back, where that leaves fewer frames outside and does no harm."""
        drawn = _Draw(draft, findings)
        if not findings or findings[0].figure == "finite":
            return drawn
        eased = self._ease(drawn, findings)
        if eased is not None:
            return eased
        # A joint whose correction does harm elsewhere must not keep the others from theirs.
        for joint in dict.fromkeys(one.joint for one in findings):
            drawn = self._ease(drawn, [one for one in findings if one.joint == joint]) or drawn
        return drawn

    def _ease(self, drawn: "_Draw", findings: Sequence[BodyFinding]) -> "_Draw | None":
        """A draw with the joints of findings eased back; None if that leaves no fewer frames of joints outside, or if
        any figure of any joint is then further outside than before."""
        other = ease(drawn.draft.motion, findings, self.bounds, self.stretches)
        found = check_motion(other, self.bounds, self.stretches)
        eased = _Draw(replace(drawn.draft, motion=other), found, eased=True)
        fewer = sum(one.frames for one in found) < sum(one.frames for one in drawn.findings)
        return eased if fewer and not _worse(found, drawn.findings) else None

    def _helps(self, findings: Sequence[BodyFinding]) -> bool:
        """Whether another draw can help: the motion of a pinned clip is the same in each. Transitions depend on the
        drawn motion, too: two in five of bad ones are good after up to three draws."""
        given = [(one.first, one.stop) for one in self.stretches if one.fixed]
        return getattr(self.sampler, "varies", True) and not all(_within(one, given) for one in findings)

    def _remedy(self, draft: Draft, findings: Sequence[BodyFinding]) -> str:
        """What a user can do about the furthest finding."""
        given = [(one.first, one.stop) for one in self.stretches if one.fixed]
        own = str(getattr(self.sampler, "remedy", ""))
        if own and _within(findings[0], given):
            return own
        if not getattr(self.sampler, "varies", True):
            return "use another speech, or other clips and settings"
        if own and _within(findings[0], [*given, *draft.transitions]):
            return f"{own}; or use another --seed"
        return "use another --seed or speech"


@dataclass(frozen=True, eq=False)
class _Draw:
    """A draft with the findings on its motion."""

    draft: Draft
    findings: tuple[BodyFinding, ...]
    eased: bool = False

    @property
    def badness(self) -> tuple[bool, int]:
        """NaN is worst, then the number of frames outside."""
        broken = any(one.figure == "finite" for one in self.findings)
        return broken, frames_outside(self.findings, self.draft.motion.frames)


def redrawn_seed(seed: int, sample: int, attempt: int) -> int:
    """Seed of another draw of a sample: a hash of seed, sample and number of the attempt, from 0 to 2**31 - 1."""
    return int(np.random.SeedSequence([seed, sample, attempt]).generate_state(1)[0] >> 1)


def _worse(after: Sequence[BodyFinding], before: Sequence[BodyFinding]) -> bool:
    """Whether a finding has no earlier one of its figure and joint at its frames that was as far outside."""
    return not all(
        any(
            (old.figure, old.joint) == (new.figure, new.joint)
            and old.first < new.stop
            and new.first < old.stop
            and new.value - new.bound <= old.value - old.bound + 1e-3
            for old in before
        )
        for new in after
    )


def _within(finding: BodyFinding, spans: Iterable[tuple[int, int]]) -> bool:
    """Whether all frames of a finding lie in spans, which may touch."""
    flags = np.zeros(finding.stop, bool)
    for first, stop in spans:
        flags[max(first, 0) : max(stop, 0)] = True
    return bool(flags[finding.first :].all())


def _same(one: Motion, other: Motion) -> bool:
    return np.array_equal(one.rotations, other.rotations) and np.array_equal(one.root, other.root)


def _times(draws: int) -> str:
    return "1 draw" if draws == 1 else f"{draws} draws"
