"""Generations of the experiment: runs, speeches and options of the command line."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2g_jax.io.audio import read_audio, write_audio
from a2g_jax.talker.demo_speech import demo_speech
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from a2g_jax.training.run import Run
from experiments.bodies.clips import ABSURD

RATE = 16_000
#: Seconds of most speeches, and of the long ones.
SECONDS, LONG = 12.0, 60.0
SEED = 3100
#: Low and high values of a control, as ``--control`` takes them.
LOW, HIGH = "0.05", "0.95"


@dataclass(frozen=True)
class Case:
    """One call of ``a2g generate``."""

    run: str
    group: str
    speech: str
    flags: tuple[str, ...] = ()
    samples: int = 6
    seed: int = 0

    @property
    def name(self) -> str:
        """Description, unique among the cases."""
        flags = " ".join(Path(flag).name if "/" in flag else flag for flag in self.flags)
        return f"{self.run}, {self.speech}, seed {self.seed}" + (f", {flags}" if flags else "")


def write_speeches(folder: Path, real: Path | None) -> dict[str, Path]:
    """WAV files of the speeches by name, written once.

    Args:
        real: folder of real recordings; None for generated speeches only.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(SEED)
    makers = {
        speaker: lambda speaker=speaker, seed=seed: talk(SECONDS, SEED + seed, speaker=speaker).audio
        for seed, speaker in enumerate(SPEAKERS)
    }
    makers["the demo's"] = lambda: demo_speech().audio
    makers["long"] = lambda: talk(LONG, SEED + 50, speaker="elif").audio
    makers["noise"] = lambda: rng.normal(0.0, 0.1, int(SECONDS * RATE)).astype(np.float32)
    makers["silence"] = lambda: np.zeros(int(SECONDS * RATE), np.float32)
    for name, path in REAL_SPEECHES.items():
        if real is not None and (real / path).is_file():
            makers[name] = lambda path=path: read_audio(real / path, RATE)[: int(SECONDS * RATE)]
    paths = {name: folder / f"{name.replace(' ', '_')}.wav" for name in makers}
    for name, path in paths.items():
        if not path.exists():
            write_audio(path, makers[name](), RATE)
    return paths


REAL_SPEECHES = {
    "Kennedy": "speech/jfk.wav",
    "BEAT": "beat/2_scott_0_1_1.wav",
    "ZeroEGGS": "zeggs/067_Speech_2_x_1_0.wav",
}
REAL_CLIPS = {"BEAT": "beat/2_scott_0_1_1.bvh", "ZeroEGGS": "zeggs/067_Speech_2_x_1_0.bvh"}


def cases(runs: dict[str, Run], speeches: dict[str, Path], clips: dict[str, Path]) -> Iterator[Case]:
    """All cases; options that a run does not take are refused, which is an outcome as well.

    Args:
        clips: BVH files by name, real and generated.
    """
    for name, run in runs.items():
        for number, speech in enumerate(speeches):
            yield Case(name, "plain", speech, samples=2 if speech == "long" else 6, seed=number)
        speech = "Kennedy" if "Kennedy" in speeches else "chiara"
        for number, flags in enumerate(_settings(run)):
            yield Case(name, "settings and controls", speech, flags, 4, number)
        for number, flags in enumerate(_pins(clips)):
            absurd = any(key in flags[1] for key in map(_file, ABSURD))
            yield Case(name, "absurd pins" if absurd else "pins", speech, flags, 2, number)
        # A run without latents of frames refuses all styles for one reason.
        for number, flags in enumerate(_styles(clips) if run.config.build().encode else ()):
            absurd = any(key in flags[1] for key in map(_file, ABSURD))
            samples = 1 if "--style-share" in flags and flags[flags.index("--style-share") + 1] == "1" else 2
            yield Case(name, "absurd styles" if absurd else "styles and seed clips", speech, flags, samples, number)


def _file(name: str) -> str:
    return name.replace(" ", "_") + ".bvh"


def _settings(run: Run) -> Iterator[tuple[str, ...]]:
    """Settings of generation at their usual and at extreme values."""
    settings = run.config.sampling_settings
    values = {
        "noise_scale": ("0.5", "1.5"),
        "edits": ("specific scale 0:128 2", "shared scale 0:128 1.5"),
        "keep_shared": ("8",),
        "temperature": ("0.7", "1.15", "1.4"),
        "denoise": ("true",),
    }
    for name, chosen in values.items():
        if hasattr(settings, name):
            flag = {"edits": "--edit"}.get(name, f"--{name.replace('_', '-')}")
            yield from ((flag, value) for value in chosen)
    controls = run.config.build().controls
    # Models that name the values of a control, such as emotions, list them.
    named = getattr(controls, "categories", {})
    for name in controls.names if controls else ():
        if name in named:
            yield from (("--control", f"{name}={value}") for value in named[name])
            continue
        yield from (("--control", f"{name}={value}") for value in (LOW, HIGH))
        yield "--control", f"{name}={LOW}@0,{HIGH}@5,{LOW}@10"
    if controls:
        yield tuple(part for name in controls.names if name not in named for part in ("--control", f"{name}={HIGH}"))


def _pins(clips: dict[str, Path]) -> Iterator[tuple[str, ...]]:
    for name, path in clips.items():
        yield "--pin", f"{path}@3+3" if name not in ABSURD else f"{path}@3"
    real = [path for name, path in clips.items() if name in REAL_CLIPS] or list(clips.values())[:2]
    yield "--pin", f"{real[0]}@0+2"
    yield "--pin", f"{real[-1]}@1+2", "--pin", f"{real[0]}@5+3"


def _styles(clips: dict[str, Path]) -> Iterator[tuple[str, ...]]:
    yield from (("--style", str(path)) for path in clips.values())
    for name in REAL_CLIPS:
        if name in clips:
            yield "--style", str(clips[name]), "--style-share", "0.5"
            yield "--style", str(clips[name]), "--style-share", "1"
            yield "--style", str(clips[name]), "--style-mode", "statistics"
            yield "--seed-clip", str(clips[name])
