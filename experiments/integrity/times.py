"""``python -m experiments.integrity.times OLD``: times of loading, inspecting and preparing before and after a change.

``OLD`` is a checkout of the state to compare with (``git worktree add OLD COMMIT``). Both states run in processes of
their own that stay open, and take turns, so that other work on the machine slows both alike; half of the turns begin
with each. Medians of wall and processor time, and of the ratios of the turns.
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

NAME = "times"


def main(arguments: list[str]) -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m experiments.integrity.times", description=__doc__)
    parser.add_argument("old", type=Path, help="folder of the earlier state")
    parser.add_argument("--repeats", type=int, default=31, help="turns of each state")
    parser.add_argument("--subjects", nargs="*", default=list(_SUBJECTS), choices=list(_SUBJECTS))
    options = parser.parse_args(arguments)
    here = Path(__file__).resolve().parents[2]
    with tempfile.TemporaryDirectory() as folder:
        sides = [_Side(place.resolve(), Path(folder), name) for place, name in ((options.old, "old"), (here, "new"))]
        rows = []
        for subject in options.subjects:
            for side in sides:
                side.measure(subject)
                side.measure(subject)
            pairs = []
            for turn in range(options.repeats):
                order = sides if turn % 2 else sides[::-1]
                found = {side.name: side.measure(subject) for side in order}
                pairs.append([found["old"], found["new"]])
            rows.append(_row(subject, pairs))
            print(_line(rows[-1]), flush=True)
        for side in sides:
            side.close()
    results = Path(__file__).parent / "results"
    if options.subjects == list(_SUBJECTS):
        (results / f"{NAME}.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        (results / f"{NAME}.md").write_text(_table(rows, options.repeats), encoding="utf-8")


class _Side:
    """One of the two states, in a process of its own."""

    def __init__(self, checkout: Path, folder: Path, name: str) -> None:
        self.name = name
        environment = {
            **os.environ,
            "PYTHONPATH": str(checkout),
            "XDG_CACHE_HOME": str(folder / f"cache of {name}"),
            "OMP_NUM_THREADS": "1",
            "JAX_PLATFORMS": "cpu",
        }
        command = [sys.executable, str(Path(__file__).resolve()), "--worker", str(folder / name)]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self._process = subprocess.Popen(command, cwd=checkout, env=environment, **pipes)

    def measure(self, subject: str) -> list[float]:
        """Seconds on the clock and of the processor."""
        self._process.stdin.write(subject + "\n")
        self._process.stdin.flush()
        while line := self._process.stdout.readline():
            if line.startswith("TIME "):
                return json.loads(line.removeprefix("TIME "))
        raise RuntimeError(f"{self.name}: {subject} failed")

    def close(self) -> None:
        """End the process."""
        self._process.stdin.close()
        self._process.wait()


def _row(subject: str, pairs: list[list[list[float]]]) -> dict[str, Any]:
    row: dict[str, Any] = {"subject": subject}
    for kind, which in (("wall", 0), ("cpu", 1)):
        old, new = ([pair[side][which] for pair in pairs] for side in (0, 1))
        row[kind] = {
            "old ms": round(1e3 * statistics.median(old), 3),
            "new ms": round(1e3 * statistics.median(new), 3),
            "ratio": round(statistics.median(b / a for a, b in zip(old, new, strict=True)), 3),
            "least ratio": round(min(new) / min(old), 3),
        }
    return row


def _line(row: dict[str, Any]) -> str:
    cells = [f"{row[kind][name]:.2f}" for kind in ("wall", "cpu") for name in ("old ms", "new ms", "ratio")]
    return f"| {row['subject']} | " + " | ".join(cells) + " |"


def _table(rows: list[dict[str, Any]], repeats: int) -> str:
    return "\n".join(
        [
            f"Milliseconds before and after, medians of {repeats} alternating turns, and of the turns' ratios.",
            "",
            "| | wall, before | after | ratio | processor, before | after | ratio |",
            "| --- | --- | --- | --- | --- | --- | --- |",
            *map(_line, rows),
            "",
        ]
    )


# What follows runs in both states, so it uses only what both have.


def _worker(folder: Path) -> None:
    _make(folder)
    for line in sys.stdin:
        prepare, call = _SUBJECTS[line.strip()]
        prepare(folder)
        wall, processor = time.perf_counter(), time.process_time()
        call(folder)
        spent = [time.perf_counter() - wall, time.process_time() - processor]
        print("TIME " + json.dumps(spent), flush=True)


def _make(folder: Path) -> None:
    from a2g_jax.io.audio import write_audio
    from a2g_jax.io.bvh import write_bvh
    from a2g_jax.talker.recordings import talk

    source = folder / "source"
    for number in range(4):
        take = talk(30.0, number, fps=60.0, fingers=True)
        write_bvh(source / f"take{number}.bvh", take.motion)
        write_audio(source / f"take{number}.wav", take.audio, 16000)
    _prepare(folder, "corpus")
    # Files that were changed a moment ago are not taken from the cache of hashes.
    time.sleep(2.5)


def _prepare(folder: Path, name: str) -> None:
    from dataclasses import replace

    from a2g_jax.data.datasets import find_data_set
    from a2g_jax.data.prepare import prepare_data_set
    from a2g_jax.data.settings import Features

    data_set = find_data_set("folder")
    features = replace(Features(), fps=data_set.fps, pose=data_set.pose, joints="body")
    prepare_data_set("folder", folder / "source", folder / name, features, workers=1)


def _read_motion(folder: Path) -> None:
    from a2g_jax.io.bvh import read_bvh

    read_bvh(folder / "source" / "take0.bvh")


def _read_audio(folder: Path) -> None:
    from a2g_jax.io.audio import read_audio

    read_audio(folder / "source" / "take0.wav")


def _inspect(name: str) -> Callable[[Path], None]:
    def call(folder: Path) -> None:
        from a2g_jax.inspection.inspect import inspect

        inspect(folder / name)

    return call


def _open_corpus(folder: Path) -> None:
    from a2g_jax.data.corpus import Corpus

    corpus = Corpus.open(folder / "corpus")
    try:
        from a2g_jax.data.corpus_integrity import verify_corpus
    except ImportError:  # the earlier state had no hashes
        return
    verify_corpus(corpus)


def _run(name: str) -> Callable[[Path], None]:
    def call(_folder: Path) -> None:
        from a2g_jax.training.run import open_run

        open_run(name)

    return call


def _nothing(_folder: Path) -> None: ...


def _removed(folder: Path) -> None:
    shutil.rmtree(folder / "again", ignore_errors=True)


_SUBJECTS: dict[str, tuple[Callable[[Path], None], Callable[[Path], None]]] = {
    "reading a BVH file (30 s, 60 fps, 52 joints)": (_nothing, _read_motion),
    "reading a WAV file (30 s)": (_nothing, _read_audio),
    "inspecting a BVH file": (_nothing, _inspect("source/take0.bvh")),
    "inspecting a WAV file": (_nothing, _inspect("source/take0.wav")),
    "inspecting a corpus (2 minutes)": (_nothing, _inspect("corpus")),
    "opening and verifying a corpus": (_nothing, _open_corpus),
    "loading demo": (_nothing, _run("demo")),
    "loading demo-flow": (_nothing, _run("demo-flow")),
    "preparing a folder (2 minutes)": (_removed, lambda folder: _prepare(folder, "again")),
}

if __name__ == "__main__":
    if sys.argv[1:2] == ["--worker"]:
        _worker(Path(sys.argv[2]))
    else:
        main(sys.argv[1:])
