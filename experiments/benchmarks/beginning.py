"""How long ``a2g`` takes to begin: mistakes, the first motion of the demo, and all of it, with and without a cache.

    python -m experiments.benchmarks.beginning [--repeats 3]

Wall time and processor time, seconds, medians of the repeats; on a busy machine only the latter means much. A motion
counts as there when its file is, which then is still in a temporary folder. The first ``demo`` has an empty cache of
compiled programs, the second that of the first.
"""

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from a2g_jax.io.files import write_json

RESULT = Path(__file__).parent / "results" / "beginning.json"
_TICKS = os.sysconf("SC_CLK_TCK")


class Took(NamedTuple):
    """Seconds of the machine and of the processor."""

    wall: float
    processor: float


def call(arguments: list[str], folder: Path, cache: Path, until: str = "") -> tuple[Took, Took | None]:
    """Run a command to its end; how long it took, and how long until a file of that name was there."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache)}
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)
    before, start, first = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter(), None
    command = [sys.executable, "-m", "a2g_jax.cli", *arguments]
    with subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as running:
        while running.poll() is None:
            if until and first is None and any(folder.rglob(until)):
                first = Took(time.perf_counter() - start, _used(running.pid))
            time.sleep(0.005)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Took(time.perf_counter() - start, used), first


def _used(process: int) -> float:
    """Processor time of a running process, seconds; 0 if it has ended."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / _TICKS


def measure(repeats: int) -> dict[str, dict[str, float]]:
    """Medians by what was done."""
    found: dict[str, list[Took]] = {}
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary)
            cache = folder / "cache"
            mistakes = {"mistyped path": ["demo", "--audio", "no.wav"], "mistyped flag": ["demo", "--adio", "x.wav"]}
            for name, arguments in mistakes.items():
                found.setdefault(name, []).append(call(arguments, folder, cache)[0])
            for name in ("first demo, empty cache", "second demo"):
                whole, first = call(["demo"], folder, cache, "sample_00.bvh")
                assert first is not None
                found.setdefault(f"{name}: first motion", []).append(first)
                found.setdefault(f"{name}: all of it", []).append(whole)
                shutil.rmtree(folder / "demo")
    return {
        name: {field: round(float(np.median([getattr(one, field) for one in rows])), 2) for field in Took._fields}
        for name, rows in found.items()
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    result = {"processors": os.cpu_count(), "load": round(os.getloadavg()[0], 1), "seconds": measure(options.repeats)}
    write_json(RESULT, result)
    for name, took in result["seconds"].items():
        print(f"{name:40} wall {took['wall']:6.2f}  processor {took['processor']:6.2f}")
