"""``a2g serve``: what is refused at once, and a clean end."""

import os
import signal
import subprocess
import sys

import pytest

from a2g_jax.cli import main, serve
from a2g_jax.io.gltf.container import read_glb, write_glb
from a2g_jax.serving import run
from experiments.characters.skinned import mixamo_glb


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["no/such/run"], ["no/such/run"]),
        (["demo", "--fingers", "none"], ["--fingers", "--to"]),
        (["demo", "--to", "none.glb"], ["none.glb", "no such file"]),
        (["demo", "--to", "figure.fbx"], ["figure.fbx", "Blender"]),
        (["demo", "--temprature", "1"], ["--temprature"]),
        (["demo", "--host", "no.such.host.invalid"], ["--host no.such.host.invalid", "127.0.0.1"]),
    ],
)
def test_flags_that_do_not_fit(flags, words, capsys):
    assert main(["serve", *flags]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    for word in words:
        assert word in message


def test_a_port_that_is_taken_is_found_before_anything_is_loaded(capsys):
    with run.listen() as bound:
        port = bound.getsockname()[1]
        assert main(["serve", "demo", "--port", str(port)]) == 2
    assert f"--port {port}: another program uses it" in capsys.readouterr().err


def test_a_missing_extra_is_one_line(monkeypatch, capsys):
    monkeypatch.setattr(run, "find_spec", lambda name: None)
    assert main(["serve", "demo"]) == 2
    assert "pip install 'a2g_jax[serve]'" in capsys.readouterr().err


SERVER = """
from a2g_jax.serving import run
from a2g_jax.serving.app import make_app, static
from a2g_jax.serving.security import Security
run.serve(make_app([static("/", "page")], Security()), run.listen(), lambda line: print(line, flush=True))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="sends SIGINT")
def test_the_url_is_printed_and_ctrl_c_ends_without_a_traceback():
    with subprocess.Popen(
        [sys.executable, "-c", SERVER], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ}
    ) as server:
        assert server.stdout.readline().startswith("http://127.0.0.1:")
        server.send_signal(signal.SIGINT)
        out, err = server.communicate(timeout=60)
    assert (server.returncode, out, err) == (0, "stopped.\n", "")


def test_a_mesh_that_is_not_read_is_named(tmp_path, monkeypatch, capsys):
    glb = read_glb(mixamo_glb(tmp_path / "mixamo.glb"))
    for part in glb.document["meshes"][0]["primitives"]:
        part["extensions"] = {"KHR_draco_mesh_compression": {}}
    write_glb(tmp_path / "draco.glb", glb.document, glb.binary)
    monkeypatch.setattr("a2g_jax.serving.live.service.Service.warm_up", lambda service: None)
    monkeypatch.setattr(serve, "serve", lambda app, bound, announce, **options: bound.close())
    assert main(["serve", "demo", "--port", "0", "--to", str(tmp_path / "draco.glb")]) == 0
    out = capsys.readouterr().out
    assert out.count("draco.glb") == 1
    assert "is compressed (Draco)" in out
    assert "the page shows our figure in its place" in out
