"""``/live`` from the first message to the last frame, and clients that do not keep to it."""

import asyncio
import json
import re
import socket
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from websockets.sync.client import connect

from a2g_jax.generation.delivery import Delivery
from a2g_jax.io.audio import write_audio
from a2g_jax.io.character import read_character
from a2g_jax.serving import client
from a2g_jax.serving.client import converse
from a2g_jax.serving.live.drawn import Drawn
from a2g_jax.serving.live.protocol import frames_binary, quaternions, read_binary
from a2g_jax.serving.live.session import Pace
from a2g_jax.viz.player.shape import build_shape
from a2g_jax.viz.player.skin import bind
from a2g_jax.viz.player.stage import shape_points
from experiments.characters.rigs import unreal
from experiments.characters.skinned import mixamo_glb
from tests.serving.live_for_tests import RATE, closing, opened, socket_url, speech


@pytest.fixture(scope="module")
def motion(live):
    """The frames that the stream gives without a server."""
    stream = live.service.default.restarted(5, RATE)
    parts = [stream.push(speech()), stream.finish()]
    rotations, root = (np.concatenate([getattr(part, name) for part in parts]) for name in ("rotations", "root"))
    return replace(parts[0], rotations=rotations, root=root)


def free(live):
    """Whether all places are free, after a moment."""
    for _ in range(200):
        if live.service.clients == 0:
            return True
        time.sleep(0.05)
    return False


def test_frames_are_those_of_the_stream(live, motion):
    received = asyncio.run(converse(socket_url(live.url), speech() / np.float32(32768), RATE, 0, seed=5))
    np.testing.assert_array_equal(np.array(received.root), np.asarray(motion.root))
    np.testing.assert_array_equal(np.array(received.rotations), quaternions(motion))
    assert received.ready["skeleton"]["joints"] == list(motion.skeleton.names)
    assert received.ready["latency"]["total"] == pytest.approx(live.service.default.latency.total, abs=0.1)


def test_json_frames_and_the_end(live, motion):
    client, ready = opened(live.url, seed=5, reply="json")
    assert (ready["type"], ready["version"], ready["fps"]) == ("ready", 1, 30.0)
    for start in range(0, RATE, 700):
        client.send(speech()[start : start + 700].tobytes())
    client.send('{"type": "end"}')
    frames, last = [], None
    for message in client:
        found = json.loads(message)
        frames += found.get("frames", []) if found["type"] == "frames" else []
        last = found
    assert last == {"type": "end", "total": motion.frames, "seconds": 1.0}
    assert client.close_code == 1000
    assert [frame["index"] for frame in frames] == list(range(motion.frames))
    np.testing.assert_allclose([frame["rotations"] for frame in frames], quaternions(motion), atol=1e-6)


def test_points_are_those_of_the_page(live, motion):
    client, ready = opened(live.url, seed=5, reply="points")
    client.send(speech().tobytes())
    client.send('{"type": "end"}')
    parts = [read_binary(message, 3 * ready["figure"]["points"])[1] for message in client if isinstance(message, bytes)]
    expected = shape_points(motion, build_shape(motion.skeleton)).reshape(motion.frames, -1)
    np.testing.assert_allclose(np.concatenate(parts), expected, atol=1e-5)
    assert len(ready["figure"]["rest"]) == expected.shape[1]


@pytest.mark.parametrize(
    ("messages", "code", "reason"),
    [
        ([b"\0\0"], 1007, "first message"),
        (["hello"], 1007, "JSON object"),
        (['{"sample_rate": 12}'], 1007, "sample_rate"),
        (['{"sample_rate": 16000, "sampling": {"temperature": -1}}'], 1007, "temperature"),
        (['{"sample_rate": 16000, "sampling": {"style": "/etc/passwd"}}'], 1007, "no setting 'style'"),
        (['{"sample_rate": 16000}', b"\0\0\0"], 1007, "no whole number"),
        (['{"sample_rate": 16000}', "stop"], 1007, "JSON object"),
        (['{"sample_rate": 16000}', '{"type": "pause"}'], 1007, "expected"),
        (['{"sample_rate": 16000, "encoding": "f32le"}', b"\xff" * 400], 1007, "NaN"),
        (['{"sample_rate": 16000}', b"\0" * 300_000], 1009, ""),
    ],
)
def test_messages_that_end_a_connection(live, messages, code, reason):
    with connect(socket_url(live.url)) as client:
        for message in messages:
            client.send(message)
        found, why, error = closing(client)
    assert found == code
    assert reason in (error or why)
    assert "Traceback" not in (error or why)
    assert free(live)


def test_further_clients_are_refused_until_a_place_is_free(live):
    assert free(live)
    clients = [opened(live.url)[0] for _ in range(3)]
    with connect(socket_url(live.url)) as fourth:
        code, reason, _ = closing(fourth)
    assert code == 1013
    assert "3 clients are connected" in reason
    # Two without a word, one in the middle of a message.
    clients[0].socket.shutdown(socket.SHUT_RDWR)
    clients[1].socket.close()
    clients[2].send(speech().tobytes())
    clients[2].socket.shutdown(socket.SHUT_RDWR)
    assert free(live)
    client, ready = opened(live.url)
    assert ready["type"] == "ready"
    client.close()


def test_silent_clients_are_disconnected(live):
    with connect(socket_url(live.url)) as silent:
        client, _ = opened(live.url)
        for one in (silent, client):
            code, reason, _ = closing(one)
            assert code == 1008
            assert "sent nothing for 3 s" in reason
    assert free(live)


def test_other_settings_are_compiled_once(live):
    for temperature in (0.5, 0.5):
        client, ready = opened(live.url, sampling={"temperature": temperature})
        assert ready["type"] == "ready"
        client.close()
    assert len(live.service._programs) == 1
    assert free(live)


def test_audio_is_read_at_a_bounded_pace():
    """Ten seconds at once, and then four times as fast as it is spoken."""
    pace, now = Pace(4.0, 10.0), 100.0
    for _ in range(300):
        now += pace.wait(0.1, now)
    assert now - 100 == pytest.approx((30 - 10) / 4)
    assert pace.wait(0.1, now + 60) == 0


@pytest.mark.parametrize("kind", [pytest.param("bvh", marks=pytest.mark.slow), "glb"])
def test_frames_of_a_character_are_those_of_its_file(live, motion, kind, tmp_path):
    path = tmp_path / f"character.{kind}"
    (unreal().write if kind == "bvh" else mixamo_glb)(path)
    delivery = Delivery(character=read_character(path))
    drawn = Drawn(live.service.default, delivery)
    whole = delivery.make(motion)
    encode = drawn.encoded(frames_binary)
    width = 3 + 4 * whole.own.skeleton.joints
    skin = delivery.skin(whole.shown.skeleton)
    assert (skin is None) == (kind == "bvh")
    shape = build_shape(whole.shown.skeleton) if skin is None else bind(skin).shape()
    for first in range(0, motion.frames - 3, 7):
        rows = read_binary(encode(motion.clip(first, first + 3), first), width)[1]
        expected = read_binary(frames_binary(whole.own.clip(first, first + 3), first), width)[1]
        np.testing.assert_allclose(rows, expected, atol=1e-5)
        points = read_binary(drawn.points(motion.clip(first, first + 3), first), 3 * drawn.figure()["points"])[1]
        shown = shape_points(whole.shown, shape)[first : first + 3]
        np.testing.assert_allclose(points, shown.reshape(3, -1), atol=1e-4)


def test_the_example_of_the_guide(live, capsys):
    guide = (Path(__file__).parents[2] / "docs" / "live.md").read_text(encoding="utf-8")
    example = next(block for block in re.findall(r"```python\n(.*?)```", guide, re.DOTALL) if "websockets" in block)
    exec(compile(example.replace("ws://127.0.0.1:8765/live", socket_url(live.url)), "live.md", "exec"), {})
    printed = capsys.readouterr().out.splitlines()
    assert len(printed) == 1 + 60
    assert printed[-1].startswith("59 [")


def test_the_client_writes_what_it_gets(live, tmp_path, capsys):
    write_audio(tmp_path / "speech.wav", speech() / np.float32(32768), RATE)
    url, out = socket_url(live.url), tmp_path / "motion.npz"
    assert client.main([str(tmp_path / "speech.wav"), url, "--out", str(out), "--pace", "0"]) == 0
    assert "30 frames at 30 fps for 1.00 s" in capsys.readouterr().out
    with np.load(out) as arrays:
        assert arrays["rotations"].shape == (30, len(arrays["joints"]), 4)
    assert client.main([str(tmp_path / "speech.wav"), url.replace("/live", "/other")]) == 2
    assert client.main([str(tmp_path / "none.wav"), url]) == 2
    assert capsys.readouterr().err.count("\n") == 2
