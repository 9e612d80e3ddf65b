"""One training step of the stylized flow or MoGlow: ours and an eager PyTorch twin's.

A step computes bits per frame and their gradients, clips those and updates by Adam, on a fixed batch; the stylized
flow's also with the reverse pass, which one batch in five takes. The perceptual loss is omitted.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from experiments.benchmarks.measure import load_torch
from experiments.benchmarks.turns import Call, Case, product_flop


def case(name: str, batch: int = 0, reverse: bool = False, recompute: bool = False, seed: int = 0) -> Case:
    """The case of a model on a data set.

    Args:
        batch: clips; as published if 0.
        reverse: with the reverse pass.
        recompute: the states of recurrent layers in the backward pass, by ours alone.
    """
    import jax
    import jax.numpy as jnp
    import numpy as np

    from a2g_jax.data.batch import Batch
    from a2g_jax.models.registry import find_model
    from a2g_jax.models.stylized_flow.model import build
    from experiments.benchmarks.flow_workload import CASES

    case = CASES[name]
    config = replace(case.config, reverse_share=1.0 if reverse else 0.0, recompute=recompute)
    settings = find_model("stylized_flow").training_preset(case.preset)
    clips, rng = batch or case.batch, np.random.default_rng(seed)
    # Random walks, so that neighbouring frames are similar.
    steps = rng.normal(0, 0.1, (clips, config.clip_frames, case.rows, 3))
    pose = np.sin(np.cumsum(steps, axis=1)).astype(np.float32)
    audio = rng.normal(size=(clips, config.clip_frames, case.bands)).astype(np.float32)
    contenders: dict[str, Callable[[], Call]] = {
        "a2g_jax": lambda: _ours(case, config, settings, pose, audio, seed),
        "torch_eager": lambda: _twin(case, config, settings, pose, audio, seed),
    }
    # The least work: without what is computed twice.
    model = build(replace(config, recompute=False), case.data)
    params = jax.eval_shape(model.init, jax.random.key(0))
    update, clip = model.stages[0].updates[0], Batch(jnp.zeros_like(audio), jnp.zeros_like(pose))
    loss = lambda params: update.loss(params, jax.random.key(0), clip, jnp.int32(0))  # noqa: E731
    flop = product_flop(jax.value_and_grad(loss, has_aux=True), params)
    return Case(contenders, flop, about={"title": case.title, "clips": clips, "reverse": reverse})


def _ours(case: Any, config: Any, settings: Any, pose: Any, audio: Any, seed: int) -> Call:
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

    def call() -> None:
        nonlocal state
        state, _ = jax.block_until_ready(step(state, jax.random.fold_in(state.key, state.step)))

    return call


def _twin(case: Any, config: Any, settings: Any, pose: Any, audio: Any, seed: int) -> Call:
    torch = load_torch()
    import jax
    from torch.nn import utils

    from a2g_jax.models.stylized_flow.networks import FlowNetworks
    from experiments.benchmarks.torch_flow import Twin
    from experiments.benchmarks.torch_flow_weights import load_params

    torch.manual_seed(seed)
    twin = Twin(config, case.channels, case.bands)
    networks = FlowNetworks(config, case.data)
    # The actnorms set from the batch, as ours are.
    fitted = jax.jit(lambda key, audio, pose: networks.fitted(networks.init(key), audio, networks.flat(pose)))
    params = fitted(jax.random.key(seed), jax.device_put(audio), jax.device_put(pose))
    load_params(twin, params)
    del params
    adam = torch.optim.Adam(twin.parameters(), lr=settings.learning_rate / settings.warmup_steps, fused=True)
    flat, audio_features = torch.from_numpy(pose).flatten(2), torch.from_numpy(audio)
    inner = config.clip_frames - config.history_frames - config.lookahead_frames

    def call() -> None:
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

    return call
