"""A server's process: the socket, the URL, and an end without a traceback."""

import errno
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.serving.security import is_loopback

#: Modules of the extra ``serve``.
_EXTRA = ("starlette", "uvicorn", "websockets", "multipart")
#: Bytes of a WebSocket's message; connections at a time, of all kinds; seconds that open ones have at the end.
MESSAGE_LIMIT, CONNECTIONS, SHUTDOWN = 256 * 1024, 128, 3


def check_extra(command: str) -> None:
    """Refuse a command whose packages are not installed.

    Raises:
        InputError: with what to install.
    """
    # find_spec: nothing is imported before the command has checked its arguments.
    missing = [name for name in _EXTRA if find_spec(name) is None]
    if missing:
        raise InputError(
            f"{command}: needs {', '.join(missing)}, which the extra 'serve' has; install it with"
            " pip install 'a2g_jax[serve]'."
        )


def listen(host: str = "127.0.0.1", port: int = 0) -> socket.socket:
    """A socket that is bound, so that a port that is taken is found before anything is loaded.

    Args:
        port: 0 for one that is free.

    Raises:
        InputError: a port that is taken or needs permissions, or a host that is not this computer.
    """
    if not 0 <= port < 65536:
        raise InputError(f"--port: expected 0 to 65535; got {port}.")
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
    except (OSError, UnicodeError):
        raise InputError(f"--host {host}: no address of this computer; use 127.0.0.1.") from None
    bound = socket.socket(family, socket.SOCK_STREAM)
    if sys.platform != "win32":  # there, it would let two servers share a port
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        bound.bind((host, port))
        bound.listen(128)
    except OSError as error:
        bound.close()
        raise InputError(_why(host, port, error)) from None
    return bound


def url_of(bound: socket.socket) -> str:
    """The address to open in a browser."""
    host, port = bound.getsockname()[:2]
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"


def exposure(host: str) -> str | None:
    """A warning where other computers can reach the server."""
    if is_loopback(host):
        return None
    return (
        f"warning: --host {host}: everybody in your network can use this server, without a password and unencrypted;"
        " browsers give a microphone only to https or this computer."
    )


def serve(app: Any, bound: socket.socket, announce: Callable[[str], None] = print, **options: Any) -> None:
    """Answer requests until Ctrl-C, which ends without a traceback.

    Args:
        announce: gets the line with the URL once requests are answered, and one at the end.
        options: of ``uvicorn.Config``.
    """
    server = _server(app, options)
    started = server.startup

    async def startup(sockets: Any = None) -> None:
        await started(sockets=sockets)
        announce(f"{url_of(bound)} (Ctrl-C ends it)")

    server.startup = startup
    try:
        server.run(sockets=[bound])
    except KeyboardInterrupt:
        announce("stopped.")


@contextmanager
def served(app: Any, host: str = "127.0.0.1", **options: Any) -> Iterator[str]:
    """The URL of a server in a thread of this process, which ends with the context; for tests and notebooks."""
    bound = listen(host)
    url = url_of(bound)
    server = _server(app, options)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [bound]}, daemon=True)
    thread.start()
    try:
        yield url
    finally:
        server.should_exit = True
        thread.join(10)


def _server(app: Any, options: dict[str, Any]) -> Any:
    import uvicorn

    settings: dict[str, Any] = {
        "http": "h11",
        "ws": "websockets-sansio",
        "ws_max_size": MESSAGE_LIMIT,
        # Audio and rotations hardly shrink, and a small message could be a large one.
        "ws_per_message_deflate": False,
        "ws_ping_interval": 20.0,
        "ws_ping_timeout": 20.0,
        "limit_concurrency": CONNECTIONS,
        "timeout_keep_alive": 10,
        "timeout_graceful_shutdown": SHUTDOWN,
        "h11_max_incomplete_event_size": 16 * 1024,
        "log_level": "error",
        "access_log": False,
        "server_header": False,
        "proxy_headers": False,
        "lifespan": "on",
    }
    return uvicorn.Server(uvicorn.Config(app, **{**settings, **options}))


def _why(host: str, port: int, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return f"--port {port}: another program uses it; choose another one, or 0 for one that is free."
    if error.errno in (errno.EACCES, errno.EPERM):
        return f"--port {port}: needs an administrator's permissions; choose one from 1024 on, or 0."
    return f"--host {host}: this computer cannot listen there ({error.strerror or error}); use 127.0.0.1."
