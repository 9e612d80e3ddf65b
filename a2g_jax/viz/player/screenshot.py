"""Pictures of a page, by a headless browser."""

import os
import shutil
from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.io.files import atomic_path, check_readable

#: Software WebGL, so that pictures are the same with and without a GPU, and no network traffic of the browser itself.
BROWSER_ARGUMENTS: tuple[str, ...] = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--autoplay-policy=no-user-gesture-required",
)


def find_browser() -> str | None:
    """Path of a Chromium: the environment variable ``A2G_CHROMIUM``, else the first one on the PATH."""
    named = os.environ.get("A2G_CHROMIUM")
    if named:
        return named
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
    return next((found for name in names if (found := shutil.which(name))), None)


def _settled(view: Any) -> bytes:
    """A picture that equals the next one: on a busy machine canvases appear frames after they are drawn."""
    before, after = b"", view.screenshot(type="png")
    for _ in range(20):
        if before == after:
            break
        view.wait_for_timeout(150)
        before, after = after, view.screenshot(type="png")
    return after


def screenshot_page(
    page: str | os.PathLike[str],
    picture: str | os.PathLike[str],
    *,
    width: int = 1280,
    height: int = 800,
    time: float = 0.0,
    dark: bool = False,
    script: str = "",
) -> None:
    """Save a PNG of a page that :func:`~a2g_jax.viz.player.page.write_page` wrote.

    Args:
        page: the HTML file.
        picture: the PNG to write; replaced atomically.
        width: width of the window, pixels.
        height: height of the window, pixels.
        time: seconds from the start.
        dark: whether to use the dark theme.
        script: JavaScript to run first, such as ``a2gPlayer.view({yaw: 0.6})``.

    Raises:
        InputError: no such page, or no Playwright or Chromium.
    """
    source = check_readable(page, "an HTML page")
    try:
        from playwright.sync_api import Error, sync_playwright
    except ImportError:
        raise InputError("pictures of a page need playwright; install it with: pip install playwright") from None
    browser_path = find_browser()
    if browser_path is None or not Path(browser_path).exists():
        raise InputError("pictures of a page need Chromium; install it, or set A2G_CHROMIUM to its path.")
    with atomic_path(picture) as temporary, sync_playwright() as playwright:
        try:
            browser = playwright.chromium.launch(executable_path=browser_path, args=list(BROWSER_ARGUMENTS))
            try:
                view = browser.new_page(
                    viewport={"width": width, "height": height}, color_scheme="dark" if dark else "light"
                )
                view.goto(source.resolve().as_uri())
                view.evaluate("a2gPlayer.ready")
                if script:
                    view.evaluate(f"() => {{ {script} }}")
                view.evaluate("time => a2gPlayer.seek(time)", time)
                view.evaluate("a2gPlayer.still()")
                temporary.write_bytes(_settled(view))
            finally:
                browser.close()
        except Error as error:
            raise InputError(f"{source}: the browser could not show it ({error.message.splitlines()[0]}).") from None
