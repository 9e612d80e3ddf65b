"""Real recordings for comparison with the generated corpus, as plain paths and audio."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from a2g_jax.geometry.motion import Motion
from a2g_jax.io.audio import read_audio
from a2g_jax.io.bvh_reader import read_bvh
from a2g_jax.io.textgrid import read_words
from a2g_jax.talker.skeleton import FOREARM, TALKER_SKELETON, UPPER_ARM
from experiments.talker import movement


class Take(NamedTuple):
    """Data of a recording; None for what it lacks."""

    name: str
    moves: movement.Paths | None
    audio: np.ndarray | None
    syllable_rate: float | None
    """Syllables a second of speech, from a transcript's vowels."""


def real_takes(shared: Path) -> tuple[list[Take], list[str]]:
    """All takes of the folder, and the reasons why others are missing."""
    takes, missing = [], []
    for name, reader in (
        ("BEAT", _beat),
        ("BEAT2", _beat2),
        ("ZeroEGGS", _zeroeggs),
        ("TED", _ted),
        ("speech", _speech),
    ):
        try:
            takes += reader(shared / "data")
        except FileNotFoundError:
            missing.append(f"{name}: no such file in the folder of real recordings")
    return takes, missing


def _beat(data: Path) -> Iterator[Take]:
    stem = _existing(data / "beat" / "2_scott_0_1_1.bvh")
    yield _rigged("BEAT, scott", stem, stem.with_suffix(".wav"), stem.with_suffix(".TextGrid"))


def _zeroeggs(data: Path) -> Iterator[Take]:
    stem = _existing(data / "zeggs" / "067_Speech_2_x_1_0.bvh")
    yield _rigged("ZeroEGGS, Speech", stem, stem.with_suffix(".wav"), None)


def _rigged(name: str, bvh: Path, wav: Path, transcript: Path | None) -> Take:
    motion = read_bvh(bvh)
    rate = None if transcript is None else vowel_rate(transcript)
    return Take(name, movement.paths(movement.body_positions(motion), motion.fps), read_audio(wav, 16000), rate)


def vowel_rate(transcript: Path) -> float:
    """Vowels a second outside of silence, of a TextGrid with ARPAbet phones (vowels end in a digit)."""
    phones = read_words(transcript, tier="phones")
    spoken = sum(phone.end - phone.start for phone in phones)
    return sum(phone.text[-1:].isdigit() for phone in phones) / spoken


def _beat2(data: Path) -> Iterator[Take]:
    with np.load(_existing(data / "beat2" / "2_scott_0_1_1.npz"), allow_pickle=False) as archive:
        poses, trans, fps = archive["poses"], archive["trans"], float(archive["mocap_frame_rate"])
    yield Take(
        "BEAT2, scott on the talker's bones", movement.paths(smplx_positions(poses, trans, fps), fps), None, None
    )


def smplx_positions(poses: np.ndarray, trans: np.ndarray, fps: float) -> np.ndarray:
    """(T, 22, 3) positions of SMPL-X body rotations (T, 165) on the talker's skeleton: its rest pose is the same."""
    turns = Rotation.from_rotvec(poses[:, :66].reshape(-1, 3)).as_matrix().reshape(len(poses), 22, 3, 3)
    return Motion(turns.astype(np.float32), trans.astype(np.float32), TALKER_SKELETON, fps).positions()


def _ted(data: Path) -> Iterator[Take]:
    clips = sorted((data / "ted").glob("*.npz"))
    if not clips:
        raise FileNotFoundError
    moves, audio = [], []
    for clip in clips:
        with np.load(clip, allow_pickle=False) as archive:
            moves.append(ted_paths(archive["dir_vec"], float(archive["fps"])))
            audio.append(archive["audio"].astype(np.float32) / 32768)
    # Clips are joined after smoothing; the few frames at the seams do not move percentiles.
    joined = movement.Paths(
        np.concatenate([part.wrists for part in moves]),
        None,
        np.concatenate([part.reach for part in moves]),
        moves[0].arm,
    )
    yield Take(f"TED, {len(clips)} clips (from video)", joined, np.concatenate(audio), None)


def ted_paths(directions: np.ndarray, fps: float) -> movement.Paths:
    """Paths from (T, 126) bone directions, on the talker's arm lengths; in the data y points down and z to the back.

    Bones 0 to 4 are spine to neck, neck to both shoulders, and the left arm, 20 and 21 the right arm.
    """
    bones = directions.reshape(len(directions), 42, 3) * np.array([1.0, -1.0, -1.0])
    neck = 0.26 * bones[:, 0]
    shoulders = neck[:, None] + 0.15 * bones[:, 1:3]
    arms = UPPER_ARM * bones[:, [3, 20]] + FOREARM * bones[:, [4, 21]]
    return movement.from_parts(shoulders + arms, None, shoulders, fps, UPPER_ARM + FOREARM)


def _speech(data: Path) -> Iterator[Take]:
    yield Take("JFK (speech only)", None, read_audio(_existing(data / "speech" / "jfk.wav"), 16000), None)


def _existing(path: Path) -> Path:
    if not path.exists():
        raise FileNotFoundError(path)
    return path


def generated_take(name: str, recording: Any) -> Take:
    """A recording of the talker as a take."""
    speech = recording.annotations["speech"]
    spoken = sum(phrase["end"] - phrase["start"] for phrase in speech["phrases"])
    moves = movement.paths(movement.body_positions(recording.motion), recording.motion.fps)
    return Take(name, moves, recording.audio, len(speech["syllables"]) / spoken)
