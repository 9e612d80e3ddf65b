"""Speeches of the table: held-out generated talk, and real recordings."""

import ast
import hashlib
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

import a2g_jax
from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.generation.clips import read_on_skeleton
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.audio import read_audio
from a2g_jax.metrics.rhythm import Agreement, energy_peaks, shifted_agreement, speech_envelope
from a2g_jax.recording import Recording
from a2g_jax.talker.recordings import cast, resample_motion, talk
from a2g_jax.talker.skeleton import TALKER_SKELETON
from a2g_jax.training.run import Run

#: The default talk: no run that is shipped or reported is trained on this seed.
MINUTES, SEED = 24.0, 77
#: All runs of this project take audio at this rate.
SAMPLE_RATE = 16000
#: Standard deviation of agreement, and time from a stroke's fastest moment to its syllable's peak in generated talk, s.
SIGMA, LEAD = 0.1, 0.15


@dataclass(frozen=True, eq=False)
class Speech:
    """One speech, with the motion of its speaker where there is one."""

    name: str
    audio: Float[np.ndarray, " N"]
    speaker: str
    truth: Motion | None
    """At the rate of the table."""
    recording: Recording | None = None
    """The generated recording; None for real speech."""

    @property
    def seconds(self) -> float:
        """Length of the audio."""
        return len(self.audio) / SAMPLE_RATE

    @cached_property
    def _envelopes(self) -> dict[tuple[float, int], Float[np.ndarray, " T"]]:
        return {}

    def envelope(self, fps: float, frames: int) -> Float[np.ndarray, " T"]:
        """Level at a motion's frames, dB; computed once."""
        if (fps, frames) not in self._envelopes:
            self._envelopes[fps, frames] = speech_envelope(self.audio, SAMPLE_RATE, fps, frames)
        return self._envelopes[fps, frames]

    def agreement(self, motion: Motion) -> Agreement:
        """Agreement of a motion with the speech, and with the speech shifted."""
        peaks = energy_peaks(self.envelope(motion.fps, motion.frames), motion.fps)
        return shifted_agreement(motion, peaks, sigma=SIGMA, lead=LEAD)

    def right_motions(self, count: int, seed: int) -> list[Motion]:
        """Other right motions, drawn by the talker.

        Raises:
            InputError: real speech, whose other right motions are unknown.
        """
        if self.recording is None:
            raise InputError(f"{self.name}: is not generated, so that its other right motions are unknown.")
        key = jax.random.fold_in(jax.random.key(seed), int(hashlib.sha256(self.name.encode()).hexdigest()[:7], 16))
        return [resample_motion(self.recording, jax.random.fold_in(key, number))[0] for number in range(count)]


@dataclass(frozen=True, eq=False)
class Talk:
    """Generated speeches, made when they are needed."""

    roles: tuple[dict[str, Any], ...]
    """Arguments of :func:`~a2g_jax.talker.recordings.talk`."""
    fps: float

    @cached_property
    def speeches(self) -> list[Speech]:
        """All speeches, half a second each to make."""
        return list(self._made())

    def _made(self) -> Iterator[Speech]:
        for role in self.roles:
            take = talk(**role, fps=self.fps, sample_rate=SAMPLE_RATE)
            yield Speech(take.name, take.audio, take.speaker, take.motion, take)

    @property
    def identity(self) -> str:
        """Digest of the speeches: of their roles and of the code of the talker."""
        return digest(repr(self.roles), f"{self.fps:g}", source_digest("talker"))

    def refuse_trained(self, name: str, run: Run) -> None:
        """Refuse a run that was trained on any of the speeches.

        Raises:
            InputError: it was.
        """
        recipe = run.config.corpus.get("recipe", {})
        theirs = {role["seed"] for role in recipe.get("roles", ())}
        if theirs & {role["seed"] for role in self.roles} and self.held_out_of != run.config.corpus.get("fingerprint"):
            raise InputError(f"{name}: was trained on these speeches; choose another --seed.")

    held_out_of: str = ""
    """Fingerprint of the corpus whose test split the speeches are."""


def held_out_talk(minutes: float, seed: int, fps: float) -> Talk:
    """Talk of about a minute each; speakers take turns."""
    return Talk(tuple(cast(minutes, seed)), fps)


def talk_of_corpus(corpus: Corpus, fps: float) -> Talk:
    """The test split of a generated corpus, generated again.

    Raises:
        InputError: a corpus of recordings.
    """
    roles = [*corpus.recipe.get("roles", ()), *corpus.later.get("stored", ())]
    if corpus.recipe.get("reader") != "talker" or not roles:
        raise InputError(f"{corpus.path}: is not generated talk; make one with 'a2g prepare talker', or use --real.")
    names = {corpus.recordings[segment.recording].name for segment in corpus.segments("test")}
    return Talk(tuple(role for role in roles if role["name"] in names), fps, corpus.fingerprint)


def shared_folder() -> Path:
    """The folder of small real recordings: ``A2G_SHARED_DATA``, else ``shared/data`` beside the checkout."""
    return Path(os.environ.get("A2G_SHARED_DATA", Path(__file__).parents[3] / "shared" / "data"))


def real_speeches(folder: Path, fps: float) -> list[Speech]:
    """Every WAV of a folder; a BVH of the same name is the speaker's own motion, retargeted to the talker's body."""
    found = []
    for path in sorted(folder.rglob("*.wav")):
        bvh = path.with_suffix(".bvh")
        truth = read_on_skeleton(bvh, TALKER_SKELETON, fps) if bvh.is_file() else None
        audio = read_audio(path, SAMPLE_RATE)
        if truth is not None:
            frames = min(truth.frames, round(len(audio) / SAMPLE_RATE * fps))
            truth, audio = truth.clip(0, frames), audio[: round(frames / fps * SAMPLE_RATE)]
        found.append(Speech(f"{path.parent.name}/{path.stem}", audio, path.stem, truth))
    return found


def digest(*parts: str) -> str:
    """A short hash of texts."""
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


def source_digest(*rooms: str) -> str:
    """Hash of the code of packages of ``a2g_jax``: figures are measured again when it changes."""
    root = Path(a2g_jax.__file__).parent
    return code_digest([path for room in rooms for path in sorted((root / room).rglob("*.py"))])


def code_digest(files: Sequence[Path]) -> str:
    """Hash of source files without their comments and formatting."""
    return digest(*(f"{path.name} {ast.dump(ast.parse(path.read_text(encoding='utf-8')))}" for path in files))
