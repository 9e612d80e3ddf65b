"""Faults of a speech recording alone: clipping, silence, no speech, a constant offset, too low a level, channels."""

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
    size = np.abs(audio)
    flat = size >= (1 - CLIPPED_WITHIN) * size.max(initial=1e-9)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flat, [False]]).astype(np.int8))).reshape(-1, 2)
    runs = edges[edges[:, 1] - edges[:, 0] >= CLIPPED_RUN]
    if len(runs) == 0:
        return 0.0, 0
    return float((runs[:, 1] - runs[:, 0]).sum() / len(audio)), int(runs[0, 0])


def check_clipping(audio: Float[np.ndarray, " N"], sample_rate: int) -> list[Finding]:
    """Peaks cut off at the limit of the recorder or of a later step."""
    share, first = clipped_share(audio)
    if share < CLIPPED_SHARE:
        return []
    message = f"{100 * share:.2f} % of the samples are clipped at {peak_db(audio):.1f} dB of full scale."
    fix = "Record at a lower level, or use the original before it was amplified."
    return [Finding("warning", "clipping", message, fix, Place(seconds=first / sample_rate), share)]


def check_silence(audio: Float[np.ndarray, " N"], sample_rate: int) -> list[Finding]:
    """Long stretches far below the level of speech."""
    audio = without_offset(audio, sample_rate)
    size = int(_BLOCK * sample_rate)
    count = len(audio) // size
    if count == 0:
        return []
    power = np.mean(np.square(audio[: count * size].reshape(count, size), dtype=np.float64), axis=1)
    quiet = 10 * np.log10(power + 1e-12) < active_level_db(audio, sample_rate) - SILENT_BELOW
    edges = np.flatnonzero(np.diff(np.concatenate([[False], quiet, [False]]).astype(np.int8))).reshape(-1, 2)
    findings = []
    for start, stop in edges[edges[:, 1] - edges[:, 0] >= SILENT_SECONDS / _BLOCK]:
        seconds = float((stop - start) * _BLOCK)
        message = f"silent for {seconds:.1f} s."
        fix = "Cut it out, unless the speaker is listening."
        findings.append(Finding("warning", "silence", message, fix, Place(seconds=float(start * _BLOCK)), seconds))
    return findings


def check_level(audio: Float[np.ndarray, " N"], sample_rate: int) -> list[Finding]:
    """A constant offset of the samples, which is removed before features are computed, and speech that is too faint."""
    offset = sample_offset(audio, sample_rate)
    level = active_level_db(without_offset(audio, sample_rate), sample_rate)
    findings = []
    if offset != 0.0:
        message = f"the samples are off zero by {offset:.4f} on average; the offset is removed when they are read."
        findings.append(Finding("info", "dc", message, value=abs(offset)))
    if level < FAINT:
        message = f"speech has a level of only {level:.0f} dB of full scale."
        findings.append(Finding("warning", "faint", message, "Record at a higher level.", value=level))
    return findings


def check_speech(audio: Float[np.ndarray, " N"], sample_rate: int) -> list[Finding]:
    """Whether there is speech at all."""
    reason = why_no_speech(audio, sample_rate)
    fix = "Name a recording of speech; motion follows whatever sound there is."
    return [Finding("warning", "no-speech", f"no speech is found: {reason}.", fix)] if reason else []


def check_audio(audio: Float[np.ndarray, " N"], sample_rate: int) -> list[Finding]:
    """All checks of the samples of a speech recording alone."""
    return [
        *check_clipping(audio, sample_rate),
        *check_silence(audio, sample_rate),
        *check_level(audio, sample_rate),
        *check_speech(audio, sample_rate),
    ]


def check_sound(sound: Sound) -> list[Finding]:
    """All checks of an audio file: header, channels and samples."""
    return [*map(finding_of, sound.notes()), *check_audio(sound.samples, sound.info.sample_rate)]


def speech_warnings(sound: Sound) -> list[Finding]:
    """Warnings that matter before motion is generated; pauses and offsets do not."""
    return [one for one in check_sound(sound) if one.severity == "warning" and one.code != "silence"]


def finding_of(note: Note) -> Finding:
    """A remark of a reader as a warning."""
    return Finding("warning", note.code, note.message, note.fix, Place(seconds=note.seconds), note.value)
