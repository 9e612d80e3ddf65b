"""All benchmarks, each beside its PyTorch twin and its floor.

    python -m experiments.benchmarks [--only NAME,...] [--threads N] [--rounds N] [--without NAME,...] [--again]

Contenders take turns in one process; peak memory is that of a process with one contender. Writes a record of every
benchmark to results/ and all of them to results/table.md. Benchmarks that have a record with as many threads are not
run again without ``--again``.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from experiments.benchmarks import measure
from experiments.benchmarks.catalogue import BENCHMARKS
from experiments.benchmarks.table import table


def main(arguments: Sequence[str] | None = None) -> None:
    """Run what has no record, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default=",".join(BENCHMARKS), help=f"comma-separated: {', '.join(BENCHMARKS)}")
    parser.add_argument("--threads", type=int, default=measure.usable_cores(), help="(default: all cores)")
    parser.add_argument("--rounds", type=int, help="turns of every contender (default: by benchmark)")
    parser.add_argument("--without", default="", help="contenders to leave out, such as torch_compiled")
    parser.add_argument("--again", action="store_true", help="also run what has a record")
    parser.add_argument("--out", type=Path, default=measure.RESULTS, help="folder of records and table")
    parser.add_argument("--contender", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    names = options.only.split(",")
    if unknown := set(names) - set(BENCHMARKS):
        parser.error(f"there is no benchmark {', '.join(sorted(unknown))}; there are {', '.join(BENCHMARKS)}")
    if options.contender:
        measure.limit_threads(options.threads)
        measure.report(_one(names[0], options))
        return
    for name in names:
        path = options.out / f"{name}.json"
        if not options.again and path.exists() and json.loads(path.read_text())["threads"] == options.threads:
            continue
        record = _record(name, options)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(record, indent=1) + "\n")
        _write_table(options.out)
    print(_write_table(options.out))


def _write_table(folder: Path) -> str:
    records = {name: folder / f"{name}.json" for name in BENCHMARKS}
    made = table({name: json.loads(path.read_text()) for name, path in records.items() if path.exists()})
    (folder / "table.md").write_text(made)
    return made


def _record(name: str, options: argparse.Namespace) -> dict[str, Any]:
    """Turns of all contenders in one process, and the memory of each in another."""
    benchmark = BENCHMARKS[name]
    rounds = options.rounds or benchmark.rounds
    common = [f"--only={name}", f"--threads={options.threads}", f"--rounds={rounds}", f"--without={options.without}"]
    found = _run(name, "turns", common)
    if "failed" in found:
        found = {"rows": [{"contender": "a2g_jax", "failed": found["failed"]}], "floor": {"seconds": 0.0}, "about": {}}
    # The compiler's own memory would count as that of compiled contenders.
    for row in found["rows"] if benchmark.module != "commands" else ():
        if "failed" not in row and row["contender"] != "torch_compiled":
            row |= {key: value for key, value in _run(name, row["contender"], common).items() if key.endswith("_mb")}
    command = f"python -m experiments.benchmarks --only {name} --threads {options.threads}"
    command += f" --without {options.without}" if options.without else ""
    found.pop("peak_mb", None)
    return {"command": command, **measure.environment(), "threads": options.threads, "commit": _commit(), **found}


def _run(name: str, contender: str, common: list[str]) -> dict[str, Any]:
    print(f"{name}: {contender} ...", file=sys.stderr, flush=True)
    return measure.run_alone("experiments.benchmarks", contender, common)


def _one(name: str, options: argparse.Namespace) -> dict[str, Any]:
    """In a process of its own: turns, or the memory of one contender."""
    from experiments.benchmarks.commands import take_commands
    from experiments.benchmarks.turns import take_memory, take_turns

    benchmark, without = BENCHMARKS[name], options.without.split(",")
    if benchmark.module == "commands":
        return take_commands(name, None, options.rounds)
    case = benchmark.case()
    if options.contender != "turns":
        return take_memory(case, options.contender)
    return take_turns(case, [one for one in case.contenders if one not in without], options.rounds)


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
