"""Cost of a minute of talk: seconds of computing, memory, disk.

    python -m experiments.talker.cost [--repeats 5] [--minutes 24] [--seed 0]

Each row runs in a process of its own. Seconds are medians of repeats after warm-up, for a recording of a minute; a
corpus is prepared from nothing each time, including the start of its processes. Memory is the largest resident memory
of the process, and of its largest child.
"""

import argparse
import resource
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np

from experiments.benchmarks import measure
from experiments.talker.common import Part, run_part, table

SECONDS = 60.0
STAGES = {
    "speech": "plan and voice, 16 kHz",
    "motion": "body motion, 30 fps",
    "fingers": "body and finger motion, 30 fps",
    "features": "log-mel features, 30 fps",
    "recording": "one recording as a corpus stores it",
}
CORPORA = {
    "corpus-1": "corpus, one process",
    "corpus-all": "corpus, one process a core",
    "corpus-fingers": "corpus with fingers, one process a core",
    "corpus-demand": "corpus on demand, a quarter stored",
}


def stage(name: str, seed: int) -> Any:
    """Return a function that runs one stage for a minute of talk."""
    from a2g_jax.data.generated import TalkerOptions, generate_rows
    from a2g_jax.data.settings import Features
    from a2g_jax.features.mel import MelConfig, log_mel
    from a2g_jax.talker.gestures import gesticulate
    from a2g_jax.talker.plan import plan_speech
    from a2g_jax.talker.voice import synthesise

    mel, fps = MelConfig(), TalkerOptions().fps
    rng = lambda: np.random.default_rng(seed)  # noqa: E731
    plan = plan_speech(SECONDS, "ada", "neutral", rng())
    audio = synthesise(plan, rng(), mel.sample_rate)
    role = {"seconds": SECONDS, "seed": seed, "speaker": "ada", "emotion": "neutral"}
    return {
        "speech": lambda: synthesise(plan_speech(SECONDS, "ada", "neutral", rng()), rng(), mel.sample_rate),
        "motion": lambda: gesticulate(plan, rng(), fps),
        "fingers": lambda: gesticulate(plan, rng(), fps, fingers=True),
        "features": lambda: log_mel(audio, mel, fps, round(SECONDS * fps)),
        "recording": lambda: generate_rows(role, 0.0, False, "body", Features()),
    }[name]


def corpus(name: str, minutes: float, seed: int, repeats: int) -> dict[str, Any]:
    """Seconds and bytes of whole corpora."""
    from a2g_jax.data.generated import TalkerOptions
    from a2g_jax.data.on_demand import OnDemand
    from a2g_jax.data.prepare import prepare_talker

    options = TalkerOptions(minutes=minutes, seed=seed, fingers=name == "corpus-fingers")
    demand = OnDemand(minutes / 4, minutes / 4) if name == "corpus-demand" else None
    watch, times, size = measure.Stopwatch(), [], 0
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "corpus"
            start = perf_counter()
            prepare_talker(out, options, workers=1 if name == "corpus-1" else None, on_demand=demand)
            times.append(perf_counter() - start)
            size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
    scale = 1e6 if sys.platform == "darwin" else 1e6 / 1024
    return {
        "median_s": median(times) / minutes,
        "min_s": min(times) / minutes,
        "max_s": max(times) / minutes,
        "repeats": repeats,
        "others_share": watch.others() if name == "corpus-1" else None,
        "child_mb": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / scale,
        "mb_per_hour": size / 1e6 / (minutes / 60),
    }


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the length of corpora and the number of repeats."""
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--minutes", type=float, default=24.0, help="length of the corpora")


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Every stage and every corpus in turn."""
    arguments = [f"--{name}={getattr(options, name)}" for name in ("repeats", "minutes", "seed")]
    rows = [
        {"contender": title, **measure.run_alone("experiments.talker.cost", name, arguments)}
        for name, title in {**STAGES, **CORPORA}.items()
    ]
    return {"recording_seconds": SECONDS, "minutes": options.minutes, "rows": rows}


def one(arguments: argparse.Namespace) -> None:
    """Run one contender in this process and report to the one that started it."""
    if arguments.contender in STAGES:
        measure.report(measure.measure(stage(arguments.contender, arguments.seed), arguments.repeats))
        return
    repeats = max(1, min(arguments.repeats, 3))
    measure.report(corpus(arguments.contender, arguments.minutes, arguments.seed, repeats))


def tables(result: dict[str, Any]) -> str:
    """Seconds a minute, memory, disk."""
    keys = ("median_s", "min_s", "max_s", "repeats", "peak_mb", "child_mb", "mb_per_hour", "others_share")
    rows = [[row.get("failed", row["contender"]), *(row.get(key) for key in keys)] for row in result["rows"]]
    headings = ["seconds of computing a minute of talk", "median", "least", "most", "repeats", "peak memory, MB"]
    headings += ["of a child, MB", "disk, MB an hour", "share of the cores others took"]
    return (
        f"Stages on recordings of {result['recording_seconds']:g} s, corpora of {result['minutes']:g} minutes from "
        "nothing. A row where others took a share of the cores would be faster alone; for a corpus with several "
        f"processes, its own count as others.\n\n{table(rows, headings)}"
    )


PART = Part("cost", "Cost", add_arguments, run, tables)

if __name__ == "__main__":
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--contender", choices=[*STAGES, *CORPORA])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--minutes", type=float, default=24.0)
    parser.add_argument("--seed", type=int, default=0)
    if any(argument.startswith("--contender") for argument in sys.argv[1:]):
        one(parser.parse_args())
    else:
        run_part(PART)
