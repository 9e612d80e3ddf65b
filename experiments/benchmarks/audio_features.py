"""Log-mel features of a speech: ours on NumPy, and PyTorch's short-time Fourier transform with the same mel filters."""

from collections.abc import Callable

from experiments.benchmarks.measure import load_torch
from experiments.benchmarks.turns import Call, Case


def case(seconds: float, seed: int = 0) -> Case:
    """So many seconds of noise at 16 kHz, to 30 frames a second."""
    import numpy as np

    from a2g_jax.features.mel import MelConfig
    from experiments.benchmarks.workload import FPS

    config, frames = MelConfig(), round(seconds * FPS)
    samples = round(seconds * config.sample_rate)
    audio = np.random.default_rng(seed).normal(0, 0.1, samples).astype(np.float32)

    def ours() -> Call:
        from a2g_jax.features.mel import log_mel

        return lambda: log_mel(audio, config, FPS, frames)

    def theirs() -> Call:
        torch = load_torch()
        from a2g_jax.features.mel_filters import mel_filters

        high = config.sample_rate / 2
        filters = torch.from_numpy(
            np.asarray(mel_filters(config.sample_rate, config.window, config.bands, config.low_hz, high), np.float32)
        )
        window = torch.hann_window(config.window)
        hop = round(config.sample_rate / FPS)

        @torch.inference_mode()
        def call() -> None:
            spectrum = torch.stft(torch.from_numpy(audio), config.window, hop, window=window, return_complex=True)
            decibel = 10.0 * torch.log10((filters @ spectrum.abs().square()).clamp(min=1e-10))
            decibel.clamp(min=float(decibel.max()) - config.range_db).numpy()

        return call

    contenders: dict[str, Callable[[], Call]] = {"a2g_jax": ours, "torch_eager": theirs}
    # 5 N log2 N a transform, and the filters.
    bins = config.window // 2 + 1
    flop = frames * (2.5 * config.window * 11 + 2.0 * bins * config.bands)
    moved = audio.nbytes + 4.0 * frames * config.bands
    return Case(contenders, flop, moved, about={"audio_s": seconds, "frames": frames})
