"""All tables of the three papers by one command: corpora, networks that score, trainings, records and pages.

    python -m experiments.tables --work FOLDER [--papers audio2gestures,emotion_gesture] [--at-once 2] [--list]

Interruptible; the same command resumes. With ``--at-once N`` each of N commands at a time has its share of the cores.
What a command prints is in ``FOLDER/logs``.
"""

import argparse
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import IO, NamedTuple

from a2g_jax.errors import InputError
from a2g_jax.io.locks import locked
from experiments.tables.jobs import JOBS, PAPERS, Job, ready

#: Seconds between two looks at running commands.
_WAIT = 0.5
#: Lines of a log that a failure shows.
_LAST = 5
#: More threads than cores only wait for each other.
_ONE_THREAD = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"


class Running(NamedTuple):
    """A command that runs."""

    job: Job
    process: subprocess.Popen[bytes]
    log: IO[bytes]
    slot: int
    began: float


def main() -> None:
    """Run what is missing."""
    parser = argparse.ArgumentParser(description="All tables of the three papers; the same command resumes.")
    parser.add_argument("--work", type=Path, help="folder for corpora, runs and logs (some GB)")
    parser.add_argument("--papers", default=",".join(PAPERS), help="comma-separated (default: %(default)s)")
    parser.add_argument("--at-once", type=int, default=1, help="commands at a time (default: %(default)s)")
    parser.add_argument("--list", action="store_true", help="print the commands and run none")
    options = parser.parse_args()
    papers = options.papers.split(",")
    if unknown := [name for name in papers if name not in PAPERS]:
        raise InputError(f"--papers: unknown {', '.join(unknown)}; choose from {', '.join(PAPERS)}.")
    jobs = [job for job in JOBS if job.paper in papers]
    work = options.work or Path("WORK")
    if options.list:
        for job in jobs:
            print(f"python -m {' '.join(job.arguments(work))}")
        return
    if options.work is None:
        raise InputError("--work: expected a folder for corpora and runs.")
    cores = os.cpu_count() or 1
    if not 1 <= options.at_once <= cores:
        raise InputError(f"--at-once: expected a number from 1 to {cores}, the cores here; got {options.at_once}.")
    sys.exit(run(jobs, work.resolve(), options.at_once))


def run(jobs: Sequence[Job], work: Path, at_once: int) -> int:
    """Run jobs in their order, several at a time; 0 if all of them succeeded, 130 if interrupted.

    After a failure, jobs that need the failed one are left out and the others continue.
    """
    (work / "logs").mkdir(parents=True, exist_ok=True)
    with locked(work / ".lock", f"{work}: tables are being made there"):
        running: list[Running] = []
        ends = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
        before = {number: signal.signal(number, signal.default_int_handler) for number in ends}
        try:
            return _run(jobs, work, at_once, running)
        except KeyboardInterrupt:
            print("interrupted; the same command resumes", flush=True)
            return 130
        finally:
            _stop(running)
            for number, handler in before.items():
                signal.signal(number, handler)


def _run(jobs: Sequence[Job], work: Path, at_once: int, running: list[Running]) -> int:
    done = {job.name for job in jobs if job.finished(work)}
    begun, failed = set(done), []
    while True:
        for job in ready(jobs, done, begun, {one.job.name for one in running})[: at_once - len(running)]:
            begun.add(job.name)
            slot = min(set(range(at_once)) - {one.slot for one in running})
            running.append(_start(job, work, slot, at_once))
            print(f"{len(begun)} of {len(jobs)}: {job.name} begins", flush=True)
        if not running:
            break
        time.sleep(_WAIT)
        for one in [one for one in running if one.process.poll() is not None]:
            running.remove(one)
            one.log.close()
            minutes = (time.monotonic() - one.began) / 60
            if one.process.returncode == 0:
                done.add(one.job.name)
                print(f"{one.job.name}: {minutes:.1f} minutes", flush=True)
            else:
                failed.append(one.job.name)
                print(f"{one.job.name}: failed after {minutes:.1f} minutes:\n{_end(one.log)}", flush=True)
    if left := [job.name for job in jobs if job.name not in begun]:
        print(f"not begun, since they need what failed: {', '.join(left)}")
    return 1 if failed else 0


def _stop(running: Sequence[Running]) -> None:
    """End what runs, and wait until its checkpoints are written; shells may have their children ignore SIGINT."""
    for one in running:
        one.process.terminate()
    for one in running:
        one.process.wait()
        one.log.close()


def _start(job: Job, work: Path, slot: int, at_once: int) -> Running:
    """Start a command in a process of its own, on its share of the cores."""
    share = _cores(slot, at_once)
    environment = dict(os.environ)
    if len(share) == 1:
        environment |= {
            "XLA_FLAGS": f"{environment.get('XLA_FLAGS', '')} {_ONE_THREAD}".strip(),
            "OMP_NUM_THREADS": "1",
        }
    log = (work / "logs" / f"{job.name}.txt").open("ab")
    command = [sys.executable, "-m", *job.arguments(work)]
    # In a session of its own: an interrupt reaches it once, from here.
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=environment, start_new_session=True
    )
    if share:
        os.sched_setaffinity(process.pid, share)
    return Running(job, process, log, slot, time.monotonic())


def _cores(slot: int, at_once: int) -> list[int]:
    """The cores of a command; none where it shares all of them, or the system cannot choose."""
    if at_once == 1 or not hasattr(os, "sched_getaffinity"):
        return []
    return sorted(os.sched_getaffinity(0))[slot::at_once]


def _end(log: IO[bytes]) -> str:
    """The last lines of a log."""
    lines = Path(log.name).read_text(encoding="utf-8", errors="replace").splitlines()
    return "\n".join(f"  {line}" for line in lines[-_LAST:])


if __name__ == "__main__":
    main()
