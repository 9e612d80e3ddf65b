"""Time and memory of one Audio2Gestures training step: ours, the PyTorch twin's, and the compiled twin's.

A step draws clips, gathers and normalises them, computes all losses and gradients, and updates weights by Adam.
"""

import argparse
import tempfile
from pathlib import Path
from typing import Any

from experiments.benchmarks import measure

CONTENDERS = ("a2g_jax", "torch_eager", "torch_compiled")
#: Rows of the corpus, 5.5 minutes: enough that gathering clips is not one contiguous copy.
CORPUS_FRAMES = 10_000


def main() -> None:
    """Command line: without ``--contender``, runs each in turn and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--preset", default="paper", choices=("paper",))
    parser.add_argument("--batch", type=int, default=32, help="clips in a batch (default %(default)s)")
    parser.add_argument("--frames", type=int, default=128, help="frames in a clip (default %(default)s)")
    parser.add_argument(
        "--joints", type=int, default=22, choices=(22, 55), help="of the skeleton (default %(default)s)"
    )
    parser.add_argument("--repeats", type=int, default=10, help="steps timed (default %(default)s)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--contenders", default=",".join(CONTENDERS), help="comma-separated (default %(default)s)")
    parser.add_argument("--out", type=Path, help="JSON file to write (default: in the results folder)")
    parser.add_argument("--contender", choices=CONTENDERS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.contender:
        measure.limit_threads()
        with tempfile.TemporaryDirectory() as folder:
            measure.report(_one(options, Path(folder)))
        return
    names = ("preset", "batch", "frames", "joints", "repeats", "seed")
    arguments = [part for name in names for part in (f"--{name}", str(getattr(options, name)))]
    rows = []
    for contender in options.contenders.split(","):
        figures = measure.run_alone("experiments.benchmarks.training_step", contender, arguments)
        rows.append({"contender": contender, **figures})
        ours = rows[0].get("median_s")
        if rows[0]["contender"] == "a2g_jax" and ours and "median_s" in rows[-1]:
            rows[-1]["ratio"] = rows[-1]["median_s"] / ours
    columns = {
        "contender": "",
        "median_s": "median, s",
        "min_s": "min",
        "max_s": "max",
        "ratio": "x ours",
        "first_s": "first step with compilation, s",
        "peak_mb": "peak memory, MB",
        "before_mb": "of it before the first step",
        "others_share": "share of the cores others took",
    }
    measure.print_table(rows, columns)
    settings = {name: getattr(options, name) for name in names}
    print(f"\nwritten to {measure.write_results('training_step', settings, rows, options.out)}")


def _one(options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    from experiments.benchmarks.workload import make_corpus, run_config

    corpus = make_corpus(folder, CORPUS_FRAMES, options.joints, options.seed)
    config = run_config(corpus, options.preset, options.batch, options.frames, options.seed)
    if options.contender == "a2g_jax":
        return _ours(config, corpus, options)
    return _twin(config, corpus, options)


def _ours(config: Any, corpus: Any, options: argparse.Namespace) -> dict[str, Any]:
    import jax

    from a2g_jax.data.batch import clip_shape
    from a2g_jax.data.batches import find_crops
    from a2g_jax.data.on_demand import Part
    from a2g_jax.training.loop import step_programs
    from a2g_jax.training.stages import stage_spans
    from a2g_jax.training.state import init_state

    model, settings = config.build(), config.train_config
    crops = find_crops(corpus, "train", options.frames)
    shape = clip_shape(model.batch_fields, options.frames, corpus.fps, corpus.mel.sample_rate)
    spans = stage_spans(model, settings)
    part = Part({name: corpus.array(name) for name in shape.arrays}, corpus.segments("train"))
    step = step_programs(spans[0], shape, crops, config)(part)
    state = init_state(model, spans, settings.seed)
    parameters = sum(leaf.size for leaf in jax.tree.leaves(state.params))
    last = {}

    def call() -> None:
        nonlocal state
        state, metrics = jax.block_until_ready(step(state))
        last.update(metrics)

    figures = measure.measure(call, options.repeats)
    return {**figures, "parameters": parameters, "loss": float(last["loss"])}


def _twin(config: Any, corpus: Any, options: argparse.Namespace) -> dict[str, Any]:
    import numpy as np
    import torch

    from experiments.benchmarks.torch_twin import Noise, Twin

    torch.set_num_threads(measure.THREADS)
    torch.manual_seed(options.seed)
    settings = config.model_config
    twin = Twin(settings, corpus.skeleton, corpus.mel.width)
    adam = torch.optim.Adam(twin.parameters(), lr=config.train_config.learning_rate, fused=True)
    audio, pose = torch.from_numpy(np.array(corpus.audio)), torch.from_numpy(np.array(corpus.pose))
    statistics = config.statistics["audio"]
    mean, std = torch.from_numpy(statistics.mean), torch.from_numpy(statistics.std)
    clip = torch.arange(options.frames)
    compute = torch.compile(twin.terms) if options.contender == "torch_compiled" else twin.terms
    step = 0
    last = 0.0

    def call() -> None:
        nonlocal step, last
        rows = torch.randint(0, len(audio) - options.frames + 1, (options.batch, 1)) + clip
        noise = Noise.draw(options.batch, settings.code_channels, options.frames)
        adam.zero_grad(set_to_none=True)
        terms = compute((audio[rows] - mean) / std, pose[rows], noise)
        # Losses of weight zero are computed, for the log, but not differentiated.
        loss = sum(weight * terms[name] for name, weight in twin.weights(step).items() if weight != 0.0)
        loss.backward()
        adam.step()
        step, last = step + 1, float(loss.detach())

    figures = measure.measure(call, options.repeats)
    parameters = sum(value.numel() for value in twin.parameters())
    return {**figures, "parameters": parameters, "loss": last}


if __name__ == "__main__":
    main()
