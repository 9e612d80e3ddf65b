"""Inspection of one file, or of a motion with its audio."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.data.datasets.smplx import BODY, HANDS, float_array, smplx_motion
from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.rig import Rig
from a2g_jax.inspection.audio_checks import check_sound, finding_of, speech_of
from a2g_jax.inspection.bvh_file import check_layout, check_wraps, scan_bvh
from a2g_jax.inspection.describe import audio_facts, body_places, motion_facts, try_rig, word_facts
from a2g_jax.inspection.finding import Finding, Place, later, located
from a2g_jax.inspection.motion_checks import check_calibration, check_finite, check_motion
from a2g_jax.inspection.shaking import check_shaking
from a2g_jax.inspection.sync import (
    Offset,
    at_rate,
    check_lengths,
    check_offset,
    energy_db,
    measure_offset,
    wrist_positions,
)
from a2g_jax.inspection.tree import skeleton_facts
from a2g_jax.io.audio import load_audio
from a2g_jax.io.bvh_reader import build
from a2g_jax.io.npz import read_motion_npz
from a2g_jax.io.reading import current_reading
from a2g_jax.io.sound_file import AUDIO_SUFFIXES, FFMPEG_SUFFIXES
from a2g_jax.io.transcripts import transcript_notes
from a2g_jax.io.untrusted import read_npz
from a2g_jax.io.words import Word

SAMPLE_RATE = 16000
AUDIO = (*AUDIO_SUFFIXES, *FFMPEG_SUFFIXES)
TRANSCRIPTS = (".textgrid", ".json", ".tsv")
#: Seconds by which the last word of a transcript may end after the audio; aligners round.
_WORDS_BEYOND = 0.25


@dataclass(eq=False)
class Inspected:
    """Facts and findings of one file, with its contents."""

    path: str
    kind: str
    facts: dict[str, Any]
    findings: list[Finding] = field(default_factory=list)
    motion: Motion | None = None
    rig: Rig | None = None
    audio: Float[np.ndarray, " N"] | None = None
    words: tuple[Word, ...] | None = None


def inspect_file(path: Path) -> Inspected:
    """Inspect a file by its suffix.

    Raises:
        InputError: no such file, of an unknown kind, or too damaged to read.
    """
    suffix = path.suffix.lower()
    if suffix == ".bvh":
        return inspect_bvh(path)
    if suffix == ".npz":
        return inspect_npz(path)
    if suffix in AUDIO:
        return inspect_audio(path)
    if suffix in TRANSCRIPTS:
        words, notes = transcript_notes(path)
        findings = located([finding_of(note) for note in notes], path=str(path))
        return Inspected(str(path), "transcript", {"words": word_facts(words)}, findings, words=words)
    kinds = ", ".join((".bvh", ".npz", *AUDIO[:4], *TRANSCRIPTS))
    raise InputError(f"{path}: cannot be inspected; expected {kinds}, a folder, a corpus or a run.")


def inspect_bvh(path: Path) -> Inspected:
    """Inspect a BVH file; faults of the header become warnings, and the readable frames are inspected."""
    file = scan_bvh(path)
    findings = list(file.findings)
    facts: dict[str, Any] = {
        "file": {
            "frames by the header": file.parsed.frames,
            "frame time (s)": file.parsed.frame_time,
            "channels": len(file.channels),
            "root channels": " ".join(file.root_order),
            "rotation orders": list(file.orders),
        }
    }
    if len(file.values) == 0:
        return Inspected(str(path), "bvh", facts, located(findings, path=str(path)))
    motion, layout = build(file.parsed, file.values)
    facts["file"]["unit"] = str(layout.unit)
    findings += check_layout(layout) + check_wraps(file, file.values, motion)
    inspected = _with_motion(path, "bvh", motion, facts)
    inspected.findings = located(findings, path=str(path)) + inspected.findings
    return inspected


def _with_motion(path: Path, kind: str, motion: Motion, facts: dict[str, Any]) -> Inspected:
    rig, findings = try_rig(motion, str(path))
    calibration, start = check_calibration(motion)
    places = None if rig is None else body_places(motion, rig)
    findings += calibration
    # What is not part of the take has faults of its own.
    taken = motion.clip(start, motion.frames) if start else motion
    faults = check_motion(taken, rig)
    if not any(finding.code == "nan" for finding in faults):
        faults += check_shaking(taken, rig, None if places is None else places[start:])
    findings += later(faults, start, motion.fps)
    facts |= {"motion": motion_facts(motion, rig, places), "skeleton": skeleton_facts(motion.skeleton, rig)}
    return Inspected(str(path), kind, facts, located(findings, path=str(path)), motion, rig)


def inspect_audio(path: Path) -> Inspected:
    """Inspect a speech recording."""
    # At its own rate, since resampling smooths clipped peaks.
    choices = current_reading()
    sound = load_audio(path, channel=choices.channel)
    info = sound.info
    facts: dict[str, Any] = {
        "file": {
            "sample rate (Hz)": info.sample_rate,
            "channels": info.channels,
            "samples": info.frames,
            "format": f"{info.format} {info.subtype}",
        }
    }
    if choices.channel is not None:
        facts["file"]["channel"] = choices.channel
    speech = speech_of(sound)
    facts["audio"] = audio_facts(speech)
    findings = located(check_sound(sound, speech), path=str(path))
    return Inspected(str(path), "audio", facts, findings, audio=sound.at(SAMPLE_RATE))


def inspect_npz(path: Path) -> Inspected:
    """Inspect arrays: a motion of this package, SMPL-X parameters as in BEAT2, or any others."""
    arrays = read_npz(path)
    facts: dict[str, Any] = {"arrays": {name: f"{array.dtype} {tuple(array.shape)}" for name, array in arrays.items()}}
    findings = [
        finding
        for name, array in arrays.items()
        if array.dtype.kind == "f"
        for finding in check_finite(array, f"array {name!r}")
    ]
    if not findings and {"rotations", "root", "joint_names", "parents", "offsets", "fps"} <= set(arrays):
        return _with_motion(path, "motion npz", read_motion_npz(path), facts)
    if not findings and "poses" in arrays and {"trans", "mocap_frame_rate"} <= set(arrays):
        return _with_motion(path, "smplx npz", _smplx(path, arrays), facts)
    return Inspected(str(path), "npz", facts, located(findings, path=str(path)))


def _smplx(path: Path, arrays: dict[str, np.ndarray]) -> Motion:
    poses = float_array(arrays["poses"], ((55, 3), (165,)), f"{path}, poses")
    trans = float_array(arrays["trans"], ((3,),), f"{path}, trans")
    if len(trans) != len(poses):
        raise InputError(f"{path}, trans: has {len(trans)} frames; 'poses' has {len(poses)}.")
    rate = arrays["mocap_frame_rate"]
    if rate.size != 1 or rate.dtype.kind not in "iuf" or not 1 <= float(rate.reshape(-1)[0]) <= 1000:
        raise InputError(f"{path}, mocap_frame_rate: expected frames per second, such as 30.")
    axis_angles = np.concatenate([poses[:, BODY], poses[:, HANDS]], axis=1)
    return smplx_motion(axis_angles, trans, float(rate.reshape(-1)[0]), str(path))


def inspect_together(first: Inspected, audio: Inspected) -> Inspected:
    """Inspect a motion or a transcript together with its audio.

    Raises:
        InputError: the first is neither, or the second is no audio.
    """
    if audio.audio is None:
        raise InputError(f"{audio.path}: is no audio; name a WAV or FLAC file with --audio.")
    seconds = len(audio.audio) / SAMPLE_RATE
    findings: list[Finding] = []
    together: dict[str, Any] = {}
    if first.motion is not None:
        motion = first.motion
        together["lengths (s)"] = {"motion": round(motion.seconds, 3), "audio": round(seconds, 3)}
        findings = check_lengths(motion.frames, motion.fps, seconds)
        if not findings and first.rig is not None:
            offset = _offset(motion, first.rig, audio.audio)
            together["offset"] = offset_text(offset)
            findings = check_offset(offset)
    elif first.words is not None:
        findings = check_words(first.words, seconds)
    else:
        raise InputError(f"{first.path}: is neither a motion nor a transcript; leave --audio out.")
    facts = {**first.facts, "audio file": audio.facts["file"], "audio": audio.facts["audio"], "together": together}
    facts["skeleton"] = facts.pop("skeleton", None)
    facts = {name: section for name, section in facts.items() if section}
    every = [*first.findings, *audio.findings, *located(findings, path=first.path)]
    return Inspected(first.path, "pair", facts, every, first.motion, first.rig, audio.audio, first.words)


def _offset(motion: Motion, rig: Rig, audio: Float[np.ndarray, " N"]) -> Offset | None:
    seconds = min(motion.seconds, len(audio) / SAMPLE_RATE)
    wrists = at_rate(wrist_positions(motion, rig), motion.fps)
    return measure_offset(energy_db(audio, SAMPLE_RATE, seconds), wrists)


def offset_text(offset: Offset | None) -> str:
    """A measured offset as text."""
    if offset is None:
        return "cannot be measured (too short, or no speech or motion)"
    height = f"{offset.deviations:.1f} standard deviations above chance; significant from 5"
    if not offset.significant:
        return f"not significant ({height})"
    return f"motion {offset.seconds:+.2f} s relative to the speech ({height})"


def check_words(words: tuple[Word, ...], audio_seconds: float) -> list[Finding]:
    """Findings on a transcript that is longer than the audio."""
    late = [word for word in words if word.end > audio_seconds + _WORDS_BEYOND]
    if not late:
        return []
    message = f"{len(late)} words lie after the end of the audio at {audio_seconds:.2f} s, the first {late[0].text!r}."
    fix = "Is it the transcript of another take?"
    return [Finding("warning", "words-beyond", message, fix, Place(seconds=late[0].start), float(len(late)))]
