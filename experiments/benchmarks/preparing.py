"""Speed and memory of preparing recordings.

    python -m experiments.benchmarks.preparing [--minutes 60] [--takes 12] [--seed 0]

Generates BVH and WAV files (not timed), then prepares them with the command, from nothing, with one process and with
one a core: rigs as they are, retargeted to the 22 body joints, and 2D keypoints in Speech2Gesture's windows.
"""

import argparse
import resource
import sys
import tempfile
from pathlib import Path
from time import perf_counter
from typing import Any

from experiments.benchmarks import measure

#: Layout, joints, and number of processes (None: one a core).
CONTENDERS: dict[str, tuple[str, str, int | None]] = {
    "BVH of 52 joints at 60 fps, as it is, one process": ("folder", "all", 1),
    "BVH of 52 joints at 60 fps, to 22 joints, one process": ("folder", "body", 1),
    "BVH of 52 joints at 60 fps, to 22 joints, one a core": ("folder", "body", None),
    "Speech2Gesture windows, 49 keypoints, one process": ("s2g", "all", 1),
    "Speech2Gesture windows, 49 keypoints, one a core": ("s2g", "all", None),
}

_SOURCES = "recordings to prepare"


def main() -> None:
    """Measure every contender and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60.0, help="of recordings in all")
    parser.add_argument("--takes", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--contender", choices=[*CONTENDERS, _SOURCES], help=argparse.SUPPRESS)
    parser.add_argument("--sources", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--out", type=Path, help="JSON file to write (default: in results/)")
    options = parser.parse_args()
    if options.contender == _SOURCES:
        _write_sources(options.sources, options)
        measure.report({})
        return
    if options.contender:
        measure.report(_prepare(options))
        return
    with tempfile.TemporaryDirectory() as folder:
        sources = Path(folder)
        arguments = [
            f"--sources={sources}",
            *(f"--{name}={getattr(options, name)}" for name in ("minutes", "takes", "seed")),
        ]
        # In a process of its own: a child inherits its parent's peak, and this one would count in every row.
        measure.run_alone("experiments.benchmarks.preparing", _SOURCES, arguments)
        rows = [
            {"contender": name, **measure.run_alone("experiments.benchmarks.preparing", name, arguments)}
            for name in CONTENDERS
        ]
    columns = {
        "contender": "recordings",
        "hours_per_minute": "hours of recording prepared a minute",
        "seconds": "seconds",
        "peak_mb": "peak memory, MB",
        "child_mb": "of a worker, MB",
        "source_mb": "source, MB",
        "corpus_mb": "corpus, MB",
    }
    measure.print_table(rows, columns)
    settings = {name: getattr(options, name) for name in ("minutes", "takes", "seed")}
    print(f"\nwritten to {measure.write_results('preparing', settings, rows, options.out)}")


def _write_sources(folder: Path, options: argparse.Namespace) -> None:
    """Write the same talk as BVH and WAV pairs and as Speech2Gesture's windows."""
    from a2g_jax.io.audio import write_audio
    from a2g_jax.io.bvh import write_bvh
    from a2g_jax.talker.recordings import talk
    from a2g_jax.talker.views.keypoints import keypoints, write_s2g_windows

    for take in range(options.takes):
        seconds = 60.0 * options.minutes / options.takes
        recording = talk(seconds, options.seed + take, fps=60.0, fingers=True)
        name = f"take{take:03d}"
        write_audio(folder / "folder" / f"{name}.wav", recording.audio, 16000)
        write_bvh(folder / "folder" / f"{name}.bvh", recording.motion)
        windows = folder / "s2g" / "speaker" / "train" / "npz"
        windows.mkdir(parents=True, exist_ok=True)
        write_s2g_windows(windows, name, keypoints(recording.motion, 15.0), recording.audio, 16000)


def _prepare(options: argparse.Namespace) -> dict[str, Any]:
    from dataclasses import replace

    from a2g_jax.data.datasets import find_data_set
    from a2g_jax.data.prepare import prepare_data_set
    from a2g_jax.data.settings import Features

    reader, joints, workers = CONTENDERS[options.contender]
    data_set = find_data_set(reader)
    features = replace(Features(), fps=data_set.fps, pose=data_set.pose, joints=joints)
    source = options.sources / reader
    with tempfile.TemporaryDirectory() as folder:
        start = perf_counter()
        prepare_data_set(reader, source, Path(folder) / "corpus", features, workers=workers)
        seconds = perf_counter() - start
        made = _megabytes(Path(folder))
    scale = 1e6 if sys.platform == "darwin" else 1e6 / 1024
    return {
        "seconds": seconds,
        "hours_per_minute": options.minutes / seconds,
        "child_mb": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / scale,
        "source_mb": _megabytes(source),
        "corpus_mb": made,
    }


def _megabytes(folder: Path) -> float:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6


if __name__ == "__main__":
    main()
