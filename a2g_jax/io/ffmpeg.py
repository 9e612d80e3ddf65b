"""Sound of files that libsndfile does not read, by the program ffmpeg where it is installed."""

import re
import shlex
import shutil
import struct
import subprocess
import tempfile
import threading
from pathlib import Path
from types import TracebackType
from typing import IO

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError

#: Suffixes of these files, with what they are.
KINDS = {
    ".m4a": "MPEG-4 audio", ".m4b": "MPEG-4 audio", ".mp4": "an MPEG-4 video", ".m4v": "an MPEG-4 video",
    ".mov": "a QuickTime video", ".3gp": "a 3GP recording", ".aac": "AAC audio", ".webm": "a WebM recording",
    ".mkv": "a Matroska video", ".mka": "Matroska audio", ".wma": "Windows Media audio", ".wmv": "Windows Media video",
    ".asf": "a Windows Media file", ".amr": "an AMR recording", ".awb": "an AMR recording", ".ac3": "AC-3 audio",
    ".ape": "Monkey's Audio", ".wv": "WavPack audio", ".avi": "an AVI video",
}  # fmt: skip
#: The same by the first bytes, for files with another suffix.
_SIGNATURES = (
    (b"\x1a\x45\xdf\xa3", "a WebM or Matroska recording"),
    (b"\x30\x26\xb2\x75\x8e\x66\xcf\x11", "a Windows Media file"),
    (b"#!AMR", "an AMR recording"),
    (b"ADIF", "AAC audio"),
    (b"MAC ", "Monkey's Audio"),
    (b"wvpk", "WavPack audio"),
)
#: First bytes of files that libsndfile reads, whatever their names.
_OTHERS = (b"RIFF", b"RF64", b"BW64", b"RIFX", b"fLaC", b"OggS", b"FORM", b"caff", b"riff")
#: Longest time without an end, seconds.
_TIMEOUT = 900.0
_HEADER_LIMIT = 2**20


def ffmpeg_kind(path: Path, head: bytes) -> str:
    """What a file is that ffmpeg reads; empty for other files.

    Args:
        head: its first bytes.
    """
    if head[:4] in _OTHERS:
        return ""
    if head[4:8] == b"ftyp":
        return KINDS.get(path.suffix.lower(), "an MPEG-4 file")
    # Sync word and layer of ADTS; MP3 has another layer.
    if len(head) > 1 and head[0] == 0xFF and head[1] & 0xF6 == 0xF0:
        return "AAC audio"
    for signature, kind in _SIGNATURES:
        if head.startswith(signature):
            return KINDS.get(path.suffix.lower(), kind)
    return KINDS.get(path.suffix.lower(), "")


def conversion(path: Path, suffix: str = "") -> str:
    """The command that converts a file to WAV.

    Args:
        suffix: of the new file's name.
    """
    target = path.with_name(f"{path.stem}{suffix}.wav")
    if target.name == path.name:
        target = path.with_name(f"{path.stem}_converted.wav")
    return f"ffmpeg -i {shlex.quote(str(path))} {shlex.quote(str(target))}"


class FfmpegSound:
    """Samples of a file, decoded by ffmpeg and read from a pipe; the interface of ``soundfile.SoundFile``."""

    format, subtype = "FFMPEG", "FLOAT"
    frames = 2**63 - 1
    """Not known before the end."""

    def __init__(self, path: Path, kind: str, max_seconds: float) -> None:
        """
        Args:
            kind: what the file is, with its article.
            max_seconds: decode this much and a second more.

        Raises:
            InputError: ffmpeg is not installed, or finds no sound in the file.
        """
        program = shutil.which("ffmpeg")
        if program is None:
            raise InputError(
                f"{path}: is {kind}, which needs ffmpeg; install it, or convert the file: {conversion(path)}"
            )
        self.path = path
        self._errors: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 (closed by close)
        # "file:" and the whitelist: a list of other files or addresses inside the file is not followed.
        self._process = subprocess.Popen(
            [
                program, "-nostdin", "-hide_banner", "-v", "error", "-protocol_whitelist", "file,pipe",
                "-i", f"file:{path.resolve()}", "-map", "0:a:0", "-vn", "-sn", "-dn", "-t", f"{max_seconds + 1:.3f}",
                "-map_metadata", "-1", "-c:a", "pcm_f32le", "-f", "wav", "pipe:1",
            ],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=self._errors,
        )  # fmt: skip
        assert self._process.stdout is not None
        self._pipe = self._process.stdout
        self._late = False
        self._timer = threading.Timer(_TIMEOUT, self._stop_late)
        self._timer.daemon = True
        self._timer.start()
        try:
            self.channels, self.samplerate = self._header()
        except BaseException:
            self.close()
            raise

    def _header(self) -> tuple[int, int]:
        head = self._exactly(12)
        found = None
        for _ in range(64):
            chunk = self._exactly(8)
            if head[:4] != b"RIFF" or len(chunk) < 8:
                break
            name, size = struct.unpack("<4sI", chunk)
            if name == b"data" and found is not None:
                return found
            if size > _HEADER_LIMIT:
                break
            body = self._exactly(size + size % 2)
            if name == b"fmt " and len(body) >= 16:
                found = struct.unpack_from("<HI", body, 2)
        self._check_end()
        raise InputError(f"{self.path}: holds no sound that ffmpeg can decode; convert it to WAV.")

    def read(
        self,
        frames: int,
        dtype: str = "float32",  # noqa: ARG002 (of soundfile's interface)
        always_2d: bool = True,  # noqa: ARG002
    ) -> Float[np.ndarray, "n C"]:
        """The next samples, float32; none at the end.

        Raises:
            InputError: ffmpeg failed.
        """
        data = self._exactly(4 * self.channels * frames)
        if len(data) < 4 * self.channels * frames:
            self._check_end()
        whole = len(data) // (4 * self.channels) * 4 * self.channels
        return np.frombuffer(data[:whole], "<f4").reshape(-1, self.channels).astype(np.float32, copy=False)

    def _exactly(self, count: int) -> bytes:
        parts = []
        while count and (part := self._pipe.read(min(count, 2**20))):
            parts.append(part)
            count -= len(part)
        return b"".join(parts)

    def _check_end(self) -> None:
        """Raise if ffmpeg failed; it has closed its output."""
        code = self._process.wait()
        if self._late:
            raise InputError(f"{self.path}: ffmpeg did not finish within {_TIMEOUT:.0f} s; convert it to WAV.")
        if code:
            reason = self._first_error() or f"exit status {code}"
            if "matches no streams" in reason:
                raise InputError(f"{self.path}: holds no sound, only other streams; name a file with speech.")
            raise InputError(f"{self.path}: cannot be decoded by ffmpeg ({reason}); export it again, or as WAV.")

    def _first_error(self) -> str:
        self._errors.seek(0)
        lines = self._errors.read(4096).decode("utf-8", "replace").strip().splitlines()
        # Without the decoder's name and address, such as "[mov,mp4,m4a @ 0x5581a0]".
        first = re.sub(r"^(\[[^]]* @ 0x[0-9a-f]+\] *)+", "", " ".join(lines[0].split())) if lines else ""
        return first[:200].rstrip(".")

    @property
    def remark(self) -> str:
        """What ffmpeg reported although it decoded the file, once all is read."""
        reason = self._first_error()
        return f"ffmpeg reports: {reason}." if reason else ""

    def _stop_late(self) -> None:
        self._late = True
        self._process.kill()

    def close(self) -> None:
        """End ffmpeg."""
        self._timer.cancel()
        if self._process.poll() is None:
            self._process.kill()
        self._pipe.close()
        self._process.wait()
        self._errors.close()

    def __enter__(self) -> "FfmpegSound":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
