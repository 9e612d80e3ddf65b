"""An ASGI application of routes and static text, behind :class:`~a2g_jax.serving.security.Guard`."""

from collections.abc import Sequence
from typing import Any

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import BaseRoute, Route

from a2g_jax.errors import A2GError
from a2g_jax.serving.security import Guard, Security

#: Media types by suffix.
_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".json": "application/json",
}


def static(path: str, text: str) -> Route:
    """A route with a text that never changes; its suffix is its type, and ``/`` is HTML."""
    kind = next((kind for suffix, kind in _TYPES.items() if path.endswith(suffix)), _TYPES[".html"])

    async def answer(_request: Request) -> Response:
        return Response(text, media_type=kind)

    return Route(path, answer, methods=["GET"])


def make_app(routes: Sequence[BaseRoute], security: Security, lifespan: Any = None) -> Guard:
    """The application of a server.

    An ``InputError`` in a route is answered with status 400 and ``{"error": message}``; anything unexpected with 500
    and no details.

    Args:
        lifespan: a function of the application that returns an asynchronous context, entered before the first request.
    """
    app = Starlette(
        routes=list(routes),
        lifespan=lifespan,
        exception_handlers={A2GError: _input_error, Exception: _unexpected},
    )
    app.router.redirect_slashes = False
    return Guard(app, security)


async def _input_error(_request: Request, error: Exception) -> Response:
    return JSONResponse({"error": " ".join(str(error).split())}, status_code=400)


async def _unexpected(_request: Request, error: Exception) -> Response:
    return PlainTextResponse(f"unexpected {type(error).__name__}; the server's output has more.", status_code=500)
