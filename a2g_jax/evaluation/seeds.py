"""What the runs of a report are, and runs that differ in nothing but their seed as one row.

Everything is decided by the contents of ``run.json``, nothing by the names of folders.
"""

import hashlib
import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from a2g_jax.metrics.intervals import mean_interval
from a2g_jax.training.run import Run, run_to_json, weights_bytes

#: Fewest seeds with an interval. Means over a split are nearly normal, whatever clips are.
LEAST_SEEDS = 3
#: Entries of run.json that do not say how a run was trained: what wrote it, and what follows from the corpus.
_NO_SETTINGS = ("format", "version", "package", "body_extremes")

Row = dict[str, Any]


def describe_run(run: Run) -> dict[str, Any]:
    """What a run is: ``model``, ``preset``, ``steps``, ``seed`` and ``corpus`` of its training, ``weights`` (their
    SHA-256), and ``settings``, a hash of everything in ``run.json`` but the seed."""
    config = run.config
    return {
        "model": config.model,
        "preset": config.preset,
        "steps": run.steps,
        "seed": config.train_config.seed,
        "corpus": config.corpus.get("fingerprint"),
        "weights": hashlib.sha256(weights_bytes(run)).hexdigest(),
        "settings": _settings(run),
    }


def _settings(run: Run) -> str:
    values = {key: value for key, value in run_to_json(run.config, run.steps).items() if key not in _NO_SETTINGS}
    values["train_config"] = {key: value for key, value in values["train_config"].items() if key != "seed"}
    if run.config.train_config.patience:
        del values["steps"]  # where training stopped by the validation loss, which differs between seeds
    if "from" in values:
        values["from"] = {key: value for key, value in values["from"].items() if key != "run"}  # a folder's name
    return hashlib.sha256(json.dumps(values, sort_keys=True, default=str).encode()).hexdigest()[:16]


def single_rows(result: dict[str, Any]) -> list[Row]:
    """The rows of a report before runs of several seeds were put into one."""
    rows: list[Row] = []
    for row in result["rows"]:
        rows += row.get("runs", [row])
    return rows


def group_seeds(rows: Sequence[Row]) -> list[Row]:
    """Rows in which runs that differ only in their seed are one, at the place of the first of them.

    Such a row has ``seeds``; the single ones under ``runs``; and the mean over seeds of each score, with its 95 %
    interval by Student's t over seeds. Copies of weights and repeated seeds count once; runs of another number of
    samples, and rows without a description of their run, stay as they are.

    Args:
        rows: of a report, single ones (:func:`single_rows`).
    """
    members: dict[Any, list[Row]] = {}
    for row in rows:
        if row.get("run"):
            members.setdefault(_key(row), []).append(row)
    groups = {key: group for key, found in members.items() if len(group := _distinct(found)) > 1}
    names = [_name(group) for group in groups.values()]
    made: list[Row] = []
    for row in rows:
        key = _key(row) if row.get("run") else None
        if key is None or key not in groups:
            made.append(row)
        elif row is groups[key][0]:
            name = _name(groups[key])
            made.append(_merged(groups[key], f"{name}, settings {key[0]}" if names.count(name) > 1 else name))
        elif all(row is not other for other in groups[key]):
            made.append(row)  # a copy or a repeated seed
    return made


def _key(row: Row) -> tuple[str, int]:
    return row["run"]["settings"], row["samples"]


def _distinct(rows: Sequence[Row]) -> list[Row]:
    """The rows without copies of weights and without repetitions of a seed."""
    found: list[Row] = []
    for row in rows:
        if not any(row["run"][key] == other["run"][key] for other in found for key in ("seed", "weights")):
            found.append(row)
    return found


def _name(rows: Sequence[Row]) -> str:
    run = rows[0]["run"]
    return f"{run['model']} {run['preset']}, seeds {', '.join(str(row['run']['seed']) for row in rows)}"


def _merged(rows: Sequence[Row], name: str) -> Row:
    first = rows[0]
    steps = {row["run"]["steps"] for row in rows}
    run = {**first["run"], "steps": first["run"]["steps"] if len(steps) == 1 else sorted(steps)}
    run |= {"seed": [row["run"]["seed"] for row in rows], "weights": [row["run"]["weights"] for row in rows]}
    keys = [key for key in first["scores"] if all(key in row["scores"] for row in rows)]
    scores = {key: _cell([row["scores"][key] for row in rows]) for key in keys}
    emotions = _emotions([row.get("emotions") for row in rows])
    merged = {"name": name, "samples": first["samples"], "seeds": len(rows), "run": run, "scores": scores}
    return {**merged, "emotions": emotions, "runs": list(rows)}


def _cell(cells: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The mean over seeds of a score, with its interval; None where a seed has none."""
    rest = {key: value for key, value in cells[0].items() if key not in ("mean", "low", "high", "best", "clips")}
    means = _values(cells, "mean")
    if means is None:
        return {**rest, **dict.fromkeys(("mean", "low", "high", "best")), "seeds": len(cells)}
    found = mean_interval(means, least=LEAST_SEEDS).to_json()
    cell = {**rest, "mean": found["mean"], "low": found["low"], "high": found["high"], "seeds": len(cells)}
    cell.pop("reason", None)
    if found["low"] is None:
        cell["reason"] = f"{len(cells)} seeds: an interval over seeds needs {LEAST_SEEDS} or more"
    for key in ("best", "halves"):
        if key in cells[0]:
            values = _values(cells, key)
            cell[key] = None if values is None else float(values.mean())
    return cell


def _values(cells: Sequence[dict[str, Any]], key: str) -> np.ndarray | None:
    values = [cell.get(key) for cell in cells]
    return None if any(value is None for value in values) else np.array(values, np.float64)


def _emotions(found: Sequence[dict[str, Any] | None]) -> dict[str, Any] | None:
    """Counts of the clips of all seeds, and mean shares."""
    there = [one for one in found if one]
    if len(there) < len(found) or not there:
        return None
    shares = there[0]["above_neutral"]
    return {
        "confusion": np.sum([one["confusion"] for one in there], axis=0).tolist(),
        "above_neutral": {name: float(np.mean([one["above_neutral"][name] for one in there])) for name in shares},
    }
