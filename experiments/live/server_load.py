"""A server under load and misuse: ``python -m experiments.live.server_load [--run demo-flow] [--clients 20]``.

The server is a process of its own, as ``a2g serve`` starts it. After a warm-up round, rounds of well-behaved clients,
malformed messages, sudden disconnects, oversized messages and connections without a word are repeated; its memory is
measured between them. A last client, and the first one, get the same motion for the same speech and seed.
"""

import argparse
import asyncio
import hashlib
import json
import os
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake

from a2g_jax.errors import InputError
from a2g_jax.io.audio import resampled
from a2g_jax.serving.client import converse
from a2g_jax.talker.recordings import talk

RATE = 16000
HELLO = json.dumps({"sample_rate": RATE})
#: Conversations that end with a close code, as lists of messages.
MALFORMED: dict[str, list[str | bytes]] = {
    "no JSON": ["hello"],
    "deep JSON": ["[" * 10000],
    "audio first": [b"\0\0"],
    "no rate": ["{}"],
    "rate of 0": ['{"sample_rate": 0}'],
    "two channels": ['{"sample_rate": 16000, "channels": 2}'],
    "unknown field": ['{"sample_rate": 16000, "x": 1}'],
    "bad setting": ['{"sample_rate": 16000, "sampling": {"temperature": "x"}}'],
    "odd bytes": [HELLO, b"\0\0\0"],
    "NaN": ['{"sample_rate": 16000, "encoding": "f32le"}', b"\xff" * 4000],
    "text in between": [HELLO, b"\0\0", "what?"],
    "oversized": [HELLO, b"\0" * 2_000_000],
    "oversized text": ["x" * 2_000_000],
}


def resident(process: int) -> float:
    """MB of a process in memory."""
    pages = int(Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


async def refused(url: str, messages: list[str | bytes]) -> int:
    """The close code of a conversation."""
    try:
        async with connect(url, max_size=None, compression=None, ping_interval=None) as client:
            for message in messages:
                await client.send(message)
            async for _ in client:
                pass
            return client.close_code or 1006
    except ConnectionClosed as error:
        return error.rcvd.code if error.rcvd else 1006
    except (InvalidHandshake, OSError):
        return 0


async def vanish(url: str, audio: np.ndarray, number: int) -> None:
    """Connect, send some audio, and be gone without a close frame."""
    try:
        async with asyncio.timeout(60):
            client = await connect(url, compression=None, ping_interval=None)
            await client.send(HELLO)
            await client.recv()
            for start in range(0, (number % 7) * 4000, 4000):
                await client.send((audio[start : start + 4000] * 32767).astype("<i2").tobytes())
            client.transport.abort()
    except (ConnectionClosed, InvalidHandshake, TimeoutError, OSError):
        pass


def noise(port: int) -> None:
    """Bytes that are no HTTP, and half a handshake."""
    for data in (b"\x16\x03\x01" + os.urandom(200), b"GET /live HTTP/1.1\r\nHost: localhost\r\nUpgr", b"\0" * 100_000):
        try:
            with socket.create_connection(("127.0.0.1", port), timeout=5) as raw:
                raw.sendall(data)
        except OSError:
            pass


async def round_of(url: str, port: int, audio: np.ndarray, clients: int, pace: float) -> dict[str, Any]:
    """One round of everything, at the same time."""

    async def good(number: int) -> str:
        try:
            received = await converse(url, audio, RATE, pace, seed=number)
        except InputError as error:
            return f"refused: {str(error)[-60:]}"
        return hashlib.sha256(np.array(received.rotations).tobytes()).hexdigest()[:12]

    start = time.monotonic()
    well = await asyncio.gather(*[good(number) for number in range(clients)])
    seconds = time.monotonic() - start
    gone = asyncio.gather(*[vanish(url, audio, number) for number in range(clients)])
    codes = dict(
        zip(MALFORMED, await asyncio.gather(*[refused(url, messages) for messages in MALFORMED.values()]), strict=True)
    )
    await gone
    await asyncio.to_thread(noise, port)
    return {"seconds": round(seconds, 1), "motions": well, "codes": codes}


def main() -> None:
    """Start the server, repeat the rounds, print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", default="demo-flow")
    parser.add_argument("--clients", type=int, default=20)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=5.0, help="of speech of each client")
    parser.add_argument("--pace", type=float, default=0.0, help="times real time; 0 for as fast as the server reads")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    audio = resampled(talk(max(args.seconds, 2.0), 1).audio, 16000, RATE)[: round(args.seconds * RATE)]
    flags = ["--port", "0", "--clients", str(args.clients + len(MALFORMED) + args.clients), "--idle", "300"]
    command = [sys.executable, "-m", "a2g_jax.cli", "serve", args.run, *flags]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        url = next(line.split()[0] for line in server.stdout if line.startswith("http"))
        port = int(url.rstrip("/").rsplit(":", 1)[1])
        rows, live = [], f"{url.replace('http', 'ws')}live"
        for number in range(args.rounds + 1):
            row = asyncio.run(round_of(live, port, audio, args.clients, args.pace))
            time.sleep(1.0)
            row["resident_mb"] = round(resident(server.pid), 1)
            row["alive"] = server.poll() is None
            rows.append(row)
            print(number, row["resident_mb"], row["seconds"], row["codes"], sorted(set(row["motions"]))[:3], flush=True)
        server.terminate()
        errors = server.stderr.read() if server.stderr else ""
    same = all(row["motions"] == rows[0]["motions"] for row in rows)
    memory = [row["resident_mb"] for row in rows]
    result = {
        "run": args.run,
        "clients": args.clients,
        "rounds": args.rounds,
        "resident_mb_after_each": memory,
        "growth_mb_after_first": round(memory[-1] - memory[0], 1),
        "all_motions_equal_in_all_rounds": same,
        "different_motions": len(set(rows[0]["motions"])),
        "codes": rows[-1]["codes"],
        "seconds": [row["seconds"] for row in rows],
        "crashed": not all(row["alive"] for row in rows),
        "tracebacks": errors.count("Traceback"),
    }
    print(json.dumps(result, indent=1))
    if args.out:
        args.out.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
