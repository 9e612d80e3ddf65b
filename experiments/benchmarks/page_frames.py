"""Pictures a second of the page while it plays, in headless Chromium with software GL.

    python -m experiments.benchmarks.page_frames [--figures 5] [--seconds 20] [--character character.glb]

The page has motions of the generated talker, in a window of 1280 x 800. First, pictures are drawn one after another, of
three quarters of the pixels in each direction, as the page begins with; the processor time of one is that of all
processes of the browser, over all cores, and on a busy machine means more than pictures a second. Then the page plays,
and pictures count from the third second on, when it has chosen how many pixels it draws.
"""

import argparse
import json
import os
import statistics
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
#: Pictures that are drawn one after another for the processor time of one.
PICTURES = 8
_TICKS = os.sysconf("SC_CLK_TCK")


def talkers_page(path: Path, figures: int, seconds: float, character: Path | None = None) -> None:
    """Write a page of generated talkers."""
    takes = [a2g_jax.talk(seconds, seed) for seed in range(figures)]
    delivery = a2g_jax.Delivery(character=None if character is None else a2g_jax.read_character(character))
    motions = [delivery.make(take.motion).shown for take in takes]
    skins = [delivery.skin(motion.skeleton) for motion in motions]
    shown = [
        a2g_jax.Figure(motion, f"talker {number}", skin=skin)
        for number, (motion, skin) in enumerate(zip(motions, skins, strict=True))
    ]
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


def measure(page: Path, seconds: float, rounds: int = 5, size: tuple[int, int] = SIZE) -> dict[str, Any]:
    """Processor time of a picture, and pictures a second while the page plays."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_browser(), args=list(BROWSER_ARGUMENTS))
        try:
            view = browser.new_page(viewport={"width": size[0], "height": size[1]})
            view.goto(page.as_uri())
            view.evaluate("a2gPlayer.ready")
            scale = view.evaluate("a2gPlayer.scale()")
            view.evaluate("a2gPlayer.moving(1, 3)")  # compiles
            drawn = []
            for _ in range(rounds):
                used = _browsers_seconds()
                view.evaluate(f"a2gPlayer.moving(1, {PICTURES})")
                drawn.append(1000 * (_browsers_seconds() - used) / PICTURES)
            view.evaluate("() => { a2gPlayer.play() }")
            view.wait_for_timeout(1000 * BEGINNING)
            before, used, start = view.evaluate("a2gPlayer.pictures()"), _browsers_seconds(), time.perf_counter()
            view.wait_for_timeout(1000 * seconds)
            pictures = view.evaluate("a2gPlayer.pictures()") - before
            used, wall = _browsers_seconds() - used, time.perf_counter() - start
            return {
                "processor_ms_a_picture": round(statistics.median(drawn), 1),
                "rounds": [round(value, 1) for value in drawn],
                "scale": scale,
                "playing": {
                    "pictures_a_second": round(pictures / wall, 2),
                    "processor_ms_a_picture": round(1000 * used / max(pictures, 1), 1),
                    "cores_used": round(used / wall, 2),
                    "scale": round(view.evaluate("a2gPlayer.scale()"), 3),
                },
                "renderer": view.evaluate("a2gPlayer.renderer"),
            }
        finally:
            browser.close()


def _browsers_seconds() -> float:
    """Processor time of the processes below this one."""
    return processor_seconds(os.getpid()) - time.process_time()


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--figures", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=20.0, help="of playing")
    parser.add_argument("--character", type=Path, help="a GLB or VRM, whose mesh is drawn in place of our figure")
    parser.add_argument("--out", type=Path, default=RESULT)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        talkers_page(page, options.figures, options.seconds + BEGINNING + 10, options.character)
        found = {"figures": options.figures, "window": list(SIZE), "cores": len(os.sched_getaffinity(0))}
        found |= {"mesh": options.character is not None, "load": round(os.getloadavg()[0], 1)}
        found |= measure(page.resolve(), options.seconds)
    print(json.dumps(found, indent=1))
    write_json(options.out, found)


if __name__ == "__main__":
    main()
