"""HDF5 files read in a process of its own, so that a file that crashes the C library or never ends is one error.

The process is started with the first file and reads all that follow; it is started anew after a crash.
"""

import atexit
import json
import os
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.io.hdf5_arrays import read_hdf5_here
from a2g_jax.io.untrusted.budget import Limits

#: Seconds for one file: 2 GB are read in less.
_SECONDS = 60.0
#: Memory beyond that of the arrays: Python, NumPy and the library.
_PROGRAM = 3 * 2**30
_START = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from a2g_jax.io.hdf5_process import serve; serve()"

_lock = threading.Lock()
_running: dict[int, subprocess.Popen[bytes]] = {}


def read_apart(path: Path, names: Sequence[str], limits: Limits) -> dict[str, np.ndarray]:
    """The arrays of :func:`~a2g_jax.io.hdf5_arrays.read_hdf5_here`, read by the other process.

    Raises:
        InputError: as there; or the library crashed, or did not end.
    """
    whole = os.path.abspath(path)  # noqa: PTH100 - links stay; the folder of the other process may differ
    request = {"path": whole, "names": list(names), "size": limits.size}
    with _lock:
        process = _process()
        assert process.stdin is not None
        assert process.stdout is not None
        timer = threading.Timer(_SECONDS, process.kill)
        timer.start()
        error: str | None = None
        complete = False
        try:
            process.stdin.write(json.dumps(request).encode() + b"\n")
            process.stdin.flush()
            answer = json.loads(process.stdout.readline())
            error = answer.get("error")
            found = {name: _received(process.stdout, *rest) for name, *rest in answer.get("arrays", ())}
            complete = True
        except (OSError, ValueError, EOFError):
            pass
        finally:
            timer.cancel()
            # Also after an interrupt: the rest of an answer would be read as the next one.
            if not complete:
                _end()
    if complete and error is None:
        return found
    if error is None:
        reason = "the HDF5 library crashed on it, or did not end"
        raise InputError(f"{path}: is damaged ({reason}); copy or download it again.")
    raise InputError(error.replace(whole, str(path), 1))


def _received(pipe: IO[bytes], kind: str, shape: list[int], size: int) -> np.ndarray:
    data = bytearray(size)
    view, done = memoryview(data), 0
    while done < size:
        got = pipe.readinto(view[done:])  # type: ignore[attr-defined]
        if not got:
            raise EOFError
        done += got
    return np.frombuffer(data, np.dtype(kind)).reshape(shape)


def _process() -> "subprocess.Popen[bytes]":
    """The process of this one, which a fork does not share."""
    process = _running.get(os.getpid())
    if process is None or process.poll() is not None:
        _running.clear()
        command = [sys.executable, "-c", _START, json.dumps(sys.path)]
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, bufsize=-1
        )
        _running[os.getpid()] = process
    return process


@atexit.register
def _end() -> None:
    process = _running.pop(os.getpid(), None)
    if process is not None:
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with suppress(OSError):
                    pipe.close()


def serve() -> None:
    """Answer requests of standard input until it ends."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing else may write between the answers
    for line in sys.stdin.buffer:
        request = json.loads(line)
        limits = Limits(size=request["size"])
        _bound(limits.size)
        arrays: dict[str, np.ndarray] = {}
        answer: dict[str, Any]
        try:
            arrays = read_hdf5_here(Path(request["path"]), request["names"], limits)
            answer = {"arrays": [[name, one.dtype.str, one.shape, one.nbytes] for name, one in arrays.items()]}
        except InputError as error:
            answer = {"error": str(error)}
        out.write(json.dumps(answer).encode() + b"\n")
        for array in arrays.values():
            out.write(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data if array.size else b"")
        out.flush()


def _bound(size: int) -> None:
    with suppress(ImportError, OSError, ValueError):  # no such limits on Windows
        import resource

        most = 3 * size + _PROGRAM
        resource.setrlimit(resource.RLIMIT_AS, (most, resource.getrlimit(resource.RLIMIT_AS)[1]))
