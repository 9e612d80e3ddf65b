"""What every request to a local server passes: host and origin, limits of bodies, and headers of responses."""

import asyncio
import ipaddress
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[MutableMapping[str, Any], Receive, Send], Awaitable[None]]

#: Bytes of a request's body where nothing else is set, and seconds in which it must have arrived.
BODY_LIMIT, BODY_SECONDS = 64 * 1024, 30.0
#: What pages may load; a response with a policy of its own keeps that.
POLICY: Mapping[str, str] = {
    "default-src": "'none'",
    "script-src": "'self'",
    "style-src": "'self'",
    "connect-src": "'self'",
    "worker-src": "'self'",
    "img-src": "'self' data: blob:",
    "media-src": "'self' blob:",
    "base-uri": "'none'",
    "form-action": "'none'",
    "frame-ancestors": "'none'",
}
_HEADERS = {
    b"x-content-type-options": b"nosniff",
    b"referrer-policy": b"no-referrer",
    b"cross-origin-opener-policy": b"same-origin",
    b"cross-origin-resource-policy": b"same-origin",
    b"permissions-policy": b"microphone=(self), camera=(), geolocation=()",
    b"cache-control": b"no-store",
}
#: Methods that change nothing.
_READING = ("GET", "HEAD")
#: Close code of a WebSocket that is refused for its origin or host.
REFUSED = 1008


@dataclass(frozen=True)
class Security:
    """What a server lets in, and what its pages may do."""

    host: str = "127.0.0.1"
    """The address that the server listens on."""
    allowed_hosts: tuple[str, ...] = ()
    """Further names in the address bar that are this server, without a port."""
    body_limits: Mapping[str, int] = field(default_factory=dict)
    """Bytes of bodies by the beginning of a path, such as ``{"/upload": 200_000_000}``; the longest that fits holds."""
    body_seconds: Mapping[str, float] = field(default_factory=dict)
    """Seconds in which a body must have arrived, in the same way."""
    policy: Mapping[str, str] = field(default_factory=dict)
    """Directives in place of those of :data:`POLICY`."""


class Guard:
    """An ASGI application in front of another one.

    The ``Host`` of a request must be a name of this computer: a page of another site cannot reach the server by a name
    of its own that is resolved to this address (DNS rebinding). The ``Origin`` of WebSockets and of everything that is
    not a GET must be this server; programs that are no browsers send none. Bodies are counted while they arrive.
    """

    def __init__(self, app: Application, security: Security) -> None:
        self.app, self.security = app, security
        directives = {**POLICY, **security.policy}
        policy = "; ".join(f"{name} {value}" for name, value in directives.items())
        self._headers = {**_HEADERS, b"content-security-policy": policy.encode("ascii")}

    async def __call__(self, scope: MutableMapping[str, Any], receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        refused = self._refusal(scope)
        if scope["type"] == "websocket":
            if refused is not None:
                await _refuse_socket(receive, send, refused)
            else:
                await self.app(scope, receive, send)
            return
        sending = self._with_headers(send)
        if refused is not None:
            await _answer(sending, *refused)
            return
        limit = longest_prefix(self.security.body_limits, scope["path"], BODY_LIMIT)
        declared = _header(scope, b"content-length")
        if declared is not None and declared.isdigit() and int(declared[:20]) > limit:
            await _answer(sending, 413, _too_large(limit))
            return
        seconds = longest_prefix(self.security.body_seconds, scope["path"], BODY_SECONDS)
        await self.app(scope, _counted(receive, limit, seconds), sending)

    def _refusal(self, scope: MutableMapping[str, Any]) -> tuple[int, str] | None:
        """Status and reason of a request that is refused for where it comes from."""
        hosts = [value for name, value in scope["headers"] if name == b"host"]
        host = hosts[0].decode("latin-1") if len(hosts) == 1 else ""
        if not self._is_here(host):
            return 421, "unknown host: open the address that the server printed, or add the name with --allow-host."
        if scope["type"] == "http" and scope["method"] in _READING:
            return None
        origins = [value.decode("latin-1") for name, value in scope["headers"] if name == b"origin"]
        if any(not _same_place(origin, host) for origin in origins):
            return 403, "another site's page: only pages of this server may send to it."
        return None

    def _is_here(self, host: str) -> bool:
        name = host_name(host)
        if name is None:
            return False
        if name in ("localhost", self.security.host.lower(), *(one.lower() for one in self.security.allowed_hosts)):
            return True
        try:
            address = ipaddress.ip_address(name)
        except ValueError:
            return False
        # An address in numbers is not resolved, so that it cannot be another site's name.
        return address.is_loopback if is_loopback(self.security.host) else True

    def _with_headers(self, send: Send) -> Send:
        async def sending(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = list(message.get("headers", ()))
                own = {name.lower() for name, _ in headers}
                headers += [(name, value) for name, value in self._headers.items() if name not in own]
                message = {**message, "headers": headers}
            await send(message)

        return sending


def is_loopback(host: str) -> bool:
    """Whether an address is reached from this computer alone."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def host_name(host: str) -> str | None:
    """The name of a ``Host`` header without its port, in lower case; None where it is no such header."""
    if any(character in host for character in "/\\@?# \t,") or not host:
        return None
    try:
        parts = urlsplit(f"//{host}")
        _ = parts.port
    except ValueError:
        return None
    return parts.hostname.rstrip(".") if parts.hostname else None


def longest_prefix(table: Mapping[str, Any], path: str, otherwise: Any) -> Any:
    """The value of the longest key that a path begins with."""
    fitting = [prefix for prefix in table if path.startswith(prefix)]
    return table[max(fitting, key=len)] if fitting else otherwise


def _same_place(origin: str, host: str) -> bool:
    try:
        parts = urlsplit(origin)
    except ValueError:
        return False
    return parts.scheme in ("http", "https") and parts.netloc.lower() == host.lower()


def _header(scope: MutableMapping[str, Any], name: bytes) -> bytes | None:
    return next((value for key, value in scope["headers"] if key == name), None)


def _too_large(limit: int) -> str:
    return f"the request's body has more than {limit} bytes, the most that is taken here."


def _counted(receive: Receive, limit: int, seconds: float) -> Receive:
    """``receive`` that refuses a body once it has more bytes than the limit, or takes longer than the time."""
    from starlette.exceptions import HTTPException

    received, deadline, complete = 0, asyncio.get_running_loop().time() + seconds, False

    async def counted() -> Message:
        nonlocal received, complete
        if complete:
            return await receive()
        try:
            async with asyncio.timeout_at(deadline):
                message = await receive()
        except TimeoutError:
            text = f"the request's body took longer than {seconds:g} s."
            raise HTTPException(408, text, {"connection": "close"}) from None
        if message["type"] == "http.request":
            received += len(message.get("body", b""))
            complete = not message.get("more_body", False)
            if received > limit:
                raise HTTPException(413, _too_large(limit), {"connection": "close"})
        return message

    return counted


async def _answer(send: Send, status: int, text: str) -> None:
    body = text.encode()
    headers = [
        (b"content-type", b"text/plain; charset=utf-8"),
        (b"content-length", str(len(body)).encode()),
        (b"connection", b"close"),
    ]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


async def _refuse_socket(receive: Receive, send: Send, refused: tuple[int, str]) -> None:
    """Close before the handshake: the client gets status 403, as ASGI has it."""
    await receive()
    await send({"type": "websocket.close", "code": REFUSED, "reason": refused[1]})
