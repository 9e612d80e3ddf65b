"""Records of the cross-validation: a take, method and seed each, with every fold and all folds together."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.generation.generator import Generator
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.files import read_json, sha256_file, write_json
from a2g_jax.training.run import Run
from a2g_jax.training.run_file import WEIGHTS_FILE, run_folder
from experiments.fine_tuning.measure import measure, posture_distance
from experiments.fine_tuning.methods import METHODS, SETTINGS, Made
from experiments.fine_tuning.takes import Fold, Spoken
from experiments.motion.resampling import smooth_resample
from experiments.motion.speeches import code_digest, digest

#: Motions of each run for the held-out speech.
SAMPLES = 8
#: Rows of the table that are the person's own motion.
HELD_OUT, OTHERS = "the person", "the person's other 80 %"

Record = dict[str, Any]
"""``take``, ``method``, ``seed``, ``folds`` (values, steps and CPU minutes of each) and ``pooled`` (values)."""


def references(folds: Sequence[Fold]) -> list[Record]:
    """The person's own statistics: of each held-out part, of the rest of the take, and of all parts together."""
    held = [fold.person(fold.held_out) for fold in folds]
    rest = [[fold.person(speech) for speech in fold.others] for fold in folds]
    about = {"take": folds[0].take, "seed": None}
    own = [{"values": {**measure([part]), "posture": 0.0}} for part in held]
    others = [
        {"values": {**measure(parts), "posture": posture_distance(parts, [part])}}
        for parts, part in zip(rest, held, strict=True)
    ]
    return [
        {**about, "method": HELD_OUT, "folds": own, "pooled": {**measure(held), "posture": 0.0}},
        {**about, "method": OTHERS, "folds": others, "pooled": None},
    ]


@dataclass(frozen=True)
class Campaign:
    """Trainings from a shipped run, and where their records and weights are."""

    name: str
    start: Run
    results: Path
    cache: Path

    def record(self, folds: Sequence[Fold], method: str, seed: int, measured: bool) -> Record | None:
        """The record of a method and a seed; None where a fold is missing and may not be measured."""
        take = folds[0].take
        place = self.results / f"{_stem(take, method)}_{seed}.json"
        measured_by = code_digest([Path(__file__).parent / name for name in ("measure.py", "takes.py", "records.py")])
        identity = digest(self._identity(folds, method), measured_by)
        found: Record = read_json(place) if place.is_file() else {}
        if found.get("identity") != identity:
            found = {"identity": identity, "take": take, "method": method, "seed": seed, "folds": [], "pooled": None}
        if found["pooled"] is not None:
            return found
        if not measured:
            return None
        place.parent.mkdir(parents=True, exist_ok=True)
        parts = []
        for fold in folds:
            made = self.made(fold, method, seed)
            parts.append(Spoken(self._motions(fold, seed, made), fold.held_out))
            if fold.number >= len(found["folds"]):
                values = _values(parts[-1:], [fold.person(fold.held_out)])
                found["folds"].append({"values": values, "steps": made.run.steps, "cpu_minutes": made.cpu_minutes})
                write_json(place, found)
                print(place.stem, fold.number, {key: round(value, 3) for key, value in values.items()}, flush=True)
        found["pooled"] = _values(parts, [fold.person(fold.held_out) for fold in folds])
        write_json(place, found)
        return found

    def made(self, fold: Fold, method: str, seed: int) -> Made:
        """The run of a method, trained where it is not there yet."""
        return METHODS[method](self.name, fold, seed, self._folder(fold, method, seed))

    def _folder(self, fold: Fold, method: str, seed: int) -> Path:
        stem = f"{_stem(fold.take, method)}_{seed}_{fold.number}"
        return self.cache / "runs" / f"{stem}_{self._identity([fold], method)}"

    def _identity(self, folds: Sequence[Fold], method: str) -> str:
        """Of what is trained: equal for equal weights."""
        weights = sha256_file(run_folder(self.name) / WEIGHTS_FILE)
        settings = SETTINGS[method](self.start.config.entry.fine_tuning)
        return digest(weights, *(fold.corpus.fingerprint for fold in folds), settings)

    def _motions(self, fold: Fold, seed: int, made: Made) -> list[Motion]:
        """Motions for the held-out speech, at the recording's rate."""
        motions = Generator(made.run).generate(fold.held_out.audio, SAMPLES, seed)
        return [fold.at_rate(smooth_resample(motion, fold.corpus.fps)) for motion in motions]


def _stem(take: str, method: str) -> str:
    return f"{take}_{method.replace(' ', '-')}"


def _values(ours: Sequence[Spoken], person: Sequence[Spoken]) -> dict[str, float]:
    values = {**measure(ours), "posture": posture_distance(ours, person)}
    assert all(np.isfinite(value) for value in values.values())
    return values
