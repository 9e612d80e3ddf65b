"""Steps of MoGlow in the time of one step of the flow, at the tables' sizes.

    taskset -c 0 python -m experiments.stylized_flow.step_time --corpus TRINITY --perceptual FEATURES \\
        --corpus-ted TED --perceptual-ted FEATURES_TED [--rounds 5]

The flow and both MoGlows take turns on one batch, so that other load on the machine affects all of them alike; medians
over the turns. Writes ``results/step_time.json``, the source of ``settings.EQUAL``.
"""

import os
import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import jax
import numpy as np

from a2g_jax.data.batch import Batch, gather
from a2g_jax.data.batches import draw_starts, find_crops
from a2g_jax.data.corpus import Corpus
from a2g_jax.io.files import write_json
from a2g_jax.training.stages import stage_spans
from a2g_jax.training.state import advance, init_state
from experiments.stylized_flow.settings import flow, moglow
from experiments.stylized_flow.table1 import ted_arguments
from experiments.tables.records import results
from experiments.tables.setting import Setting, Variant, arguments, setting
from experiments.tables.training import described

#: Steps of a turn: one in five has the reverse pass, so a multiple of five, and enough to approximate that share.
TURN = 40


def stepper(variant: Variant, corpus: Corpus, where: Setting) -> Callable[[], None]:
    """Return a function that trains for one turn on a fixed batch."""
    _, config = described("", variant, {}, 0, corpus, where)
    model, settings = config.build(), config.train_config
    state = init_state(model, stage_spans(model, settings), settings.seed)
    rows = draw_starts(jax.random.key(0), find_crops(corpus, "train", model.clip_frames), settings.batch_size)
    clips = [gather(jax.device_put(np.asarray(a)), rows, model.clip_frames) for a in (corpus.audio, corpus.pose)]
    batch = Batch(*clips)
    step = jax.jit(
        lambda state: advance(stage_spans(model, settings)[0], state, batch, jax.random.fold_in(state.key, state.step)),
        donate_argnums=0,
    )

    def turn() -> None:
        nonlocal state
        for _ in range(TURN):
            state, _ = step(state)
        jax.block_until_ready(state)

    return turn


def measure(protocol: str, where: Setting, rounds: int) -> dict[str, Any]:
    """Seconds of a step of each, and steps of MoGlow in one of the flow's."""
    corpus = Corpus.open(where.corpus)
    contenders = {
        "stylized flow": flow(protocol),
        "MoGlow with the linear layer": moglow(protocol, predictor=True),
        "MoGlow": moglow(protocol, predictor=False),
    }
    turns = {name: stepper(variant, corpus, where) for name, variant in contenders.items()}
    seconds: dict[str, list[float]] = {name: [] for name in turns}
    for turn in turns.values():
        turn()  # compiles
    for _ in range(rounds):
        for name, turn in turns.items():
            began = time.perf_counter()
            turn()
            seconds[name].append((time.perf_counter() - began) / TURN)
    medians = {name: statistics.median(values) for name, values in seconds.items()}
    ours = medians["stylized flow"]
    return {"step_s": medians, "steps_in_one_of_ours": {name: ours / value for name, value in medians.items()}}


def main() -> None:
    """Measure both protocols and write the figures."""
    parser = arguments("Seconds of a training step")
    ted_arguments(parser)
    parser.add_argument("--rounds", type=int, default=5, help="turns of each (default: 5)")
    options = parser.parse_args()
    where = setting(options)
    ted = replace(where, corpus=options.corpus_ted, features=options.features_ted, perceptual=options.perceptual_ted)
    places = {"trinity": where, "ted": ted}
    found = {name: measure(name, place, options.rounds) for name, place in places.items() if place.corpus is not None}
    print(found)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    write_json(results("stylized_flow") / "step_time.json", {"cores": cores, "rounds": options.rounds, **found})


if __name__ == "__main__":
    main()
