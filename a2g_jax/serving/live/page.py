"""The page with a microphone, and the routes of ``a2g serve``."""

import html
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib.resources import files
from typing import Any

from starlette.routing import BaseRoute, WebSocketRoute
from starlette.websockets import WebSocket

from a2g_jax.serving.app import static
from a2g_jax.serving.live.drawn import Drawn
from a2g_jax.serving.live.service import Service
from a2g_jax.serving.live.session import live
from a2g_jax.viz.player.page import fill_template, scripts, style

#: Parts of the written page's script that draw, and the page's own.
_PLAYER = ("math", "unpack", "figures", "shaders", "soup", "shadows", "webgl", "canvas", "layout", "controls")
_OWN = ("live_figure", "live_pace", "live_stage", "live")
#: Look-ahead of the quick choice on the page, seconds.
QUICK = 0.5


def routes(service: Service, name: str) -> list[BaseRoute]:
    """Page, its files and ``/live``.

    Args:
        name: of the run, for the page.
    """

    async def answer(websocket: WebSocket) -> None:
        await live(websocket, service)

    drawn = Drawn(service.default, service.delivery)
    own = "\n".join(_template(f"{part}.js") for part in _OWN)
    return [
        static("/", page(service, name)),
        static("/player.css", style()),
        static("/live.css", _template("live.css")),
        static("/live.js", f'(() => {{\n"use strict";\n{scripts(_PLAYER)}\n{own}\n}})();\n'),
        static("/capture.js", _template("capture.js")),
        static("/figure.json", json.dumps({**drawn.figure(), "mesh": drawn.mesh()})),
        WebSocketRoute("/live", answer),
    ]


def page(service: Service, name: str) -> str:
    """The HTML text."""
    character = service.delivery.character
    subtitle = name if character is None else f"{name} on {character.path.name}"
    return fill_template(
        _template("live.html"),
        {
            "title": "Speak, and the figure gestures",
            "subtitle": html.escape(subtitle),
            "hint": "Your voice stays on the computer that runs this server, and is not kept.",
            "choices": "\n          ".join(_choices(service)),
        },
    )


def lifespan(service: Service) -> Any:
    """The end of the threads with the server."""

    @asynccontextmanager
    async def context(_app: Any) -> AsyncIterator[None]:
        try:
            yield
        finally:
            service.close()

    return context


def _choices(service: Service) -> list[str]:
    """Options of the look-ahead; the selected one is the server's own, whose programs are compiled."""
    least, most = service.default.lookaheads
    own = service.default.latency.model
    options = []
    for value in sorted({own, min(max(QUICK, least), most), most}):
        text = "all it uses" if value == most else f"{value:.2g} s of speech"
        chosen = value == own
        options.append(f'<option value="{"" if chosen else value}"{" selected" if chosen else ""}>{text}</option>')
    return options


def _template(name: str) -> str:
    return files("a2g_jax.serving.live").joinpath("template", name).read_text(encoding="utf-8")
