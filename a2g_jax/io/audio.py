"""Read and write audio files."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.io.files import atomic_path, check_readable
from a2g_jax.io.riff import check_wav_length

#: Peak below which a recording counts as silent: -70 dB of full scale.
SILENCE = 10 ** (-70 / 20)
#: Peak above which floating-point samples cannot be audio in -1 to 1 that was merely mixed too loud.
_LOUDEST = 100.0
_LOWEST_RATE, _HIGHEST_RATE = 1_000, 1_000_000
#: Formats whose header states the number of samples exactly.
_EXACT = ("WAV", "WAVEX", "RF64", "W64", "FLAC", "AIFF", "AU", "CAF")
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


def audio_info(path: str | os.PathLike[str]) -> AudioInfo:
    """Properties of an audio file, from its header.

    Raises:
        InputError: no such file, or not an audio file.
    """
    path = check_readable(path, "an audio file")
    with _open(path) as sound:
        return AudioInfo(sound.samplerate, sound.channels, sound.frames, sound.format, sound.subtype)


def read_audio(
    path: str | os.PathLike[str], sample_rate: int = 16000, *, max_seconds: float = 4 * 3600.0
) -> Float[np.ndarray, " N"]:
    """Read audio as mono float32 samples at ``sample_rate``.

    Reads what libsndfile reads: WAV of any width, FLAC, OGG, MP3, AIFF and more, at any rate. Channels are averaged,
    other rates resampled (soxr, high quality) to ``round(frames * sample_rate / rate)`` samples.

    Args:
        path: the file.
        sample_rate: rate of the result, Hz.
        max_seconds: a longer file is an error.

    Raises:
        InputError: no such file; not audio; cut short; without samples; with NaN or infinities; silent (peak below
            -70 dB of full scale); too long; or not scaled to -1 to 1.
    """
    if sample_rate <= 0:
        raise ValueError(f"Expected a positive sample rate; got {sample_rate}.")
    path = check_readable(path, "an audio file")
    check_wav_length(path)
    samples, rate = _read_mono(path, max_seconds)
    if rate == sample_rate:
        return samples
    import soxr  # slow to load, and files at the right rate do not need it

    length = max(1, round(len(samples) * sample_rate / rate))
    result = np.asarray(soxr.resample(samples, rate, sample_rate, quality="HQ"), np.float32)[:length]
    return np.pad(result, (0, length - len(result)))


def write_audio(
    path: str | os.PathLike[str], samples: Float[np.ndarray, " N"], sample_rate: int, subtype: str | None = "PCM_16"
) -> None:
    """Write mono samples in -1 to 1, atomically; integer formats clip values outside.

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
            raise InputError(f"{path}: cannot be written ({_reason(error)}); check the rate and the folder.") from None


def _open(path: Path) -> Any:
    import soundfile

    # soundfile reads files of this suffix as headerless samples, whatever their content.
    if path.suffix.lower() == ".raw":
        raise InputError(f"{path}: raw samples have no header with their rate; convert the file to WAV.")
    try:
        return soundfile.SoundFile(str(path))
    except (soundfile.LibsndfileError, UnicodeError) as error:
        with path.open("rb") as file:
            head = file.read(512)
        if head[:4] in (b"RIFF", b"RF64", b"fLaC", b"OggS"):
            reason = f"is a damaged audio file ({_reason(error)})"
        elif _is_text(head):
            reason = "is text, not audio"
        else:
            reason = f"is not audio that can be read ({_reason(error)})"
        raise InputError(f"{path}: {reason}; convert it to WAV or FLAC.") from None


def _is_text(head: bytes) -> bool:
    try:
        text = head.decode("ascii")
    except UnicodeDecodeError:
        return False
    return all(letter.isprintable() or letter in "\t\r\n\f" for letter in text)


def _reason(error: Exception) -> str:
    text = getattr(error, "error_string", None) or str(error)
    return " ".join(text.split()).rstrip(".")


def _read_mono(path: Path, max_seconds: float) -> tuple[Float[np.ndarray, " N"], int]:
    # In blocks: a header may claim more samples than fit into memory.
    import soundfile

    with _open(path) as sound:
        rate, channels, claimed, format = sound.samplerate, sound.channels, sound.frames, sound.format
        if not _LOWEST_RATE <= rate <= _HIGHEST_RATE:
            raise InputError(f"{path}: has a sample rate of {rate} Hz; expected {_LOWEST_RATE} to {_HIGHEST_RATE}.")
        longest = int(max_seconds * rate)
        if longest < claimed != _UNKNOWN_LENGTH:
            _refuse_length(path, claimed / rate, max_seconds)
        blocks: list[np.ndarray] = []
        count, peak = 0, 0.0
        size = max(1, 2**19 // channels)
        while True:
            try:
                block = sound.read(size, dtype="float32", always_2d=True)
            except (soundfile.LibsndfileError, RuntimeError) as error:
                raise InputError(
                    f"{path}: is damaged after {count / rate:.1f} s ({_reason(error)}); export it again."
                ) from None
            if len(block) == 0:
                break
            finite = np.isfinite(block).all(axis=1)
            if not finite.all():
                at = (count + int(np.argmin(finite))) / rate
                raise InputError(f"{path}: contains NaN or infinity at {at:.3f} s; export it again.")
            count += len(block)
            if count > longest:
                _refuse_length(path, count / rate, max_seconds)
            peak = max(peak, float(np.max(np.abs(block))))
            blocks.append(block.mean(axis=1, dtype=np.float64).astype(np.float32))
    if count == 0:
        raise InputError(f"{path}: contains no samples; record or export it again.")
    if format in _EXACT and claimed != _UNKNOWN_LENGTH and count < claimed:
        raise InputError(
            f"{path}: is cut short: the header says {claimed / rate:.2f} s and {count / rate:.2f} s can be read; "
            "copy or export it again."
        )
    samples = np.concatenate(blocks)
    _check_level(path, samples, peak)
    return samples, rate


def _refuse_length(path: Path, seconds: float, max_seconds: float) -> None:
    raise InputError(f"{path}: is {seconds:.0f} s long, and the limit is {max_seconds:.0f} s; split it.")


def _check_level(path: Path, samples: Float[np.ndarray, " N"], peak: float) -> None:
    if peak > _LOUDEST:
        raise InputError(f"{path}: has samples as large as {peak:.4g}; scale them to -1 to 1.")
    if peak < SILENCE:
        raise InputError(f"{path}: is silent (its peak is below -70 dB of full scale); check the recording.")
    if np.max(np.abs(samples)) < SILENCE:
        raise InputError(f"{path}: is silent as mono, because its channels cancel out; export one channel.")
