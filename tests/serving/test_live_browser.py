"""The page with a microphone, in a Chromium whose microphone is a file."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.io.audio import write_audio
from tests.browser_for_tests import FAKE_MICROPHONE, chromium
from tests.serving.live_for_tests import RATE, speech

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    wav = tmp_path_factory.mktemp("microphone") / "speech.wav"
    write_audio(wav, speech(3.0) / np.float32(32768), RATE)
    with chromium(*FAKE_MICROPHONE, f"--use-file-for-fake-audio-capture={wav}") as opened:
        yield opened


@contextmanager
def page_of(browser, url, width=390, height=700, mark="#2d", **options):
    """The page with what went wrong on it, which must be nothing."""
    troubles = []
    context = browser.new_context(viewport={"width": width, "height": height}, **options)
    page = context.new_page()
    page.on("console", lambda message: troubles.append(message.text) if message.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: troubles.append(str(error)))
    try:
        page.goto(f"{url}{mark}")
        page.evaluate("a2gLive.ready")
        yield page
        assert troubles == []
    finally:
        context.close()


def wait_until(page, condition, seconds=60.0):
    for _ in range(round(seconds * 10)):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(100)
    raise AssertionError(f"{condition} did not become true in {seconds} s: {page.inner_text('#status')}")


def test_the_figure_follows_the_microphone(browser, live):
    with page_of(browser, live.url) as page:
        rest = np.array(page.evaluate("a2gLive.pose()"))
        page.click("#speak")
        wait_until(page, "a2gLive.frames() > 45")
        assert live.service.clients == 1
        wait_until(page, "a2gLive.time() > 0.5")
        time, first = page.evaluate("[a2gLive.time(), a2gLive.pose()]")
        # Pictures come whenever the browser has time for them.
        wait_until(page, f"a2gLive.time() > {time + 0.3}")
        assert np.abs(first - rest).max() > 0.01
        assert np.abs(np.array(page.evaluate("a2gLive.pose()")) - first).max() > 0.001
        # Behind the voice by at least what the frames wait for.
        assert page.evaluate("a2gLive.behind()") > 0.3
        assert page.inner_text("#behind").endswith(" s")
        page.click("#speak")
        assert page.evaluate("a2gLive.state()") == "idle"
        for _ in range(2400):
            if live.service.clients == 0:
                break
            page.wait_for_timeout(50)
        assert live.service.clients == 0


def slow_drawing(page, milliseconds):
    """Every picture takes at least so long."""
    page.evaluate(
        "(time) => { const draw = CanvasRenderingContext2D.prototype.restore;"
        " CanvasRenderingContext2D.prototype.restore = function () {"
        " draw.call(this); const end = performance.now() + time; while (performance.now() < end); }; }",
        milliseconds,
    )


@pytest.mark.slow
def test_slow_drawing_takes_no_time_from_messages(browser, live):
    with page_of(browser, live.url) as page:
        slow_drawing(page, 400)
        page.click("#speak")
        wait_until(page, "a2gLive.frames() > 90")
        late = [page.evaluate("a2gLive.newest() - a2gLive.time()") for _ in range(10) if not page.wait_for_timeout(150)]
        assert max(late) <= 1.7  # a second, and what arrived during a picture
        assert page.evaluate("a2gLive.scale()") < 0.9


@pytest.mark.slow
def test_a_page_that_draws_too_slowly_says_so(browser, live):
    with page_of(browser, live.url) as page:
        slow_drawing(page, 2600)
        page.click("#speak")
        wait_until(page, "document.getElementById('status').textContent.includes('make the window smaller')")


def test_controls_are_large_enough_for_fingers_and_fit_a_phone(browser, live):
    with page_of(browser, live.url, has_touch=True, is_mobile=True) as page:
        sizes = page.evaluate(
            "[...document.querySelectorAll('button, select')].map((one) => one.getBoundingClientRect())"
            ".map(({ width, height, right }) => [width, height, right])"
        )
        for width, height, right in sizes:
            assert min(width, height) >= 44
            assert right <= 390
        assert page.evaluate("document.documentElement.scrollWidth") == 390


def test_a_refusal_is_shown(browser, live, monkeypatch):
    monkeypatch.setattr(live.service, "limits", replace(live.service.limits, clients=0))
    with page_of(browser, live.url) as page:
        page.click("#speak")
        wait_until(page, "a2gLive.state() === 'idle'")
        assert "the most at a time" in page.inner_text("#status")
