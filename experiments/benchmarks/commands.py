"""Commands in processes of their own: wall time, processor time of all their processes, and the largest of these.

Importing PyTorch stands beside importing ours; the other commands have no twin.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Collection
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from experiments.benchmarks.measure import Stopwatch, others_share, usable_cores
from experiments.benchmarks.turns import clock


class Command(NamedTuple):
    """What is run, in a temporary folder."""

    arguments: list[str]
    """Of Python."""
    prepare: Callable[[Path], None] | None = None
    """Makes the command's input in the folder; not timed."""
    removed: str = ""
    """What a repetition leaves behind that the next one must not find."""


def commands(name: str) -> dict[str, Command]:
    """Contenders of a benchmark, ours first."""
    a2g = ["-m", "a2g_jax.cli"]
    return {
        "import": {
            "a2g_jax": Command(["-c", "import a2g_jax"]),
            "a2g_jax with JAX": Command(["-c", "import a2g_jax, jax; a2g_jax.Generator"]),
            "torch_eager": Command(["-c", "import torch"]),
        },
        "demo": {
            "a2g_jax": Command([*a2g, "demo"], removed="demo"),
            "a2g_jax without cache": Command([*a2g, "demo"], removed="demo cache"),
        },
        "generate": {"a2g_jax": Command([*a2g, "generate", "demo-flow", *_SPEECH, "--formats", "npz"], _write_speech)},
        "prepare": {
            "a2g_jax": Command([*a2g, "prepare", "folder", "source", "--out", "corpus"], _write_takes, "corpus"),
        },
        "evaluate": {
            "a2g_jax": Command(
                [*a2g, "evaluate", "demo", "--corpus", "corpus", "--samples", "3", "--out", "report"],
                _write_corpus,
                "report",
            ),
        },
    }[name]


_SPEECH = ["--audio", "speech.wav", "--samples", "1", "--out", "out"]
#: Length of the speech that a user waits for, and of the takes that are prepared, seconds.
_SHORT, _TAKE = 3.0, 60.0


def _write_speech(folder: Path) -> None:
    from a2g_jax.io.audio import write_audio
    from a2g_jax.talker.recordings import talk

    write_audio(folder / "speech.wav", talk(_SHORT, 5).audio, 16000)


def _write_takes(folder: Path) -> None:
    """Four minutes of BVH of 52 joints at 60 frames a second, with WAV."""
    from a2g_jax.io.audio import write_audio
    from a2g_jax.io.bvh import write_bvh
    from a2g_jax.talker.recordings import talk

    (folder / "source").mkdir()
    for take in range(4):
        recording = talk(_TAKE, take, fps=60.0, fingers=True)
        write_audio(folder / "source" / f"take{take}.wav", recording.audio, 16000)
        write_bvh(folder / "source" / f"take{take}.bvh", recording.motion)


def _write_corpus(folder: Path) -> None:
    arguments = ["prepare", "talker", "--out", "corpus", "--minutes", "10"]
    subprocess.run([sys.executable, "-m", "a2g_jax.cli", *arguments], cwd=folder, check=True, capture_output=True)


def take_commands(name: str, without: Collection[str], rounds: int) -> dict[str, Any]:
    """Figures of every contender, in turns, after one round that fills caches.

    Args:
        without: contenders to leave out; not ours.
    """
    own = {key: one for key, one in commands(name).items() if key not in without}
    rows: dict[str, dict[str, Any]] = {key: {"contender": key, "rounds": rounds} for key in own}
    taken: dict[str, list[dict[str, Any]]] = {key: [] for key in own}
    which = clock(usable_cores())
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for prepare in {one.prepare for one in own.values() if one.prepare is not None}:
            prepare(folder)
        for number in range(rounds + 1):
            for key, one in own.items():
                turn = _run(one, folder)
                if number:
                    taken[key].append(turn)
    for key, turns in taken.items():
        rows[key] |= {field: median(turn[field] for turn in turns) for field in ("wall_s", "cpu_s", "peak_mb")}
        rows[key]["others_share"] = others_share(turns)
        ours = taken[next(iter(own))]
        rows[key]["ratio"] = median(turn[which] / mine[which] for turn, mine in zip(turns, ours, strict=True))
    return {"rows": list(rows.values()), "floor": {"seconds": 0.0}, "about": {}}


def _run(command: Command, folder: Path) -> dict[str, Any]:
    """Times and the largest process of a command that has to succeed."""
    import shutil

    for name in command.removed.split():
        shutil.rmtree(folder / name, ignore_errors=True)
    environment = {**os.environ, "XDG_CACHE_HOME": str(folder / "cache")}
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)
    watch, start = Stopwatch(), time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, *command.arguments],
        cwd=folder,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    assert process.stderr is not None
    errors = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        last = (errors.decode(errors="replace").strip().splitlines() or ["no message"])[-1]
        raise RuntimeError(f"{' '.join(command.arguments)}: {last}")
    return {**_figures(time.perf_counter() - start, usage), "others": watch.signed_others()}


def _figures(wall: float, usage: resource.struct_rusage) -> dict[str, float]:
    scale = 1e6 if sys.platform == "darwin" else 1e6 / 1024
    return {"wall_s": wall, "cpu_s": usage.ru_utime + usage.ru_stime, "peak_mb": usage.ru_maxrss / scale}
