"""Read and write audio files."""

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.features.offset import without_offset
from a2g_jax.io.channels import MOST, Channels, Meter
from a2g_jax.io.files import atomic_path, check_readable
from a2g_jax.io.reading import Note, current_reading
from a2g_jax.io.sound_file import open_sound, reason_of
from a2g_jax.io.sound_notes import sound_notes

#: Peak below which a recording counts as silent: -70 dB of full scale, or -120 dB for samples of 24 bits and more.
SILENCE = 10 ** (-70 / 20)
FINE_SILENCE = 1e-6
_FINE = ("PCM_24", "PCM_32", "FLOAT", "DOUBLE", "ALAC_24", "ALAC_32")
#: Peak above which floating-point samples cannot be audio in -1 to 1 that was merely mixed too loud.
_LOUDEST = 100.0
_LOWEST_RATE, _HIGHEST_RATE = 1_000, 1_000_000
#: Formats whose header states the number of samples exactly.
_EXACT = ("WAV", "WAVEX", "RF64", "W64", "FLAC", "AIFF", "AU", "CAF")
#: Longest recording, seconds.
MAX_SECONDS = 4 * 3600.0
_UNKNOWN_LENGTH = 2**63 - 1


@dataclass(frozen=True)
class AudioInfo:
    """Properties of an audio file."""

    sample_rate: int
    channels: int
    frames: int
    """Samples per channel."""
    format: str
    """Container, such as ``"WAV"``."""
    subtype: str
    """Encoding, such as ``"PCM_16"``."""

    @property
    def seconds(self) -> float:
        """Length: frames / sample_rate."""
        return self.frames / self.sample_rate


@dataclass(frozen=True, eq=False)
class Sound:
    """The samples of an audio file at its own rate, mono, and what is known of the file."""

    path: Path
    samples: Float[np.ndarray, " N"]
    """Of the chosen channel, or the mean of all."""
    info: AudioInfo
    peak: float
    """Largest sample of the chosen channels."""
    channels: Channels | None = None
    """Of files with several, where none was chosen."""
    header: str = ""
    """How the header was repaired."""

    def at(self, sample_rate: int) -> Float[np.ndarray, " N"]:
        """Samples at another rate, without a constant offset (:mod:`a2g_jax.features.offset`)."""
        return resampled(self.centred, self.info.sample_rate, sample_rate)

    @cached_property
    def centred(self) -> Float[np.ndarray, " N"]:
        """Samples without a constant offset."""
        return without_offset(self.samples, self.info.sample_rate)

    def notes(self) -> list[Note]:
        """Remarks on header, channels and levels."""
        return sound_notes(self.header, self.channels, self.peak, self.info.format, self.info.subtype)


def audio_info(path: str | os.PathLike[str]) -> AudioInfo:
    """Properties of an audio file, from its header; one that needs ffmpeg is decoded for its length.

    Raises:
        InputError: no such file, or not an audio file.
    """
    path = check_readable(path, "an audio file")
    with open_sound(path, MAX_SECONDS) as (sound, _):
        frames = sound.frames
        if sound.format == "FFMPEG":
            frames = 0
            while count := len(sound.read(2**19)):
                frames += count
        return AudioInfo(sound.samplerate, sound.channels, frames, sound.format, sound.subtype)


def read_audio(
    path: str | os.PathLike[str],
    sample_rate: int = 16000,
    *,
    max_seconds: float = MAX_SECONDS,
    channel: int | None = None,
) -> Float[np.ndarray, " N"]:
    """Read audio as mono float32 samples at ``sample_rate``, around zero.

    Reads what libsndfile reads, WAV of any width, FLAC, OGG, MP3, AIFF and more, at any rate, and M4A, AAC, MP4, WebM,
    WMA and AMR where ffmpeg is installed. Channels are averaged, other rates resampled (soxr, high quality) to
    ``round(frames * sample_rate / rate)`` samples. A constant offset is removed where it is large enough to matter
    (:mod:`a2g_jax.features.offset`). A WAV header that was never finished is repaired.

    Args:
        path: the file.
        sample_rate: rate of the result, Hz.
        max_seconds: a longer file is an error.
        channel: a single channel, from 1 on; None for the mean of all, or the choice of
            :func:`~a2g_jax.io.reading.reading`.

    Raises:
        InputError: no such file; not audio; cut short; without samples or that channel; with NaN or infinities; silent
            (peak below -70 dB of full scale, or -120 dB for 24 bits and more); too long; or not scaled to -1 to 1.
    """
    if sample_rate <= 0:
        raise ValueError(f"Expected a positive sample rate; got {sample_rate}.")
    choices = current_reading()
    sound = load_audio(path, channel=choices.channel if channel is None else channel, max_seconds=max_seconds)
    for note in sound.notes():
        choices.note(sound.path, note)
    return sound.at(sample_rate)


def resampled(samples: Float[np.ndarray, " N"], rate: int, sample_rate: int) -> Float[np.ndarray, " M"]:
    """Samples at another rate: ``round(N * sample_rate / rate)`` of them (soxr, high quality)."""
    if rate == sample_rate:
        return samples
    import soxr  # slow to load, and files at the right rate do not need it

    length = max(1, round(len(samples) * sample_rate / rate))
    result = np.asarray(soxr.resample(samples, rate, sample_rate, quality="HQ"), np.float32)[:length]
    return np.pad(result, (0, length - len(result)))


def load_audio(path: str | os.PathLike[str], *, channel: int | None = None, max_seconds: float = MAX_SECONDS) -> Sound:
    """Read an audio file at its own rate, with what is known of it.

    Args:
        channel: a single channel, from 1 on; None for the mean of all.

    Raises:
        InputError: as :func:`read_audio`.
    """
    # In blocks: a header may claim more samples than fit into memory.
    import soundfile

    path = check_readable(path, "an audio file")
    with open_sound(path, max_seconds) as (sound, header):
        rate, channels, claimed, format = sound.samplerate, sound.channels, sound.frames, sound.format
        if not _LOWEST_RATE <= rate <= _HIGHEST_RATE:
            raise InputError(f"{path}: has a sample rate of {rate} Hz; expected {_LOWEST_RATE} to {_HIGHEST_RATE}.")
        if channel is not None and channel > channels:
            number = "1 channel" if channels == 1 else f"{channels} channels"
            raise InputError(f"{path}: has {number}, and channel {channel} was chosen; choose another (--channel).")
        longest = int(max_seconds * rate)
        if longest < claimed != _UNKNOWN_LENGTH:
            _refuse_length(path, claimed / rate, max_seconds)
        blocks: list[np.ndarray] = []
        count, peak = 0, 0.0
        size = max(1, 2**19 // channels)
        meter = Meter(channels, rate) if channel is None and 1 < channels <= MOST else None
        while True:
            try:
                block = sound.read(size, dtype="float32", always_2d=True)
            except (soundfile.LibsndfileError, RuntimeError) as error:
                raise InputError(
                    f"{path}: is damaged after {count / rate:.1f} s ({reason_of(error)}); export it again."
                ) from None
            if len(block) == 0:
                break
            block = block if channel is None else block[:, channel - 1 : channel]
            finite = np.isfinite(block).all(axis=1)
            if not finite.all():
                at = (count + int(np.argmin(finite))) / rate
                raise InputError(f"{path}: contains NaN or infinity at {at:.3f} s; export it again.")
            count += len(block)
            if count > longest:
                _refuse_length(path, count / rate, max_seconds)
            highest = float(max(block.max(), -block.min()))
            peak, mixed = max(peak, highest), _mixed(block)
            if meter is not None:
                meter.add(block, mixed, highest)
            blocks.append(mixed)
        info = AudioInfo(rate, channels, count, format, sound.subtype)
        header = header or getattr(sound, "remark", "")
    if count == 0:
        raise InputError(
            f"{path}: contains no samples: nothing follows its header; take another copy, or export it again."
        )
    if format in _EXACT and claimed != _UNKNOWN_LENGTH and count < claimed:
        raise InputError(
            f"{path}: is cut short: the header says {claimed / rate:.2f} s and {count / rate:.2f} s can be read; "
            "copy or export it again."
        )
    found = Sound(path, np.concatenate(blocks), info, peak, None if meter is None else meter.channels(), header)
    _check_level(found)
    return found


def _mixed(block: Float[np.ndarray, "n C"]) -> Float[np.ndarray, " n"]:
    if block.shape[1] == 1:
        return np.ascontiguousarray(block[:, 0])
    if block.shape[1] == 2:  # half the sum in single precision is the rounded mean, and five times as fast
        return (block[:, 0] + block[:, 1]) * np.float32(0.5)
    return block.mean(axis=1, dtype=np.float64).astype(np.float32)


def _refuse_length(path: Path, seconds: float, max_seconds: float) -> None:
    raise InputError(f"{path}: is {seconds:.0f} s long, and the limit is {max_seconds:.0f} s; split it.")


def _check_level(sound: Sound) -> None:
    path, peak = sound.path, sound.peak
    if peak > _LOUDEST:
        raise InputError(f"{path}: has samples as large as {peak:.4g}; scale them to -1 to 1.")
    fine = sound.info.subtype in _FINE and sound.info.format != "FFMPEG"
    limit, decibels = (FINE_SILENCE, -120) if fine else (SILENCE, -70)
    if peak >= limit and max(sound.centred.max(), -sound.centred.min()) >= limit:
        return
    if sound.channels is not None and np.sqrt(sound.channels.power.max(initial=0.0)) >= limit:
        raise InputError(f"{path}: is silent as mono, because its channels cancel out; choose one with --channel.")
    raise InputError(f"{path}: is silent (its peak is below {decibels} dB of full scale); check the recording.")


def write_audio(
    path: str | os.PathLike[str], samples: Float[np.ndarray, " N"], sample_rate: int, subtype: str | None = "PCM_16"
) -> None:
    """Write mono samples in -1 to 1, atomically; integer formats clip values outside.

    Example:
        >>> import a2g_jax
        >>> a2g_jax.write_audio("speech.wav", a2g_jax.talk(2.0, seed=1).audio, 16000)
        >>> len(a2g_jax.read_audio("speech.wav", 48000))
        96000

    Args:
        path: its suffix is the format: ``.wav``, ``.flac``, ``.ogg`` ...
        subtype: encoding, by libsndfile's names; None takes the format's default.

    Raises:
        InputError: unknown format, or an encoding that it does not have; NaN or infinities; no samples.
    """
    import soundfile

    path = Path(path)
    if sample_rate <= 0:
        raise ValueError(f"Expected a positive sample rate; got {sample_rate}.")
    if len(samples) == 0:
        raise InputError(f"{path}: not written: there are no samples; record or export the audio again.")
    if not np.all(np.isfinite(samples)):
        at = int(np.argmax(~np.isfinite(samples)))
        raise InputError(f"{path}: not written: NaN or infinity at {at / sample_rate:.3f} s.")
    format = path.suffix[1:].upper()
    if format not in soundfile.available_formats() or format == "RAW":
        raise InputError(f"{path}: not written: {path.suffix!r} is not an audio format; use .wav or .flac.")
    if subtype is None:
        subtype = soundfile.default_subtype(format)
    if not soundfile.check_format(format, subtype):
        encodings = ", ".join(soundfile.available_subtypes(format))
        raise InputError(f"{path}: not written: {format} has no encoding {subtype}; it has {encodings}.")
    with atomic_path(path) as temporary:
        try:
            soundfile.write(str(temporary), samples, sample_rate, subtype=subtype, format=format)
        except soundfile.LibsndfileError as error:
            raise InputError(
                f"{path}: cannot be written ({reason_of(error)}); check the rate and the folder."
            ) from None
