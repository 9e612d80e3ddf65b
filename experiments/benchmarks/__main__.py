"""All benchmarks, each beside its PyTorch twin and its floor.

    python -m experiments.benchmarks [--only NAME,...] [--threads N] [--rounds N] [--without NAME,...] [--again]

Contenders take turns in one process; peak memory is that of a process with one contender. Writes a record of every
benchmark to results/ and all of them to results/table.md. A benchmark with a complete record of as many threads is not
run again without ``--again``: one that has all contenders, none of which failed, of cores that were not busy.
"""

import argparse
import shlex
import subprocess
import sys
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

from a2g_jax.io.files import atomic_path, read_json, write_json
from experiments.benchmarks import measure
from experiments.benchmarks.catalogue import BENCHMARKS, TWINS
from experiments.benchmarks.commands import commands, take_commands
from experiments.benchmarks.table import busy, table


def main(arguments: Sequence[str] | None = None) -> None:
    """Run what has no record, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(BENCHMARKS), help=f"comma-separated: {', '.join(BENCHMARKS)}")
    parser.add_argument("--threads", type=int, default=measure.usable_cores(), help="(default: all cores)")
    parser.add_argument("--rounds", type=int, help="turns of every contender (default: by benchmark)")
    parser.add_argument("--without", default="", help=f"contenders to leave out: {', '.join(_others())}")
    parser.add_argument("--again", action="store_true", help="also run what has a record")
    parser.add_argument("--out", type=Path, default=measure.RESULTS, help="folder of records and table")
    parser.add_argument("--contender", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    names = options.only.split(",")
    if unknown := set(names) - set(BENCHMARKS):
        parser.error(f"there is no benchmark {', '.join(sorted(unknown))}; there are {', '.join(BENCHMARKS)}")
    options.without = [name for name in options.without.split(",") if name]
    if unknown := set(options.without) - set(_others()):
        parser.error(f"--without: no contender {', '.join(sorted(unknown))}; there are {', '.join(_others())}")
    if options.contender:
        measure.limit_threads(options.threads)
        measure.report(_one(names[0], options))
        return
    for name in names:
        path = options.out / f"{name}.json"
        if not options.again and path.exists() and made(read_json(path), options.threads, options.without):
            continue
        write_json(path, _record(name, options))
        _write_table(options.out)
    print(_write_table(options.out))


def made(record: dict[str, Any], threads: int, without: Collection[str] = ()) -> bool:
    """Whether a record is complete, so that its benchmark need not run again.

    Args:
        without: contenders that may be missing.
    """
    if "without" not in record:  # an older record
        return False
    missing = {*record["without"], *(row["contender"] for row in record["rows"] if "failed" in row)}
    return record["threads"] == threads and missing <= set(without) and not busy(record)


def _others() -> list[str]:
    """All contenders beside ours."""
    names = [contender for name, one in BENCHMARKS.items() if one.module == "commands" for contender in commands(name)]
    return [name for name in dict.fromkeys([*TWINS, *names]) if name != "a2g_jax"]


def _write_table(folder: Path) -> str:
    records = {name: folder / f"{name}.json" for name in BENCHMARKS}
    text = table({name: read_json(path) for name, path in records.items() if path.exists()})
    with atomic_path(folder / "table.md") as temporary:
        temporary.write_text(text, encoding="utf-8")
    return text


def _record(name: str, options: argparse.Namespace) -> dict[str, Any]:
    """Turns of all contenders in one process, and the memory of each in another."""
    benchmark = BENCHMARKS[name]
    rounds = options.rounds or benchmark.rounds
    without = ",".join(options.without)
    common = [f"--only={name}", f"--threads={options.threads}", f"--rounds={rounds}", f"--without={without}"]
    found = _run(name, "turns", common)
    if "failed" in found:
        found = {"rows": [{"contender": "a2g_jax", "failed": found["failed"]}], "floor": {"seconds": 0.0}, "about": {}}
    # The compiler's own memory would count as that of compiled contenders.
    for row in found["rows"] if benchmark.module != "commands" else ():
        if "failed" not in row and row["contender"] != "torch_compiled":
            row |= {key: value for key, value in _run(name, row["contender"], common).items() if key.endswith("_mb")}
    command = f"python -m experiments.benchmarks --only {name} --threads {options.threads} --rounds {rounds}"
    command += f" --without {shlex.quote(without)}" if without else ""
    found.pop("peak_mb", None)
    about = {"threads": options.threads, "without": options.without, "commit": _commit()}
    return {"command": command, **measure.environment(), **about, **found}


def _run(name: str, contender: str, common: list[str]) -> dict[str, Any]:
    print(f"{name}: {contender} ...", file=sys.stderr, flush=True)
    return measure.run_alone("experiments.benchmarks", contender, common)


def _one(name: str, options: argparse.Namespace) -> dict[str, Any]:
    """In a process of its own: turns, or the memory of one contender."""
    from experiments.benchmarks.turns import take_memory, take_turns

    benchmark = BENCHMARKS[name]
    if benchmark.module == "commands":
        return take_commands(name, options.without, options.rounds)
    case = benchmark.case()
    if options.contender != "turns":
        return take_memory(case, options.contender)
    return take_turns(case, [one for one in case.contenders if one not in options.without], options.rounds)


def _commit() -> str:
    done = subprocess.run(
        ["git", "describe", "--always", "--dirty"],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parent,
    )
    return done.stdout.strip()


if __name__ == "__main__":
    main()
