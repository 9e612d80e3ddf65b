"""Clips for styles and seed poses: real takes, generated speakers, and clips made absurd on purpose."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.data.datasets.smplx import BODY, smplx_motion
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.audio import read_audio
from a2g_jax.io.bvh import read_bvh
from a2g_jax.talker.emotions import VOICE_EMOTIONS
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from experiments.motion.speeches import SAMPLE_RATE

#: Generated clips, their length in seconds, and the seeds of clips and of absurd ones.
SPEAKERS_SHOWN, SECONDS, SEED = 10, 20.0, 410_000
#: First second and length of the parts that are taken from real takes.
PARTS = ((5.0, SECONDS), (30.0, SECONDS))


@dataclass(frozen=True, eq=False)
class CandidateClip:
    """A clip, with its speech where there is one."""

    group: str
    """``real``, ``generated`` or ``absurd``."""
    name: str
    read: Callable[[], Motion]
    """May raise InputError, as reading a file does."""
    audio: Float[np.ndarray, " N"] | None = None


def clips(shared: Path, fps: float) -> Iterator[CandidateClip]:
    """Every clip; real ones and the dog only where the folder of recordings has them."""
    yield from real_clips(shared)
    yield from generated_clips(fps)
    yield from absurd_clips(shared, fps)


def real_clips(shared: Path) -> Iterator[CandidateClip]:
    """Two parts of each take: ZeroEGGS, BEAT, and BEAT2, which is the BEAT take fitted to SMPL-X."""
    sources = {
        "zeroeggs": (shared / "zeggs" / "067_Speech_2_x_1_0.bvh", shared / "zeggs" / "067_Speech_2_x_1_0.wav"),
        "beat": (shared / "beat" / "2_scott_0_1_1.bvh", shared / "beat" / "2_scott_0_1_1.wav"),
        "beat2": (shared / "beat2" / "2_scott_0_1_1.npz", shared / "beat" / "2_scott_0_1_1.wav"),
    }
    for name, (path, sound) in sources.items():
        if not path.is_file():
            continue
        motion, audio = _read(path), read_audio(sound, SAMPLE_RATE)
        for first, seconds in PARTS:
            start, stop = (round(second * motion.fps) for second in (first, first + seconds))
            part = motion.clip(start, stop)
            speech = audio[round(first * SAMPLE_RATE) : round((first + seconds) * SAMPLE_RATE)]
            yield CandidateClip("real", f"{name} from {first:g} s", lambda part=part: part, speech)


def generated_clips(fps: float) -> Iterator[CandidateClip]:
    """Clips of generated speakers, each with an emotion of its own."""
    for number in range(SPEAKERS_SHOWN):
        speaker, emotion = list(SPEAKERS)[number % 6], list(VOICE_EMOTIONS)[number % len(VOICE_EMOTIONS)]
        take = talk(SECONDS, SEED + number, speaker=speaker, emotion=emotion, fps=fps)
        yield CandidateClip("generated", f"{speaker}, {emotion}", lambda take=take: take.motion, take.audio)


def absurd_clips(shared: Path, fps: float) -> Iterator[CandidateClip]:
    """Clips that no style should be taken from as they are, made from a generated one."""
    take = talk(12.0, SEED + 99, speaker="bruno", fps=fps)
    for name, change in ABSURD.items():
        motion = change(take.motion)
        yield CandidateClip("absurd", name, lambda motion=motion: motion, take.audio[: round(motion.seconds * 16000)])
    dog = shared.parent / "cases" / "bvh" / "dog_walk.bvh"
    if dog.is_file():
        yield CandidateClip("absurd", "a dog", lambda: _read(dog))


def _read(path: Path) -> Motion:
    if path.suffix != ".npz":
        return read_bvh(path)
    with np.load(path) as arrays:
        turns = arrays["poses"].reshape(len(arrays["poses"]), -1, 3)[:, BODY]
        return smplx_motion(turns, arrays["trans"], float(arrays["mocap_frame_rate"]), str(path))


def turn(axis: int, radians: Float[np.ndarray, " T"]) -> Float[np.ndarray, "T 3 3"]:
    """Rotations about a coordinate axis."""
    cos, sin = np.cos(radians), np.sin(radians)
    matrices = np.tile(np.eye(3, dtype=np.float32), (len(radians), 1, 1))
    first, second = [number for number in range(3) if number != axis]
    sign = -1.0 if axis == 1 else 1.0
    matrices[:, first, first] = matrices[:, second, second] = cos
    matrices[:, first, second], matrices[:, second, first] = -sign * sin, sign * sin
    return matrices


def _turned(motion: Motion, joint: str, axis: int, radians: Float[np.ndarray, " T"]) -> Motion:
    rotations, number = np.array(motion.rotations), motion.skeleton.names.index(joint)
    rotations[:, number] = rotations[:, number] @ turn(axis, radians)
    return replace(motion, rotations=rotations)


def _flips(motion: Motion) -> Motion:
    flipped = np.random.default_rng(0).random(motion.frames) < 0.15
    for joint in ("L_Elbow", "R_Elbow"):
        motion = _turned(motion, joint, 1, np.where(flipped, np.radians(170.0), 0.0))
    return motion


def _teleports(motion: Motion) -> Motion:
    block = round(0.5 * motion.fps)
    starts = np.random.default_rng(1).integers(0, motion.frames - block, motion.frames // block)
    rows = (starts[:, None] + np.arange(block)).ravel()
    jumps = np.repeat(np.random.default_rng(2).normal(size=(len(starts), 3)), block, axis=0)
    return replace(motion, rotations=motion.rotations[rows], root=(motion.root[rows] + jumps).astype(np.float32))


def _cartwheel(motion: Motion) -> Motion:
    angle = 2 * np.pi * np.arange(motion.frames) / (1.5 * motion.fps)
    arms = _turned(
        _turned(motion, "L_Shoulder", 2, np.full(motion.frames, 1.8)), "R_Shoulder", 2, np.full(motion.frames, -1.8)
    )
    return replace(
        arms, rotations=np.concatenate([turn(2, angle)[:, None] @ arms.rotations[:, :1], arms.rotations[:, 1:]], axis=1)
    )


def _t_pose(motion: Motion) -> Motion:
    still = np.tile(np.eye(3, dtype=np.float32), (*motion.rotations.shape[:2], 1, 1))
    return replace(motion, rotations=still, root=np.repeat(motion.root[:1], motion.frames, axis=0))


def _fast(motion: Motion) -> Motion:
    return replace(motion, rotations=motion.rotations[::4], root=motion.root[::4])


def _upside_down(motion: Motion) -> Motion:
    return _turned(motion, motion.skeleton.names[0], 2, np.full(motion.frames, np.pi))


def _arms_up(motion: Motion) -> Motion:
    for joint, angle in (("L_Shoulder", 2.2), ("R_Shoulder", -2.2)):
        rotations, number = np.array(motion.rotations), motion.skeleton.names.index(joint)
        rotations[:, number] = turn(2, np.full(motion.frames, angle)) @ rotations[:, number]
        motion = replace(motion, rotations=rotations)
    return motion


def _jitter(motion: Motion) -> Motion:
    rng = np.random.default_rng(3)
    for joint in motion.skeleton.names[1:]:
        motion = _turned(motion, joint, 2, rng.normal(scale=np.radians(4.0), size=motion.frames))
    return motion


def _lying(motion: Motion) -> Motion:
    return replace(
        motion,
        rotations=np.concatenate(
            [turn(0, np.full(motion.frames, -0.5 * np.pi))[:, None] @ motion.rotations[:, :1], motion.rotations[:, 1:]],
            axis=1,
        ),
    )


def _spinning(motion: Motion) -> Motion:
    return _turned(motion, motion.skeleton.names[0], 1, 2 * np.pi * np.arange(motion.frames) / (1.0 * motion.fps))


def _held(motion: Motion) -> Motion:
    rows = np.full(motion.frames, motion.frames // 2)
    return replace(motion, rotations=motion.rotations[rows], root=motion.root[rows])


def _half_a_second(motion: Motion) -> Motion:
    return motion.clip(0, round(0.5 * motion.fps))


#: What is done to a clip of 12 s.
ABSURD: dict[str, Callable[[Motion], Motion]] = {
    "flips of the elbows": _flips,
    "teleports": _teleports,
    "cartwheels": _cartwheel,
    "T-pose": _t_pose,
    "four times as fast": _fast,
    "upside down": _upside_down,
    "lying": _lying,
    "spinning": _spinning,
    "arms above the head": _arms_up,
    "jitter": _jitter,
    "one pose held": _held,
    "half a second": _half_a_second,
}
