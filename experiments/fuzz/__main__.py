"""``python -m experiments.fuzz``: changed files for every reader, with a table of what became of them."""

import argparse
import json
import os
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from experiments.fuzz.child import CRASH, LARGE, OUTCOMES, READ, SLOW, UNNAMED, Outcome, read_apart
from experiments.fuzz.readers import READERS, Reader

RESULTS = Path(__file__).parent / "results"


def main(arguments: list[str]) -> int:
    """The command; its status is 1 if any file was more than read or refused."""
    names = [reader.name for reader in READERS]
    parser = argparse.ArgumentParser(prog="python -m experiments.fuzz", description=__doc__)
    parser.add_argument("--files", type=int, default=1000, help="changed files for each reader")
    parser.add_argument("--seed", type=int, default=0, help="of the changes")
    parser.add_argument("--first", type=int, default=0, help="number of the first file, to continue or repeat")
    parser.add_argument("--reader", action="append", choices=names, metavar="NAME", help=f"any of: {', '.join(names)}")
    parser.add_argument("--keep", type=Path, help="folder for the files that crash, take long or much memory")
    parser.add_argument("--record", action="store_true", help="add the counts to the results")
    options = parser.parse_args(arguments)
    rows = []
    for reader in READERS:
        if options.reader is None or reader.name in options.reader:
            rows.append(_campaign(reader, options))
            print(json.dumps(rows[-1], ensure_ascii=False), flush=True)
    if options.record:
        _record(rows)
    return int(any(row["outcomes"].get(kind) for row in rows for kind in (CRASH, SLOW, LARGE, UNNAMED)))


def _campaign(reader: Reader, options: argparse.Namespace) -> dict[str, Any]:
    begun = time.process_time() + sum(os.times()[2:4])
    with tempfile.TemporaryDirectory() as name:
        os.environ["XDG_CACHE_HOME"] = name
        folder = Path(name) / "files"
        folder.mkdir()
        seeds, path = reader.seeds(folder), folder / reader.file
        for seed in seeds:
            path.write_bytes(seed)
            sound = read_apart(reader.read, path)
            if sound.kind not in (READ, "refused"):
                raise RuntimeError(f"{reader.name}: a sound file is not read: {sound}")
        reader.read(path) if sound.kind == READ else None  # imports everything once
        counts: Counter[str] = Counter()
        faults, slowest, largest = [], 0.0, 0.0
        for number in range(options.first, options.first + options.files):
            rng = np.random.default_rng([options.seed, number])
            path.write_bytes(reader.change(seeds[int(rng.integers(len(seeds)))], rng, seeds))
            found = read_apart(reader.read, path)
            counts[found.kind] += 1
            slowest, largest = max(slowest, found.seconds), max(largest, found.megabytes)
            if found.kind in (CRASH, SLOW, LARGE, UNNAMED):
                faults.append(_fault(number, found))
                if options.keep is not None:
                    options.keep.mkdir(parents=True, exist_ok=True)
                    (options.keep / f"{reader.name} {options.seed} {number} {path.name}").write_bytes(path.read_bytes())
    return {
        "reader": reader.name,
        "seed": options.seed,
        "first": options.first,
        "files": options.files,
        "outcomes": dict(counts),
        "slowest s": round(slowest, 2),
        "largest MB": round(largest),
        "processor s": round(time.process_time() + sum(os.times()[2:4]) - begun, 1),
        "faults": faults[:20],
    }


def _fault(number: int, found: Outcome) -> dict[str, Any]:
    return {
        "file": number,
        "kind": found.kind,
        "s": round(found.seconds, 2),
        "MB": round(found.megabytes),
        "message": found.message[:400],
    }


def _record(rows: list[dict[str, Any]]) -> None:
    """Replace the rows of these readers and seeds in the results, and write the table."""
    RESULTS.mkdir(exist_ok=True)
    place = RESULTS / "fuzz.json"
    key = lambda row: (row["reader"], row["seed"], row["first"])  # noqa: E731
    kept = json.loads(place.read_text(encoding="utf-8")) if place.is_file() else []
    found = {key(row): row for row in [*kept, *rows]}
    order = [reader.name for reader in READERS]
    every = sorted(found.values(), key=lambda row: (order.index(row["reader"]), row["seed"], row["first"]))
    place.write_text(json.dumps(every, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    (RESULTS / "fuzz.md").write_text(_table(every), encoding="utf-8")


def _table(rows: list[dict[str, Any]]) -> str:
    lines = [
        "Changed files by reader, each read in its own process; processor time, and memory with the program itself.",
        "",
        "| reader | files | " + " | ".join(OUTCOMES) + " | slowest, s | largest, MB |",
        "|" + " --- |" * (len(OUTCOMES) + 4),
    ]
    for name in dict.fromkeys(row["reader"] for row in rows):
        own = [row for row in rows if row["reader"] == name]
        cells = [str(sum(row["outcomes"].get(kind, 0) for row in own)) for kind in OUTCOMES]
        worst = [f"{max(row['slowest s'] for row in own):.2f}", str(max(row["largest MB"] for row in own))]
        lines.append(f"| {name} | {sum(row['files'] for row in own)} | " + " | ".join([*cells, *worst]) + " |")
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
