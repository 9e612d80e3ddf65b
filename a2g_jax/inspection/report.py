"""The report of an inspection, as one JSON document and as text."""

import math
from dataclasses import dataclass, field
from typing import Any

from a2g_jax.inspection.finding import Finding, warnings_of

FORMAT, VERSION = "a2g_jax inspection", 2
#: Findings of one code shown as text; JSON has all.
_SHOWN = 8


@dataclass(frozen=True, eq=False)
class Report:
    """Facts and findings of a file, folder, corpus or run.

    As JSON, stable within a version::

        {"format": "a2g_jax inspection", "version": 2,
         "path": ..., "kind": "bvh" | "audio" | "transcript" | "motion npz" | "smplx npz" | "npz" | "pair" | "folder"
                              | "corpus" | "run" | "likelihood",
         "facts": {section: {name: number, text, list or further names}},
         "findings": [{"severity": "warning" | "info", "code", "message", "fix", "value": number or null,
                       "place": {"path", "recording", "joint", "frame", "seconds"} as far as they apply}]}
    """

    path: str
    kind: str
    facts: dict[str, Any]
    """Sections of numbers, texts and lists; the section ``skeleton`` is drawn by :mod:`a2g_jax.inspection.tree`."""
    findings: list[Finding] = field(default_factory=list)

    @property
    def warnings(self) -> int:
        """Number of warnings."""
        return len(warnings_of(self.findings))

    def __str__(self) -> str:
        """The text of ``a2g inspect``."""
        return self.text()

    def to_json(self) -> dict[str, Any]:
        """The JSON document."""
        document = {
            "format": FORMAT,
            "version": VERSION,
            "path": self.path,
            "kind": self.kind,
            "facts": self.facts,
            "findings": [finding.to_json() for finding in self.findings],
        }
        return _without_nan(document)

    def text(self) -> str:
        """The report for a terminal."""
        from a2g_jax.inspection.tree import draw_tree

        lines = [f"{self.path}: {self.kind}"]
        for title, section in self.facts.items():
            lines += ["", title]
            if title == "skeleton":
                lines += [f"  {line}" for line in draw_tree(section)]
                section = {name: value for name, value in section.items() if name not in ("joints", "count")}
            lines += _section(section)
        return "\n".join([*lines, *self._findings()])

    def _findings(self) -> list[str]:
        lines = []
        for severity, title in (("info", "notes"), ("warning", "warnings")):
            chosen = [finding for finding in self.findings if finding.severity == severity]
            if chosen:
                lines += ["", f"{title} ({len(chosen)})"]
            for code in dict.fromkeys(finding.code for finding in chosen):
                groups: dict[tuple[str, str], list[Finding]] = {}
                for finding in (finding for finding in chosen if finding.code == code):
                    groups.setdefault((finding.message, finding.fix), []).append(finding)
                same = [
                    first.line() + (f" (The same in {len(more)} more places.)" if more else "")
                    for first, *more in groups.values()
                ]
                lines += [f"  {line}" for line in same[:_SHOWN]]
                if len(same) > _SHOWN:
                    lines.append(f"  [{code}] and {len(same) - _SHOWN} more; --json lists them all")
        return lines if self.warnings else [*lines, "", "no warnings"]


def _without_nan(value: Any) -> Any:
    """The value with null for NaN and infinity, which JSON lacks."""
    if isinstance(value, dict):
        return {name: _without_nan(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _section(section: dict[str, Any]) -> list[str]:
    if not section:
        return []
    width = max(len(name) for name in section)
    return [f"  {name.ljust(width)}  {_shown(value)}" for name, value in section.items()]


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}" if abs(value) < 1e6 else f"{value:.3e}"
    if isinstance(value, dict):
        return ", ".join(f"{name} {_shown(inner)}" for name, inner in value.items())
    if isinstance(value, list | tuple):
        if len(value) == 2 and all(isinstance(item, float) for item in value):
            return f"{_shown(value[0])} to {_shown(value[1])}"
        return ", ".join(_shown(item) for item in value)
    return "-" if value is None else str(value)
