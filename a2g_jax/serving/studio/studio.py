"""The state of a studio: its files, systems and takes, in a temporary folder that ends with it."""

import re
import secrets
import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.generation.capabilities import Capabilities
from a2g_jax.io.temporary import remove, temporary_path
from a2g_jax.io.words import Word
from a2g_jax.serving.studio.jobs import DONE, Job, Jobs
from a2g_jax.serving.studio.readers import KINDS
from a2g_jax.serving.studio.sample_formats import formats, missing_programs, slow_formats
from a2g_jax.serving.studio.settings import MOST_SAMPLES, Request, field_of, read_request
from a2g_jax.serving.studio.takes import MOST_STARS, Generate, Outcome, Take, with_client_names
from a2g_jax.serving.studio.takes_page import takes_page
from a2g_jax.serving.studio.uploads import Kind, Upload, Uploads

#: Takes that are kept; the oldest without stars make room, then the oldest.
MOST_TAKES = 24
_SHOWN = re.compile(r"([0-9a-f]{16}):(\d{1,3})")


class Studio:
    """Everything behind the page; a context manager that cancels all work and removes all files at its end."""

    def __init__(
        self,
        systems: Mapping[str, str],
        describe: Callable[[str], Capabilities],
        generate: Generate,
        *,
        first: str | None = None,
        titles: Mapping[str, str] = MappingProxyType({}),
        kinds: Mapping[str, Kind] = KINDS,
        takes: int = MOST_TAKES,
    ) -> None:
        """
        Args:
            systems: runs, names of shipped ones or folders, by what the page calls them.
            describe: what can be requested of a run.
            generate: generates a take.
            first: the system that the page begins with.
            titles: plain words for systems, by their names.
            kinds: of uploads.
            takes: that are kept.
        """
        self.systems, self._describe, self._generate = dict(systems), describe, generate
        self.first = first or next(iter(self.systems))
        self._titles = dict(titles)
        self._kinds, self._most = kinds, takes
        self.takes: dict[str, Take] = {}
        self._made = 0
        self._pace: dict[str, float] = {}
        self._described: dict[str, Capabilities] = {}
        self._describing, self._requesting = threading.Lock(), threading.Lock()
        self._words: dict[str, Sequence[Word]] = {}
        self._changes = 0

    def __enter__(self) -> "Studio":
        # The name holds this process, so that the folder of a killed one is removed by the next.
        self.folder = temporary_path(Path(tempfile.gettempdir()) / "studio")
        self.folder.mkdir(mode=0o700)
        (self.folder / "uploads").mkdir()
        self.uploads = Uploads(self.folder / "uploads", self._kinds, in_use=self._in_use)
        self.jobs = Jobs()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.jobs.close()
        remove(self.folder)

    def add_speech(self, id: str, name: str, path: Path, words: Sequence[Word] = ()) -> None:
        """Offer a recording that comes with the package.

        Raises:
            InputError: audio that cannot be used.
        """
        about = self._kinds["speech"].read(path)
        self.uploads.add(Upload(id, "speech", name, path, about, keep=True))
        self._words[id] = words

    @property
    def version(self) -> int:
        """Grows with every change of :meth:`state`."""
        return self.jobs.version + self._changes

    # --- systems ---

    def describe(self, system: str) -> dict[str, Any]:
        """What can be requested of a system.

        Raises:
            InputError: no such system, or a run that cannot be used.
        """
        if system not in self.systems:
            raise InputError(f"no system {system!r}; there are {', '.join(self.systems)}.")
        return {"name": system, **asdict(self._capabilities(system))}

    def _capabilities(self, system: str) -> Capabilities:
        with self._describing:  # a run is opened once, however many pages wait for it
            if system not in self._described:
                self._described[system] = self._describe(self.systems[system])
            return self._described[system]

    def _settings_of(self, system: str) -> set[str]:
        return {setting.name for setting in self._capabilities(system).settings}

    def about(self) -> dict[str, Any]:
        """What the page has to know at its start."""
        built_in = [upload.to_json() for upload in self.uploads.all() if upload.keep]
        return {
            "systems": list(self.systems),
            "titles": {name: self._titles.get(name, "") for name in self.systems},
            "first": self.first,
            "speeches": built_in,
            "formats": list(formats()),
            "slow": {name: self._missing.get(name, "") for name in slow_formats()},
            "accept": {name: ",".join(kind.suffixes) for name, kind in self._kinds.items()},
            "most_bytes": {name: kind.most_bytes for name, kind in self._kinds.items()},
            "most_samples": MOST_SAMPLES,
            "most_stars": MOST_STARS,
        }

    @cached_property
    def _missing(self) -> dict[str, str]:
        return missing_programs()

    # --- takes ---

    def request(self, values: Any) -> Take:
        """Put a request into the queue.

        Raises:
            FieldError: a request that has another form.
            InputError: too many requests wait.
        """
        request = read_request(values, self.systems, self.uploads, self._settings_of)
        with self._requesting:
            return self._submit(request, values)

    def _submit(self, request: Request, values: Any) -> Take:
        folder = self.folder / f"take-{secrets.token_hex(8)}"
        seconds = float(request.speech.about.get("seconds", 0.0))
        pace = self._pace.get(request.system)
        job = Job(
            f"take {self._made + 1}",
            lambda job: self._work(job, take),
            expected=None if pace is None else pace * seconds * request.samples,
            refused=lambda message: field_of(message, request),
        )
        job.total, job.unit = request.samples, "sample"
        take = Take(self._made + 1, request, folder, job, self._words.get(request.speech.id, ()), values)
        self.jobs.submit(job)  # first: one that is refused removes no other take
        self._make_room()
        self._made += 1
        self.takes[take.id] = take
        self._changes += 1
        return take

    def _work(self, job: Job, take: Take) -> Outcome:
        take.folder.mkdir()
        try:
            with take.working():
                outcome = self._generate(take.request.arguments, take.folder, job)
        except BaseException:
            remove(take.folder)
            raise
        length = outcome.seconds * take.request.samples
        if length > 0:
            # The first one of a system compiles its programs, which the next ones do not.
            pace = job.seconds() / length
            self._pace[take.request.system] = min(pace, self._pace.get(take.request.system, pace))
        return with_client_names(outcome, take.request.used)

    def find(self, id: str) -> Take:
        """A take.

        Raises:
            InputError: it is no longer kept.
        """
        if id not in self.takes:
            raise InputError("this take is no longer kept; generate it again.")
        return self.takes[id]

    def cancel(self, id: str) -> None:
        """End the work on a take.

        Raises:
            InputError: it is no longer kept.
        """
        self.jobs.cancel(self.find(id).job)

    def drop(self, id: str) -> None:
        """Remove a take with its files; its work is cancelled, and leaves nothing when it ends.

        Raises:
            InputError: it is no longer kept.
        """
        take = self.find(id)
        for job in (take.job, *take.films.values()):
            self.jobs.cancel(job)
        self.takes.pop(id, None)
        take.remove()
        self._changes += 1

    def rate(self, id: str, stars: Any) -> None:
        """Rank a sample.

        Args:
            stars: JSON ``{"sample": 0, "stars": 4}``; 0 stars take the ranking back.

        Raises:
            InputError: no such take or sample, or another form.
        """
        take = self.find(id)
        sample, number = (stars.get(name) if isinstance(stars, dict) else None for name in ("sample", "stars"))
        if type(sample) is not int or type(number) is not int or not 0 <= number <= MOST_STARS:
            raise InputError(f"expected a sample and 0 to {MOST_STARS} stars.")
        take.check_sample(sample)
        take.stars[sample] = number
        self._changes += 1

    def film(self, id: str, sample: int, format: str) -> Job:
        """The job that writes a file in a slow format; the same one until it fails.

        Raises:
            InputError: no such take, sample or format, or a program for it is missing.
        """
        take = self.find(id)
        take.check_sample(sample)
        if format not in slow_formats():
            raise InputError(f"{format} is not written by a job.")
        if self._missing.get(format):
            raise InputError(self._missing[format])
        job = take.films.get((sample, format))
        if job is None or (job.state != DONE and job.ended is not None):
            job = Job(f"{format} of take {take.number}, sample {sample}", lambda _: take.file(sample, format))
            take.films[sample, format] = self.jobs.submit(job)
            self._changes += 1
        return job

    def cancel_film(self, id: str, sample: int, format: str) -> None:
        """End the work on a file.

        Raises:
            InputError: no such take.
        """
        job = self.find(id).films.get((sample, format))
        if job is not None:
            self.jobs.cancel(job)

    def page(self, shown: str) -> str:
        """The page of samples such as ``TAKE:0,TAKE:2``.

        Raises:
            InputError: another form, or samples that cannot be shown together.
        """
        parts = [_SHOWN.fullmatch(part) for part in shown.split(",")][: 2 * MOST_SAMPLES + 1]
        if not all(parts) or len(parts) > 2 * MOST_SAMPLES:
            raise InputError(f"expected up to {2 * MOST_SAMPLES} samples of takes.")
        chosen = [(self.find(part[1]), int(part[2])) for part in parts if part]
        name = chosen[0][0].request.speech.name
        return takes_page(chosen, f"{len(chosen)} gestures for {name}" if len(chosen) > 1 else f"A gesture for {name}")

    def state(self) -> dict[str, Any]:
        """All takes, the newest first."""
        takes = list(self.takes.values())  # requests arrive in other threads
        takes.sort(key=lambda take: -take.number)
        return {"takes": [take.to_json(self.jobs.position(take.job)) for take in takes]}

    @property
    def busy(self) -> bool:
        """Whether any job waits or runs."""
        return any(take.busy for take in list(self.takes.values()))

    def _in_use(self) -> list[Path]:
        """The uploads that waiting requests name."""
        return [upload.path for take in list(self.takes.values()) if take.busy for upload in take.request.used]

    def _make_room(self) -> None:
        ended = [take for take in list(self.takes.values()) if not take.busy]
        for take in sorted(ended, key=lambda take: (any(take.stars.values()), take.number)):
            if len(self.takes) < self._most:
                return
            del self.takes[take.id]
            take.remove()
