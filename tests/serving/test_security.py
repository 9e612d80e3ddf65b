"""What every server of the package lets in, with a real uvicorn in a thread."""

import socket

import httpx
import pytest
from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.routing import Route, WebSocketRoute
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from a2g_jax.errors import InputError
from a2g_jax.serving import run
from a2g_jax.serving.app import make_app, static
from a2g_jax.serving.security import Security


async def _size(request: Request) -> JSONResponse:
    return JSONResponse({"bytes": len(await request.body())})


async def _refuses(_request: Request) -> JSONResponse:
    raise InputError("bad\nvalue")


async def _breaks(_request: Request) -> JSONResponse:
    raise RuntimeError("secret")


async def _echo(websocket) -> None:
    await websocket.accept()
    await websocket.send_text(await websocket.receive_text())
    await websocket.close()


@pytest.fixture(scope="module")
def url():
    routes = [
        static("/", "<p>page</p>"),
        Route("/size", _size, methods=["POST"]),
        Route("/upload", _size, methods=["POST"]),
        Route("/refuses", _refuses),
        Route("/breaks", _breaks),
        WebSocketRoute("/echo", _echo),
    ]
    limits = {"/size": 1000, "/upload": 100_000}
    with run.served(make_app(routes, Security(allowed_hosts=("studio.test",), body_limits=limits))) as address:
        yield address


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1:1234", "[::1]:80", "studio.test", "LOCALHOST:9"])
def test_names_of_this_computer_are_let_in(url, host):
    assert httpx.get(url, headers={"host": host}).status_code == 200


OTHERS = (
    "evil.example",
    "127.0.0.1.evil.example",
    "localhost@evil.example",
    "10.0.0.1",
    "",
    "localhost, evil",
    "[",
    "a:b",
)


@pytest.mark.parametrize("host", OTHERS)
def test_other_names_are_refused(url, host):
    reply = httpx.get(url, headers={"host": host})
    assert reply.status_code in (400, 421)
    assert "page" not in reply.text


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "file://", "http://localhost:1", "http://["])
def test_pages_of_other_sites_cannot_send(url, origin):
    assert httpx.post(f"{url}size", content=b"x", headers={"origin": origin}).status_code == 403
    with pytest.raises(InvalidStatus, match="403"):
        connect(f"{url.replace('http', 'ws')}echo", additional_headers={"origin": origin})


def test_own_pages_and_programs_can_send(url):
    place = url.rstrip("/")
    assert httpx.post(f"{url}size", content=b"xyz", headers={"origin": place}).json() == {"bytes": 3}
    for headers in ({}, {"origin": place}):
        with connect(f"{url.replace('http', 'ws')}echo", additional_headers=headers) as client:
            client.send("hello")
            assert client.recv() == "hello"


def test_bodies_are_counted_as_they_arrive(url):
    assert httpx.post(f"{url}size", content=b"x" * 1001).status_code == 413
    # Without a Content-Length.
    assert httpx.post(f"{url}size", content=iter([b"x" * 400] * 3)).status_code == 413
    assert httpx.post(f"{url}upload", content=iter([b"x" * 400] * 3)).json() == {"bytes": 1200}


def test_a_small_content_length_does_not_let_more_in(url):
    address = url.removeprefix("http://").rstrip("/").split(":")
    with socket.create_connection((address[0], int(address[1]))) as raw:
        raw.sendall(b"POST /size HTTP/1.1\r\nHost: localhost\r\nContent-Length: 3\r\n\r\n" + b"x" * 5000)
        raw.settimeout(10)
        answer = b""
        while b'{"bytes":3}' not in answer:  # headers and body may arrive apart
            part = raw.recv(65536)
            assert part, answer
            answer += part


def test_errors_are_one_line_without_details(url):
    assert httpx.get(f"{url}refuses").json() == {"error": "bad value"}
    reply = httpx.get(f"{url}breaks")
    assert reply.status_code == 500
    assert "secret" not in reply.text
    assert "Traceback" not in reply.text


def test_every_answer_has_the_headers(url):
    for reply in (httpx.get(url), httpx.get(f"{url}nothing"), httpx.get(url, headers={"host": "evil.example"})):
        assert "default-src 'none'" in reply.headers["content-security-policy"]
        assert reply.headers["x-content-type-options"] == "nosniff"
        assert "server" not in reply.headers


def test_a_port_that_is_taken_is_one_line():
    with run.listen() as bound:
        port = bound.getsockname()[1]
        with pytest.raises(InputError, match=f"--port {port}: another program uses it"):
            run.listen(port=port)
    with pytest.raises(InputError, match="--host no.such.host.invalid"):
        run.listen("no.such.host.invalid")
    with pytest.raises(InputError, match="0 to 65535"):
        run.listen(port=70000)


def test_a_missing_extra_is_one_line(monkeypatch):
    monkeypatch.setattr(run, "find_spec", lambda name: None if name == "uvicorn" else object())
    with pytest.raises(InputError, match=r"needs uvicorn.*pip install 'a2g_jax\[serve\]'"):
        run.check_extra("a2g serve")


def test_other_computers_are_a_warning():
    assert run.exposure("127.0.0.1") is None
    assert run.exposure("::1") is None
    assert "everybody in your network" in run.exposure("0.0.0.0")
