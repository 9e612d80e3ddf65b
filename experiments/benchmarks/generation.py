"""Generating motions with random weights: from mel features to the joint positions of every frame.

Ours goes through ``Generator`` as a user's call does: in windows with context, and with the root path that plants the
feet and the legs that lock them, which the twin omits; ``planted=False`` omits both in ours too. The twin takes the
whole audio in one piece, and one sample after another. The audio is encoded once for all samples.
"""

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from experiments.benchmarks.measure import load_torch
from experiments.benchmarks.turns import Call, Case, product_flop

#: Rows of the table of latent statistics that samples draw from.
_CLIPS = 64


def case(samples: int, frames: int, planted: bool = True, seed: int = 0) -> Case:
    """So many samples of so many frames, at 30 a second, with the preset ``paper`` on 22 joints.

    Args:
        planted: whether ours plants and locks the feet.
    """
    import numpy as np

    from experiments.benchmarks.workload import make_corpus, run_config

    with tempfile.TemporaryDirectory() as folder:
        corpus = make_corpus(Path(folder), 2000, 22, seed)
        config = run_config(corpus, "paper", 1, 128, seed)
    features = np.random.default_rng(seed).normal(size=(frames, config.mel.width)).astype(np.float32)
    contenders: dict[str, Callable[[], Call]] = {
        "a2g_jax": lambda: _ours(config, features, samples, planted, seed),
        "torch_eager": lambda: _theirs(config, features, samples, seed, False),
        "torch_compiled": lambda: _theirs(config, features, samples, seed, True),
    }
    # Read once a sample: the features; written: the positions.
    written = 4.0 * samples * frames * 22 * 3
    about = {"samples": samples, "frames": frames, "audio_s": frames / config.fps, "planted": planted}
    return Case(contenders, _flop(config, samples, frames), features.nbytes + written, about=about)


def _flop(config: Any, samples: int, frames: int) -> float:
    """Of encoding the audio once, and of mapping and decoding every sample, without any context around windows."""
    import jax
    import jax.numpy as jnp

    from a2g_jax.models.audio2gestures.codec import Codec

    codec = Codec(config.model_config, config.data())
    params = jax.eval_shape(codec.init, jax.random.key(0))
    code, audio = jnp.zeros((1, frames, config.model_config.code_channels)), jnp.zeros((1, frames, config.mel.width))
    one = product_flop(lambda p: codec.decode(p, code, codec.map_noise(p, code).mean), params)
    return product_flop(lambda p: codec.encode_audio(p, audio), params) + samples * one


def _ours(config: Any, features: Any, samples: int, planted: bool, seed: int) -> Call:
    import jax
    import numpy as np

    from a2g_jax.generation.generator import Generator
    from a2g_jax.geometry.motion import Motion
    from a2g_jax.geometry.pose_rows import rotations_from_rows
    from a2g_jax.training.run import Run

    rng, code = np.random.default_rng(seed), config.model_config.code_channels
    summary = {
        "specific_mean": rng.normal(size=(_CLIPS, code)).astype(np.float32),
        "specific_std": rng.uniform(0.5, 1.5, (_CLIPS, code)).astype(np.float32),
    }
    generator = Generator(Run(config, jax.jit(config.build().init)(jax.random.key(seed)), summary, 0))

    def motions() -> Iterator[Any]:
        if planted:
            yield from generator.stream_features(features, samples, seed)
            return
        root = np.zeros((len(features), 3), np.float32)
        for rows in generator.rows(features, samples, seed):
            yield Motion(rotations_from_rows(rows, config.space.kind), root, config.skeleton, config.fps)

    def call() -> None:
        for motion in motions():
            motion.positions()

    return call


def _theirs(config: Any, features: Any, samples: int, seed: int, compiled: bool) -> Call:
    torch = load_torch()
    from experiments.benchmarks.torch_twin import Gaussian, Twin

    torch.manual_seed(seed)
    twin = Twin(config.model_config, config.skeleton, config.mel.width).eval()
    audio, code = torch.from_numpy(features), config.model_config.code_channels
    means, stds = torch.randn(_CLIPS, code), torch.rand(_CLIPS, code) + 0.5

    def encode(audio: Any) -> Any:
        return twin.audio_encoder(audio[None].transpose(1, 2))

    def decode(mean: Any, log_variance: Any, row: Any, noise: Any) -> Any:
        around = means[row][:, :, None], stds[row][:, :, None]
        return twin.positions(twin.generate(Gaussian(mean, log_variance), *around, tuple(noise)))

    if compiled:
        encode, decode = torch.compile(encode), torch.compile(decode)

    @torch.inference_mode()
    def call() -> None:
        shared = encode(audio)
        for _ in range(samples):
            row = torch.randint(_CLIPS, (1,))
            decode(*shared, row, torch.randn(3, 1, code, len(audio))).numpy()

    return call
