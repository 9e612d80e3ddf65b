"""The picture of ``a2g studio`` in the guide and the README: the page in the light theme, a phone in the dark one.

    python -m experiments.studio_pictures [--out docs/pictures]

Needs the extra ``serve``, playwright, Pillow and Chromium. Writes ``studio.png``; with ``--all`` every state that is
looked at before a release as well: both themes at 1280 x 800 and at 390 pixels, the form with its folds open.
"""

import argparse
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PIL import Image

from a2g_jax.cli.studio import add_demo_speech, make_studio, named_runs
from a2g_jax.compilations import keep_compilations
from a2g_jax.io.files import atomic_path
from a2g_jax.serving.run import served
from a2g_jax.serving.studio.routes import studio_app
from a2g_jax.serving.studio.studio import Studio
from a2g_jax.viz.player.screenshot import BROWSER_ARGUMENTS, find_browser

DESK, PHONE = (1280, 800), (390, 800)
#: The moment of the picture, seconds.
MOMENT = 4.2


def generated(studio: Studio) -> None:
    """Two takes, one with stars."""
    for request in ({"samples": 2, "seed": 1, "controls": {"energy": 0.9}}, {"samples": 3, "seed": 4}):
        take = studio.request({"speech": "demo", "system": "demo", **request})
        if not studio.jobs.wait(take.job, 600.0) or take.job.error is not None:
            raise SystemExit(f"{take.job.title}: {take.job.error or 'takes too long'}")
    for sample, stars in ((0, 4), (1, 5)):
        studio.rate(take.id, {"sample": sample, "stars": stars})


@contextmanager
def opened(browser: Any, url: str, size: tuple[int, int], dark: bool) -> Iterator[Any]:
    """The page in a window."""
    phone = size == PHONE
    view = browser.new_page(
        viewport={"width": size[0], "height": size[1]},
        color_scheme="dark" if dark else "light",
        has_touch=phone,
        is_mobile=phone,
    )
    try:
        view.goto(url)
        view.locator("#system-about", has_text="You can choose").wait_for(timeout=120_000)
        yield view
    finally:
        view.close()


def looked_at(view: Any) -> None:
    """Wait for the newest take, which the page shows, and go to the moment of the picture."""
    view.frame_locator("#player").locator("#labels button").nth(2).wait_for(timeout=120_000)
    frame = next(frame for frame in view.frames if "/page?show=" in frame.url)
    frame.evaluate("a2gPlayer.ready")
    frame.evaluate("time => a2gPlayer.seek(time)", MOMENT)
    frame.evaluate("a2gPlayer.still()")
    view.wait_for_timeout(800)


def shot(view: Any, **options: Any) -> Image.Image:
    """A picture of the page."""
    return Image.open(io.BytesIO(view.screenshot(type="png", timeout=120_000, **options))).convert("RGB")


def beside(left: Image.Image, right: Image.Image, gap: int = 24) -> Image.Image:
    """Two pictures of one height side by side."""
    both = Image.new("RGB", (left.width + gap + right.width, max(left.height, right.height)), (255, 255, 255))
    both.paste(left, (0, 0))
    both.paste(right, (left.width + gap, 0))
    return both


def states(browser: Any, url: str, out: Path) -> None:
    """Every state that is looked at."""
    for size in (DESK, PHONE):
        for dark in (False, True):
            name = f"studio_{size[0]}_{'dark' if dark else 'light'}"
            with opened(browser, url, size, dark) as view:
                looked_at(view)
                save(shot(view, full_page=size == PHONE), out / f"{name}.png")
                for fold in view.locator("form > details:visible > summary").all():
                    fold.click()
                view.locator(".control").nth(0).locator("button", has_text="Level").click()
                view.locator(".control").nth(1).locator("button", has_text="Curve").click()
                view.locator(".control").nth(1).scroll_into_view_if_needed()
                save(shot(view), out / f"{name}_form.png")


def save(picture: Image.Image, path: Path) -> None:
    """Write a PNG."""
    with atomic_path(path) as temporary:
        picture.save(temporary, format="PNG", optimize=True)


def main() -> None:
    """Write the pictures."""
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    parser.add_argument("--all", action="store_true", help="all states, for looking at them")
    options = parser.parse_args()
    keep_compilations()
    with make_studio(named_runs([]), "demo") as studio:
        add_demo_speech(studio)
        generated(studio)
        with served(studio_app(studio)) as url, sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=find_browser(), args=list(BROWSER_ARGUMENTS))
            try:
                with opened(browser, url, DESK, dark=False) as view:
                    looked_at(view)
                    desk = shot(view)
                with opened(browser, url, PHONE, dark=True) as view:
                    looked_at(view)
                    view.evaluate("document.getElementById('stage').scrollIntoView()")
                    view.wait_for_timeout(500)
                    phone = shot(view)
                save(beside(desk, phone), options.out / "studio.png")
                if options.all:
                    states(browser, url, options.out)
            finally:
                browser.close()


if __name__ == "__main__":
    main()
