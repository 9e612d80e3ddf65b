"""SIGKILL at random moments of commands that are then repeated until they finish."""

import hashlib
import shutil
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.io.files import read_json, write_json
from a2g_jax.training.checkpoint import Checkpoints
from a2g_jax.training.run import load_run
from experiments.integrity.commands import Command, Inputs, commands, start

#: Files that hold times, and the lock that a killed training leaves.
_OTHERS = ("checkpoints", ".lock")


def campaign(
    inputs: Inputs, cache: Path, number: int, seed: int, seconds: float, only: tuple[str, ...] = ()
) -> list[dict[str, Any]]:
    """Outcomes by command; kills are distributed over the commands in turn, and earlier ones are not repeated.

    Args:
        number: of kills in all.
        seconds: after which no further chain begins.
        only: names of commands; all if empty.
    """
    place = cache / f"kills {seed}.json"
    rows: list[dict[str, Any]] = read_json(place) if place.is_file() else []
    cases = [case for case in commands(inputs) if not only or case.name in only]
    until = time.monotonic() + seconds
    while sum(row["kills"] for row in rows) < number and time.monotonic() < until:
        case = min(cases, key=lambda one: sum(1 + row["kills"] for row in rows if row["command"] == one.name))
        left = number - sum(row["kills"] for row in rows)
        # A machine that became faster finishes before it is killed.
        early = 0.7 ** sum(row["kills"] == 0 for row in rows if row["command"] == case.name)
        rows.append(_chain(case, cache, np.random.default_rng([seed, len(rows)]), min(4, left), early))
        write_json(place, rows)
        print(rows[-1], flush=True)
    return rows


def _chain(case: Command, cache: Path, rng: np.random.Generator, most: int, early: float) -> dict[str, Any]:
    """Kill a command up to ``most`` times, repeating it in the same place; then let it finish, and compare.

    Args:
        early: factor on the time before a kill.
    """
    seconds, expected = _reference(case, cache)
    folder = cache / "kills" / case.name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    kills, lost, faults, before = 0, 0, [], -1
    while True:
        process = start([*case.arguments, *case.again, "--out", str(folder / case.output)])
        if kills < most:
            try:
                process.wait(float(rng.uniform(0.15, 1.0)) * seconds * early)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
                process.communicate()
                kills += 1
                faults += _torn(case, folder, expected)
                step = _latest_step(case, folder)
                lost, before = lost + (step < before), step
                continue
        _, errors = process.communicate()
        break
    same = _digests(folder) == expected
    # A command that was killed after its last file had its name refuses the complete output: no fault.
    if process.returncode and not (same and b"exists already" in errors):
        faults.append(errors.decode()[-300:])
    left = [path.name for path in folder.rglob(".*") if "checkpoints" not in path.parts]
    return {
        "command": case.name,
        "kills": kills,
        "same result": same,
        "checkpoints lost": lost,
        "left behind": left,
        "faults": faults,
    }


def _torn(case: Command, folder: Path, expected: dict[str, str]) -> list[str]:
    """Faults of what is there after a kill: files under their own names that are not whole, runs that do not load."""
    if case.run:
        try:
            if (folder / case.output / "weights.safetensors").is_file():
                load_run(folder / case.output)
        except InputError as error:
            return [str(error)]
        return []
    return [name for name, digest in _digests(folder).items() if expected.get(name) != digest]


def _latest_step(case: Command, folder: Path) -> int:
    steps = Checkpoints(folder / case.output / "checkpoints", 1).steps() if case.run else []
    return max(steps, default=-1)


def _reference(case: Command, cache: Path) -> tuple[float, dict[str, str]]:
    """Seconds and results of the command without kills."""
    place, folder = cache / f"reference {case.name}.json", cache / "reference" / case.name
    if not place.is_file():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        begun = time.monotonic()
        process = start([*case.arguments, "--out", str(folder / case.output)])
        _, errors = process.communicate()
        if process.returncode:
            raise RuntimeError(f"{case.name}: {errors.decode()[-400:]}")
        write_json(place, {"seconds": time.monotonic() - begun, "digests": _digests(folder)})
    found = read_json(place)
    return found["seconds"], found["digests"]


def _digests(folder: Path) -> dict[str, str]:
    """SHA-256 of the files under their own names."""
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    names = {path: path.relative_to(folder) for path in paths}
    return {
        str(name): hashlib.sha256(path.read_bytes()).hexdigest()
        for path, name in names.items()
        if not any(part in _OTHERS or part.startswith(".") for part in name.parts)
    }
