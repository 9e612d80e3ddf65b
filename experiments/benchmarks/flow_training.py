"""Time and memory of one training step of the stylized flow and MoGlow: ours and an eager PyTorch twin's.

A step computes bits per frame and their gradients, clips those and updates by Adam, on a fixed batch; the stylized
flow's also with the reverse pass, which one batch in five takes.
"""

import argparse
import os
import statistics
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from experiments.benchmarks import measure

CONTENDERS = ("a2g_jax", "torch_eager")


def main() -> None:
    """Command line: without ``--contender``, runs each in turn and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", default="moglow,trinity,ted", help="comma-separated (default %(default)s)")
    parser.add_argument("--batch", type=int, default=0, help="clips in a batch (default: as published)")
    parser.add_argument("--repeats", type=int, default=3, help="steps timed (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--contenders", default=",".join(CONTENDERS), help="comma-separated (default %(default)s)")
    parser.add_argument("--quick", action="store_true", help="MoGlow, batches of 4 clips")
    parser.add_argument("--out", type=Path, help="JSON file to write (default: in the results folder)")
    parser.add_argument("--contender", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.quick:
        options.cases, options.batch = "moglow", 4
    if options.contender:
        measure.limit_threads()
        measure.report(_one(options))
        return
    names = ("batch", "repeats", "seed")
    arguments = [part for name in names for part in (f"--{name}", str(getattr(options, name)))]
    rows: list[dict[str, Any]] = []
    for case in options.cases.split(","):
        for reverse in ("",) if case == "moglow" else ("", "reverse"):
            ours = None
            for contender in options.contenders.split(","):
                which = ":".join((case, reverse, contender))
                row = measure.run_alone("experiments.benchmarks.flow_training", which, arguments)
                rows.append({"contender": contender, "case": case, "reverse": reverse or "no", **row})
                ours = row.get("median_s") if contender == "a2g_jax" else ours
                if ours and "median_s" in row:
                    rows[-1]["ratio"] = row["median_s"] / ours
    columns = {
        "title": "",
        "clips": "clips",
        "reverse": "reverse pass",
        "contender": "",
        "median_s": "median, s",
        "min_s": "min",
        "max_s": "max",
        "cpu_s": "CPU time, s",
        "ratio": "x ours",
        "first_s": "first step with compilation, s",
        "peak_mb": "peak memory, MB",
        "others_share": "share of the cores others took",
    }
    measure.print_table(rows, columns)
    settings = {name: getattr(options, name) for name in ("cases", *names)}
    print(f"\nwritten to {measure.write_results('flow_training', settings, rows, options.out)}")


def _one(options: argparse.Namespace) -> dict[str, Any]:
    import numpy as np

    from a2g_jax.models.registry import find_model
    from experiments.benchmarks.flow_workload import CASES

    name, reverse, contender = options.contender.split(":")
    case = CASES[name]
    config = replace(case.config, reverse_share=1.0 if reverse else 0.0)
    settings = find_model("stylized_flow").training_preset(case.preset)
    clips, rng = options.batch or case.batch, np.random.default_rng(options.seed)
    # Random walks, so that neighbouring frames are similar.
    steps = rng.normal(0, 0.1, (clips, config.clip_frames, case.rows, 3))
    pose = np.sin(np.cumsum(steps, axis=1)).astype(np.float32)
    audio = rng.normal(size=(clips, config.clip_frames, case.bands)).astype(np.float32)
    step = (_ours if contender == "a2g_jax" else _twin)(case, config, settings, pose, audio, options.seed)
    last, used = {}, []

    def call() -> None:
        before = time.process_time()
        last.update(step())
        used.append(time.process_time() - before)

    figures = measure.measure(call, options.repeats, 1)
    # CPU time of all threads is informative on a busy machine too.
    figures["cpu_s"] = statistics.median(used[-options.repeats :])
    return {**figures, **last, "title": case.title, "clips": clips}


def _ours(case: Any, config: Any, settings: Any, pose: Any, audio: Any, seed: int) -> Any:
    import jax

    from a2g_jax.data.batch import Batch
    from a2g_jax.models.stylized_flow.model import build
    from a2g_jax.training.stages import stage_spans
    from a2g_jax.training.state import advance, init_state

    model = build(config, case.data)
    span = stage_spans(model, settings)[0]
    state = init_state(model, (span,), seed)
    batch = Batch(jax.device_put(audio), jax.device_put(pose))
    step = jax.jit(lambda state, key: advance(span, state, batch, key), donate_argnums=0)

    def call() -> dict[str, float]:
        nonlocal state
        state, metrics = jax.block_until_ready(step(state, jax.random.fold_in(state.key, state.step)))
        return {"loss": float(metrics["loss"])}

    return call


def _twin(case: Any, config: Any, settings: Any, pose: Any, audio: Any, seed: int) -> Any:
    import jax
    import torch
    from torch.nn import utils

    from a2g_jax.models.stylized_flow.networks import FlowNetworks
    from experiments.benchmarks.torch_flow import Twin
    from experiments.benchmarks.torch_flow_weights import load_params

    torch.set_num_threads(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else measure.THREADS)
    torch.manual_seed(seed)
    twin = Twin(config, case.channels, case.bands)
    networks = FlowNetworks(config, case.data)
    # The actnorms set from the batch, as ours are.
    params = networks.fitted(networks.init(jax.random.key(seed)), audio, networks.flat(pose))
    load_params(twin, params)
    del params
    adam = torch.optim.Adam(twin.parameters(), lr=settings.learning_rate / settings.warmup_steps, fused=True)
    flat, audio_features = torch.from_numpy(pose).flatten(2), torch.from_numpy(audio)
    inner = config.clip_frames - config.history_frames - config.lookahead_frames

    def call() -> dict[str, float]:
        visible = torch.rand(len(flat), inner, config.history_frames) >= config.frame_dropout
        z = None
        if config.reverses:
            z = torch.randn(len(flat), inner, case.channels)
            z = z / (torch.distributions.Chi2(config.freedom).sample((len(flat), inner, 1)) / config.freedom).sqrt()
        adam.zero_grad(set_to_none=True)
        terms = twin.terms(flat + config.input_noise * torch.randn_like(flat), audio_features, visible, z)
        loss = sum(terms.values())
        loss.backward()
        utils.clip_grad_value_(twin.parameters(), settings.clip_value)
        utils.clip_grad_norm_(twin.parameters(), settings.clip_norm)
        adam.step()
        return {"loss": float(loss.detach())}

    return call


if __name__ == "__main__":
    main()
