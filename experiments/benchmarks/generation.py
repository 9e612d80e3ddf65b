"""Time and memory of generating long motions with random weights: ours, the PyTorch twin's, and the compiled twin's.

From mel features to the joint positions of every frame: encoded audio, codes, decoded motion, rotation matrices,
forward kinematics. The audio is encoded once for all samples. Extracting the mel features is timed on its own.
"""

import argparse
import tempfile
from pathlib import Path
from typing import Any

from experiments.benchmarks import measure

CONTENDERS = ("a2g_jax", "torch_eager", "torch_compiled")
#: Rows of the table of latent statistics that samples draw from.
SUMMARY_CLIPS = 64


def main() -> None:
    """Command line: without ``--contender``, runs each in turn and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--preset", default="paper", choices=("paper",))
    parser.add_argument("--frames", type=int, default=5000, help="at 30 a second (default %(default)s: 166 s)")
    parser.add_argument("--samples", type=int, default=20, help="besides a single one (default %(default)s)")
    parser.add_argument(
        "--joints", type=int, default=22, choices=(22, 55), help="of the skeleton (default %(default)s)"
    )
    parser.add_argument("--repeats", type=int, default=10, help="runs timed (default %(default)s)")
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
    names = ("preset", "frames", "samples", "joints", "repeats", "seed")
    arguments = [part for name in names for part in (f"--{name}", str(getattr(options, name)))]
    results = [
        {"contender": name, **measure.run_alone("experiments.benchmarks.generation", name, arguments)}
        for name in options.contenders.split(",")
    ]
    rows = [row for result in results for row in _rows(result)]
    base = {row["work"]: row["median_s"] for row in rows if row["contender"] == "a2g_jax" and "work" in row}
    for row in rows:
        if "median_s" in row and row["work"] in base:
            row["ratio"] = row["median_s"] / base[row["work"]]
    columns = {
        "contender": "",
        "work": "work",
        "median_s": "median, s",
        "min_s": "min",
        "max_s": "max",
        "ratio": "x ours",
        "first_s": "first call with compilation, s",
        "peak_mb": "peak memory of all, MB",
        "before_mb": "of it before the first call",
        "others_share": "share of the cores others took",
    }
    measure.print_table(rows, columns)
    settings = {name: getattr(options, name) for name in names}
    print(f"\nwritten to {measure.write_results('generation', settings, rows, options.out)}")


def _rows(result: dict[str, Any]) -> list[dict[str, Any]]:
    if "failed" in result:
        return [result]
    peak = {"contender": result["contender"], "peak_mb": result["peak_mb"]}
    return [{**peak, "work": work, **figures} for work, figures in result["works"].items()]


def _one(options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    from experiments.benchmarks.workload import make_corpus, run_config

    corpus = make_corpus(folder, 2000, options.joints, options.seed)
    config = run_config(corpus, options.preset, 1, 128, options.seed)
    contender = _ours if options.contender == "a2g_jax" else _twin
    return {"works": contender(config, options)}


def _features(options: argparse.Namespace, bands: int) -> Any:
    import numpy as np

    return np.random.default_rng(options.seed).normal(size=(options.frames, bands)).astype(np.float32)


def _ours(config: Any, options: argparse.Namespace) -> dict[str, Any]:
    import jax
    import numpy as np

    from a2g_jax.features.mel import log_mel
    from a2g_jax.generation.generator import Generator
    from a2g_jax.training.run import Run

    rng = np.random.default_rng(options.seed)
    code = config.model_config.code_channels
    summary = {
        "specific_mean": rng.normal(size=(SUMMARY_CLIPS, code)).astype(np.float32),
        "specific_std": rng.uniform(0.5, 1.5, (SUMMARY_CLIPS, code)).astype(np.float32),
    }
    generator = Generator(Run(config, config.build().init(jax.random.key(options.seed)), summary, 0))
    features = _features(options, config.mel.width)
    audio = rng.normal(0, 0.1, round(options.frames / config.fps * config.mel.sample_rate)).astype(np.float32)

    def positions(samples: int) -> None:
        for motion in generator.stream_features(features, samples, options.seed):
            motion.positions()

    works = {"1 sample": measure.measure(lambda: positions(1), options.repeats)}
    works[f"{options.samples} samples"] = measure.measure(lambda: positions(options.samples), options.repeats, 0)
    mel = measure.measure(lambda: log_mel(audio, config.mel, config.fps, options.frames), options.repeats)
    return {**works, "mel features": mel}


def _twin(config: Any, options: argparse.Namespace) -> dict[str, Any]:
    import torch

    from experiments.benchmarks.torch_twin import Gaussian, Twin

    torch.set_num_threads(measure.THREADS)
    torch.manual_seed(options.seed)
    twin = Twin(config.model_config, config.skeleton, config.mel.width).eval()
    features = torch.from_numpy(_features(options, config.mel.width))
    code = config.model_config.code_channels
    means, stds = torch.randn(SUMMARY_CLIPS, code), torch.rand(SUMMARY_CLIPS, code) + 0.5

    def encode(audio: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return twin.audio_encoder(audio[None].transpose(1, 2))

    def decode(
        audio_mean: torch.Tensor, audio_log_variance: torch.Tensor, row: torch.Tensor, noise: torch.Tensor
    ) -> torch.Tensor:
        mean, std = means[row][:, :, None], stds[row][:, :, None]
        rotations = twin.generate(Gaussian(audio_mean, audio_log_variance), mean, std, tuple(noise))
        return twin.positions(rotations)

    if options.contender == "torch_compiled":
        encode, decode = torch.compile(encode), torch.compile(decode)

    @torch.inference_mode()
    def positions(samples: int) -> None:
        shared = encode(features)
        for _ in range(samples):
            row = torch.randint(SUMMARY_CLIPS, (1,))
            decode(*shared, row, torch.randn(3, 1, code, options.frames)).numpy()

    works = {"1 sample": measure.measure(lambda: positions(1), options.repeats)}
    works[f"{options.samples} samples"] = measure.measure(lambda: positions(options.samples), options.repeats, 0)
    return works


if __name__ == "__main__":
    main()
