"""Timing of one contender in a process of its own, and tables and JSON of several."""

import datetime
import importlib.metadata
import json
import os
import platform
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).parent / "results"
#: Last line of a contender's output: its figures, after this mark.
_MARK = "FIGURES "


#: Environment variable with the cores that a benchmark keeps to.
_CORES = "A2G_BENCHMARK_CORES"


def usable_cores() -> int:
    """Cores that this process may use."""
    if _CORES in os.environ:
        return len(os.environ[_CORES].split(","))
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def limit_threads(threads: int) -> None:
    """As many threads for whichever library is imported next; call it before importing JAX, NumPy or PyTorch."""
    for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ[name] = str(threads)
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    if hasattr(os, "sched_setaffinity"):
        # XLA uses as many threads as the process has cores.
        os.environ[_CORES] = ",".join(map(str, sorted(os.sched_getaffinity(0))[:threads]))
        keep_to_cores()


def keep_to_cores() -> None:
    """Put all threads of this process on the cores of :func:`limit_threads` again, which libraries may undo."""
    tasks = Path("/proc/self/task")
    if _CORES not in os.environ:
        return
    cores = {int(core) for core in os.environ[_CORES].split(",")}
    for task in tasks.iterdir() if tasks.exists() else ():
        with suppress(ProcessLookupError):
            os.sched_setaffinity(int(task.name), cores)


def load_torch() -> Any:
    """PyTorch with as many threads as this process may use cores; its import may give the process all of them."""
    import torch

    keep_to_cores()
    torch.set_num_threads(usable_cores())
    return torch


def _busy_seconds(cores: set[str]) -> float:
    """CPU seconds that all processes together have used since boot on some cores."""
    total = 0
    for line in Path("/proc/stat").read_text().splitlines():
        name, *ticks = line.split()
        if name in cores:
            user, nice, system, _idle, _wait, interrupt, soft, steal = (int(tick) for tick in ticks[:8])
            total += user + nice + system + interrupt + soft + steal
    return total / os.sysconf("SC_CLK_TCK")


def _own_seconds() -> float:
    """CPU seconds of this process and of its children that have ended."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


class Stopwatch:
    """Share of the cores that other processes, apart from children that have ended, took while it ran; ``None`` where
    Linux's /proc is missing."""

    def __init__(self) -> None:
        self._linux = Path("/proc/stat").exists()
        self._wall, self._own = time.perf_counter(), _own_seconds()
        # The same ones at the end: libraries may put the process on others.
        self._cores = {f"cpu{core}" for core in os.sched_getaffinity(0)} if self._linux else set()
        self._busy = _busy_seconds(self._cores) if self._linux else 0.0

    def others(self) -> float | None:
        """The share, 0 to 1."""
        share = self.signed_others()
        return None if share is None else max(0.0, share)

    def signed_others(self) -> float | None:
        """The share, or a little below 0: times in /proc/stat are rounded to ticks of 10 ms."""
        if not self._linux:
            return None
        wall, own = time.perf_counter() - self._wall, _own_seconds() - self._own
        busy = _busy_seconds(self._cores) - self._busy
        return (busy - own) / (wall * len(self._cores))


def others_share(stretches: Iterable[Mapping[str, Any]]) -> float | None:
    """Share of the cores that other processes took in several stretches, from ``others`` and ``wall_s`` of each: over
    all of them, since that of a short one is rounded either way."""
    known = [(one["others"], one["wall_s"]) for one in stretches if one["others"] is not None]
    if not known:
        return None
    return max(0.0, sum(share * wall for share, wall in known) / sum(wall for _, wall in known))


def measure(call: Callable[[], Any], repeats: int, warm_up: int = 2) -> dict[str, Any]:
    """Seconds of calls that wait for their results, after the first one (timed apart) and some more to warm up."""
    before = peak_megabytes()
    start = time.perf_counter()
    call()
    first = time.perf_counter() - start
    for _ in range(warm_up):
        call()
    watch = Stopwatch()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return {
        "median_s": statistics.median(times),
        "min_s": min(times),
        "max_s": max(times),
        "first_s": first,
        "repeats": repeats,
        "others_share": watch.others(),
        "before_mb": before,
    }


def peak_megabytes() -> float:
    """Largest resident memory of this process so far."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    # Bytes on macOS, kibibytes on Linux.
    return peak / 1e6 if sys.platform == "darwin" else peak * 1024 / 1e6


def report(figures: dict[str, Any]) -> None:
    """Report figures to the process that started this one."""
    print(_MARK + json.dumps({**figures, "peak_mb": peak_megabytes()}), flush=True)


def run_alone(module: str, contender: str, arguments: list[str]) -> dict[str, Any]:
    """Run one contender of a benchmark module in a fresh process and return its figures, or how it failed."""
    command = [sys.executable, "-m", module, *arguments, "--contender", contender]
    print(f"{contender} ...", file=sys.stderr, flush=True)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = [line for line in done.stdout.splitlines() if line.startswith(_MARK)]
    if done.returncode != 0 or not lines:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        return {"failed": f"exit code {done.returncode}: {last}"}
    return json.loads(lines[-1].removeprefix(_MARK))


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.3f}" if abs(value) < 100 else f"{value:.0f}"
    return "-" if value is None else str(value)


def print_table(rows: list[dict[str, Any]], columns: dict[str, str]) -> None:
    """Rows as a Markdown table; ``columns`` maps keys to headings."""
    print("| " + " | ".join(columns.values()) + " |")
    print("|" + " --- |" * len(columns))
    for row in rows:
        print("| " + " | ".join(_cell(row.get(key)) for key in columns) + " |")
        if "failed" in row:
            print(f"\n{row['contender']} failed: {row['failed']}\n")


def environment() -> dict[str, Any]:
    """Date, machine and versions: what else is needed to repeat a measurement."""
    versions = {}
    for package in ("a2g_jax", "jax", "jaxlib", "flax", "optax", "numpy", "torch"):
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            versions[package] = None
    return {
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        "cores": os.cpu_count(),
        "versions": versions,
    }


def write_results(name: str, settings: dict[str, Any], rows: list[dict[str, Any]], out: Path | None) -> Path:
    """JSON with everything needed to repeat the measurement."""
    path = out or RESULTS / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    command = " ".join(["python -m", f"experiments.benchmarks.{name}", *sys.argv[1:]])
    values = {"command": command, **environment(), "settings": settings, "rows": rows}
    path.write_text(json.dumps(values, indent=1) + "\n")
    return path
