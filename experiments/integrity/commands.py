"""The commands that are killed, on tiny settings, and the files that they are made from."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.talker.recordings import talk

_CORPUS = "prepare talker --minutes 2 --speakers ada --emotions neutral,happiness --workers 1 --out"
_STEPS = "--steps 24 --checkpoint-every 4 --validate-every 8 --log-every 4 --batch-size 4"
_TINY = (
    "--audio-channels 8,8 --motion-channels 8,8 --decoder-channels 8,8 --head-channels 8 --code-channels 4"
    " --clip-frames 16 --specific-frames 1 --specific-jitter 0 --smoothing 0 --stored-codes false"
    f" --adversarial-steps 0 {_STEPS}"
)
_FLOW = f"--flow-steps 2 --hidden 8 --clip-frames 80 --lookahead-frames 36 --audio-channels 8 {_STEPS}"


class Command(NamedTuple):
    """A command of the campaign."""

    name: str
    arguments: tuple[str, ...]
    """Without the output, which is last."""
    output: str
    """Name of the file or folder that it writes."""
    again: tuple[str, ...] = ()
    """Further arguments of every call."""
    run: bool = False
    """Whether the output is a run."""


class Inputs(NamedTuple):
    """What the commands need, in a folder."""

    folder: Path

    @property
    def corpus(self) -> Path:
        """A corpus of two minutes."""
        return self.folder / "corpus"

    @property
    def run(self) -> Path:
        """A run of Audio2Gestures on it."""
        return self.folder / "run"


def make_inputs(folder: Path) -> Inputs:
    """The inputs, made once."""
    inputs = Inputs(folder)
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / "speech.wav").is_file():
        take = talk(4.0, 5)
        write_bvh(folder / "take.bvh", take.motion)
        write_audio(folder / "speech.wav", take.audio, take.sample_rate)
    if not inputs.corpus.is_dir():
        _finished([*_CORPUS.split(), str(inputs.corpus)])
    trained = ["train", "audio2gestures", "--corpus", str(inputs.corpus), *_TINY.split(), "--resume"]
    _finished([*trained, "--out", str(inputs.run)])
    return inputs


def commands(inputs: Inputs) -> tuple[Command, ...]:
    """All commands of the campaign."""
    corpus, speech = str(inputs.corpus), str(inputs.folder / "speech.wav")
    talker = "prepare talker --minutes 0.5 --speakers ada --emotions neutral,anger --workers 1"
    train = ("--corpus", corpus)
    return (
        Command("prepare", tuple(talker.split()), "corpus"),
        Command(
            "train audio2gestures", ("train", "audio2gestures", *train, *_TINY.split()), "run", ("--resume",), True
        ),
        Command("train stylized_flow", ("train", "stylized_flow", *train, *_FLOW.split()), "run", ("--resume",), True),
        Command(
            "generate",
            ("generate", str(inputs.run), "--audio", speech, "--samples", "3", "--formats", "bvh,npz,html"),
            "out",
        ),
        Command("evaluate", ("evaluate", "--corpus", corpus, "--samples", "1"), "report"),
        Command("retarget", ("retarget", str(inputs.folder / "take.bvh"), "--to", "body"), "moved.bvh"),
    )


def start(arguments: Sequence[str]) -> subprocess.Popen:
    """A command as a process of its own."""
    line = [sys.executable, "-m", "a2g_jax.cli", *arguments]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    return subprocess.Popen(line, **quiet, env={**os.environ, "JAX_PLATFORMS": "cpu"})


def _finished(arguments: Sequence[str]) -> None:
    process = start(arguments)
    _, errors = process.communicate()
    if process.returncode:
        raise RuntimeError(f"a2g {' '.join(arguments)}: {errors.decode()[-400:]}")
