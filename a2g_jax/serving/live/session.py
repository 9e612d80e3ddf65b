"""One client of ``/live``, from its first message to its last frame."""

import asyncio
import json
import logging
import time
from collections.abc import Awaitable
from dataclasses import asdict
from typing import Any, TypeVar

import numpy as np
from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from a2g_jax.errors import InputError
from a2g_jax.generation.live.stream import Stream
from a2g_jax.geometry.motion import Motion
from a2g_jax.serving.live.drawn import Drawn
from a2g_jax.serving.live.protocol import (
    BROKEN,
    BUSY,
    LIMITED,
    MALFORMED,
    VERSION,
    Hello,
    Refusal,
    decode_audio,
    frames_binary,
    frames_json,
    parse_hello,
    parse_object,
)
from a2g_jax.serving.live.service import Service

#: Seconds of audio that are computed at a time, so that clients take turns.
PIECE = 0.2
_LOG = logging.getLogger("a2g_jax.serving")

Result = TypeVar("Result")


async def live(websocket: WebSocket, service: Service) -> None:
    """Answer one client; whatever it sends, this returns and its place is free again."""
    await websocket.accept()
    try:
        if service.clients >= service.limits.clients:
            raise Refusal(BUSY, f"{service.limits.clients} clients are connected, the most at a time; try again later.")
        service.clients += 1
        try:
            await Session(websocket, service).answer()
        finally:
            service.clients -= 1
    except Refusal as refusal:
        await _end(websocket, refusal)
    except (WebSocketDisconnect, OSError):
        pass
    except Exception as error:  # noqa: BLE001 - one client's fault must not be everybody's
        # The client gets no details; a server in a terminal shows them.
        _LOG.exception("live: unexpected %s", type(error).__name__)
        await _end(websocket, Refusal(BROKEN, f"unexpected {type(error).__name__} on the server."))


class Pace:
    """How fast the audio of a client is read."""

    def __init__(self, pace: float, burst: float) -> None:
        """
        Args:
            pace: times real time.
            burst: seconds of audio that are read without waiting.
        """
        self._pace, self._burst = pace, burst
        self._start: float | None = None
        #: Audio so far.
        self.seconds = 0.0

    def wait(self, seconds: float, now: float) -> float:
        """Seconds to wait before further audio is taken, at a time."""
        self._start = now if self._start is None else self._start
        self.seconds += seconds
        return max(0.0, (self.seconds - self._burst) / self._pace - (now - self._start))


class Session:
    """The stream of one client."""

    def __init__(self, websocket: WebSocket, service: Service) -> None:
        self.websocket, self.service, self.limits = websocket, service, service.limits
        self._sent = 0
        self._pace = Pace(self.limits.pace, self.limits.burst)

    async def answer(self) -> None:
        """First message, audio, end.

        Raises:
            Refusal: the client broke the protocol or a limit.
        """
        first = await self._message()
        if not isinstance(first, str):
            raise Refusal(MALFORMED, 'the first message: expected a JSON object, {"sample_rate": 48000}.')
        hello = parse_hello(first)
        stream = await self.service.open(hello)
        encode, ready = await self.service.compute(self._prepare, hello, stream)
        await self._send(ready)
        while True:
            message = await self._message()
            if isinstance(message, str):
                if parse_object(message, "message").get("type") != "end":
                    raise Refusal(MALFORMED, 'text after the first message: expected {"type": "end"}.')
                await self._give(await self.service.compute(_made, stream.finish, encode, self._sent))
                await self._send(
                    json.dumps({"type": "end", "total": self._sent, "seconds": round(self._pace.seconds, 6)})
                )
                await self.websocket.close(1000, "end")
                return
            samples = decode_audio(message, hello.encoding)
            piece = max(1, round(PIECE * hello.sample_rate))
            for start in range(0, len(samples), piece):
                part = samples[start : start + piece]
                # Nothing is read meanwhile, so that the client waits as well.
                await asyncio.sleep(self._pace.wait(len(part) / hello.sample_rate, time.monotonic()))
                await self._give(await self.service.compute(_made, stream.push, encode, self._sent, part))

    def _prepare(self, hello: Hello, stream: Stream) -> tuple[Any, str]:
        """What encodes frames, and the first message of the server."""
        drawn = Drawn(stream, self.service.delivery)
        encoders = {"json": drawn.encoded(frames_json), "binary": drawn.encoded(frames_binary), "points": drawn.points}
        skeleton = drawn.own.skeleton
        ready: dict[str, Any] = {
            "type": "ready",
            "version": VERSION,
            "fps": stream.fps,
            "latency": {**asdict(stream.latency), "total": stream.latency.total},
            "reply": hello.reply,
            "metres": drawn.metres,
            "skeleton": {
                "joints": list(skeleton.names),
                "parents": list(skeleton.parents),
                "offsets": np.asarray(skeleton.offsets, np.float64).round(6).tolist(),
            },
        }
        if hello.reply == "points":
            ready["figure"] = drawn.figure()
        return encoders[hello.reply], json.dumps(ready, separators=(",", ":"))

    async def _message(self) -> str | bytes:
        """The next message of the client."""
        event = await self._within(self.websocket.receive(), "sent nothing")
        if event["type"] == "websocket.disconnect":
            raise WebSocketDisconnect(event.get("code") or 1005)
        text = event.get("text")
        return text if text is not None else event.get("bytes") or b""

    async def _give(self, made: tuple[int, str | bytes | None]) -> None:
        frames, message = made
        if message is not None:
            self._sent += frames
            await self._send(message)

    async def _send(self, message: str | bytes) -> None:
        kind = "text" if isinstance(message, str) else "bytes"
        await self._within(self.websocket.send({"type": "websocket.send", kind: message}), "read nothing")

    async def _within(self, waiting: Awaitable[Result], what: str) -> Result:
        try:
            return await asyncio.wait_for(waiting, self.limits.idle)
        except TimeoutError:
            raise Refusal(LIMITED, f"the client {what} for {self.limits.idle:g} s.") from None


def _made(function: Any, encode: Any, first: int, *arguments: Any) -> tuple[int, str | bytes | None]:
    """Number of new frames and their message; in a thread."""
    try:
        motion: Motion = function(*arguments)
    except InputError as error:
        raise Refusal(MALFORMED, str(error)) from None
    return motion.frames, encode(motion, first) if motion.frames else None


async def _end(websocket: WebSocket, refusal: Refusal) -> None:
    """Send the whole reason, and close with as much of it as a close frame holds."""
    if websocket.application_state != WebSocketState.CONNECTED:
        return
    try:
        async with asyncio.timeout(2):
            await websocket.send_json({"type": "error", "code": refusal.code, "error": refusal.reason})
            await websocket.close(refusal.code, refusal.short)
    except (TimeoutError, RuntimeError, OSError, WebSocketDisconnect):
        pass  # gone already, or it does not read
