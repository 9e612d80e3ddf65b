"""The table of all records."""

from typing import Any

from experiments.benchmarks.catalogue import BENCHMARKS, Benchmark, Target
from experiments.benchmarks.turns import clock

#: Share of the cores above which other processes make a record's times worthless.
MOST_OTHERS = 0.05
#: Share of its floor that a time may be below it: rates of the machine differ by a tenth between turns.
LEAST_OF_FLOOR = 0.9
#: Cell of a time that means nothing, since :func:`busy`.
_BUSY = "busy"
_HEADINGS = (
    "",
    "ours, s",
    "processor, s",
    "PyTorch eager",
    "compiled",
    "authors' structure",
    "floor, s",
    "x floor",
    "peak MB",
    "eager's",
    "targets",
)


def table(records: dict[str, dict[str, Any]]) -> str:
    """A Markdown table: times of ours, of the others in multiples of ours, floors, memory, and whether targets are met.

    Args:
        records: by name of the benchmark.
    """
    lines = ["| " + " | ".join(_HEADINGS) + " |", "|" + " --- |" * len(_HEADINGS)]
    for name, benchmark in BENCHMARKS.items():
        if name in records:
            lines.append("| " + " | ".join(_cells(benchmark, records[name])) + " |")
    return "\n".join(lines) + "\n"


def busy(record: dict[str, Any]) -> bool:
    """Whether the times of a record mean nothing: other processes took the cores, or a time is clearly below its floor,
    whose rates were then measured beside other work."""
    floor, which = record["floor"]["seconds"], clock(record["threads"])
    shares = [row.get("others_share") or 0.0 for row in record["rows"]]
    times = [row[which] for row in record["rows"] if which in row]
    return any(share > MOST_OTHERS for share in shares) or any(seconds < LEAST_OF_FLOOR * floor for seconds in times)


def _cells(benchmark: Benchmark, record: dict[str, Any]) -> list[str]:
    rows = {row["contender"]: row for row in record["rows"]}
    ours = rows.get("a2g_jax", {})
    others = [rows.get(name, {}) for name in ("torch_eager", "torch_compiled", "torch_authors")]
    own, floor = ours.get(clock(record["threads"])), record["floor"]["seconds"]
    times = [
        _number(ours.get("wall_s")),
        _number(ours.get("cpu_s")),
        *map(_ratio, others),
        _number(floor) if floor else "-",
        _number(own / floor) if floor and own else "-",
    ]
    return [
        benchmark.title,
        *([_BUSY] * len(times) if busy(record) else times),
        _number(ours.get("peak_mb")),
        _number(others[0].get("peak_mb")),
        "; ".join(_judged(target, record, rows) for target in benchmark.targets) or "-",
    ]


def _judged(target: Target, record: dict[str, Any], rows: dict[str, Any]) -> str:
    found = _found(target, record, rows)
    least = target.kind in ("ratio", "speed")
    names = {
        "ratio": f"{target.contender.removeprefix('torch_')} >= {target.value:g}x",
        "floor": f"floor <= {target.value:g}x",
        "memory": "memory <= eager's" if target.value == 1.0 else f"memory <= {target.value:g}x eager's",
        "megabytes": f"memory <= {target.value:g} MB",
        "speed": f">= {target.value:g}x real time",
    }
    if target.kind in ("ratio", "floor", "speed") and busy(record):
        return f"{names[target.kind]}: not measured: the cores were busy"
    if found is None:
        return f"{names[target.kind]}: not measured"
    met = found >= target.value if least else found <= target.value
    return f"{names[target.kind]}: {_number(found)}, {'met' if met else '**not met**'}"


def _found(target: Target, record: dict[str, Any], rows: dict[str, Any]) -> float | None:
    """The figure that a target bounds."""
    ours, other = rows.get("a2g_jax", {}), rows.get(target.contender, {})
    own, floor = ours.get(clock(record["threads"])), record["floor"]["seconds"]
    peak, theirs = ours.get("peak_mb"), other.get("peak_mb")
    if target.kind == "ratio":
        return other.get("ratio")
    if target.kind == "floor":
        return own / floor if own and floor else None
    if target.kind == "memory":
        return peak / theirs if peak and theirs else None
    if target.kind == "speed":
        return record["about"]["audio_s"] / own if own else None
    return peak


def _ratio(row: dict[str, Any]) -> str:
    return f"{_number(row['ratio'])}x" if "ratio" in row else "failed" if "failed" in row else "-"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"
