"""The studio over HTTP with a generator that needs no model: takes, files, ranking, limits, and no leftovers."""

import asyncio
import io
import json
import threading
import time
import zipfile
from contextlib import suppress

import httpx
import numpy as np
import pytest
from starlette.requests import Request

from a2g_jax.errors import InputError
from a2g_jax.generation.capabilities import Capabilities, Setting
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import read_bvh
from a2g_jax.io.npz import write_motion_npz
from a2g_jax.io.words import Word
from a2g_jax.progress import checkpoint
from a2g_jax.serving.run import served
from a2g_jax.serving.studio.routes import _Api, studio_app
from a2g_jax.serving.studio.studio import Studio
from a2g_jax.serving.studio.takes import SPEECH, Outcome
from a2g_jax.talker.recordings import talk
from a2g_jax.viz.player import Track

SECONDS = 2.0
JSON = {"content-type": "application/json"}


class Generator:
    """Two samples of a recording; it waits before the second one where it is held."""

    def __init__(self, recording):
        self.recording, self.held, self.reached = recording, threading.Event(), threading.Event()

    def __call__(self, arguments, folder, job):
        if "--seed=666" in arguments:
            raise InputError(f"--control 'energy=0.5': {arguments[1].partition('=')[2]} is too calm.")
        job.say("generating")
        count = int(next(one for one in arguments if one.startswith("--samples=")).partition("=")[2])
        for number in range(count):
            self.reached.set()
            while self.held.is_set():
                checkpoint()
                time.sleep(0.01)
            write_motion_npz(folder / f"sample_{number:02d}.npz", self.recording.motion)
            job.step(number + 1, count, "sample")
        write_audio(folder / SPEECH, self.recording.audio, 16000)
        name = arguments[1].rpartition("/")[2]
        lanes = (Track("pins", ((0.0, 0.5, f"clip {name}", "#336699"),)),)
        return Outcome(
            SECONDS,
            f"for {name}",
            lanes,
            ("", "outside")[:count],
            scores=tuple(map(float, range(count))),
            lines=("fine",),
            warning=f"warning: {arguments[1].partition('=')[2]}: is unusual",
        )


@pytest.fixture(scope="module")
def recording():
    return talk(SECONDS, 4)


@pytest.fixture
def generator(recording):
    return Generator(recording)


@pytest.fixture
def studio(generator, recording, tmp_path):
    about = Capabilities(
        title="fake", controls=("energy",), settings=(Setting("warmth", 1.0, "float", False, False, ""),)
    )
    with Studio({"fake": "fake-run"}, lambda run: about, generator, titles={"fake": "Plain"}, takes=3) as made:
        write_audio(tmp_path / "demo.wav", recording.audio, 16000)
        made.add_speech("demo", "the demo", tmp_path / "demo.wav", (Word("hello", 0.1, 0.4),))
        yield made


@pytest.fixture
def client(studio):
    with served(studio_app(studio)) as url, httpx.Client(base_url=url, timeout=20) as opened:
        yield opened


def wanted(**changes):
    return {"speech": "demo", "system": "fake", "samples": 2, "seed": 0, **changes}


def generate(client, studio, **changes):
    answer = client.post("/api/takes", json=wanted(**changes))
    assert answer.status_code == 202, answer.text
    take = studio.takes[answer.json()["id"]]
    assert studio.jobs.wait(take.job, 10.0)
    return take.id


def wav(recording) -> bytes:
    import soundfile

    data = io.BytesIO()
    soundfile.write(data, recording.audio, 16000, format="WAV")
    return data.getvalue()


def test_samples_are_generated_shown_and_downloaded(client, studio, recording):
    take = generate(client, studio)
    (state,) = client.get("/api/state").json()["takes"]
    assert (state["job"]["state"], state["job"]["done"], state["subtitle"]) == ("done", 2, "for the demo")
    assert [sample["note"] for sample in state["samples"]] == ["", "outside"]
    page = client.get(f"/page?show={take}:1,{take}:0")
    assert page.status_code == 200
    assert page.headers["content-security-policy"].startswith("default-src 'none'")
    assert "frame-ancestors 'self'" in page.headers["content-security-policy"]
    assert page.text.index('"sample 1"') < page.text.index('"sample 0"')
    assert '["hello",0.1,0.4]' in page.text
    bvh = client.get(f"/api/takes/{take}/files/1/bvh")
    assert 'filename="take1_sample1.bvh"' in bvh.headers["content-disposition"]
    path = studio.folder / "read.bvh"
    path.write_bytes(bvh.content)
    assert read_bvh(path).frames == recording.motion.frames
    glb = client.get(f"/api/takes/{take}/files/0/glb")
    assert glb.content[:4] == b"glTF"


def test_the_archive_has_all_samples_and_the_ranking(client, studio):
    take = generate(client, studio)
    assert client.post(f"/api/takes/{take}/stars", json={"sample": 1, "stars": 4}).status_code == 204
    archive = zipfile.ZipFile(io.BytesIO(client.get(f"/api/takes/{take}/all.zip?formats=bvh,npz,mp4,bvh").content))
    names = archive.namelist()
    assert names[:3] == ["speech.wav", "take1_sample1.bvh", "take1_sample1.npz"]
    assert len(names) == len(set(names))
    assert {"take1_sample0.bvh", "take1_sample0.npz", "take.json"} <= set(names)
    about = json.loads(archive.read("take.json"))
    assert about["stars"] == {"1": 4}
    assert about["command"].startswith("a2g generate fake-run")
    for _ in range(100):  # it is removed after the last byte is sent
        if not list(studio.folder.glob("zip-*")):
            break
        time.sleep(0.05)
    assert list(studio.folder.glob("zip-*")) == []


def test_ranking_is_kept_and_orders_samples(client, studio):
    take = generate(client, studio)
    for sample, stars in ((0, 2), (1, 5)):
        client.post(f"/api/takes/{take}/stars", json={"sample": sample, "stars": stars})
    assert [one["stars"] for one in client.get("/api/state").json()["takes"][0]["samples"]] == [2, 5]
    assert studio.find(take).order("stars") == [1, 0]
    assert studio.find(take).order("score") == [1, 0]
    for bad in ({"sample": 2, "stars": 1}, {"sample": 0, "stars": 6}, {"sample": "0", "stars": 1}, [], None):
        assert client.post(f"/api/takes/{take}/stars", json=bad).status_code == 400


def test_a_running_request_is_cancelled_and_leaves_no_files(client, studio, generator):
    generator.held.set()
    first = client.post("/api/takes", json=wanted()).json()["id"]
    second = client.post("/api/takes", json=wanted()).json()["id"]
    assert generator.reached.wait(5)
    states = {one["id"]: one["job"] for one in client.get("/api/state").json()["takes"]}
    assert (states[first]["state"], states[second]["state"], states[second]["position"]) == ("running", "queued", 1)
    for take in (second, first):
        assert client.post(f"/api/takes/{take}/cancel").status_code == 204
        assert studio.jobs.wait(studio.takes[take].job, 5.0)
    assert generator.held.is_set()
    assert {one["job"]["state"] for one in client.get("/api/state").json()["takes"]} == {"cancelled"}
    assert list(studio.folder.glob("take-*")) == []
    assert client.get(f"/api/takes/{first}/files/0/bvh").status_code == 400
    generator.held.clear()
    assert studio.find(generate(client, studio)).outcome.seconds == SECONDS


def test_work_that_continues_after_its_take_is_dropped_leaves_no_files(client, studio, monkeypatch, recording):
    reached, go = threading.Event(), threading.Event()

    def deaf(arguments, folder, job):
        reached.set()
        assert go.wait(10)
        folder.mkdir(exist_ok=True)  # as every writer of files does
        write_audio(folder / SPEECH, recording.audio, 16000)
        return Outcome(SECONDS)

    monkeypatch.setattr(studio, "_generate", deaf)
    take = studio.takes[client.post("/api/takes", json=wanted()).json()["id"]]
    assert reached.wait(5)
    assert client.delete(f"/api/takes/{take.id}").status_code == 204
    assert list(studio.folder.glob("take-*")) == []
    go.set()
    assert studio.jobs.wait(take.job, 10.0)
    assert list(studio.folder.glob("take-*")) == []


def test_streams_of_events_are_limited_from_the_moment_of_their_request(studio, monkeypatch):
    monkeypatch.setattr("a2g_jax.serving.studio.routes.MOST_STREAMS", 2)
    api = _Api(studio)

    async def gone(_message=None):
        raise OSError("the client has gone")

    async def opened():
        streams = [await api.events(Request({"type": "http"})) for _ in range(2)]
        with pytest.raises(InputError, match="2 pages of this studio are open"):
            await api.events(Request({"type": "http"}))
        with suppress(Exception):  # whichever error: nothing was sent
            await streams[0]({"type": "http"}, gone, gone)
        await api.events(Request({"type": "http"}))

    asyncio.run(opened())


def test_events_follow_the_state(client, studio, generator):
    generator.held.set()
    with client.stream("GET", "/api/events") as events:
        assert events.headers["content-type"].startswith("text/event-stream")
        lines = (line for line in events.iter_lines() if line.startswith("data:"))
        assert json.loads(next(lines)[5:]) == {"takes": []}
        client.post("/api/takes", json=wanted())
        seen = []
        for line in lines:
            seen.append(json.loads(line[5:])["takes"][0]["job"]["state"])
            if seen[-1] == "running":
                generator.held.clear()
            if seen[-1] == "done":
                break
    assert "running" in seen


def test_errors_name_the_field_and_the_clients_file(client, studio, recording):
    answer = client.post("/api/takes", json=wanted(samples=99))
    assert (answer.status_code, answer.json()["field"]) == (422, "samples")
    assert client.post("/api/takes", json=wanted(settings={"transcript": "/etc/passwd"})).json()["field"] == (
        "settings.transcript"
    )
    upload = client.post(
        "/api/uploads/speech", content=wav(recording), headers={"x-file-name": "M%C3%BCller.wav"}
    ).json()
    assert (upload["name"], round(upload["seconds"], 1)) == ("Müller.wav", SECONDS)
    take = generate(client, studio, speech=upload["id"], seed=666)
    (state,) = client.get("/api/state").json()["takes"]
    assert (state["id"], state["job"]["state"]) == (take, "failed")
    assert state["job"]["error"] == {"field": "controls.energy", "message": "Müller.wav is too calm."}
    take = generate(client, studio, speech=upload["id"])
    assert studio.find(take).outcome.lanes[0].spans[0][2] == "clip Müller.wav"
    assert studio.find(take).outcome.warning == "warning: Müller.wav: is unusual"


@pytest.mark.parametrize(
    ("kind", "name", "data", "status", "message"),
    [
        ("speech", "a.wav", b"junk", 400, "a.wav"),
        ("speech", "../a.sh", b"junk", 400, "a.sh: is not a file for speech"),
        ("clip", "a.bvh", b"HIERARCHY", 400, "a.bvh"),
        ("weights", "a.bvh", b"x", 400, "no uploads of the kind"),
        ("speech", "", b"x", 400, "file: is not a file"),
    ],
)
def test_uploads_that_cannot_be_used_leave_nothing(client, studio, kind, name, data, status, message):
    answer = client.post(f"/api/uploads/{kind}", content=data, headers={"x-file-name": name})
    assert (answer.status_code, message in answer.json()["error"]) == (status, True), answer.text
    assert list((studio.folder / "uploads").iterdir()) == []


def test_uploads_have_a_limit_that_is_counted_on_the_way(client, studio, monkeypatch):
    kinds = dict(studio.uploads.kinds)
    kinds["speech"] = type(kinds["speech"])("speech", (".wav",), 1000, kinds["speech"].read)
    monkeypatch.setattr(studio.uploads, "kinds", kinds)
    answer = client.post("/api/uploads/speech", content=iter([b"x" * 600] * 5), headers={"x-file-name": "a.wav"})
    assert (answer.status_code, "larger than" in answer.json()["error"]) == (400, True)
    assert list((studio.folder / "uploads").iterdir()) == []


def test_other_sites_and_other_hosts_are_refused(client):
    assert client.post("/api/takes", json=wanted(), headers={"origin": "http://evil.test"}).status_code == 403
    assert client.get("/api/state", headers={"host": "evil.test"}).status_code == 421
    assert client.get("/page?show=../../etc").status_code == 400
    page = client.get("/")
    assert "unsafe" not in page.headers["content-security-policy"]
    assert "frame-src 'self'" in page.headers["content-security-policy"]


@pytest.mark.parametrize("path", ["/api/takes/../../etc/passwd/files/0/bvh", "/api/takes/x/files/0/bvh", "/main.py"])
def test_paths_that_do_not_exist(client, path):
    assert client.get(path).status_code in (400, 404)


def test_the_oldest_takes_without_stars_make_room(client, studio):
    takes = []
    for _ in range(3):
        takes.append(generate(client, studio))
        time.sleep(0.01)
    client.post(f"/api/takes/{takes[0]}/stars", json={"sample": 0, "stars": 3})
    takes.append(generate(client, studio))
    assert set(studio.takes) == {takes[0], takes[2], takes[3]}
    assert len(list(studio.folder.glob("take-*"))) == 3
    assert client.delete(f"/api/takes/{takes[0]}").status_code == 204
    assert len(list(studio.folder.glob("take-*"))) == 2


def test_a_request_that_is_refused_removes_no_take(client, studio, monkeypatch):
    kept = [generate(client, studio, seed=seed) for seed in range(3)]
    monkeypatch.setattr(studio.jobs, "_waiting", 0)
    assert client.post("/api/takes", json=wanted()).status_code == 400
    assert list(studio.takes) == kept


def test_samples_of_different_speeches_are_not_played_together(client, studio, recording):
    upload = client.post("/api/uploads/speech", content=wav(recording), headers={"x-file-name": "a.wav"}).json()
    one, other = generate(client, studio), generate(client, studio, speech=upload["id"])
    answer = client.get(f"/page?show={one}:0,{other}:0")
    assert (answer.status_code, "different speeches" in answer.text) == (400, True)
    again = generate(client, studio)
    page = client.get(f"/page?show={one}:0,{again}:1").text
    assert '"take 1, sample 0"' in page
    assert '"take 3, sample 1"' in page


def test_nothing_is_left_at_the_end(recording, tmp_path):
    generator = Generator(recording)
    generator.held.set()
    write_audio(tmp_path / "demo.wav", recording.audio, 16000)
    with Studio({"fake": "fake"}, lambda run: Capabilities(), generator) as studio:
        studio.add_speech("demo", "the demo", tmp_path / "demo.wav")
        take = studio.request(wanted())
        assert generator.reached.wait(5)
        folder = studio.folder
        assert folder.is_dir()
    assert take.job.state == "cancelled"
    assert not folder.exists()


def test_films_wait_in_the_queue_and_can_be_cancelled(client, studio, monkeypatch):
    take = generate(client, studio)
    reached = threading.Event()

    def film(path, motion, audio, rate, skin=None):
        for frame in range(10_000):
            reached.set()
            checkpoint(frame + 1, 10_000, "frame")
            time.sleep(0.005)

    monkeypatch.setattr("a2g_jax.viz.player.video.write_video", film)
    monkeypatch.setattr("a2g_jax.viz.player.video.check_video", lambda: None)
    about = client.get("/api/about").json()
    assert about["slow"] == {"mp4": ""}
    assert about["titles"] == {"fake": "Plain"}
    assert client.post(f"/api/takes/{take}/films/0/mp4").status_code == 202
    assert reached.wait(5)
    job = studio.find(take).films[0, "mp4"]
    assert client.get(f"/api/takes/{take}/files/0/mp4").status_code == 400
    assert client.post(f"/api/takes/{take}/films/0/mp4/cancel").status_code == 204
    assert studio.jobs.wait(job, 5.0)
    assert client.get("/api/state").json()["takes"][0]["samples"][0]["films"]["mp4"]["state"] == "cancelled"
    assert client.post(f"/api/takes/{take}/films/0/bvh").status_code == 400
    assert np.isfinite(job.seconds())
