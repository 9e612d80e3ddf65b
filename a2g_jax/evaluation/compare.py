"""Reports of the same conditions as one."""

from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.evaluation.report_cells import condition
from a2g_jax.evaluation.row_names import BASELINES
from a2g_jax.evaluation.seeds import group_seeds, single_rows
from a2g_jax.io.files import read_json

_CONDITIONS = (
    *("skeleton", "corpus", "split", "samples", "clips", "units", "beat_sigma", "wrist_to_wrist"),
    *("feature_network", "emotion_classifier"),
)
#: Numbers of every cell, or None.
_VALUES = ("mean", "low", "high", "best")


def check_comparable(results: dict[str, dict[str, Any]]) -> None:
    """Refuse to compare reports of different conditions.

    Args:
        results: contents of ``report.json`` files by name.

    Raises:
        InputError: different skeletons, corpora, splits, numbers of samples, units, tolerances of beat alignment,
            feature networks or classifiers.
    """
    (first, reference), *others = results.items()
    for name, result in others:
        for key in _CONDITIONS:
            here, there = (condition(each["about"], key) for each in (reference, result))
            if here != there:
                raise InputError(
                    f"{first} and {name}: cannot be compared: {key.replace('_', ' ')} is {here} in one and {there} in"
                    " the other; evaluate both in the same way."
                )


def merge(results: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Several reports as one: the models of all, and the baselines once. Runs that differ only in their seed are one
    row, also where they are of different reports.

    Args:
        results: contents of ``report.json`` files by name.

    Raises:
        InputError: see :func:`check_comparable`.
    """
    check_comparable(results)
    single = {report: single_rows(result) for report, result in results.items()}
    names: list[str] = [row["name"] for rows in single.values() for row in rows]
    rows: list[dict[str, Any]] = []
    baselines: dict[str, dict[str, Any]] = {}
    audits: dict[str, Any] = {}
    for report, result in results.items():
        for row in single[report]:
            if row["name"] in BASELINES:
                # One report may have metrics that another one lacks.
                earlier = baselines.get(row["name"], row)
                baselines[row["name"]] = {**earlier, "scores": row["scores"] | earlier["scores"]}
                continue
            name = f"{row['name']} ({report})" if names.count(row["name"]) > 1 else row["name"]
            rows.append({**row, "name": name})
            if row["name"] in result.get("audits", {}):
                audits[name] = result["audits"][row["name"]]
    about = dict(next(iter(results.values()))["about"])
    extra = {
        key: values for result in results.values() for key, values in result["about"].get("extra_metrics", {}).items()
    }
    if extra:
        about["extra_metrics"] = extra
    return {"about": about, "rows": [*group_seeds(rows), *baselines.values()], "audits": audits}


def read_report(folder: Path) -> dict[str, Any]:
    """The contents of a report's ``report.json``.

    Raises:
        InputError: no such file, or not a report.
    """
    path = folder / "report.json"
    if not path.is_file():
        raise InputError(f"{folder}: is no report (no report.json in it); make one with 'a2g evaluate RUN ...'.")
    value = read_json(path)
    if not _is_report(value):
        raise InputError(f"{path}: is not a report of 'a2g evaluate'; run that again.")
    return value


def _is_report(value: Any) -> bool:
    """Whether a JSON value has what every report has, also those of 0.1, with values of the right types."""
    if not isinstance(value, dict) or not isinstance(value.get("about"), dict):
        return False
    if not isinstance(value.get("rows"), list) or not isinstance(value.get("audits", {}), dict):
        return False
    about, rows = value["about"], value["rows"]
    right = all(isinstance(about.get(key), str) for key in ("split", "corpus", "package"))
    right = right and all(_is_number(about.get(key)) for key in ("clips", "samples", "seconds", "seed"))
    network = about.get("feature_network", 0)  # None where there is none
    if network is not None:
        right = right and isinstance(network, str) and _is_number(about.get("feature_vectors")) and "floor" in about
    return right and isinstance(about.get("recipe"), dict) and all(_is_row(row) for row in rows)


def _is_row(row: Any) -> bool:
    if not isinstance(row, dict) or not isinstance(row.get("scores"), dict):
        return False
    cells = row["scores"].values()
    return (
        isinstance(row.get("name"), str)
        and _is_number(row.get("samples"))
        and all(
            isinstance(cell, dict)
            and all(key in cell and (cell[key] is None or _is_number(cell[key])) for key in _VALUES)
            for cell in cells
        )
        and all(map(_is_row, row.get("runs") or ()))
    )


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
