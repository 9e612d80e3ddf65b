"""HTTP of the studio: the page, uploads, requests, states as server-sent events, and files."""

import asyncio
import json
import tempfile
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import BaseRoute, Route
from starlette.types import Receive, Scope, Send

from a2g_jax.errors import InputError
from a2g_jax.serving.app import make_app, static
from a2g_jax.serving.security import Guard, Security
from a2g_jax.serving.studio.jobs import DONE
from a2g_jax.serving.studio.sample_formats import slow_formats
from a2g_jax.serving.studio.settings import FieldError
from a2g_jax.serving.studio.studio import Studio

#: Files of the page, in the folder ``page``.
PAGE_FILES = (
    "studio.css", "main.js", "api.js", "dom.js", "speech.js", "recorder.js", "capture.js", "form.js", "controls.js",
    "timeline.js", "takes.js", "player.js",
)  # fmt: skip
#: Seconds in which an upload must have arrived, and bytes of a request's JSON.
UPLOAD_SECONDS, REQUEST_BYTES = 900.0, 256 * 1024
#: Streams of events at a time; seconds between looks at the state, and between events without a change.
MOST_STREAMS, LOOK, BEAT = 16, 0.2, 10.0
#: The player's page has its script and style in itself, and is shown in a frame of the studio alone.
_PLAYER_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; media-src blob:; img-src data:;"
    " base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)


def studio_app(
    studio: Studio,
    host: str = "127.0.0.1",
    allowed_hosts: tuple[str, ...] = (),
    begin: Callable[[], None] = lambda: None,
) -> Guard:
    """The application of a studio.

    Args:
        begin: called in a thread at the start, to load what the first request needs.
    """

    @asynccontextmanager
    async def lifespan(_app: Any) -> AsyncIterator[None]:
        task = asyncio.get_running_loop().run_in_executor(None, begin)
        yield
        task.cancel()

    largest = max(kind.most_bytes for kind in studio.uploads.kinds.values())
    security = Security(
        host=host,
        allowed_hosts=allowed_hosts,
        body_limits={"/api/uploads/": largest + 1, "/api/takes": REQUEST_BYTES},
        body_seconds={"/api/uploads/": UPLOAD_SECONDS},
        policy={"frame-src": "'self'", "style-src": "'self'"},
    )
    return make_app(studio_routes(studio), security, lifespan)


def studio_routes(studio: Studio) -> list[BaseRoute]:
    """The routes of a studio."""
    api = _Api(studio)
    page = files("a2g_jax.serving.studio").joinpath("page")
    texts = [static("/", page.joinpath("index.html").read_text("utf-8"))]
    texts += [static(f"/{name}", page.joinpath(name).read_text("utf-8")) for name in PAGE_FILES]
    take = "/api/takes/{take}"
    return [
        *texts,
        Route("/page", api.page),
        Route("/api/about", api.about),
        Route("/api/systems/{system}", api.system),
        Route("/api/state", api.state),
        Route("/api/events", api.events),
        Route("/api/uploads/{kind}", api.upload, methods=["POST"]),
        Route("/api/takes", api.request, methods=["POST"]),
        Route(take, api.drop, methods=["DELETE"]),
        Route(f"{take}/cancel", api.cancel, methods=["POST"]),
        Route(f"{take}/stars", api.rate, methods=["POST"]),
        Route(f"{take}/films/{{sample:int}}/{{format}}", api.film, methods=["POST"]),
        Route(f"{take}/films/{{sample:int}}/{{format}}/cancel", api.cancel_film, methods=["POST"]),
        Route(f"{take}/files/{{sample:int}}/{{format}}", api.file),
        Route(f"{take}/all.zip", api.zip),
    ]


class _Api:
    """Answers; whatever reads or writes files runs in a thread."""

    def __init__(self, studio: Studio) -> None:
        self.studio = studio
        # Readers take memory: two uploads are read at a time.
        self._reading, self._writing = asyncio.Semaphore(2), asyncio.Semaphore(2)
        self._streams = 0

    async def page(self, request: Request) -> Response:
        async with self._writing:
            try:
                text = await _thread(self.studio.page, request.query_params.get("show", ""))
            except InputError as error:
                return HTMLResponse(_plain_page(str(error)), 400)
        return HTMLResponse(text, headers={"content-security-policy": _PLAYER_POLICY})

    async def about(self, _request: Request) -> Response:
        return JSONResponse(await _thread(self.studio.about))

    async def system(self, request: Request) -> Response:
        return JSONResponse(await _thread(self.studio.describe, request.path_params["system"]))

    async def state(self, _request: Request) -> Response:
        return JSONResponse(self.studio.state())

    async def upload(self, request: Request) -> Response:
        """The body is the file, and the header ``X-File-Name`` its name, percent-encoded."""
        name = unquote(request.headers.get("x-file-name", ""))
        with self.studio.uploads.incoming(request.path_params["kind"], name) as incoming:
            async for data in request.stream():
                if data:
                    await _thread(incoming.write, data)
            async with self._reading:
                upload = await _thread(incoming.finish)
        return JSONResponse(upload.to_json(), 201)

    async def request(self, request: Request) -> Response:
        try:
            take = await _thread(self.studio.request, await _json(request))
        except FieldError as error:
            return JSONResponse({"field": error.field, "message": str(error)}, 422)
        return JSONResponse(take.to_json(), 202)

    async def drop(self, request: Request) -> Response:
        await _thread(self.studio.drop, request.path_params["take"])
        return Response(status_code=204)

    async def cancel(self, request: Request) -> Response:
        self.studio.cancel(request.path_params["take"])
        return Response(status_code=204)

    async def rate(self, request: Request) -> Response:
        self.studio.rate(request.path_params["take"], await _json(request))
        return Response(status_code=204)

    async def film(self, request: Request) -> Response:
        job = self.studio.film(*_file_of(request))
        return JSONResponse(job.to_json(), 202)

    async def cancel_film(self, request: Request) -> Response:
        self.studio.cancel_film(*_file_of(request))
        return Response(status_code=204)

    async def file(self, request: Request) -> Response:
        id, sample, format = _file_of(request)
        take = self.studio.find(id)
        if format in slow_formats():
            job = take.films.get((sample, format))
            if job is None or job.state != DONE:
                raise InputError(f"the {format} of this sample is not written yet.")
        async with self._writing:
            path = await _thread(take.file, sample, format)
        return FileResponse(path, filename=take.file_name(sample, format))

    async def zip(self, request: Request) -> Response:
        take = self.studio.find(request.path_params["take"])
        names = request.query_params.get("formats", "bvh,npz").split(",")
        chosen = list(dict.fromkeys(name for name in names if name))  # each once, however often it is named
        folder = tempfile.mkdtemp(prefix="zip-", dir=self.studio.folder)
        path = Path(folder) / "samples.zip"
        try:
            async with self._writing:
                await _thread(take.write_zip, path, chosen)
        except BaseException:
            _remove(path)
            raise
        return FileResponse(path, filename=f"take{take.number}.zip", background=BackgroundTask(_remove, path))

    async def events(self, request: Request) -> Response:
        """The state whenever it changes, and every second while something is worked on."""
        if self._streams >= MOST_STREAMS:
            raise InputError(f"{MOST_STREAMS} pages of this studio are open already; close one.")
        # Counted before anything is awaited, so that requests at the same time are not more than the limit.
        self._streams += 1
        return _Stream(self._events(request), self._closed)

    def _closed(self) -> None:
        self._streams -= 1

    async def _events(self, request: Request) -> AsyncIterator[str]:
        version, quiet, sent = -1, 0.0, ""
        while not await request.is_disconnected():
            if version != self.studio.version or (self.studio.busy and quiet >= 1.0):
                version = self.studio.version
                text = json.dumps(self.studio.state(), separators=(",", ":"))
                if text != sent:
                    yield f"data: {text}\n\n"
                    sent, quiet = text, 0.0
            elif quiet >= BEAT:
                yield ": \n\n"
                quiet = 0.0
            await asyncio.sleep(LOOK)
            quiet += LOOK


class _Stream(StreamingResponse):
    """Server-sent events; calls a function when they end, also where none was sent."""

    def __init__(self, events: AsyncIterator[str], ended: Callable[[], None]) -> None:
        super().__init__(events, media_type="text/event-stream")
        self._ended = ended

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._ended()


async def _thread(function: Callable[..., Any], *arguments: Any) -> Any:
    return await asyncio.to_thread(function, *arguments)


async def _json(request: Request) -> Any:
    try:
        return json.loads(await request.body())
    except (ValueError, RecursionError):
        raise InputError("expected JSON.") from None


def _file_of(request: Request) -> tuple[str, int, str]:
    return request.path_params["take"], request.path_params["sample"], request.path_params["format"]


def _plain_page(message: str) -> str:
    import html

    return f"<!doctype html><meta charset=utf-8><title>studio</title><p>{html.escape(message)}</p>"


def _remove(path: Path) -> None:
    path.unlink(missing_ok=True)
    path.parent.rmdir()
