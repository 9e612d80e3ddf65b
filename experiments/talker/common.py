"""Common part of the experiments: arguments, processes, intervals, tables, JSON."""

import argparse
import datetime
import json
import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from a2g_jax import __version__
from a2g_jax.metrics.pooled import jackknife
from a2g_jax.talker.emotions import VOICE_EMOTIONS
from a2g_jax.talker.speakers import SPEAKERS

ROOT = Path(__file__).parents[2]
RESULTS = Path(__file__).parent / "results"
PICTURES = ROOT / "docs" / "pictures"
#: Arguments that name the machine's or the reader's folders, which results must not repeat.
_PLACES = ("out", "pictures", "shared")
_In, _Out = TypeVar("_In"), TypeVar("_Out")


class Part(NamedTuple):
    """One experiment: its computation, and the rendering of its results from JSON."""

    name: str
    title: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], dict[str, Any]]
    tables: Callable[[dict[str, Any]], str]
    picture: Callable[[dict[str, Any], Path], None] | None = None


def parse(part: Part, arguments: list[str] | None = None) -> argparse.Namespace:
    """Options of one experiment; defaults are those of the README."""
    parser = argparse.ArgumentParser(prog=f"python -m experiments.talker.{part.name}", description=part.title)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes (default: all cores)")
    parser.add_argument("--out", type=Path, help="JSON file to write (default: in the results folder)")
    parser.add_argument("--pictures", type=Path, default=PICTURES, help="folder for the PNG (default: docs/pictures)")
    part.add_arguments(parser)
    return parser.parse_args(arguments)


def run_part(part: Part, arguments: list[str] | None = None) -> dict[str, Any]:
    """Run one experiment, print its tables, write its JSON and its picture."""
    options = parse(part, arguments)
    start = datetime.datetime.now(datetime.UTC)
    result = part.run(options)
    settings = {name: value for name, value in vars(options).items() if name not in (*_PLACES, "workers")}
    document = {
        "experiment": part.name,
        "command": " ".join([f"python -m experiments.talker.{part.name}", *_flags(settings)]),
        "settings": settings,
        "date": start.isoformat(timespec="seconds"),
        "seconds": round((datetime.datetime.now(datetime.UTC) - start).total_seconds(), 1),
        "cores": os.cpu_count(),
        "a2g_jax": __version__,
        "result": result,
    }
    path = options.out or RESULTS / f"{part.name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(rounded(document), indent=1) + "\n")
    if part.picture is not None:
        options.pictures.mkdir(parents=True, exist_ok=True)
        part.picture(rounded(result), options.pictures / f"talker_{part.name}.png")
    print(f"## {part.title}\n\n{part.tables(rounded(result))}")
    return document


def _flags(settings: dict[str, Any]) -> Iterator[str]:
    for name, value in settings.items():
        yield f"--{name.replace('_', '-')}"
        yield str(value)


def rounded(value: Any) -> Any:
    """Plain JSON values, floats to four significant digits; values that are not finite become None."""
    if isinstance(value, dict):
        return {str(key): rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [rounded(item) for item in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.4g}") if math.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value


def parallel(function: Callable[[_In], _Out], items: Iterable[_In], workers: int) -> list[_Out]:
    """``map`` on several processes, in order, with a progress count on standard error."""
    items = list(items)
    if workers < 2 or len(items) < 8:  # starting a process costs as much as a few recordings
        return list(map(function, items))
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # inherited: processes share the cores already
    results = []
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for result in pool.map(function, items, chunksize=max(1, len(items) // (16 * workers))):
            results.append(result)
            if sys.stderr.isatty():
                print(f"\r{len(results)} of {len(items)}", end="", file=sys.stderr, flush=True)
    if sys.stderr.isatty():
        print(file=sys.stderr)
    return results


def cast_evenly(
    repeats: int,
    seconds: float,
    seed: int,
    *,
    speakers: Iterable[str] = tuple(SPEAKERS),
    emotions: Iterable[str] = tuple(VOICE_EMOTIONS),
    rooms: bool = True,
) -> list[dict[str, Any]]:
    """Arguments of ``talk``: every speaker in every emotion ``repeats`` times; every other one in a room."""
    rng = np.random.default_rng([seed, 31])
    cells = [cell for cell in product(speakers, emotions) for _ in range(repeats)]
    return [
        {
            "seconds": seconds,
            "seed": int(rng.integers(2**31)),
            "speaker": speaker,
            "emotion": emotion,
            "name": f"{index:04d}",
            "room": rooms and index % 2 == 1,
        }
        for index, (speaker, emotion) in enumerate(cells)
    ]


def interval_of(statistic: Callable[[np.ndarray], float], groups: int) -> tuple[float, float]:
    """95 % interval of a statistic of group indices over groups (recordings), by the jackknife and Student's t."""
    found = jackknife(lambda chosen: float(statistic(np.asarray(chosen))), groups)
    return found.low, found.high


def wilson(correct: int, count: int) -> tuple[float, float]:
    """95 % score interval of a proportion (Wilson 1927)."""
    z, share = 1.96, correct / count
    middle = share + z * z / (2 * count)
    half = z * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    return (middle - half) / (1 + z * z / count), (middle + half) / (1 + z * z / count)


def table(rows: Iterable[Iterable[Any]], headings: Iterable[str]) -> str:
    """A Markdown table; pairs are shown as intervals."""
    headings = list(headings)
    lines = ["| " + " | ".join(headings) + " |", "|" + " --- |" * len(headings)]
    lines += ["| " + " | ".join(show(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def show(value: Any) -> str:
    """One cell: three significant digits, pairs as ``low to high``, a missing value as a dash."""
    if value is None:
        return "-"
    if isinstance(value, list | tuple):
        return " to ".join(show(item) for item in value)
    if isinstance(value, float):
        return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"
    return str(value)
