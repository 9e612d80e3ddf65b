"""A client of ``a2g serve``: ``python -m a2g_jax.serving.client speech.wav ws://127.0.0.1:8765/live``.

Sends a sound file as a microphone would, in pieces of 20 ms and in real time, and prints how far behind the frames are.
"""

import argparse
import asyncio
import json
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.io.audio import read_audio
from a2g_jax.io.files import atomic_path
from a2g_jax.serving.live.protocol import read_binary

#: Seconds of audio in a message, and the rate that files are read at, Hz.
PIECE, RATE = 0.02, 48000


@dataclass
class Received:
    """What a server has sent."""

    ready: dict[str, Any] = field(default_factory=dict)
    """Its first message: frame rate, skeleton, latency."""
    root: list[Float[np.ndarray, " 3"]] = field(default_factory=list)
    """Of each frame."""
    rotations: list[Float[np.ndarray, "J 4"]] = field(default_factory=list)
    """Of each frame: quaternions x, y, z, w."""
    delays: list[float] = field(default_factory=list)
    """Seconds between the sound at the time of a frame and its arrival; in real time only."""


async def converse(
    url: str, samples: Float[np.ndarray, " N"], sample_rate: int, pace: float = 1.0, **hello: Any
) -> Received:
    """All frames of a speech.

    Args:
        pace: times real time at which the speech is sent; 0 for as fast as the server reads.
        hello: further fields of the first message, such as ``seed=3``.

    Raises:
        InputError: the server cannot be reached, or refuses, with its reason.
    """
    from websockets.asyncio.client import connect
    from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidURI

    received = Received()
    try:
        # Without pings, whose answers would wait behind audio that the server has not read yet.
        async with connect(url, max_size=2**24, compression=None, ping_interval=None) as socket:
            await socket.send(json.dumps({"sample_rate": sample_rate, "encoding": "f32le", "reply": "binary", **hello}))
            received.ready = _text(await socket.recv())
            start = time.monotonic()
            sending = asyncio.create_task(_send(socket, samples, sample_rate, pace, start))
            try:
                async for message in socket:
                    if isinstance(message, str):
                        _text(message)
                    else:
                        _add(received, message, time.monotonic() - start)
            finally:
                sending.cancel()
    except (OSError, InvalidHandshake, InvalidURI) as error:
        raise InputError(
            f"{url}: no answer ({error}); start one with 'a2g serve' and use the URL that it prints."
        ) from None
    except ConnectionClosed as error:
        raise InputError(f"{url}: {error.reason or 'the connection is lost'}.") from None
    return received


async def _send(socket: Any, samples: np.ndarray, sample_rate: int, pace: float, start: float) -> None:
    piece = max(1, round(PIECE * sample_rate))
    for at in range(0, len(samples), piece):
        if pace:
            await asyncio.sleep(max(0.0, start + at / sample_rate / pace - time.monotonic()))
        await socket.send(samples[at : at + piece].astype("<f4").tobytes())
    await socket.send('{"type": "end"}')


def _text(message: str | bytes) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(message)
    if found.get("type") == "error":
        raise InputError(f"the server refuses: {found['error']}")
    return found


def _add(received: Received, message: bytes, now: float) -> None:
    joints = len(received.ready["skeleton"]["joints"])
    first, rows = read_binary(message, 3 + 4 * joints)
    received.root.extend(rows[:, :3])
    received.rotations.extend(rows[:, 3:].reshape(-1, joints, 4))
    received.delays.extend(now - (first + number) / received.ready["fps"] for number in range(len(rows)))


def main(arguments: list[str] | None = None) -> int:
    """Send the file, print, and write the frames where requested."""
    parser = argparse.ArgumentParser(prog="python -m a2g_jax.serving.client", description=__doc__.split("\n")[0])
    parser.add_argument("audio", help="a sound file")
    parser.add_argument("url", help="such as ws://127.0.0.1:8765/live")
    parser.add_argument("--out", type=Path, help="NPZ to write: rotations (frames, joints, x y z w), root, joints, fps")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--pace", type=float, default=1.0, help="times real time (default: 1); 0 for as fast as it goes"
    )
    options = parser.parse_args(arguments)
    try:
        samples = read_audio(options.audio, RATE)
        received = asyncio.run(converse(options.url, samples, RATE, options.pace, seed=options.seed))
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    fps, frames = received.ready["fps"], len(received.root)
    print(f"{frames} frames at {fps:g} fps for {len(samples) / RATE:.2f} s of speech")
    if options.pace == 1 and frames:
        median, late = np.percentile(received.delays, (50, 99))
        total = received.ready["latency"]["total"]
        print(f"behind the sound: {median:.2f} s (median), {late:.2f} s (99th percentile); look-ahead {total:.2f} s")
    if options.out:
        joints = np.array(received.ready["skeleton"]["joints"])
        with atomic_path(options.out) as temporary, temporary.open("wb") as file:
            rotations, root = np.array(received.rotations), np.array(received.root)
            np.savez(file, rotations=rotations, root=root, joints=joints, fps=fps)
    return 0


if __name__ == "__main__":
    sys.exit(main())
