"""Speed of sampling from the stylized flow and MoGlow with random weights: ours and an eager PyTorch twin's.

The contenders take turns in one process, so that other load on the machine affects them alike. Every turn goes from
audio features to z-scores of poses for one audio, frame by frame, with the latents given.
"""

import argparse
import os
import statistics
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from experiments.benchmarks import measure

#: Ours; the twin with the whole condition through its recurrent layers; the twin with the audio's share precomputed.
CONTENDERS = ("a2g_jax", "torch_eager", "torch_precomputed")
#: Bytes copied to measure the memory's bandwidth; far more than the caches' size.
_COPIED = 2**28
#: Frames; the first 20 of them do not reach its end, whatever the lookahead.
_WARM_UP = 50


def main() -> None:
    """Command line: without ``--contender``, runs each case in turn and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", default="moglow,trinity,ted", help="comma-separated (default %(default)s)")
    parser.add_argument("--sequences", default="1,20", help="at once; comma-separated (default %(default)s)")
    parser.add_argument("--frames", type=int, default=600, help="of a turn (default %(default)s)")
    parser.add_argument("--rounds", type=int, default=3, help="turns of every contender (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--contenders", default=",".join(CONTENDERS), help="comma-separated (default %(default)s)")
    parser.add_argument("--quick", action="store_true", help="MoGlow, one sequence, 60 frames a turn")
    parser.add_argument("--out", type=Path, help="JSON file to write (default: in the results folder)")
    parser.add_argument("--contender", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.quick:
        options.cases, options.sequences, options.frames = "moglow", "1", 60
    if options.contender:
        measure.limit_threads()
        measure.report(_case(options))
        return
    names = ("sequences", "frames", "rounds", "seed", "contenders")
    arguments = [part for name in names for part in (f"--{name}", str(getattr(options, name)))]
    rows: list[dict[str, Any]] = []
    for case in options.cases.split(","):
        result = measure.run_alone("experiments.benchmarks.flow_sampling", case, arguments)
        rows += [{"contender": case, **result}] if "failed" in result else result["rows"]
    columns = {
        "case": "",
        "sequences": "sequences",
        "contender": "",
        "frame_ms": "median, ms a frame",
        "min_ms": "min",
        "max_ms": "max",
        "cpu_ms": "CPU time, ms a frame",
        "real_time": "x real time",
        "ratio": "x ours",
        "floor_ms": "reading the weights once, ms",
        "others_share": "share of the cores others took",
    }
    measure.print_table(rows, columns)
    cores = min(len(os.sched_getaffinity(0)), measure.THREADS) if hasattr(os, "sched_getaffinity") else measure.THREADS
    settings = {name: getattr(options, name) for name in ("cases", *names)} | {"cores_used": cores}
    print(f"\nwritten to {measure.write_results('flow_sampling', settings, rows, options.out)}")


def bandwidth(threads: int) -> float:
    """Bytes a second, read and written, of copying a large array."""
    import numpy as np

    parts = [(np.ones(_COPIED // threads, np.uint8), np.zeros(_COPIED // threads, np.uint8)) for _ in range(threads)]
    seconds = []
    with ThreadPoolExecutor(threads) as pool:
        for _ in range(7):
            start = time.perf_counter()
            list(pool.map(lambda pair: np.copyto(pair[1], pair[0]), parts))
            seconds.append(time.perf_counter() - start)
    return 2 * _COPIED / statistics.median(seconds)


def _case(options: argparse.Namespace) -> dict[str, Any]:
    """Rows for every number of sequences and every contender."""
    import jax
    import numpy as np

    from a2g_jax.models.stylized_flow.networks import FlowNetworks
    from experiments.benchmarks.flow_workload import CASES, moved

    case = CASES[options.contender]
    networks = FlowNetworks(case.config, case.data)
    params = moved(jax.jit(networks.init)(jax.random.key(options.seed)), options.seed)
    rng = np.random.default_rng(options.seed)
    audio = rng.normal(size=(options.frames, case.bands)).astype(np.float32)
    calls = _contenders(case, networks, params, options.contenders.split(","))
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else measure.THREADS
    rate, weights = bandwidth(cores), _bytes_of_a_frame(params)
    rows = []
    for sequences in (int(part) for part in options.sequences.split(",")):
        z = rng.normal(size=(sequences, options.frames, case.channels)).astype(np.float32)
        # Ours compiles for the length; the twin is warm after a few frames.
        lengths = {name: options.frames if name == "a2g_jax" else _WARM_UP for name in calls}
        warm = {name: call(z[:, : lengths[name]], audio[: lengths[name]]) for name, call in calls.items()}
        turns: dict[str, list[dict[str, Any]]] = {name: [] for name in calls}
        for _ in range(options.rounds):
            for name, call in calls.items():
                turns[name].append(_turn(lambda call=call, z=z: call(z, audio), options.frames))
        first = next(iter(warm.values()))
        ours = None
        for name, taken in turns.items():
            frame = statistics.median(turn["ms"] for turn in taken)
            ours = frame if name == "a2g_jax" else ours
            others = [turn["others"] for turn in taken if turn["others"] is not None]
            rows.append(
                {
                    "case": case.title,
                    "sequences": sequences,
                    "contender": name,
                    "frame_ms": frame,
                    "min_ms": min(turn["ms"] for turn in taken),
                    "max_ms": max(turn["ms"] for turn in taken),
                    "cpu_ms": statistics.median(turn["cpu_ms"] for turn in taken),
                    "real_time": 1000.0 / case.fps / frame,
                    "ratio": frame / ours if ours else None,
                    "floor_ms": 1000.0 * weights / rate,
                    "others_share": statistics.mean(others) if others else None,
                    "weights_mb": weights / 1e6,
                    "bandwidth_gb_s": rate / 1e9,
                    "largest_difference": float(np.abs(warm[name][:, :20] - first[:, :20]).max()),
                }
            )
    return {"rows": rows}


def _turn(call: Callable[[], Any], frames: int) -> dict[str, Any]:
    watch, start, own = measure.Stopwatch(), time.perf_counter(), time.process_time()
    call()
    wall, used = time.perf_counter() - start, time.process_time() - own
    return {"ms": 1000 * wall / frames, "cpu_ms": 1000 * used / frames, "others": watch.others()}


def _bytes_of_a_frame(params: Any) -> int:
    """Bytes of the weights that every frame needs: all but those that multiply audio."""
    import jax

    couplings, encoder = params["glow"]["coupling"], params.get("global_encoder", {})
    needed = [couplings, [part for name, part in encoder.items() if name != "audio"]]
    count = sum(leaf.size for leaf in jax.tree.leaves(needed)) - couplings["layer_0"]["known_kernel"].size
    return 4 * (count + params["glow"]["invertible"]["lower"].size)


def _contenders(case: Any, networks: Any, params: Any, names: list[str]) -> dict[str, Callable[..., Any]]:
    """For each contender a function from latents (B, T, C) and audio (T, bands) to motions (B, T, C)."""
    calls = {name: call for name, call in (("a2g_jax", _ours(networks, params)),) if name in names}
    return calls | (_twins(case, params, names) if any(name.startswith("torch") for name in names) else {})


def _ours(networks: Any, params: Any) -> Callable[..., Any]:
    import jax
    import numpy as np

    condition = jax.jit(networks.audio_context)
    begin, proceed = jax.jit(networks.start, static_argnums=1), jax.jit(networks.proceed)

    def sample(z: Any, audio: Any) -> Any:
        state = begin(params, len(z))
        x, _ = proceed(params, np.ascontiguousarray(z.swapaxes(0, 1)), condition(params, audio), state)
        return np.asarray(x).swapaxes(0, 1)

    return sample


def _twins(case: Any, params: Any, names: list[str]) -> dict[str, Callable[..., Any]]:
    import torch

    from experiments.benchmarks.torch_flow import Twin
    from experiments.benchmarks.torch_flow_weights import load_params

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else measure.THREADS
    torch.set_num_threads(cores)
    twin = Twin(case.config, case.channels, case.bands).eval()
    load_params(twin, params)

    def sample(z: Any, audio: Any, precompute: bool) -> Any:
        return twin.sample(torch.from_numpy(z), torch.from_numpy(audio), precompute).numpy()

    calls = {
        "torch_eager": lambda z, audio: sample(z, audio, False),
        "torch_precomputed": lambda z, audio: sample(z, audio, True),
    }
    return {name: call for name, call in calls.items() if name in names}


if __name__ == "__main__":
    main()
