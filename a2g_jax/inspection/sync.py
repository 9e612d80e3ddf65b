"""Do motion and audio last equally long, and do they start together?

The offset is measured where speech starts a syllable and hands speed up: the rise of the speech's energy is correlated
with the square root of the wrists' speed, both between 0.3 and 4 Hz, over all circular shifts. A relation of motion to
speech makes a peak at the true offset. How high a peak is by chance, the shifts beyond any plausible offset say: they
are the null. On 18 generated recordings of 64 s the peak stood 4 to 9 of its standard deviations out, at -0.06 s with a
spread of 0.01 s; on a ZeroEGGS take 6.5 at 0.02 s; on a BEAT take of 15 fps it did not stand out (2.9), and nothing is
said.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy import ndimage, signal

from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.retarget.poses import joint_places, world_rotations
from a2g_jax.geometry.retarget.rig import Rig
from a2g_jax.inspection.finding import Finding, Place

#: Rate at which both are compared, Hz.
RATE = 50.0
#: Standard deviations of the null that a peak must stand out by. The largest of the about 160 independent shifts that
#: are searched stands out by 3 by chance, and by 5 once in 20000 recordings.
SIGNIFICANT = 5.0
#: By how many it must be higher than any shift that counts as none.
CLEARER = 2.5
#: Seconds by which hands lead on sound recordings, and how far from that no listener notices: lip-sync standards allow
#: 0.1 s, and gestures lead their words by up to 0.2 s.
USUAL, TOLERATED = -0.03, 0.2
#: Longest offset that is looked for, and shortest recording in which one can be told from chance, seconds.
LONGEST, SHORTEST = 10.0, 20.0
#: Lengths may differ by so many seconds and by this share: recorders stop at different times.
SPARE_SECONDS, SPARE_SHARE = 0.5, 0.01
#: A wrong rate explains a difference in length if what remains is below this share, or below so many frames.
RATE_FITS, FRAMES_FIT = 0.02, 1.5
_RATES = (15.0, 20.0, 24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 90.0, 100.0, 120.0, 240.0)
_BROADCAST = tuple(rate * 1000 / 1001 for rate in (24.0, 30.0, 60.0, 120.0))


@dataclass(frozen=True)
class Offset:
    """How late the motion is against the audio, and how sure that is."""

    seconds: float
    """Positive where the motion is late."""
    deviations: float
    """Height of the peak over the null's mean, in standard deviations of the null."""
    clearer: float
    """The same over the highest value among the shifts that count as none."""

    @property
    def known(self) -> bool:
        """Whether motion and audio are related so clearly that the offset means something."""
        return self.deviations >= SIGNIFICANT

    @property
    def wrong(self) -> bool:
        """Whether they do not start together."""
        return self.known and abs(self.seconds - USUAL) > TOLERATED and self.clearer >= CLEARER


def check_lengths(frames: int, fps: float, audio_seconds: float) -> list[Finding]:
    """Length of the motion against that of the audio; names the frame time that would fit, if one does."""
    seconds = frames / fps
    gap = seconds - audio_seconds
    rate = _fitting_rate(frames, fps, audio_seconds)
    # A rate that fits to a frame says more than the spare time that recorders need: 29.97 fps read as 30.
    exact = rate is not None and abs(frames / rate - audio_seconds) * fps <= FRAMES_FIT
    spare = max(SPARE_SECONDS, SPARE_SHARE * audio_seconds)
    if abs(gap) <= (SPARE_SECONDS if exact else spare):
        return []
    lengths = f"the motion lasts {seconds:.2f} s and the audio {audio_seconds:.2f} s"
    if rate is not None:
        message = f"{lengths}: at {rate:.6g} instead of {fps:.6g} fps the motion would last {frames / rate:.2f} s."
        return [Finding("warning", "frame-time", message, f"Set 'Frame Time: {1 / rate:.8f}'.", value=rate)]
    return [Finding("warning", "length", f"{lengths}.", "Are they of the same take? Cut both to it.", value=gap)]


def _fitting_rate(frames: int, fps: float, audio_seconds: float) -> float | None:
    def gap(rate: float) -> float:
        return abs(frames / rate - audio_seconds)

    others = [rate for rate in (*_RATES, *_BROADCAST) if abs(rate - fps) > 1e-4 * fps]
    best = min(others, key=gap)
    whole = min((rate for rate in others if rate in _RATES), key=gap)
    if gap(best) * fps > FRAMES_FIT:
        best = whole
    fits = gap(best) <= RATE_FITS * audio_seconds or gap(best) * fps <= FRAMES_FIT
    return best if fits and gap(best) < gap(fps) / 2 else None


def check_offset(offset: Offset | None) -> list[Finding]:
    """What a measured offset means."""
    if offset is None or not offset.wrong:
        return []
    shift = offset.seconds - USUAL
    message = (
        f"the hands move {abs(shift):.2f} s {'after' if shift > 0 else 'before'} the speech they go with "
        f"({offset.deviations:.1f} standard deviations above chance)."
    )
    fix = f"Cut {abs(shift):.2f} s from the start of the {'motion' if shift > 0 else 'audio'}."
    return [Finding("warning", "offset", message, fix, Place(seconds=0.0), shift)]


def energy_db(audio: Float[np.ndarray, " N"], sample_rate: int, seconds: float) -> Float[np.ndarray, " K"]:
    """Energy of speech at :data:`RATE`, in dB, smoothed over 20 ms, from zero to ``seconds``."""
    block = max(1, sample_rate // 400)
    count = max(1, len(audio) // block)
    power = np.square(audio[: count * block].reshape(count, -1), dtype=np.float64).mean(axis=1)
    smooth = ndimage.gaussian_filter1d(power, 0.02 * sample_rate / block, mode="constant")
    # Of the blocks, whose middles lie half a block after their starts.
    where = np.arange(int(seconds * RATE)) * sample_rate / RATE / block - 0.5
    return 10 * np.log10(smooth[np.clip(np.rint(where).astype(int), 0, count - 1)] + 1e-12)


def wrist_places(motion: Motion, rig: Rig) -> Float[np.ndarray, "T 2 3"]:
    """Both wrists, relative to the chest's place, metres."""
    world = world_rotations(np.asarray(motion.rotations, np.float32), motion.skeleton.parents)
    places = joint_places(world, np.asarray(motion.skeleton.offsets), motion.skeleton.parents)
    wrists = places[:, [rig.roles["L_Wrist"], rig.roles["R_Wrist"]]]
    return (wrists - places[:, [rig.roles["Chest"]]]).astype(np.float64)


def at_rate(values: Float[np.ndarray, "T *d"], fps: float) -> Float[np.ndarray, "K *d"]:
    """Values of frames at ``k / fps`` brought to :data:`RATE`, linearly."""
    count = int(len(values) / fps * RATE)
    where = np.minimum(np.arange(count) * fps / RATE, len(values) - 1)
    low = np.minimum(where.astype(int), max(len(values) - 2, 0))
    weight = (where - low).reshape(-1, *(1,) * (values.ndim - 1))
    return values[low] * (1 - weight) + values[np.minimum(low + 1, len(values) - 1)] * weight


def measure_offset(energy: Float[np.ndarray, " K"], wrists: Float[np.ndarray, "M 2 3"]) -> Offset | None:
    """How late hands are against speech; None for recordings too short, or without speech or motion.

    Args:
        energy: of speech in dB, at :data:`RATE`.
        wrists: their places at :data:`RATE`, metres.
    """
    count = min(len(energy), len(wrists))
    if count < SHORTEST * RATE:
        return None
    energy = np.maximum(energy[:count], np.percentile(energy[:count], 95) - 40)
    rises = np.maximum(np.gradient(energy), 0)
    velocity = np.gradient(ndimage.gaussian_filter1d(wrists[:count], 0.06 * RATE, axis=0), axis=0)
    speed = np.sqrt(np.linalg.norm(velocity, axis=-1).sum(axis=-1))
    band = signal.butter(2, [0.3, 4.0], "band", fs=RATE, output="sos")
    heard, seen = signal.sosfiltfilt(band, rises), signal.sosfiltfilt(band, speed)
    if heard.std() < 1e-9 or seen.std() < 1e-9:
        return None
    spectrum = np.fft.rfft(seen / seen.std()) * np.conj(np.fft.rfft(heard / heard.std()))
    correlation = np.fft.irfft(spectrum, count) / count
    lags = (np.arange(count) - count * (np.arange(count) > count // 2)) / RATE
    longest = min(LONGEST, count / RATE / 6)
    null = correlation[np.abs(lags) > longest + 1]
    peak = int(np.argmax(np.where(np.abs(lags) <= longest, correlation, -np.inf)))
    usual = correlation[np.abs(lags - USUAL) <= TOLERATED].max()
    spread = max(float(null.std()), 1e-9)
    return Offset(
        float(lags[peak]),
        float((correlation[peak] - null.mean()) / spread),
        float((correlation[peak] - usual) / spread),
    )
