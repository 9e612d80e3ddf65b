"""Audio files opened by whatever reads them: libsndfile, ffmpeg, or libsndfile with a repaired header."""

import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.io.ffmpeg import KINDS, FfmpegSound, ffmpeg_kind
from a2g_jax.io.riff import rebuilt, wav_layout

#: Suffixes of files that libsndfile reads, and of those that need ffmpeg.
AUDIO_SUFFIXES = (".wav", ".flac", ".ogg", ".mp3", ".aiff", ".aif", ".au", ".w64", ".caf", ".opus", ".rf64", ".bw64")
FFMPEG_SUFFIXES = tuple(KINDS)


@contextmanager
def open_sound(path: Path, max_seconds: float) -> Iterator[tuple[Any, str]]:
    """An open file with the interface of ``soundfile.SoundFile``, and a remark on its header.

    Args:
        max_seconds: what needs ffmpeg is decoded no further.

    Raises:
        InputError: not audio, cut short, or ffmpeg is needed and not installed.
    """
    with path.open("rb") as file:
        head = file.read(512)
    if (kind := ffmpeg_kind(path, head)) and not _is_text(head):
        with FfmpegSound(path, kind, max_seconds) as decoded:
            yield decoded, ""
        return
    layout = wav_layout(path)
    if layout is None or layout.plain:
        with _soundfile(path, head) as sound:
            yield sound, ""
        return
    with rebuilt(path, layout) as whole, _soundfile(path, head, whole) as sound:
        yield sound, layout.note


def _soundfile(path: Path, head: bytes, file: Any = None) -> Any:
    import soundfile

    # soundfile reads files of this suffix as headerless samples, whatever their content.
    if path.suffix.lower() == ".raw":
        raise InputError(f"{path}: raw samples have no header with their rate; convert the file to WAV.")
    try:
        return soundfile.SoundFile(str(path) if file is None else file)
    except (soundfile.LibsndfileError, UnicodeError, RuntimeError, TypeError) as error:
        if head[:4] in (b"RIFF", b"RF64", b"BW64", b"fLaC", b"OggS"):
            reason = f"is a damaged audio file ({reason_of(error)})"
        elif _is_text(head):
            reason = "is text, not audio"
        elif (at := max(head.find(b"RIFF"), 0)) and head[at + 8 : at + 12] == b"WAVE":
            raise InputError(
                f"{path}: {at} other bytes come before its header; remove them:"
                f" tail -c +{at + 1} {shlex.quote(str(path))} > whole.wav"
            ) from None
        elif path.suffix.lower() == ".wav" and len(head) > 44 and not head[:44].strip(b"\0"):
            raise InputError(
                f"{path}: its header was never written (zeros); samples may follow in the other"
                f" {path.stat().st_size - 44} bytes. With the recorder's rate and channels: ffmpeg"
                f" -skip_initial_bytes 44 -f s16le -ar 48000 -ac 1 -i {shlex.quote(str(path))} whole.wav"
            ) from None
        else:
            reason = f"is not audio that can be read ({reason_of(error)})"
        raise InputError(f"{path}: {reason}; convert it to WAV or FLAC.") from None


def _is_text(head: bytes) -> bool:
    try:
        text = head.decode("ascii")
    except UnicodeDecodeError:
        return False
    return all(letter.isprintable() or letter in "\t\r\n\f" for letter in text)


def reason_of(error: Exception) -> str:
    """The message of an error of libsndfile on one line."""
    text = getattr(error, "error_string", None) or str(error)
    return " ".join(text.split()).rstrip(".")
