import io
import subprocess
import sys
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image

from a2g_jax.errors import InputError
from a2g_jax.recording import Word
from a2g_jax.viz.player import Figure, Track, screenshot_page, write_page
from tests.browser_for_tests import chromium
from tests.viz.figures_for_tests import tone, waving

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("player") / "page.html"
    track = Track("phases", ((0.0, 0.5, "prep", "preparation"), (0.5, 1.0, "</script>", "stroke")))
    figures = [Figure(waving(120), "One", "30 fps", (track,)), Figure(waving(60, 15.0, 0.7), "<b>Two</b>")]
    write_page(path, figures, tone(4.0), 16000, title="Test & page", words=[Word("hello", 0.2, 0.6)], footer="foot")
    return path


@contextmanager
def opened(browser, path, mark="", width=420, height=560, **options):
    """The page with what went wrong on it, which must be nothing."""
    troubles, requests = [], []
    page = browser.new_page(viewport={"width": width, "height": height}, **options)
    page.on("console", lambda message: troubles.append(message.text) if message.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    try:
        page.goto(path.as_uri() + mark)
        page.evaluate("a2gPlayer.ready")
        yield page
        assert troubles == []
        assert [url for url in requests if not url.startswith(("file:", "blob:", "data:"))] == []
        assert len([url for url in requests if url.startswith("file:")]) == 1
    finally:
        page.close()


def wait_until(page, condition: str, seconds: float = 20.0) -> None:
    """Poll from here: the page's own policy forbids the evaluation that playwright's waiting needs."""
    for _ in range(round(seconds * 20)):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(50)
    raise AssertionError(f"{condition} did not become true in {seconds} s")


def picture(page) -> np.ndarray:
    page.evaluate("a2gPlayer.still()")
    shot = page.locator("#stage").screenshot(type="png")
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def saturation(image: np.ndarray) -> np.ndarray:
    return image.max(axis=2) - image.min(axis=2)


@pytest.mark.parametrize("mark", ["", "#2d"])
def test_figures_are_on_the_stage_and_seeking_moves_them(browser, page_file, mark):
    with opened(browser, page_file, mark) as page:
        assert page.evaluate("a2gPlayer.renderer") == ("canvas2d" if mark else "webgl2")
        first = picture(page)
        # The ground and sky are nearly grey; the figures are not.
        assert (saturation(first) > 60).mean() > 0.02
        left, right = np.array_split(saturation(first) > 60, 2, axis=1)
        assert left.any()
        assert right.any()
        page.evaluate("a2gPlayer.seek(1.3)")
        assert page.evaluate("a2gPlayer.time()") == pytest.approx(1.3, abs=1e-6)
        assert page.evaluate("[a2gPlayer.frame(0), a2gPlayer.frame(1)]") == [39, 20]
        assert (np.abs(picture(page) - first).max(axis=2) > 40).mean() > 0.003
        page.evaluate("a2gPlayer.seek(0)")
        assert (np.abs(picture(page) - first).max(axis=2) > 40).mean() < 0.001


def test_playing_follows_the_audio_and_stops_at_its_end(browser, page_file):
    with opened(browser, page_file, width=300, height=400) as page:
        page.evaluate("() => { a2gPlayer.play() }")
        wait_until(page, "a2gPlayer.time() > 0.7")
        player, audio = page.evaluate("[a2gPlayer.time(), document.getElementById('audio').currentTime]")
        assert player == pytest.approx(audio, abs=0.6)
        page.evaluate("a2gPlayer.pause()")
        stopped = page.evaluate("a2gPlayer.time()")
        page.wait_for_timeout(200)
        assert page.evaluate("a2gPlayer.time()") == stopped
        page.evaluate("() => { a2gPlayer.seek(3.7); a2gPlayer.play() }")
        wait_until(page, "!a2gPlayer.playing()")
        assert page.evaluate("a2gPlayer.time()") == pytest.approx(4.0)
        assert page.evaluate("a2gPlayer.frame(0)") == 119


def test_long_speech_is_in_its_place(browser, tmp_path):
    """MP3 delays speech by a part of a frame, which the page takes back."""
    audio = tone(62.0) * 0.05
    for second in (0.5, 30.25, 61.5):
        audio[round(16000 * second)] = 1.0
    write_page(tmp_path / "page.html", [Figure(waving(60), "One")], audio, 16000, title="long")
    with opened(browser, tmp_path / "page.html") as page:
        found = page.evaluate(
            "() => { const { samples, rate } = a2gPlayer.speech(); const peak = (from, to) => { let at = from;"
            " for (let i = from; i < to; i++) if (samples[i] > samples[at]) at = i; return at / rate; };"
            " return [samples.length, peak(0, 16000), peak(480000, 490000), peak(976000, samples.length)]; }"
        )
        assert found[0] == len(audio)
        np.testing.assert_allclose(found[1:], [0.5, 30.25, 61.5], atol=2e-3)
        wait_until(page, "Number.isFinite(document.getElementById('audio').duration)")
        assert page.evaluate("document.getElementById('audio').duration") == pytest.approx(62.0, abs=1e-3)


def test_keys_step_solo_and_play(browser, page_file):
    with opened(browser, page_file, width=300, height=400) as page:
        page.keyboard.press("ArrowRight")
        assert page.evaluate("a2gPlayer.time()") == pytest.approx(1 / 30)
        page.keyboard.press("2")
        page.evaluate("a2gPlayer.still()")
        assert page.locator("#labels button:visible").all_inner_texts() == ["<b>Two</b>"]
        page.keyboard.press("0")
        page.evaluate("a2gPlayer.still()")
        assert page.locator("#labels button:visible").count() == 2
        page.keyboard.press(" ")
        assert page.evaluate("a2gPlayer.playing()")
        page.keyboard.press(" ")
        assert not page.evaluate("a2gPlayer.playing()")


def test_buttons_have_names_and_the_page_fits_a_phone(browser, page_file):
    with opened(browser, page_file, width=390, height=844, color_scheme="dark") as page:
        unnamed = "[...document.querySelectorAll('button')].filter(b => !(b.textContent.trim() || b.ariaLabel)).length"
        assert page.evaluate(unnamed) == 0
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        for button in page.locator("#transport button:visible").all():
            box = button.bounding_box()
            assert 0 <= box["x"] <= 390 - box["width"]
        page.get_by_role("button", name="Overlay").click()
        page.get_by_role("button", name="Trails").click()
        assert (saturation(picture(page)) > 60).any()


def test_screenshot_has_the_requested_size(browser, page_file, tmp_path, monkeypatch):
    # Its own playwright cannot run inside that of the fixture, so run it as users do: in a process of its own.
    code = (
        "import sys; from a2g_jax.viz.player import screenshot_page as s;"
        "s(sys.argv[1], sys.argv[2], width=320, height=400, time=0.5)"
    )
    subprocess.run([sys.executable, "-c", code, str(page_file), str(tmp_path / "shot.png")], check=True, timeout=120)
    with Image.open(tmp_path / "shot.png") as image:
        assert image.size == (320, 400)
    monkeypatch.setenv("A2G_CHROMIUM", str(tmp_path / "nothing"))
    with pytest.raises(InputError, match="Chromium"):
        screenshot_page(page_file, tmp_path / "other.png")
    assert not (tmp_path / "other.png").exists()
