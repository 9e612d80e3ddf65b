"""Measured rows, each kept on disk as soon as it is done, so that the command is interruptible and resumable."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from a2g_jax.evaluation.feature_network import FeatureNetwork
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.files import write_json
from a2g_jax.metrics.distribution import Features
from experiments.motion.listening import audit
from experiments.motion.rows import HALVES, Row
from experiments.motion.speeches import Speech, Talk, code_digest, digest, source_digest
from experiments.motion.statistics import feature_vectors, fgd, halves, statistics
from experiments.motion.targets import TRUTH


def kept(place: Path, measured: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """The figures in a file, which is written first where it is missing."""
    if not place.is_file():
        found = measured()
        place.parent.mkdir(parents=True, exist_ok=True)
        write_json(place, found)
    figures: dict[str, Any] = json.loads(place.read_text(encoding="utf-8"))
    return figures


@dataclass(frozen=True, eq=False)
class Bench:
    """Everything that the rows of one table share."""

    talk: Talk
    network: FeatureNetwork
    samples: int
    seed: int
    cache: Path

    @cached_property
    def speeches(self) -> list[Speech]:
        """The speeches, made when the first row needs them."""
        return self.talk.speeches

    @cached_property
    def reference(self) -> list[list[Features]]:
        """Feature vectors of the truth."""
        return feature_vectors(self.network, [[speech.truth] for speech in self.speeches if speech.truth is not None])

    @cached_property
    def identity(self) -> str:
        """Digest of the speeches, the network, the settings and the code of the statistics."""
        own = code_digest([Path(__file__).parent / name for name in _MEASURING])
        return digest(
            self.talk.identity,
            self.network.fingerprint,
            f"{self.samples} {self.seed}",
            source_digest("metrics", "geometry", "evaluation"),
            own,
        )

    def place(self, row: Row) -> Path:
        """The file of a row's figures."""
        return self.cache / f"{digest(self.identity, row.name if row.run is None else '', row.identity)}.json"

    def found(self, row: Row) -> dict[str, Any] | None:
        """The figures of a row that was measured before."""
        place = self.place(row)
        return kept(place, dict) if place.is_file() else None

    def measure(self, row: Row, report: Callable[[], None]) -> dict[str, Any]:
        """The figures of a row; kept on disk.

        Args:
            report: called after each speech.
        """
        return kept(self.place(row), lambda: self._measured(row, report))

    def _measured(self, row: Row, report: Callable[[], None]) -> dict[str, Any]:
        if row.draw is None:
            assert row.name == HALVES
            return {"fgd": halves(self.reference, self.seed)}
        motions: list[list[Motion]] = []
        for number in range(len(self.speeches)):
            motions.append(row.draw(number))
            report()
        values = statistics(self.speeches, motions)
        if row.name != TRUTH:
            values = {"fgd": fgd(feature_vectors(self.network, motions), self.reference), **values}
        if row.run is not None:
            values["listening"] = audit(row.run, self.speeches, self.seed, report)
        return values

    def work(self, rows: Sequence[Row]) -> int:
        """Number of calls of ``report`` for the rows that are not measured yet."""
        from experiments.motion.listening import CLIPS

        missing = [row for row in rows if row.draw is not None and self.found(row) is None]
        speeches = len(self.talk.roles)
        return sum(speeches + (8 * min(CLIPS, speeches) if row.run is not None else 0) for row in missing)


#: Files of this folder that determine the figures.
_MEASURING = ("rows.py", "statistics.py", "speeches.py", "listening.py", "resampling.py")
