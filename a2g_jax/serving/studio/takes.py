"""A take: the samples of one request in a folder of its own, with their files, page and ranking."""

import threading
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.generation.formats import motion_format
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.audio import read_audio
from a2g_jax.io.files import atomic_path, json_text
from a2g_jax.io.npz import read_motion_npz
from a2g_jax.io.temporary import remove
from a2g_jax.io.words import Word
from a2g_jax.serving.studio.jobs import DONE, ENDED, Job
from a2g_jax.serving.studio.sample_formats import formats, slow_formats
from a2g_jax.serving.studio.settings import Request, named
from a2g_jax.serving.studio.uploads import Upload
from a2g_jax.viz.player import Figure, Lane, Track
from a2g_jax.viz.player.skin import Skin

#: The speech of a take, in its folder.
SPEECH = "speech.wav"
#: Most stars of a sample.
MOST_STARS = 5


@dataclass(frozen=True)
class Outcome:
    """What generation wrote into a take's folder: ``sample_00.npz``, ..., ``speech.wav`` and reports."""

    seconds: float
    """Length of a motion."""
    subtitle: str = ""
    lanes: tuple[Lane, ...] = ()
    """Further lanes of the page, such as the pinned clips."""
    notes: tuple[str, ...] = ()
    """Of each sample: what is outside the bounds of a body."""
    tracks: tuple[tuple[Lane, ...], ...] = ()
    """Lanes of each sample."""
    scores: tuple[float, ...] = ()
    """Of each sample, higher is better; none where samples have no score."""
    lines: tuple[str, ...] = ()
    """Reports on the whole, for the user."""
    plain: str = ""
    """The most important one in plain words; the page shows the others on request."""
    warning: str = ""
    """About the speech; shown at once."""
    skin: Skin | None = None
    """The mesh of the character that it was generated for."""


#: Generates: the arguments of ``a2g generate``, the folder, and the job that progress is reported to.
Generate = Callable[[Sequence[str], Path, Job], Outcome]


@dataclass(eq=False)
class Take:
    """The samples of one request."""

    number: int
    request: Request
    folder: Path
    job: Job
    words: Sequence[Word] = ()
    values: Any = None
    """The request as the page sent it, to show it again."""
    stars: dict[int, int] = field(default_factory=dict)
    """Ranking: 1 to 5 of samples that have some."""
    films: dict[tuple[int, str], Job] = field(default_factory=dict)
    """Jobs of slow formats by sample and format."""
    _writing: threading.Lock = field(default_factory=threading.Lock)
    _removed: bool = False

    @property
    def id(self) -> str:
        """The job's."""
        return self.job.id

    @property
    def outcome(self) -> Outcome:
        """Of the finished job.

        Raises:
            InputError: it has not finished.
        """
        if self.job.state != DONE:
            raise InputError(f"take {self.number} is not finished; wait for it.")
        result: Outcome = self.job.result
        return result

    @property
    def busy(self) -> bool:
        """Whether any of its jobs waits or runs."""
        return any(job.state not in ENDED for job in (self.job, *self.films.values()))

    def check_sample(self, sample: int) -> None:
        """Refuse a sample that does not exist.

        Raises:
            InputError: there is no such sample, or not yet.
        """
        _ = self.outcome
        if not 0 <= sample < self.request.samples:
            raise InputError(f"take {self.number} has no sample {sample}.")

    def motion(self, sample: int) -> Motion:
        """A sample.

        Raises:
            InputError: as :meth:`check_sample`.
        """
        self.check_sample(sample)
        return read_motion_npz(self.folder / f"sample_{sample:02d}.npz")

    def speech(self) -> tuple[Any, int]:
        """The speech and its sample rate, as generation used it."""
        return read_audio(self.folder / SPEECH, SPEECH_RATE), SPEECH_RATE

    def file(self, sample: int, format: str) -> Path:
        """The file of a sample in a format, written if it is not there yet.

        Raises:
            InputError: no such format or sample.
            OutputError: the disk is full.
        """
        self.check_sample(sample)
        if format not in formats():
            raise InputError(f"no format {format!r}; there are {', '.join(formats())}.")
        found = motion_format(format)
        assert found is not None
        path = self.folder / f"sample_{sample:02d}{found.suffix}"
        # Slow ones are written by the one worker, and must not keep the others waiting.
        with nullcontext() if found.check else self._writing, self.working():
            if not path.exists():
                speech = self.speech() if found.sound else None
                found.write(path, self.motion(sample), speech, self.outcome.skin)
        return path

    @contextmanager
    def working(self) -> Iterator[None]:
        """A block that writes into the folder: if the take is removed meanwhile, so is what the block wrote.

        Raises:
            InputError: the take is removed.
        """
        try:
            yield
        finally:
            if self._removed:
                remove(self.folder)
        if self._removed:
            raise InputError("this take is no longer kept; generate it again.")

    def remove(self) -> None:
        """Remove the files; work that has not ended yet leaves none either."""
        self._removed = True
        remove(self.folder)

    def file_name(self, sample: int, format: str) -> str:
        """The name that a downloaded file gets."""
        found = motion_format(format)
        return f"take{self.number}_sample{sample}{'' if found is None else found.suffix}"

    def figure(self, sample: int, label: str = "", number: int | None = None) -> Figure:
        """A sample on the page.

        Args:
            number: picks its colour; None for its place on the page.
        """
        outcome = self.outcome
        note = outcome.notes[sample] if sample < len(outcome.notes) else ""
        tracks = outcome.tracks[sample] if sample < len(outcome.tracks) else ()
        motion = self.motion(sample)
        return Figure(motion, label or f"sample {sample}", note, tracks, number=number, skin=outcome.skin)

    def order(self, by: str = "made") -> list[int]:
        """Samples in an order: ``made``, ``stars`` or ``score``, the best first."""
        samples = list(range(self.request.samples))
        scores = self.outcome.scores
        if by == "stars":
            return sorted(samples, key=lambda sample: -self.stars.get(sample, 0))
        if by == "score" and len(scores) == len(samples):
            return sorted(samples, key=lambda sample: -scores[sample])
        return samples

    def write_zip(self, path: Path, chosen: Sequence[str]) -> None:
        """All samples in some formats, the speech and the ranking as one archive, the samples with most stars first.

        Files in a slow format that are not there yet are left out.

        Raises:
            InputError: no such format.
            OutputError: the disk is full.
        """
        with atomic_path(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.write(self.folder / SPEECH, SPEECH)
            for sample in self.order("stars"):
                for format in chosen:
                    if format in slow_formats() and not self._there(sample, format):
                        continue
                    archive.write(self.file(sample, format), self.file_name(sample, format))
            archive.writestr("take.json", json_text(self.summary()))
            for report in self.folder.glob("*.json"):
                archive.write(report, report.name)

    def summary(self) -> dict[str, Any]:
        """Command, ranking and scores, for the archive."""
        return {
            "command": self.request.command,
            "stars": {str(sample): stars for sample, stars in sorted(self.stars.items())},
            "scores": list(self.outcome.scores),
        }

    def to_json(self, position: int = 0) -> dict[str, Any]:
        """The take as JSON values.

        Args:
            position: jobs before it in the queue.
        """
        found = {
            "id": self.id,
            "number": self.number,
            "system": self.request.system,
            "speech": {"id": self.request.speech.id, "name": self.request.speech.name},
            "count": self.request.samples,
            "command": self.request.command,
            "request": self.values,
            "job": {**self.job.to_json(), "position": position},
        }
        if self.job.state != DONE:
            return found
        outcome = self.outcome
        samples = [
            {
                "number": sample,
                "note": outcome.notes[sample] if sample < len(outcome.notes) else "",
                "stars": self.stars.get(sample, 0),
                "score": outcome.scores[sample] if sample < len(outcome.scores) else None,
                "films": {format: job.to_json() for (of, format), job in sorted(self.films.items()) if of == sample},
            }
            for sample in range(self.request.samples)
        ]
        about = {"seconds": outcome.seconds, "subtitle": outcome.subtitle, "lines": list(outcome.lines)}
        about |= {"plain": outcome.plain, "warning": outcome.warning}
        return {**found, **about, "samples": samples}

    def _there(self, sample: int, format: str) -> bool:
        found = motion_format(format)
        return found is not None and (self.folder / f"sample_{sample:02d}{found.suffix}").exists()


#: Sample rate of a take's speech, Hz: that of the models.
SPEECH_RATE = 16_000


def with_client_names(outcome: Outcome, used: Sequence[Upload]) -> Outcome:
    """The texts of an outcome with the names that the client has for its files."""
    lanes = tuple(
        replace(lane, spans=tuple((*span[:2], named(span[2], used), *span[3:]) for span in lane.spans))
        if isinstance(lane, Track)
        else lane
        for lane in outcome.lanes
    )
    lines = tuple(named(line, used) for line in outcome.lines)
    warning = named(outcome.warning, used)
    return replace(outcome, subtitle=named(outcome.subtitle, used), lanes=lanes, lines=lines, warning=warning)
