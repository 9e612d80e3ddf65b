"""The picture of ``a2g serve`` in the guide and the README: the page while generated speech is its microphone.

    python -m experiments.live.picture [--run demo-flow] [--to character.glb] [--out docs/pictures/live.png]

The dark theme at 1280 x 800, and the light one on a phone. Needs the extra ``serve``, playwright, Pillow and Chromium.
"""

import argparse
import tempfile
from pathlib import Path

import a2g_jax
from a2g_jax.compilations import keep_compilations
from a2g_jax.generation.delivery import Delivery
from a2g_jax.serving.app import make_app
from a2g_jax.serving.live.page import lifespan, routes
from a2g_jax.serving.live.service import Limits, Service
from a2g_jax.serving.run import served
from a2g_jax.serving.security import Security
from a2g_jax.viz.player.screenshot import BROWSER_ARGUMENTS, find_browser
from experiments.studio_pictures import DESK, PHONE, beside, save, shot

#: Seconds of speech, and frames after which the picture is taken.
SECONDS, FRAMES = 30.0, 45
_MICROPHONE = ("--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream")


def main() -> None:
    """Write the picture."""
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", default="demo-flow")
    parser.add_argument("--to", type=Path, help="a character")
    parser.add_argument("--out", type=Path, default=Path("docs/pictures/live.png"))
    options = parser.parse_args()
    keep_compilations()
    delivery = Delivery(character=None if options.to is None else a2g_jax.read_character(options.to))
    service = Service(a2g_jax.open_run(options.run), Limits(), 0.5, delivery)
    service.warm_up()
    app = make_app(routes(service, options.run), Security("127.0.0.1"), lifespan(service))
    with tempfile.TemporaryDirectory() as folder, served(app) as url, sync_playwright() as playwright:
        speech = a2g_jax.talk(SECONDS, seed=3)
        a2g_jax.write_audio(Path(folder) / "speech.wav", speech.audio, speech.sample_rate)
        microphone = (*_MICROPHONE, f"--use-file-for-fake-audio-capture={folder}/speech.wav")
        browser = playwright.chromium.launch(executable_path=find_browser(), args=[*BROWSER_ARGUMENTS, *microphone])
        pictures = []
        for size, dark in ((DESK, True), (PHONE, False)):
            view = browser.new_page(
                viewport={"width": size[0], "height": size[1]}, color_scheme="dark" if dark else "light"
            )
            view.goto(url)
            view.evaluate("a2gLive.ready")
            view.locator("#speak").click()
            for _ in range(200):
                view.wait_for_timeout(500)
                if view.evaluate("a2gLive.frames()") >= FRAMES:
                    break
            pictures.append(shot(view))
            view.close()
        browser.close()
        save(beside(*pictures), options.out)


if __name__ == "__main__":
    main()
