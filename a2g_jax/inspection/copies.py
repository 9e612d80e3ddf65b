"""Equal audio or equal motion in two recordings, at any place, after any gain or re-encoding.

Each frame becomes a word of 32 bits; two recordings have a stretch in common where many words agree at one time shift.
Audio: the
signs of how the energy differences between neighbouring bands change (Haitsma & Kalker, "A Highly Robust Audio
Fingerprinting System", ISMIR 2002). Motion: the signs of 32 fixed random projections of how the pose changes in 0.2 s.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt32

from a2g_jax.features.mel import MelConfig, log_mel
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_track import PoseTrack
from a2g_jax.inspection.finding import Finding, Place

#: Words per second, of audio and of motion.
AUDIO_RATE, MOTION_RATE = 50.0, 20.0
#: Windows of 0.26 s, long compared with the 10 ms by which a copy cut elsewhere can be off the frames.
_MEL = MelConfig(window=4096, bands=33, level_db=None, low_hz=300.0, high_hz=4000.0)
#: Words that occur more often are ignored: silence or rest.
_COMMON = 16
#: Words that must agree at one shift: more than by chance in 10 s, fewer than in a copy of 10 s.
_AGREEING = 24
#: Least share of agreeing words between the first and the last: similar gestures share a few words in a row.
_DENSE = 0.1
#: At rest a pose changes by less than this share of its root-mean-square change; signs are noise then.
_RESTING = 0.2
#: Time differences of energies, and of poses, seconds.
_APART, _POSES_APART = 0.1, 0.2
_BITS = (np.uint32(1) << np.arange(32, dtype=np.uint32)).astype(np.uint32)


@dataclass(frozen=True)
class Fingerprint:
    """The words of a recording."""

    words: UInt32[np.ndarray, " K"]
    frames: np.ndarray
    """Frame of each word, at ``rate``."""
    rate: float

    @classmethod
    def of(cls, bits: np.ndarray, valid: np.ndarray, rate: float) -> "Fingerprint":
        """The words of bits (T, 32) at the valid frames."""
        words = (bits.astype(np.uint32) * _BITS).sum(axis=1, dtype=np.uint32)
        frames = np.flatnonzero(valid)
        return cls(words[frames], frames, rate)


@dataclass(frozen=True)
class Copy:
    """A stretch that two recordings have in common."""

    first: int
    second: int
    start: float
    """Its start in the first recording, seconds."""
    shift: float
    """Seconds by which it is later in the second."""
    seconds: float


def audio_fingerprint(audio: Float[np.ndarray, " N"], sample_rate: int) -> Fingerprint:
    """The words of a speech recording."""
    if sample_rate != _MEL.sample_rate:
        import soxr

        audio = np.asarray(soxr.resample(audio, sample_rate, _MEL.sample_rate), np.float32)
    frames = int(len(audio) / _MEL.sample_rate * AUDIO_RATE)
    return bands_fingerprint(log_mel(audio, _MEL, AUDIO_RATE, frames), AUDIO_RATE)


def bands_fingerprint(bands: Float[np.ndarray, "T B"], rate: float) -> Fingerprint:
    """The words of log-mel rows, of any number of bands."""
    if len(bands) <= _APART * rate + 1:
        return Fingerprint(np.zeros(0, np.uint32), np.zeros(0, np.int64), rate)
    if bands.shape[1] != 33:
        at = np.linspace(0, bands.shape[1] - 1, 33)
        low = np.minimum(at.astype(int), bands.shape[1] - 2)
        bands = bands[:, low] * (1 - (at - low)).astype(bands.dtype) + bands[:, low + 1] * (at - low).astype(
            bands.dtype
        )
    across, apart = np.diff(bands, axis=1), max(1, round(_APART * rate))
    change = across[apart:] - across[:-apart]
    loud = bands[: len(change)].max(axis=1) > bands.max() - 30
    return Fingerprint.of(change > 0, loud, rate)


def motion_fingerprint(motion: Motion | PoseTrack) -> Fingerprint:
    """The words of a motion."""
    values = motion.values if isinstance(motion, PoseTrack) else np.asarray(motion.rotations)[..., :2]
    return poses_fingerprint(values.reshape(len(values), -1), motion.fps)


def poses_fingerprint(poses: Float[np.ndarray, "T F"], fps: float) -> Fingerprint:
    """The words of rows of pose values: rotations, positions or directions."""
    count = int(len(poses) / fps * MOTION_RATE)
    where = np.minimum(np.arange(count) * fps / MOTION_RATE, max(len(poses) - 1, 0))
    low = np.minimum(where.astype(int), max(len(poses) - 2, 0))
    high = np.minimum(low + 1, len(poses) - 1)
    weight = (where - low)[:, None].astype(np.float32)
    at = poses[low] * (1 - weight) + poses[high] * weight
    apart = round(_POSES_APART * MOTION_RATE)
    change = at[apart:] - at[:-apart]
    directions = np.random.default_rng(2002).normal(size=(poses.shape[1], 32)).astype(np.float32)
    size = np.linalg.norm(change, axis=1)
    moving = size > _RESTING * np.sqrt(np.mean(size**2)) if len(size) else np.zeros(0, bool)
    return Fingerprint.of(change @ directions > 0, moving & (size > 1e-6), MOTION_RATE)


def find_copies(prints: Sequence[Fingerprint]) -> list[Copy]:
    """Common stretches, one for each pair of recordings that has any."""
    if len(prints) < 2:
        return []
    words = np.concatenate([one.words for one in prints])
    owner = np.repeat(np.arange(len(prints)), [len(one.words) for one in prints])
    frame = np.concatenate([one.frames for one in prints])
    order = np.lexsort((owner, words))
    words, owner, frame = words[order], owner[order], frame[order]
    starts = np.flatnonzero(np.concatenate([[True], words[1:] != words[:-1]]))
    sizes = np.diff(np.append(starts, len(words)))
    keep = np.repeat(sizes <= _COMMON, sizes)
    words, owner, frame = words[keep], owner[keep], frame[keep]
    found = []
    for step in range(1, _COMMON):
        same = np.flatnonzero((words[step:] == words[:-step]) & (owner[step:] != owner[:-step]))
        found.append(np.stack([owner[same], owner[same + step], frame[same], frame[same + step]], axis=1))
    # Owners are sorted among equal words, so the first is always the smaller.
    hits = np.concatenate(found).astype(np.int32)
    copies: dict[tuple[int, int], tuple[int, Copy]] = {}
    lag = hits[:, 3] - hits[:, 2]
    # A copy cut between two frames agrees at either of the shifts beside it.
    for keys in (lag, lag + 1):
        group = np.stack([hits[:, 0], hits[:, 1], keys // 2], axis=1)
        kinds, where, counts = np.unique(group, axis=0, return_inverse=True, return_counts=True)
        rows, stops = np.argsort(where.ravel(), kind="stable"), np.cumsum(counts)
        for kind in np.flatnonzero(counts >= _AGREEING):
            members = hits[rows[stops[kind] - counts[kind] : stops[kind]]]
            span = int(members[:, 2].max() - members[:, 2].min()) + 1
            pair = int(kinds[kind, 0]), int(kinds[kind, 1])
            if len(np.unique(members[:, 2])) < max(_AGREEING, _DENSE * span):
                continue
            rate = prints[pair[0]].rate
            shift = float(np.median(members[:, 3] - members[:, 2]) / rate)
            copy = Copy(*pair, float(members[:, 2].min() / rate), shift, span / rate)
            if copies.get(pair, (0, copy))[0] < len(members):
                copies[pair] = len(members), copy
    return [copy for _, (_, copy) in sorted(copies.items())]


def check_copies(
    what: str, prints: Sequence[Fingerprint], names: Sequence[str], splits: Sequence[frozenset[str]] | None = None
) -> list[Finding]:
    """Recordings with equal audio, or equal motion; a leak where they are in two splits.

    Args:
        what: ``"audio"`` or ``"motion"``.
        names: names of the recordings.
        splits: splits that each recording is part of.
    """
    findings = []
    for copy in find_copies(prints):
        first, second = names[copy.first], names[copy.second]
        start = copy.start + copy.shift
        message = f"has the same {what} as {first} for about {copy.seconds:.1f} s (there at {copy.start:.1f} s)"
        place = Place(recording=second, seconds=max(start, 0.0))
        parts = (splits[copy.first], splits[copy.second]) if splits else (frozenset[str](), frozenset[str]())
        if splits and parts[0] and parts[1] and len(parts[0] | parts[1]) > 1:
            message += f", and they are in different splits ({_join(parts[0])}; {_join(parts[1])})."
            fix = "Put both into one split; otherwise the model is tested on training data."
            findings.append(Finding("warning", "leak", message, fix, place, copy.seconds))
        else:
            fix = "Remove one, unless both are meant to be there."
            findings.append(Finding("warning", "duplicate", f"{message}.", fix, place, copy.seconds))
    return findings


def _join(parts: frozenset[str]) -> str:
    return " and ".join(sorted(parts))
