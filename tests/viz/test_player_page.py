import base64
import html
import io
import json
import re
import wave
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import soundfile
from hypothesis import given, settings
from hypothesis import strategies as st

from a2g_jax.errors import InputError
from a2g_jax.recording import Word
from a2g_jax.talker.recordings import talk
from a2g_jax.viz.player import Figure, Track, show_page, write_page
from a2g_jax.viz.player.encode import decode_positions, encode_positions
from a2g_jax.viz.player.page import fill_template, script_json
from tests.viz.figures_for_tests import tone, waving


def page_data(page: str) -> dict:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return json.loads(found.group(1))


def write(folder: Path, **changes) -> str:
    given = {
        "figures": [Figure(waving(), "Recorded", "note"), Figure(waving(25, 15.0), "Sample")],
        "audio": tone(2.0),
        "sample_rate": 16000,
        "title": "A title",
    }
    given.update(changes)
    write_page(folder / "page.html", **given)
    return (folder / "page.html").read_text(encoding="utf-8")


def test_page_names_no_address_outside_itself(tmp_path):
    page = write(tmp_path, words=[Word("hello", 0.1, 0.4)], subtitle="sub", footer="foot")
    without_data = re.sub(r'"data":"[A-Za-z0-9+/=]*"|"audio":"[A-Za-z0-9+/=]*"', "", page)
    assert not re.search(r"https?:|wss?://|ftp://|//[a-z0-9-]+\.[a-z]{2,}", without_data, re.IGNORECASE)
    assert not re.search(r"<link[^>]*href=\"(?!data:)|\bsrc=|@import|url\(", without_data)
    assert "default-src 'none'" in page


def test_positions_survive_within_half_a_millimetre(tmp_path):
    motions = [waving(), waving(25, 15.0)]
    data = page_data(write(tmp_path, figures=[Figure(motion, "x") for motion in motions]))
    for motion, figure in zip(motions, data["figures"], strict=True):
        decoded = decode_positions(figure, figure["points"])
        assert decoded.shape == (motion.frames, figure["points"], 3)
        assert figure["fps"] == motion.fps
        np.testing.assert_allclose(decoded[:, :22], motion.positions(), atol=5e-4)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(1e-3, 30.0), st.floats(-1e3, 1e3))
def test_quantisation_error_is_below_half_a_millimetre(seed, reach, shift):
    points = np.random.default_rng(seed).uniform(-reach, reach, (5, 4, 3)) + shift
    encoded = encode_positions(points, "any")
    assert np.abs(decode_positions(encoded, 4) - points).max() <= 5e-4


def test_audio_is_the_same_to_16_bits(tmp_path):
    audio = np.concatenate([tone(0.5), np.float32([1.0, -1.0, 0.5, 0.0])])
    data = page_data(write(tmp_path, audio=audio))
    with wave.open(io.BytesIO(base64.b64decode(data["audio"]["data"]))) as sound:
        assert (sound.getframerate(), sound.getnchannels(), sound.getsampwidth()) == (16000, 1, 2)
        samples = np.frombuffer(sound.readframes(sound.getnframes()), "<i2")
    np.testing.assert_array_equal(samples, np.round(audio * 32767))
    assert data["duration"] == pytest.approx(len(audio) / 16000)


def test_without_audio_the_longest_motion_sets_the_length(tmp_path):
    data = page_data(write(tmp_path, audio=np.zeros(0, np.float32)))
    assert data["audio"]["data"] == ""
    assert data["duration"] == pytest.approx(2.0)


def test_hostile_text_stays_text(tmp_path):
    evil = "</script><script>alert(1)</script><!-- {{data}} \u2028 & \"' \ud800"
    track = Track(evil, ((0.0, 1.0, evil, evil),))
    page = write(
        tmp_path,
        figures=[Figure(waving(), evil, evil, (track,))],
        title=evil.replace("\ud800", ""),
        subtitle="<img src=x onerror=alert(1)>",
        words=[Word(evil, 0.0, 0.5)],
    )
    assert "alert(1)</script>" not in page
    assert "<img" not in page
    assert page.count("</script>") == 2
    figure = page_data(page)["figures"][0]
    assert figure["label"] == figure["note"] == evil
    assert figure["tracks"] == [{"name": evil, "spans": [[0.0, 1.0, evil, evil]]}]


@given(st.text())
def test_script_json_is_json_without_markup(text):
    written = script_json({"text": text})
    assert not set("<>&") & set(written)
    written.encode("utf-8")
    assert json.loads(written) == {"text": text}


def test_template_values_are_not_filled_again():
    assert fill_template("{{a}} {{b}}", {"a": "{{b}}", "b": "2"}) == "{{b}} 2"


def test_minutes_of_talk_stay_small(tmp_path):
    """At this rate, ten minutes with five samples are below 12 MB."""
    recording = talk(65.0, 3, fps=30.0)
    write(tmp_path, figures=[Figure(recording.motion, "talk")], audio=recording.audio)
    empty = tmp_path / "empty"
    empty.mkdir()
    write(empty, figures=[Figure(recording.motion.clip(0, 1), "talk")], audio=recording.audio[:160])
    motion = len(page_data((tmp_path / "page.html").read_text())["figures"][0]["data"])
    sound = len(page_data((tmp_path / "page.html").read_text())["audio"]["data"])
    page = (empty / "page.html").stat().st_size
    assert page + 600 / 65 * (5 * motion + sound) < 12e6


def test_long_speech_is_compressed(tmp_path):
    audio = tone(61.0)
    data = page_data(write(tmp_path, audio=audio))["audio"]
    assert (data["type"], data["samples"], data["rate"]) == ("audio/mpeg", len(audio), 16000)
    decoded, rate = soundfile.read(io.BytesIO(base64.b64decode(data["data"])), dtype="float32")
    assert rate == 16000
    assert abs(len(decoded) - len(audio)) < 2400
    assert len(data["data"]) < 61 * 16000


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"figures": []}, "at least one"),
        ({"audio": np.float32([0.0, np.nan])}, "sample 1"),
        ({"sample_rate": 0}, "sample rate"),
        ({"figures": [Figure(waving().clip(0, 0), "empty")]}, "'empty'.*no frames"),
        ({"figures": [Figure(replace(waving(), fps=0.0), "still")]}, "'still'.*frames per second"),
        ({"figures": [Figure(replace(waving(), root=np.full((60, 3), np.inf, np.float32)), "far")]}, "'far', frame 0"),
        (
            {
                "figures": [
                    Figure(replace(waving(), root=np.linspace(0, 100, 180, dtype=np.float32).reshape(60, 3)), "cm")
                ]
            },
            "metres",
        ),
    ],
)
def test_bad_input_is_named_and_leaves_no_file(tmp_path, change, message):
    with pytest.raises(InputError, match=message):
        write(tmp_path, **change)
    assert list(tmp_path.iterdir()) == []


def test_a_notebook_shows_the_page_that_a_file_would_hold(tmp_path):
    words = [Word('<"quoted" & bold>', 0.1, 0.4)]
    shown = show_page([Figure(waving(), "Recorded")], tone(2.0), 16000, title="It's a title", words=words, height=500)
    frame = shown._repr_html_()
    source = re.fullmatch(r'<iframe srcdoc="([^"]*)" width="100%" height="500" style="border: 0"></iframe>', frame)
    assert source is not None
    written = write(tmp_path, figures=[Figure(waving(), "Recorded")], title="It's a title", words=words)
    assert html.unescape(source.group(1)) == written
    with pytest.raises(InputError, match="no figures"):
        show_page([], tone(2.0), 16000)


@pytest.mark.parametrize(("peak", "played", "words"), [(0.9, 0.9, ""), (2.5, 1.0, "-8.0 dB"), (1e-4, 0.1, "+60.0 dB")])
def test_audio_beyond_full_scale_and_too_quiet_audio_are_scaled_and_the_page_says_so(tmp_path, peak, played, words):
    audio = tone(2.0)
    audio = audio * np.float32(peak / np.abs(audio).max())
    page = write(tmp_path, audio=audio, footer="A footer.")
    with wave.open(io.BytesIO(base64.b64decode(page_data(page)["audio"]["data"]))) as file:
        samples = np.frombuffer(file.readframes(-1), "<i2") / 32767
    np.testing.assert_allclose(samples, audio * (played / peak), atol=2e-5)
    footer = re.search(r"<footer>(.*?)</footer>", page)[1]
    assert footer == (
        "A footer." if not words else f"A footer. Audio played {words}: its peak is {peak:.2g} of full scale."
    )
