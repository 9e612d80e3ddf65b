"""Control tracks of the vocal tract for a speech plan: formants, nasality and the levels of the sound sources."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.ndimage import convolve1d

from a2g_jax.talker.emotions import VoiceEmotion
from a2g_jax.talker.phones import NEUTRAL_VOWEL, PHONES, SILENT, Phone
from a2g_jax.talker.plan import phone_spans
from a2g_jax.talker.speech import SpeechPlan, Syllable

TRACK_RATE = 400.0
"""Samples per second of the control tracks."""


@dataclass(frozen=True)
class Tracks:
    """Control tracks at :data:`TRACK_RATE`, before the speaker's tract length scales the frequencies."""

    times: Float[np.ndarray, " K"]
    """Seconds."""
    formants: Float[np.ndarray, "K 3"]
    """F1, F2, F3 in Hz."""
    nasal: Float[np.ndarray, " K"]
    """0 oral to 1 nasal."""
    nasal_zero: Float[np.ndarray, " K"]
    """Antiformant in Hz (meaningless where oral)."""
    voiced_db: Float[np.ndarray, " K"]
    aspiration_db: Float[np.ndarray, " K"]
    noise_db: Float[np.ndarray, " K"]
    noise_hz: Float[np.ndarray, " K"]
    noise_width_hz: Float[np.ndarray, " K"]


class _Curve:
    """Control points of one track."""

    def __init__(self) -> None:
        self.times: list[float] = []
        self.values: list[float] = []

    def hold(self, start: float, end: float, value: float, ramp: float) -> None:
        """Add a plateau that leaves ``ramp`` seconds at both ends for the transitions."""
        ramp = min(ramp, 0.45 * (end - start))
        self.times += [start + ramp, end - ramp]
        self.values += [value, value]

    def sample(self, times: Float[np.ndarray, " K"], default: float) -> Float[np.ndarray, " K"]:
        if not self.times:
            return np.full(len(times), default)
        return np.interp(times, self.times, self.values)


def _smooth(track: Float[np.ndarray, "K *C"], seconds: float) -> Float[np.ndarray, "K *C"]:
    window = np.hanning(round(seconds * TRACK_RATE) + 2)[1:-1]
    return convolve1d(track, window / window.sum(), axis=0, mode="nearest")


def _vowel_targets(phone: Phone, syllable: Syllable, articulation: float) -> list[np.ndarray]:
    """A vowel's formants: unstressed and slurred vowels fall short of their targets."""
    reach = articulation * (1.0 + 0.08 * syllable.accent if syllable.stress else 0.72)
    neutral = np.array(NEUTRAL_VOWEL)
    return [neutral + reach * (np.array(row) - neutral) for row in phone.targets]


def _consonant_target(phone: Phone, vowel_row: np.ndarray) -> np.ndarray:
    """A consonant's formants: F2 by the locus equation; F3 follows the vowel by a third."""
    f1, f2, f3 = phone.targets[0]
    return np.array([f1, phone.slope * vowel_row[1] + (1.0 - phone.slope) * f2, f3 + 0.33 * (vowel_row[2] - f3)])


def articulate(plan: SpeechPlan, emotion: VoiceEmotion, rng: np.random.Generator) -> Tracks:
    """Control tracks of the whole recording; ``rng`` makes no two tokens of a sound alike."""
    times = np.arange(int(np.ceil(plan.seconds * TRACK_RATE)) + 1) / TRACK_RATE
    curves = {name: _Curve() for name in ("f1", "f2", "f3", "nasal", "zero", "voice", "breath", "noise", "hz", "width")}
    previous_end = 0.0
    for syllable in plan.syllables:
        if syllable.onset > previous_end + 1e-6:
            _rest(curves, previous_end, syllable.onset)
        _syllable(curves, syllable, emotion.articulation, rng)
        previous_end = syllable.end
    if plan.seconds > previous_end:
        _rest(curves, previous_end, plan.seconds)
    defaults = {"f1": NEUTRAL_VOWEL[0], "f2": NEUTRAL_VOWEL[1], "f3": NEUTRAL_VOWEL[2], "nasal": 0.0, "zero": 1500.0}
    defaults |= {"voice": SILENT, "breath": SILENT, "noise": SILENT, "hz": 4000.0, "width": 2000.0}
    sampled = {name: curve.sample(times, defaults[name]) for name, curve in curves.items()}
    formants = _smooth(np.stack([sampled["f1"], sampled["f2"], sampled["f3"]], axis=1), 0.065)
    return Tracks(
        times,
        formants,
        _smooth(sampled["nasal"], 0.05),
        _smooth(sampled["zero"], 0.05),
        _smooth(sampled["voice"], 0.0125),
        _smooth(sampled["breath"], 0.0125),
        sampled["noise"],
        sampled["hz"],
        sampled["width"],
    )


def _rest(curves: dict[str, _Curve], start: float, end: float) -> None:
    for name in ("voice", "breath", "noise"):
        curves[name].hold(start, end, SILENT, 0.03)
    curves["nasal"].hold(start, end, 0.0, 0.05)


def _syllable(curves: dict[str, _Curve], syllable: Syllable, articulation: float, rng: np.random.Generator) -> None:
    spans = phone_spans(syllable)
    nucleus = next(i for i, (symbol, _, _) in enumerate(spans) if PHONES[symbol].is_vowel)
    rows = _vowel_targets(PHONES[spans[nucleus][0]], syllable, articulation)
    for index, (symbol, start, end) in enumerate(spans):
        phone = PHONES[symbol]
        if phone.is_vowel:
            points = [(0.4, rows[0]), (0.6, rows[0])] if len(rows) == 1 else [(0.3, rows[0]), (0.85, rows[1])]
        else:
            points = [(0.5, _consonant_target(phone, rows[0] if index < nucleus else rows[-1]))]
        for share, row in points:
            for name, value in zip(("f1", "f2", "f3"), row, strict=True):
                curves[name].times.append(start + share * (end - start))
                curves[name].values.append(float(value) * (1.0 + 0.03 * rng.standard_normal()))
        curves["nasal"].hold(start, end, float(phone.nasal_zero_hz > 0), 0.01)
        if phone.nasal_zero_hz > 0:
            curves["zero"].hold(start, end, phone.nasal_zero_hz, 0.01)
        if phone.noise_db > SILENT:
            curves["hz"].hold(start, end, phone.noise_hz, 0.0)
            curves["width"].hold(start, end, phone.noise_width_hz, 0.0)
        _sources(curves, _token(phone, rng), start, end)


def _token(phone: Phone, rng: np.random.Generator) -> Phone:
    """One token of a consonant: louder or softer than the type."""
    if phone.is_vowel:
        return phone
    voiced, noise = rng.normal(0.0, (2.0, 2.5))
    return replace(
        phone,
        voiced_db=phone.voiced_db + voiced * (phone.voiced_db > SILENT),
        noise_db=phone.noise_db + noise * (phone.noise_db > SILENT),
    )


def _sources(curves: dict[str, _Curve], phone: Phone, start: float, end: float) -> None:
    """Levels of voice, aspiration and frication during one phone."""
    voice, breath, noise = curves["voice"], curves["breath"], curves["noise"]
    if phone.kind in ("plosive", "affricate"):
        # Closure, burst (or the affricate's frication), and, if voiceless, aspiration until voicing sets in.
        length = end - start
        if phone.kind == "affricate":
            release, burst_end = start + 0.42 * length, end - 0.006
        else:
            release = start + (0.55 if phone.voiced_db <= SILENT else 0.8) * length
            burst_end = release + min(0.012, 0.5 * (end - release))
        voice.hold(start, end, phone.voiced_db, 0.006)
        noise.hold(start, release, SILENT, 0.002)
        noise.hold(release, burst_end, phone.noise_db, 0.0015)
        if phone.kind == "plosive" and burst_end < end - 0.004:
            noise.hold(burst_end, end, phone.noise_db - 16.0, 0.004)
        breath.hold(start, release, SILENT, 0.003)
        breath.hold(release, end, phone.aspiration_db, 0.003)
        return
    ramp = {"vowel": 0.008, "nasal": 0.006, "approximant": 0.015, "fricative": 0.012}[phone.kind]
    voice.hold(start, end, phone.voiced_db, 0.006 if phone.voiced_db <= SILENT else ramp)
    breath.hold(start, end, phone.aspiration_db, ramp)
    noise.hold(start, end, phone.noise_db, 0.28 * (end - start) if phone.noise_db > SILENT else 0.001)
