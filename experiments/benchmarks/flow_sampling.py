"""Sampling from the stylized flow or MoGlow with random weights, frame by frame: ours and an eager PyTorch twin's.

From audio features to z-scores of poses for one audio, with the latents given. The twin takes the whole condition
through its recurrent layers at every frame, or has the audio's share of their gates precomputed, as ours. All invert
the matrices once. The floor reads the weights once a frame, and computes their products.
"""

from collections.abc import Callable
from typing import Any

from experiments.benchmarks.measure import load_torch
from experiments.benchmarks.turns import Call, Case


def case(name: str, sequences: int, frames: int, seed: int = 0) -> Case:
    """So many frames of so many sequences at once."""
    import jax
    import numpy as np

    from a2g_jax.models.stylized_flow.networks import FlowNetworks
    from experiments.benchmarks.flow_workload import CASES, moved

    case = CASES[name]
    networks = FlowNetworks(case.config, case.data)
    params = moved(jax.jit(networks.init)(jax.random.key(seed)), seed)
    rng = np.random.default_rng(seed)
    audio = rng.normal(size=(frames, case.bands)).astype(np.float32)
    z = rng.normal(size=(sequences, frames, case.channels)).astype(np.float32)
    contenders: dict[str, Callable[[], Call]] = {
        "a2g_jax": lambda: _bound(_ours(networks, params), z, audio),
        "torch_eager": lambda: _bound(_twin(case, params, False), z, audio),
        "torch_precomputed": lambda: _bound(_twin(case, params, True), z, audio),
    }
    read = float(_bytes_of_a_frame(params)) * frames
    about = {"title": case.title, "sequences": sequences, "frames": frames, "audio_s": frames / case.fps}
    return Case(contenders, read / 4 * 2 * sequences, read=read, about=about)


def _bound(sample: Callable[..., Any], z: Any, audio: Any) -> Call:
    return lambda: sample(z, audio)


def _bytes_of_a_frame(params: Any) -> int:
    """Bytes of the weights that every frame needs: all but those that multiply audio."""
    import jax

    couplings, encoder = params["glow"]["coupling"], params.get("global_encoder", {})
    needed = [couplings, [part for name, part in encoder.items() if name != "audio"]]
    count = sum(leaf.size for leaf in jax.tree.leaves(needed)) - couplings["layer_0"]["known_kernel"].size
    return 4 * (count + params["glow"]["invertible"]["lower"].size)


def _ours(networks: Any, params: Any) -> Callable[..., Any]:
    from functools import partial

    import jax
    import numpy as np

    from a2g_jax.models.stylized_flow.autoregression import proceed, start

    condition = jax.jit(networks.audio_context)
    begin, onward = jax.jit(partial(start, networks), static_argnums=1), jax.jit(partial(proceed, networks))

    def sample(z: Any, audio: Any) -> Any:
        latents, given = np.ascontiguousarray(z.swapaxes(0, 1)), condition(params, audio)
        return np.asarray(onward(params, latents, given, begin(params, len(z)), np.int32(0))[0])

    return sample


def _twin(case: Any, params: Any, precompute: bool) -> Callable[..., Any]:
    torch = load_torch()
    from experiments.benchmarks.torch_flow import Twin
    from experiments.benchmarks.torch_flow_weights import load_params

    twin = Twin(case.config, case.channels, case.bands).eval()
    load_params(twin, params)
    return lambda z, audio: twin.sample(torch.from_numpy(z), torch.from_numpy(audio), precompute).numpy()
