"""Memory over hours of speech: ``python -m experiments.live.endurance [--run demo-flow] [--hours 10] [--out FILE]``.

Speeches of different speakers and loudness, with pauses, are pushed 20 ms at a time, as fast as they are computed.
Every simulated minute is a line of JSON with the resident memory, Python's objects, JAX's arrays, and the computing of
a second of speech; an interrupted run leaves what it has. At the end the slope, without the first minutes.
"""

import argparse
import gc
import json
import os
import time
from pathlib import Path

import jax
import numpy as np

from a2g_jax.generation.live.stream import HOP, Stream
from a2g_jax.io.audio import resampled
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import open_run

RATE = 48000
#: Samples of a push; seconds and number of different speeches; minutes that are left out of the slope.
PUSH, SPEECH, SPEECHES, WARM = RATE // 50, 20.0, 30, 30


def resident() -> int:
    """Bytes of this process in memory."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def speeches() -> list[np.ndarray]:
    """Different speeches, of different loudness, some with silence or noise after them."""
    rng = np.random.default_rng(0)
    found = []
    for seed in range(SPEECHES):
        audio = resampled(talk(SPEECH, seed).audio, 16000, RATE) * rng.uniform(0.1, 1.0)
        pause = rng.choice([0.0, 1e-4, 1e-3]) * rng.standard_normal(round(RATE * rng.uniform(0.0, 10.0)))
        found.append((np.clip(np.concatenate([audio, pause]), -1, 1) * 32767).astype(np.int16))
    return found


def slope(minutes: list[float], values: list[float]) -> float:
    """Growth per hour of a least-squares line."""
    return float(np.polyfit(np.asarray(minutes) / 60, values, 1)[0]) if len(minutes) > 2 else float("nan")


def endure(name: str, hours: float, hop: float, out: Path) -> dict:
    """Push hours of speech through one stream; returns the summary."""
    stream = Stream(open_run(name), RATE, hop=hop)
    stream.warm_up()
    library = speeches()
    rng = np.random.default_rng(1)
    current, at = library[0], 0
    rows: list[dict] = []
    with out.open("w", encoding="utf-8") as file:
        for minute in range(1, round(hours * 60) + 1):
            start, frames, bad = time.process_time(), 0, 0
            for _ in range(60 * 50):
                if at + PUSH > len(current):
                    current, at = library[rng.integers(len(library))], 0
                motion = stream.push(current[at : at + PUSH])
                at += PUSH
                frames += motion.frames
                bad += int(not np.isfinite(motion.rotations).all() or not np.isfinite(motion.root).all())
            row = {
                "minute": minute,
                "resident": resident(),
                "objects": len(gc.get_objects()),
                "arrays": len(jax.live_arrays()),
                "frames": frames,
                "bad": bad,
                "cpu": round((time.process_time() - start) / 60, 4),
                "compiled": stream._program.compilations(),
                "hop": hop,
                "root": [round(float(value), 4) for value in motion.root[-1]] if motion.frames else None,
            }
            rows.append(row)
            file.write(json.dumps(row) + "\n")
            file.flush()
    return summary(name, rows)


def summary(name: str, rows: list[dict]) -> dict:
    """Growth and computing of the rows of one run."""
    late = [row for row in rows if row["minute"] > min(WARM, len(rows) // 2)]
    minutes = [row["minute"] for row in late]
    megabytes = [row["resident"] / 2**20 for row in late]
    return {
        "run": name,
        "simulated_hours": round(len(rows) / 60, 2),
        "hop_seconds": rows[-1].get("hop", HOP),
        "resident_mb_first_counted": round(megabytes[0], 1),
        "resident_mb_last": round(megabytes[-1], 1),
        "resident_mb_most": round(max(megabytes), 1),
        "growth_mb_per_hour": round(slope(minutes, megabytes), 3),
        "objects_per_hour": round(slope(minutes, [row["objects"] for row in late]), 1),
        "arrays": sorted({row["arrays"] for row in late}),
        "frames_per_minute": sorted({row["frames"] for row in late}),
        "bad_pushes": sum(row["bad"] for row in rows),
        "compiled": sorted({row["compiled"] for row in late}),
        "cpu_per_second_first_and_last_tenth": [
            round(float(np.mean([row["cpu"] for row in part])), 4)
            for part in (late[: max(1, len(late) // 10)], late[-max(1, len(late) // 10) :])
        ],
    }


def main() -> None:
    """Measure, or summarise what an interrupted run has left."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", default="demo-flow")
    parser.add_argument("--hours", type=float, default=10.0)
    parser.add_argument("--hop", type=float, default=HOP, help="seconds of motion that a call computes")
    parser.add_argument("--out", type=Path, default=Path("endurance.jsonl"))
    parser.add_argument("--summary", action="store_true", help="of the file, without measuring")
    args = parser.parse_args()
    if args.summary:
        rows = [json.loads(line) for line in args.out.read_text(encoding="utf-8").splitlines()]
        print(json.dumps(summary(args.run, rows), indent=1))
    else:
        print(json.dumps(endure(args.run, args.hours, args.hop, args.out), indent=1))


if __name__ == "__main__":
    main()
