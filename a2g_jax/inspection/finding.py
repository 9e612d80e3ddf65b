"""The results of checks, as plain data for printing and for JSON."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal


@dataclass(frozen=True)
class Place:
    """The place of a finding; fields that do not apply are empty."""

    path: str = ""
    recording: str = ""
    joint: str = ""
    frame: int | None = None
    seconds: float | None = None

    def __str__(self) -> str:
        parts = [self.path, self.recording, self.joint and f"joint {self.joint}"]
        if self.frame is not None:
            parts.append(f"frame {self.frame}")
        if self.seconds is not None:
            parts.append(f"{self.seconds:.2f} s")
        return ", ".join(part for part in parts if part)


@dataclass(frozen=True)
class Finding:
    """One result of a check."""

    severity: Literal["warning", "info"]
    """``"warning"``: a likely fault; ``"info"``: an unusual fact."""
    code: str
    """The check, such as ``"frozen"``; stable, for scripts."""
    message: str
    fix: str = ""
    """Remedy."""
    place: Place = field(default_factory=Place)
    value: float | None = None
    """The measured number in the message."""

    def to_json(self) -> dict[str, Any]:
        """JSON values; the place without fields that do not apply."""
        values = asdict(self)
        values["place"] = {name: value for name, value in values["place"].items() if value not in ("", None)}
        return values

    def line(self) -> str:
        """One line of text."""
        where = f"{self.place}: " if str(self.place) else ""
        return f"[{self.code}] {where}{self.message}{f' {self.fix}' if self.fix else ''}"


def located(findings: Iterable[Finding], *, path: str = "", recording: str = "") -> list[Finding]:
    """The findings with a file or recording filled in where they have none."""
    return [
        replace(
            finding,
            place=replace(
                finding.place, path=finding.place.path or path, recording=finding.place.recording or recording
            ),
        )
        for finding in findings
    ]


def later(findings: Iterable[Finding], frames: int, fps: float) -> list[Finding]:
    """The findings of a motion that starts ``frames`` frames later in its file."""
    if frames == 0:
        return list(findings)

    def moved(place: Place) -> Place:
        frame = None if place.frame is None else place.frame + frames
        seconds = None if place.seconds is None else place.seconds + frames / fps
        return replace(place, frame=frame, seconds=seconds)

    return [replace(finding, place=moved(finding.place)) for finding in findings]


def warnings_of(findings: Iterable[Finding]) -> list[Finding]:
    """The warnings among findings."""
    return [finding for finding in findings if finding.severity == "warning"]
