"""Pictures a second of the page while it plays, in headless Chromium with software GL.

    python -m experiments.benchmarks.page_frames [--figures 5] [--seconds 20] [--character character.glb]

The page has motions of the generated talker, in a window of 1280 x 800. Pictures count from the third second on, when
the page has chosen its size. On a busy machine only the processor time of a picture means much: that of all processes
of the browser, over all cores.
"""

import argparse
import json
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import a2g_jax
from a2g_jax.io.files import write_json
from a2g_jax.viz.player.screenshot import BROWSER_ARGUMENTS, find_browser

RESULT = Path(__file__).parent / "results" / "page_frames.json"
SIZE = (1280, 800)
#: Seconds of playing before pictures count.
BEGINNING = 3.0
_TICKS = os.sysconf("SC_CLK_TCK")


def talkers_page(path: Path, figures: int, seconds: float) -> None:
    """Write a page of generated talkers of one speech."""
    takes = [a2g_jax.talk(seconds, seed) for seed in range(figures)]
    shown = [a2g_jax.Figure(take.motion, f"talker {number}") for number, take in enumerate(takes)]
    a2g_jax.write_page(path, shown, takes[0].audio, takes[0].sample_rate, title=f"{figures} talkers")


def processor_seconds(browser: int) -> float:
    """Processor time of a process and all below it."""
    parents, used = {}, {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue  # it has just ended
            number = int(entry.name)
            parents[number], used[number] = int(fields[1]), (int(fields[11]) + int(fields[12])) / _TICKS
    below, total = {browser}, used.get(browser, 0.0)
    for number in sorted(parents):
        if parents[number] in below:
            below.add(number)
            total += used[number]
    return total


def measure(page: Path, seconds: float, size: tuple[int, int] = SIZE) -> dict[str, Any]:
    """Pictures a second, and processor time of one, while the page plays."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_browser(), args=list(BROWSER_ARGUMENTS))
        try:
            view = browser.new_page(viewport={"width": size[0], "height": size[1]})
            view.goto(page.as_uri())
            view.evaluate("a2gPlayer.ready")
            view.evaluate("() => { a2gPlayer.play() }")
            view.wait_for_timeout(1000 * BEGINNING)
            driver = os.getpid()
            before, used, start = view.evaluate("a2gPlayer.pictures()"), processor_seconds(driver), time.perf_counter()
            own = time.process_time()
            view.wait_for_timeout(1000 * seconds)
            pictures = view.evaluate("a2gPlayer.pictures()") - before
            used = processor_seconds(driver) - used - (time.process_time() - own)
            wall = time.perf_counter() - start
            return {
                "pictures": pictures,
                "a_second": round(pictures / wall, 2),
                "processor_ms_a_picture": round(1000 * used / max(pictures, 1), 1),
                "cores_used": round(used / wall, 2),
                "scale": round(view.evaluate("a2gPlayer.scale()"), 3),
                "renderer": view.evaluate("a2gPlayer.renderer"),
            }
        finally:
            browser.close()


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--figures", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--page", type=Path, help="a page to measure, in place of generated talkers")
    parser.add_argument("--out", type=Path, default=RESULT)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        page = options.page or Path(folder) / "page.html"
        if options.page is None:
            talkers_page(page, options.figures, options.seconds + BEGINNING + 10)
        found = {"figures": options.figures, "window": list(SIZE), "cores": len(os.sched_getaffinity(0))}
        found |= measure(page.resolve(), options.seconds)
    print(json.dumps(found, indent=1))
    write_json(options.out, found)


if __name__ == "__main__":
    main()
