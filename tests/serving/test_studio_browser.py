"""The studio in Chromium with a shipped run: drop speech, generate, look, rank, download, and cancel."""

import base64

import numpy as np
import pytest

# Modules that threads of the studio import later: with the import hook of the tests, CPython 3.11 parses in one thread.
import a2g_jax.generation.clips
import a2g_jax.generation.export
import a2g_jax.inspection.audio_checks
import a2g_jax.training.run
import a2g_jax.viz.player.video  # noqa: F401
from a2g_jax.cli.studio import add_demo_speech, make_studio, named_runs
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import read_bvh, write_bvh
from a2g_jax.serving.run import served
from a2g_jax.serving.studio.routes import studio_app
from a2g_jax.talker.recordings import talk
from tests.browser_for_tests import FAKE_MICROPHONE, chromium

pytestmark = pytest.mark.browser

SECONDS = 2.0
_DROP = """([name, data]) => {
  const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0)), transfer = new DataTransfer();
  transfer.items.add(new File([bytes], name));
  for (const type of ["dragover", "drop"]) document.body.dispatchEvent(new DragEvent(type, { dataTransfer: transfer, bubbles: true, cancelable: true }));
}"""  # noqa: E501


@pytest.fixture(scope="module")
def browser():
    with chromium(*FAKE_MICROPHONE) as opened:
        yield opened


@pytest.fixture(scope="module")
def studio():
    with make_studio(named_runs([]), "demo") as made:
        add_demo_speech(made)
        yield made


@pytest.fixture(scope="module")
def url(studio):
    with served(studio_app(studio)) as address:
        yield address


@pytest.fixture
def page(browser, url):
    """The studio; what goes wrong on it must be nothing."""
    troubles = []
    context = browser.new_context(viewport={"width": 1280, "height": 800}, permissions=["microphone"])
    opened = context.new_page()
    opened.set_default_timeout(120_000)
    opened.on("console", lambda message: troubles.append(message.text) if message.type == "error" else None)
    opened.on("pageerror", lambda error: troubles.append(str(error)))
    opened.goto(url)
    opened.locator("#system-about", has_text="You can choose").wait_for()
    yield opened
    context.close()
    assert [text for text in troubles if "status of 4" not in text] == []


@pytest.fixture(scope="module")
def talked(tmp_path_factory):
    folder, recording = tmp_path_factory.mktemp("speech"), talk(SECONDS, 4)
    write_audio(folder / "talk.wav", recording.audio, 16000)
    write_audio(folder / "long.wav", np.tile(recording.audio, 120), 16000)
    write_bvh(folder / "wave.bvh", recording.motion)
    (folder / "junk.wav").write_bytes(b"no sound")
    return folder


def drop(page, path):
    page.evaluate(_DROP, [path.name, base64.b64encode(path.read_bytes()).decode()])


def test_speech_is_dropped_and_its_gestures_are_seen_ranked_and_downloaded(page, studio, talked, tmp_path):
    drop(page, talked / "junk.wav")
    page.locator('[data-field="speech"] > .error', has_text="junk.wav").wait_for()
    drop(page, talked / "talk.wav")
    page.locator("#speech-name", has_text="talk.wav").wait_for()
    page.locator("#samples").fill("2")
    page.locator("#generate").click()
    page.locator(".take.done").wait_for()

    # A second request, for four minutes of speech, is cancelled while it is worked on.
    drop(page, talked / "long.wav")
    page.locator("#speech-name", has_text="long.wav").wait_for()
    page.locator("#samples").fill("12")
    page.locator("#generate").click()
    page.locator(".take.card button", has_text="Cancel").press("Enter")
    page.locator(".take.cancelled").wait_for()
    assert not studio.busy
    assert len(list(studio.folder.glob("take-*"))) == 1

    frame = page.frame(url=lambda address: "/page?show=" in address)
    frame.evaluate("a2gPlayer.ready")
    figures = frame.evaluate("a2gPlayer.figures")
    assert [(one["label"], one["frames"]) for one in figures] == [("sample 0", 60), ("sample 1", 60)]
    before = frame.locator("#view").screenshot()
    frame.evaluate("a2gPlayer.seek(1.5)")
    frame.evaluate("a2gPlayer.still()")
    assert frame.locator("#view").screenshot() != before

    page.locator(".sample", has_text="sample 1").locator('[aria-label="5 stars"]').click()
    page.locator('[aria-label="Ranking of sample 1: 5 stars"]').wait_for()
    page.locator(".order select").select_option("stars")
    page.locator(".sample .eye").first.filter(has_text="sample 1").wait_for()
    with page.expect_download() as download:
        page.locator(".sample", has_text="sample 0").locator("a", has_text="BVH").click()
    assert download.value.suggested_filename == "take1_sample0.bvh"
    download.value.save_as(tmp_path / "sample.bvh")
    assert read_bvh(tmp_path / "sample.bvh").frames == 60


@pytest.mark.slow
def test_clips_curves_and_errors_beside_their_fields(page, talked):
    drop(page, talked / "wave.bvh")
    page.locator(".pin", has_text="wave.bvh").wait_for()
    page.locator("#controls-section > summary").click()
    energy = page.locator('[data-part="controls.energy"]')
    energy.locator("button", has_text="Curve").click()
    energy.locator("svg .handle").nth(1).press("ArrowUp")
    # Past the end of the speech: the clip cannot be there.
    page.locator(".pin input").first.fill("19.5")
    page.locator("#samples").fill("1")
    page.locator("#generate").click()
    page.locator('[data-field="pins"] > .error', has_text="the speech").wait_for()
    assert "upload-" not in page.locator('[data-field="pins"] > .error').inner_text()


@pytest.mark.slow
def test_a_microphone_is_recorded(page):
    page.locator("#record").click()
    page.locator("#recorded", has_text="0:02").wait_for()
    page.locator("#record").click()
    page.locator("#speech-name", has_text="recording.wav").wait_for()


def test_nothing_overflows_and_targets_are_large(page):
    for fold in page.locator("form > details:visible > summary").all():
        fold.click()
    for part in page.locator(".control button", has_text="Curve").all():
        part.click()
    for width in (1280, 390):
        page.set_viewport_size({"width": width, "height": 800})
        assert page.evaluate("document.documentElement.scrollWidth") == width
        small = page.evaluate(
            """[...document.querySelectorAll("form :is(button, .button, select, input:not(.hidden), summary)")]
            .filter((one) => one.offsetParent && one.type !== "checkbox")
            .filter((one) => one.offsetHeight < 44 || one.offsetWidth < 44).map((one) => one.outerHTML)"""
        )
        assert small == []
