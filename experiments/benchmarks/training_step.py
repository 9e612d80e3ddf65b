"""One training step of Audio2Gestures: ours, the PyTorch twin's, and one with the structure of the authors' code.

A step draws clips, gathers and normalises them, computes all losses and gradients, and updates weights by Adam. Ours is
the trainer's own compiled step, which also checks that everything is finite.
"""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from experiments.benchmarks.measure import load_torch
from experiments.benchmarks.turns import Call, Case, product_flop

#: Rows of the corpus, 5.5 minutes: enough that gathering clips is not one contiguous copy.
_CORPUS_FRAMES = 10_000
#: Joints of SMPL-X, and of the body alone.
_FULL, _BODY = 55, 22


def case(preset: str = "paper", seed: int = 0) -> Case:
    """The case of a preset's batch and clip length."""
    import numpy as np

    from a2g_jax.models.audio2gestures.config import PRESETS
    from a2g_jax.models.registry import find_model
    from experiments.benchmarks.workload import make_corpus, run_config

    frames = PRESETS[preset].clip_frames
    batch = find_model("audio2gestures").training_preset(preset).batch_size
    with tempfile.TemporaryDirectory() as folder:
        corpus = make_corpus(Path(folder), _CORPUS_FRAMES, _BODY, seed)
        # In memory: the folder is removed.
        arrays = {name: np.array(corpus.array(name)) for name in ("audio", "pose", "root")}
        config = run_config(corpus, preset, batch, frames, seed)
    contenders: dict[str, Callable[[], Call]] = {
        "a2g_jax": lambda: _ours(config, corpus, arrays),
        "torch_eager": lambda: _theirs(config, corpus, arrays, "eager"),
        "torch_compiled": lambda: _theirs(config, corpus, arrays, "compiled"),
        "torch_authors": lambda: _theirs(config, corpus, arrays, "authors"),
    }
    return Case(contenders, flop=_flop(config, batch, frames), about={"batch": batch, "frames": frames})


def _flop(config: Any, batch: int, frames: int) -> float:
    """Of the products of the losses and their gradient."""
    import jax
    import jax.numpy as jnp

    from a2g_jax.data.batch import Batch

    model, data = config.build(), config.data()
    clips = Batch(jnp.zeros((batch, frames, data.audio_bands)), jnp.zeros((batch, frames, *data.space.shape)))
    params = jax.eval_shape(model.init, jax.random.key(0))
    loss = lambda params: model.stages[0].updates[0].loss(params, jax.random.key(0), clips, jnp.int32(0))  # noqa: E731
    return product_flop(jax.value_and_grad(loss, has_aux=True), params)


def _ours(config: Any, corpus: Any, arrays: dict[str, Any]) -> Call:
    import jax

    from a2g_jax.data.batch import clip_shape
    from a2g_jax.data.batches import find_crops
    from a2g_jax.data.on_demand import Part
    from a2g_jax.training.loop import step_programs
    from a2g_jax.training.stages import stage_spans
    from a2g_jax.training.state import init_state

    model, settings = config.build(), config.train_config
    crops = find_crops(corpus, "train", model.clip_frames)
    shape = clip_shape(model.batch_fields, model.clip_frames, corpus.fps, corpus.mel.sample_rate)
    spans = stage_spans(model, settings)
    part = Part({name: arrays[name] for name in shape.arrays}, corpus.segments("train"))
    step = step_programs(spans[0], shape, crops, config)(part)
    state = init_state(model, spans, settings.seed)

    def call() -> None:
        nonlocal state
        state, _ = jax.block_until_ready(step(state))

    return call


def _theirs(config: Any, corpus: Any, arrays: dict[str, Any], kind: str) -> Call:
    torch = load_torch()
    from experiments.benchmarks.torch_authors import AuthorsTwin
    from experiments.benchmarks.torch_twin import Noise, Twin
    from experiments.benchmarks.workload import make_skeleton

    torch.manual_seed(config.train_config.seed)
    settings, training = config.model_config, config.train_config
    if kind == "authors":
        full = make_skeleton(_FULL, training.seed)
        twin: Twin = AuthorsTwin(settings, corpus.skeleton, full, corpus.mel.width)
    else:
        twin = Twin(settings, corpus.skeleton, corpus.mel.width)
    adam = torch.optim.Adam(twin.parameters(), lr=training.learning_rate, fused=True)
    audio, pose = torch.from_numpy(arrays["audio"]), torch.from_numpy(arrays["pose"])
    statistics = config.statistics["audio"]
    mean, std = torch.from_numpy(statistics.mean), torch.from_numpy(statistics.std)
    frames, clips = settings.clip_frames, training.batch_size
    compute = torch.compile(twin.terms) if kind == "compiled" else twin.terms
    step = 0

    def call() -> None:
        nonlocal step
        rows = torch.randint(0, len(audio) - frames + 1, (clips, 1)) + torch.arange(frames)
        noise = Noise.draw(clips, settings.code_channels, frames)
        adam.zero_grad(set_to_none=True)
        terms = compute((audio[rows] - mean) / std, pose[rows], noise)
        # Losses of weight zero are computed, for the log, but not differentiated.
        weights = twin.weights(step)
        loss = sum(weights[name] * terms[name] for name in terms if weights.get(name, 0.0) != 0.0)
        loss.backward()
        adam.step()
        step += 1

    return call
