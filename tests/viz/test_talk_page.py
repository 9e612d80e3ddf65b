import re

import numpy as np
import pytest

from a2g_jax.generation.talk.files import right_motions
from a2g_jax.generation.talk.page import busiest_moments, gesture_lane, write_talk_page
from a2g_jax.talker.recordings import resample_motion, talk
from a2g_jax.talker.speech import plan_from_json
from a2g_jax.viz.pitch import pitch_curve
from a2g_jax.viz.player import Bars, Curve, Figure, Hands, Mark, write_page
from tests.viz.figures_for_tests import tone, waving
from tests.viz.test_player_browser import browser as browser  # the fixture
from tests.viz.test_player_browser import opened, wait_until
from tests.viz.test_player_page import page_data


@pytest.fixture(scope="module")
def recording():
    return talk(6.0, 3, fingers=True)


@pytest.fixture(scope="module")
def page_file(recording, tmp_path_factory):
    path = tmp_path_factory.mktemp("talk") / "index.html"
    write_talk_page(path, recording, list(right_motions(recording, 2, 0)))
    return path


def test_pitch_of_a_tone_and_of_silence():
    pitch = pitch_curve(tone(2.0), 16000)
    voiced = pitch[np.isfinite(pitch)]
    assert len(pitch) == 100
    assert len(voiced) > 50
    np.testing.assert_allclose(voiced, 220.0, rtol=0.01)
    assert np.isnan(pitch_curve(np.zeros(16000, np.float32), 16000)).all()
    assert np.isnan(pitch_curve(np.random.default_rng(0).normal(size=16000) * 0.1, 16000)).mean() > 0.9


def test_lane_of_a_motion_holds_its_truth(recording):
    plan = plan_from_json(recording.annotations["speech"])
    _, truth = resample_motion(recording, 7)
    lane = gesture_lane(truth, plan)
    assert [mark.time for mark in lane.marks] == [stroke.apex for stroke in truth.strokes]
    assert [mark.key for mark in lane.marks] == [stroke.family for stroke in truth.strokes]
    assert len(lane.left) + len(lane.right) == len(truth.phases)
    for mark in lane.marks:
        for hand in ("left", "right") if mark.hand == "both" else (mark.hand,):
            phases = [phase for start, end, phase in getattr(lane, hand) if start - 0.05 <= mark.time <= end + 0.05]
            assert "stroke" in phases


def test_busiest_moments_are_apart_and_in_order(recording):
    _, truth = resample_motion(recording, 7)
    moments = busiest_moments([truth], 3, 1.0)
    assert moments == sorted(moments)
    assert min(np.diff(moments)) >= 1.0
    assert max(truth.strokes, key=lambda stroke: stroke.size).apex in moments


def test_lanes_are_in_the_page_data(tmp_path):
    lanes = (
        Bars("bars", ((0.0, 0.5, 0.7, "ba", "note"),)),
        Curve("curve", 10.0, np.array([1.0, np.nan, 2.0]), "Hz"),
    )
    hands = Hands("both", ((0.0, 1.0, "hold"),), (), (Mark(0.5, 1.0, "left", "beat", "note"),))
    write_page(tmp_path / "a.html", [Figure(waving(), "One", "", (hands,))], tone(2.0), 16000, title="t", lanes=lanes)
    data = page_data((tmp_path / "a.html").read_text(encoding="utf-8"))
    assert data["lanes"] == [
        {"name": "bars", "bars": [[0.0, 0.5, 0.7, "ba", "note"]]},
        {"name": "curve", "rate": 10.0, "values": [1.0, None, 2.0], "unit": "Hz"},
    ]
    assert data["figures"][0]["tracks"][0]["marks"] == [[0.5, 1.0, "left", "beat", "note"]]


@pytest.mark.browser
def test_lanes_tell_exact_values_and_labels_follow_the_hands(browser, page_file, recording):
    with opened(browser, page_file, width=1000, height=900) as page:
        lanes = page.evaluate("a2gPlayer.lanes()")
        kinds = [lane["kind"] for lane in lanes]
        assert kinds == ["wave", "words", "bars", "curve", "hands", "hands", "speed"]
        truth = recording.annotations["gestures"]
        stroke = truth["strokes"][0]
        page.evaluate("time => a2gPlayer.seek(time)", stroke["apex"])
        page.evaluate("a2gPlayer.still()")
        hand = "R" if stroke["hand"] == "right" else "L"
        assert f"{hand} {stroke['family']}" in page.locator("#labels .doing").first.inner_text()
        # All six seconds are in view.
        box = page.locator("#detail").bounding_box()
        top = 4 + sum(lane["height"] for lane in lanes[:4])
        height = lanes[4]["height"] * (0.75 if stroke["hand"] == "right" else 0.3)
        page.mouse.move(box["x"] + stroke["apex"] / 6.0 * box["width"], box["y"] + top + height)
        tip = page.locator("#tip").inner_text()
        assert stroke["family"] in tip
        assert f"apex at {stroke['apex']:.2f} s" in tip
        syllable = recording.annotations["speech"]["syllables"][stroke["syllable"]]
        middle = (syllable["onset"] + syllable["end"]) / 2
        page.mouse.move(box["x"] + middle / 6.0 * box["width"], box["y"] + 4 + 44 + 20 + 25)
        assert f"accent {syllable['accent']:.2f}" in page.locator("#tip").inner_text()
        page.mouse.move(box["x"] + 5, box["y"] - 200)
        assert not page.locator("#tip").is_visible()


@pytest.mark.browser
@pytest.mark.parametrize(("mark", "dark"), [("", True), ("#2d", False)])
def test_the_page_plays_in_both_renderers_and_themes(browser, page_file, mark, dark):
    with opened(browser, page_file, mark, width=800, height=900, color_scheme="dark" if dark else "light") as page:
        page.keyboard.press(" ")
        wait_until(page, "a2gPlayer.time() > 0.3")
        page.keyboard.press(" ")
        page.keyboard.press("1")
        page.evaluate("a2gPlayer.still()")
        assert [lane["kind"] for lane in page.evaluate("a2gPlayer.lanes()")].count("hands") == 1
        assert page.evaluate("document.documentElement.scrollWidth") <= 800
        legend = page.locator("#legend").inner_text()
        assert re.search(r"stroke.*retraction.*apex of a", legend, re.DOTALL)
