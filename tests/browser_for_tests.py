"""The Chromium of browser tests."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from a2g_jax.viz.player.screenshot import BROWSER_ARGUMENTS, find_browser

#: A microphone that needs no permission and plays a tone.
FAKE_MICROPHONE = ("--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream")


@contextmanager
def chromium(*arguments: str) -> Iterator[Any]:
    """A browser with further arguments; without one the test is skipped, or fails with ``A2G_REQUIRE_BROWSER=1``."""
    reason = None
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        reason = "playwright is not installed"
    path = find_browser()
    if path is None or not Path(path).exists():
        reason = "no Chromium found; install it or set A2G_CHROMIUM"
    if reason:
        if os.environ.get("A2G_REQUIRE_BROWSER") == "1":
            pytest.fail(reason)
        pytest.skip(reason)
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=path, args=[*BROWSER_ARGUMENTS, *arguments])
        yield opened
        opened.close()
