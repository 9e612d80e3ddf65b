"""Faults of a speech recording alone: clipping, silence, no speech, a constant offset, too low a level, channels."""

from functools import cached_property

import numpy as np
from jaxtyping import Float

from a2g_jax.features.mel import active_level_db
from a2g_jax.features.offset import sample_offset, without_offset
from a2g_jax.features.speech_likeness import why_no_speech
from a2g_jax.inspection.finding import Finding, Place
from a2g_jax.io.audio import Sound
from a2g_jax.io.reading import Note
from a2g_jax.io.sound_notes import CLIPPED_SHARE

#: Consecutive samples at the largest value that make a clipped peak; a peak of speech has one or two.
CLIPPED_RUN = 3
#: Relative distance from the largest value within which a sample counts as clipped; a dithered 16-bit converter strays
#: by less.
CLIPPED_WITHIN = 1e-3
#: Seconds without speech, and decibels below the level of speech that count as silence. Pauses of a talking person
#: last 2 to 4 s at most.
SILENT_SECONDS, SILENT_BELOW = 5.0, 40.0
#: Level of active speech, dB of full scale, below which 16-bit rounding and hum matter.
FAINT = -50.0
_BLOCK = 0.025


def peak_db(audio: Float[np.ndarray, " N"]) -> float:
    """Largest sample in dB of full scale; -100 for silence."""
    return float(20 * np.log10(max(np.abs(audio).max(initial=0.0), 1e-5)))


def clipped_share(audio: Float[np.ndarray, " N"]) -> tuple[float, int]:
    """Share of samples that lie in flat peaks, and the first such sample."""
    least = (1 - CLIPPED_WITHIN) * max(audio.max(initial=1e-9), -audio.min(initial=0.0))
    flat = np.flatnonzero((audio >= least) | (audio <= -least))
    if len(flat) == 0:
        return 0.0, 0
    breaks = np.flatnonzero(np.diff(flat) > 1) + 1
    firsts = np.concatenate([[0], breaks])
    lengths = np.diff(np.concatenate([firsts, [len(flat)]]))
    runs = lengths >= CLIPPED_RUN
    if not runs.any():
        return 0.0, 0
    return float(lengths[runs].sum() / len(audio)), int(flat[firsts[runs][0]])


class Speech:
    """The samples of a recording, and what is measured of them once.

    Args:
        audio: (N,) samples.
        sample_rate: Hz.
        centred: the same without a constant offset, where they are computed already.
    """

    def __init__(
        self, audio: Float[np.ndarray, " N"], sample_rate: int, centred: Float[np.ndarray, " N"] | None = None
    ) -> None:
        self.audio, self.sample_rate = audio, sample_rate
        self.centred = without_offset(audio, sample_rate) if centred is None else centred

    @cached_property
    def level(self) -> float:
        """Level of active speech, dB of full scale, without the offset."""
        return active_level_db(self.centred, self.sample_rate)

    @cached_property
    def level_with_offset(self) -> float:
        """The same of the samples as they are."""
        return self.level if self.centred is self.audio else active_level_db(self.audio, self.sample_rate)

    @cached_property
    def clipped(self) -> tuple[float, int]:
        """As :func:`clipped_share`."""
        return clipped_share(self.audio)


def check_clipping(speech: Speech) -> list[Finding]:
    """Peaks cut off at the limit of the recorder or of a later step."""
    share, first = speech.clipped
    if share < CLIPPED_SHARE:
        return []
    message = f"{100 * share:.2f} % of the samples are clipped at {peak_db(speech.audio):.1f} dB of full scale."
    fix = "Record at a lower level, or use the original before it was amplified."
    return [Finding("warning", "clipping", message, fix, Place(seconds=first / speech.sample_rate), share)]


def check_silence(speech: Speech) -> list[Finding]:
    """Long stretches far below the level of speech."""
    audio, size = speech.centred, int(_BLOCK * speech.sample_rate)
    count = len(audio) // size
    if count == 0:
        return []
    power = np.mean(np.square(audio[: count * size].reshape(count, size), dtype=np.float64), axis=1)
    quiet = 10 * np.log10(power + 1e-12) < speech.level - SILENT_BELOW
    edges = np.flatnonzero(np.diff(np.concatenate([[False], quiet, [False]]).astype(np.int8))).reshape(-1, 2)
    findings = []
    for start, stop in edges[edges[:, 1] - edges[:, 0] >= SILENT_SECONDS / _BLOCK]:
        seconds = float((stop - start) * _BLOCK)
        message = f"silent for {seconds:.1f} s."
        fix = "Cut it out, unless the speaker is listening."
        findings.append(Finding("warning", "silence", message, fix, Place(seconds=float(start * _BLOCK)), seconds))
    return findings


def check_level(speech: Speech) -> list[Finding]:
    """A constant offset of the samples, which is removed before features are computed, and speech that is too faint."""
    level, findings = speech.level, []
    if speech.centred is not speech.audio:
        offset = sample_offset(speech.audio, speech.sample_rate)
        message = f"the samples are off zero by {offset:.4f} on average; the offset is removed when they are read."
        findings.append(Finding("info", "dc", message, value=abs(offset)))
    if level < FAINT:
        message = f"speech has a level of only {level:.0f} dB of full scale."
        findings.append(Finding("warning", "faint", message, "Record at a higher level.", value=level))
    return findings


def check_speech(speech: Speech) -> list[Finding]:
    """Whether there is speech at all."""
    reason = why_no_speech(speech.audio, speech.sample_rate)
    fix = "Name a recording of speech; motion follows whatever sound there is."
    return [Finding("warning", "no-speech", f"no speech is found: {reason}.", fix)] if reason else []


def check_audio(speech: Speech) -> list[Finding]:
    """All checks of the samples of a speech recording alone."""
    return [*check_clipping(speech), *check_silence(speech), *check_level(speech), *check_speech(speech)]


def speech_of(sound: Sound) -> Speech:
    """The samples of an audio file."""
    return Speech(sound.samples, sound.info.sample_rate, sound.centred)


def check_sound(sound: Sound, speech: Speech | None = None) -> list[Finding]:
    """All checks of an audio file: header, channels and samples.

    Args:
        speech: its samples, where something of them has been measured.
    """
    return [*map(finding_of, sound.notes()), *check_audio(speech or speech_of(sound))]


def speech_warnings(sound: Sound) -> list[Finding]:
    """Warnings that matter before motion is generated; pauses and offsets do not."""
    return [one for one in check_sound(sound) if one.severity == "warning" and one.code != "silence"]


def finding_of(note: Note) -> Finding:
    """A remark of a reader as a warning."""
    return Finding("warning", note.code, note.message, note.fix, Place(seconds=note.seconds), note.value)
