"""The cost of the papers' presets: counted, measured on one core of this machine, and estimated for GPUs."""

import argparse
import json
import os
import time
from pathlib import Path
from typing import Any

from experiments.scale.cases import CASES, Case, corpus_of, run_config, steps_of

#: Peak rates in TF32, which JAX uses for float32 products on these GPUs, dense, TFLOP/s (makers' data sheets).
GPUS = {"A100": 156.0, "H100": 495.0}
#: Share of the peak that is assumed, not measured; recurrent networks compute small products one after another.
UTILISATION = {"convolutions and attention": 0.10, "recurrent": 0.01}
RESULTS = Path(__file__).with_name("results")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m experiments.scale", description=__doc__)
    parser.add_argument("--work", type=Path, required=True, help="folder for the small corpora")
    parser.add_argument("--clips", type=int, default=8, help="of the steps that are timed (default %(default)s)")
    parser.add_argument("--repeats", type=int, default=2, help="steps that are timed (default %(default)s)")
    parser.add_argument("--only", help="count and time one case, and store it")
    parser.add_argument("--count-only", action="store_true", help="time nothing")
    options = parser.parse_args()
    RESULTS.mkdir(exist_ok=True)
    for case in CASES:
        if options.only in (None, case.name):
            figures = _counted(case, options.work)
            if not options.count_only:
                figures |= _timed(case, options.work, options.clips, options.repeats)
            path = RESULTS / f"{case.name.replace(' ', '_')}.json"
            before = json.loads(path.read_text()) if path.is_file() else {}
            path.write_text(json.dumps({**before, **figures}, indent=1) + "\n")
            print(case.name, figures, flush=True)
    paths = [RESULTS / f"{case.name.replace(' ', '_')}.json" for case in CASES]
    found = [json.loads(path.read_text()) for path in paths if path.is_file()]
    (RESULTS / "scale.md").write_text(table(found))
    print(table(found))


def _counted(case: Case, work: Path) -> dict[str, Any]:
    """Parameters and operations, of shapes alone: nothing is computed."""
    import jax

    from a2g_jax.training.state import init_state
    from experiments.scale.flops import loop_flops, product_flops

    corpus = corpus_of(case, work)
    config = run_config(case, corpus)
    model, spans, step_of = steps_of(config, corpus)
    state = jax.eval_shape(lambda: init_state(model, spans, 0))
    stages = []
    for span in spans:
        program = jax.make_jaxpr(step_of(span))(state).jaxpr
        counts = {"flops": product_flops(program), "in_loops": loop_flops(program)}
        stages.append({"stage": span.stage.name, "steps": span.config.steps, **counts})
    rows = sum(array.nbytes for array in (corpus.audio, corpus.pose, corpus.root)) / corpus.frames
    return {
        "case": case.name,
        "clips": config.train_config.batch_size,
        "clip_seconds": model.clip_frames / corpus.fps,
        "parameters": sum(leaf.size for leaf in jax.tree.leaves(state.params)),
        "stages": stages,
        "megabytes_an_hour": rows * corpus.fps * 3600 / 1e6,
    }


def _timed(case: Case, work: Path, clips: int, repeats: int) -> dict[str, Any]:
    """CPU time of a step of the longest stage with a few clips; of all threads, so that a busy machine matters less."""
    import jax

    from a2g_jax.training.state import init_state

    corpus = corpus_of(case, work)
    config = run_config(case, corpus, clips)
    model, spans, step_of = steps_of(config, corpus)
    longest = max(spans, key=lambda span: span.config.steps)
    step, state = step_of(longest), init_state(model, spans, 0)
    state = state._replace(step=state.step + longest.first)
    begin = time.process_time()
    state, metrics = jax.block_until_ready(step(state))
    compiled = time.process_time() - begin
    seconds = []
    for _ in range(repeats):
        begin = time.process_time()
        state, metrics = jax.block_until_ready(step(state))
        seconds.append(time.process_time() - begin)
    timed = {"clips": clips, "stage": longest.stage.name, "seconds": min(seconds), "first_seconds": compiled}
    return {"timed": timed, "cores": os.cpu_count(), "loss": float(metrics["loss"])}


def table(cases: list[dict[str, Any]]) -> str:
    """The figures as Markdown."""
    lines = [
        "Costs of the papers' presets: `python -m experiments.scale --work FOLDER`, seed 0. FLOP are those of",
        "products and convolutions. CPU: core seconds of a step, measured with a few clips (in brackets) and scaled to",
        "the batch. GPU: FLOP over the peak in TF32",
        f"({', '.join(f'{name} {peak:g}' for name, peak in GPUS.items())} TFLOP/s)",
        "times a utilisation that is assumed, not measured:",
        f"{UTILISATION['convolutions and attention']:.0%}, recurrent networks {UTILISATION['recurrent']:.0%}.",
        "",
        "| preset | parameters | clips | GFLOP a step | core s a step | steps | core days | "
        + " | ".join(f"{name}, h" for name in GPUS)
        + " |",
        "|---|---|---|---|---|---|---|" + "---|" * len(GPUS),
    ]
    for one in cases:
        steps = sum(stage["steps"] for stage in one["stages"])
        total = sum(stage["steps"] * stage["flops"] for stage in one["stages"])
        longest = max(one["stages"], key=lambda stage: stage["steps"])
        recurrent = longest["in_loops"] > 0.3 * longest["flops"]
        share = UTILISATION["recurrent" if recurrent else "convolutions and attention"]
        timed, seconds, days = one.get("timed"), "", ""
        if timed:
            each = timed["seconds"] * one["clips"] / timed["clips"]
            seconds = f"{each:.1f} ({timed['clips']})"
            days = f"{each * total / longest['flops'] / 86400:.1f}"
        hours = [f"{total / (peak * 1e12 * share) / 3600:.1f}" for peak in GPUS.values()]
        lines.append(
            f"| {one['case']} | {one['parameters'] / 1e6:.1f} M | {one['clips']} | {longest['flops'] / 1e9:.0f} |"
            f" {seconds} | {steps} | {days} | {' | '.join(hours)} |"
        )
    lines += [
        "",
        "| preset | MB an hour of recordings | GB for 1000 hours | steps to see each second once |",
        "|---|---|---|---|",
    ]
    for one in cases:
        epoch = 1000 * 3600 / one["clip_seconds"] / one["clips"]
        rate = one["megabytes_an_hour"]
        lines.append(f"| {one['case']} | {rate:.0f} | {rate:.0f} | {epoch:.0f} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
