"""Latency and memory of live generation: ``python -m experiments.live.latency [RUN ...] [--minutes 2]``.

Pushes of 10 ms, 48 kHz, of ten seconds of generated speech over and over. Computing is the time of one push that gives
frames; the time between two of these is that of the frames.
"""

import argparse
import resource
import time

import numpy as np

from a2g_jax.generation.live.stream import Stream
from a2g_jax.io.audio import resampled
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import open_run

RATE = 48000


def measure(name: str, minutes: float, lookahead: float | None) -> str:
    """A row of the table for one run."""
    stream = Stream(open_run(name), RATE, lookahead=lookahead)
    stream.warm_up()
    audio = resampled(talk(10.0, 3).audio, 16000, RATE)
    pieces = np.split(audio[: len(audio) // 480 * 480], len(audio) // 480)
    wall, processor, busy, frames = [], [], 0.0, 0
    memory = {}
    count = round(minutes * 60 * 100)
    for number in range(count):
        start, used = time.perf_counter(), time.process_time()
        given = stream.push(pieces[number % len(pieces)]).frames
        elapsed = time.perf_counter() - start
        busy += elapsed
        if given:
            wall.append(elapsed)
            processor.append(time.process_time() - used)
        frames += given
        if number in (count // 4, count - 1):
            memory[number] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    ahead = stream.latency
    parts = " | ".join(
        f"{1000 * value:.0f}" for value in (ahead.model, ahead.features, ahead.feet, ahead.hop, ahead.total)
    )
    p50, p99 = (f"{1000 * value:.0f}" for value in np.percentile(wall, (50, 99)))
    cpu = f"{1000 * np.percentile(processor, 50):.0f} / {1000 * np.percentile(processor, 99):.0f}"
    period = 1000 * frames / len(wall) / stream.fps
    first, last = memory.values()
    share = busy / (minutes * 60)
    return f"| {name} | {parts} | {period:.0f} | {p50} / {p99} | {cpu} | {share:.2f} | {last - first:+.1f} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="*", default=["demo", "demo-flow", "demo-emotion"])
    parser.add_argument("--minutes", type=float, default=2.0)
    parser.add_argument("--lookahead", type=float, help="seconds; by default all that the model depends on")
    args = parser.parse_args()
    print(
        "| run | model, ms | features | feet | hop | in all, ms | frames every, ms | computing p50 / p99, ms |", end=""
    )
    print(" of one core, p50 / p99, ms | share of the time | growth of memory, MB |")
    print("|---|" + "---|" * 10)
    for name in args.runs:
        print(measure(name, args.minutes, args.lookahead), flush=True)


if __name__ == "__main__":
    main()
