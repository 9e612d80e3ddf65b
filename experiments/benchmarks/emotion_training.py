"""One training step of EmotionGesture's game (discriminator, generator, average); there is no PyTorch twin of it."""

from collections.abc import Callable
from typing import Any

from experiments.benchmarks.turns import Call, Case, product_flop


def case(preset: str, batch: int = 0, seed: int = 0) -> Case:
    """The case of a preset on 22 joints.

    Args:
        batch: clips; those of the preset's training if 0.
    """
    import jax
    import jax.numpy as jnp
    import numpy as np

    from a2g_jax.data.batch import Batch
    from a2g_jax.features.statistics import Statistics
    from a2g_jax.geometry.pose_space import PoseSpace
    from a2g_jax.models.base import Data
    from a2g_jax.models.emotion_gesture.model import build
    from a2g_jax.models.registry import find_model
    from experiments.benchmarks.workload import FPS, make_skeleton

    entry = find_model("emotion_gesture")
    config, settings = entry.presets[preset], entry.training_preset(preset)
    clips, frames, rng = batch or settings.batch_size, config.clip_frames, np.random.default_rng(seed)
    space = PoseSpace(make_skeleton(22, seed))
    ones = Statistics(np.zeros(space.shape, np.float32), np.ones(space.shape, np.float32))
    data = Data(space, FPS, 64, ones, emotions=("neutral", "happiness", "sadness", "anger"))
    model = build(config, data)
    pose = np.cumsum(rng.normal(0, 0.02, (clips, frames, *space.shape)), axis=1).astype(np.float32)
    given = Batch(
        jnp.asarray(rng.normal(size=(clips, frames, data.audio_bands)), jnp.float32),
        jnp.asarray(pose + np.eye(3, dtype=np.float32)[:2].reshape(6)),
        emotion=jnp.asarray(rng.integers(0, len(data.emotions), clips)),
        words=jnp.asarray(rng.integers(0, 100, (clips, frames))),
        word_starts=jnp.asarray(rng.random((clips, frames)) < 0.1),
    )
    contenders: dict[str, Callable[[], Call]] = {"a2g_jax": lambda: _ours(model, settings, given, seed)}
    stage = next(stage for stage in model.stages if stage.name == "main")
    params = jax.eval_shape(model.init, jax.random.key(0))
    flop = sum(
        product_flop(
            jax.value_and_grad(lambda p, update=update: update.loss(p, jax.random.key(0), given, jnp.int32(0))[0]),
            params,
        )
        for update in stage.updates
        if update.name != "average"
    )
    return Case(contenders, flop, about={"preset": preset, "clips": clips, "frames": frames})


def _ours(model: Any, settings: Any, given: Any, seed: int) -> Call:
    import jax

    from a2g_jax.training.stages import stage_spans
    from a2g_jax.training.state import advance, init_state

    spans = stage_spans(model, settings)
    span = next(span for span in spans if span.stage.name == "main")
    state = init_state(model, spans, seed)._replace(step=jax.numpy.int32(span.first + 1))
    step = jax.jit(lambda state, key: advance(span, state, given, key), donate_argnums=0)

    def call() -> None:
        nonlocal state
        state, _ = jax.block_until_ready(step(state, jax.random.fold_in(state.key, state.step)))

    return call
