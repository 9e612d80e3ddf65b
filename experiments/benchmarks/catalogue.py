"""All benchmarks by name: where they are, what they take, and the targets that they are held to."""

import importlib
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from experiments.benchmarks.turns import Case


class Target(NamedTuple):
    """A bound on a figure of ours."""

    kind: str
    """``ratio``: a contender's time over ours, at least; ``floor``: our time over the floor, at most; ``memory``: our
    peak memory over a contender's, at most; ``megabytes``: our peak memory, at most; ``speed``: seconds of motion a
    second, at least."""
    value: float
    contender: str = "torch_eager"


class Benchmark(NamedTuple):
    """One row of the table."""

    title: str
    module: str
    """In this package; ``commands`` for processes."""
    settings: Mapping[str, Any] = MappingProxyType({})
    targets: tuple[Target, ...] = ()
    rounds: int = 5
    """Turns of every contender."""

    def case(self) -> Case:
        """What is measured; imports JAX."""
        return importlib.import_module(f"experiments.benchmarks.{self.module}").case(**self.settings)


#: Contenders beside ours in the benchmarks that are not commands; not every benchmark has all of them.
TWINS = ("torch_eager", "torch_compiled", "torch_authors", "torch_precomputed")
_FLOW = {"name": "moglow"}
BENCHMARKS: dict[str, Benchmark] = {
    "kinematics-22": Benchmark(
        "6D and kinematics with gradient, 22 joints", "kinematics", {"joints": 22}, (Target("ratio", 5.0),), 20
    ),
    "kinematics-55": Benchmark(
        "6D and kinematics with gradient, 55 joints", "kinematics", {"joints": 55}, (Target("ratio", 5.0),), 20
    ),
    "audio2gestures-step": Benchmark(
        "training step of Audio2Gestures, paper",
        "training_step",
        {"preset": "paper"},
        (
            Target("ratio", 1.6, "torch_authors"),
            Target("ratio", 1.0, "torch_compiled"),
            Target("floor", 1.3),
            Target("memory", 1.0),
        ),
    ),
    "moglow-step": Benchmark(
        "training step of MoGlow, as published", "flow_training", _FLOW,
        (Target("ratio", 1.5),), 2,
    ),
    "moglow-step-recompute": Benchmark(
        "the same with `--recompute true`", "flow_training", {**_FLOW, "recompute": True},
        (Target("megabytes", 4000),), 2,
    ),
    "moglow-step-8": Benchmark(
        "training step of MoGlow, 8 clips", "flow_training", {**_FLOW, "batch": 8}, (Target("ratio", 1.5),), 3
    ),
    "flow-step": Benchmark(
        "training step of the stylized flow, 8 clips", "flow_training", {"name": "trinity", "batch": 8},
        (Target("ratio", 1.5),), 3,
    ),
    "flow-step-reverse": Benchmark(
        "the same with the reverse pass", "flow_training", {"name": "trinity", "batch": 8, "reverse": True},
        (Target("ratio", 1.5),), 3,
    ),
    "emotion-step": Benchmark(
        "training step of EmotionGesture, 8 clips", "emotion_training", {"preset": "paper", "batch": 8}, (), 3
    ),
    "generation-1": Benchmark(
        "1 sample of 5000 frames", "generation", {"samples": 1, "frames": 5000}, (Target("ratio", 1.5),)
    ),
    "generation-1-unplanted": Benchmark(
        "the same without planted feet, as the twin",
        "generation", {"samples": 1, "frames": 5000, "planted": False}, (Target("ratio", 1.5),)
    ),
    "generation-20": Benchmark(
        "20 samples of 5000 frames", "generation", {"samples": 20, "frames": 5000}, (Target("ratio", 2.0),), 3
    ),
    "generation-20-unplanted": Benchmark(
        "the same without planted feet, as the twin",
        "generation", {"samples": 20, "frames": 5000, "planted": False}, (Target("ratio", 2.0),), 3
    ),
    "generation-short": Benchmark("1 sample of 3 seconds", "generation", {"samples": 1, "frames": 90}, (), 10),
    "flow-sampling-1": Benchmark(
        "sampling from MoGlow, 1 sequence", "flow_sampling", {**_FLOW, "sequences": 1, "frames": 200},
        (Target("floor", 1.2),), 3,
    ),
    "flow-sampling-20": Benchmark(
        "sampling from MoGlow, 20 sequences", "flow_sampling", {**_FLOW, "sequences": 20, "frames": 100},
        (Target("speed", 2.0),), 3,
    ),
    "features": Benchmark("log-mel features of 166 s", "audio_features", {"seconds": 5000 / 30.0}, ()),
    "import": Benchmark("import", "commands", rounds=3),
    "demo": Benchmark("a2g demo", "commands", rounds=2),
    "generate": Benchmark("a2g generate demo-flow, 3 s of speech", "commands", rounds=2),
    "prepare": Benchmark("a2g prepare, 4 minutes of BVH", "commands", rounds=1),
    "evaluate": Benchmark("a2g evaluate, 3 samples", "commands", rounds=1),
}  # fmt: skip
