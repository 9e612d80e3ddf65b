"""Detection of truncated WAV files, which libsndfile reads without an error."""

import struct
from pathlib import Path

from a2g_jax.errors import InputError

#: Placeholder sizes of programs that write to a pipe and cannot know the length.
_STREAMED = (0xFFFFFFFF, 0x7FFFFFFF, 0x7FFFF000, 0)


def check_wav_length(path: Path) -> None:
    """Raise ``InputError`` for a WAV (RIFF or RF64) file that is cut short; other files pass."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(12)
        if len(head) < 4 or head[:4] not in (b"RIFF", b"RF64"):
            return
        if len(head) < 12:
            raise InputError(f"{path}: is cut short inside its header; copy or export it again.")
        if head[8:] != b"WAVE":
            return
        long_size = None
        # Each chunk is a name, a size and as many bytes, padded to an even number.
        while len(chunk := file.read(8)) == 8:
            name, claimed = chunk[:4], struct.unpack("<I", chunk[4:])[0]
            start = file.tell()
            if name == b"ds64" and claimed >= 16:
                long_size = struct.unpack("<Q", file.read(16)[8:].ljust(8, b"\0"))[0]
            if name == b"data":
                if long_size is not None and claimed == 0xFFFFFFFF:
                    claimed = long_size
                elif claimed in _STREAMED:
                    return
                if start + claimed > size:
                    raise InputError(
                        f"{path}: is cut short: the header says {claimed} bytes of samples and the file has "
                        f"{max(size - start, 0)}; copy or export it again."
                    )
                return
            file.seek(start + claimed + claimed % 2)
    raise InputError(f"{path}: has no samples in it (no 'data' chunk); is it cut short? Copy or export it again.")
