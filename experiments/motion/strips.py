"""Film strips: every run at equal times of one speech, under the speaker's own motion."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from a2g_jax.geometry.motion import Motion
from a2g_jax.io.files import atomic_path
from a2g_jax.viz.player import Figure, screenshot_page, write_page
from experiments.motion.rows import Row
from experiments.motion.speeches import Speech

#: Moments of a strip, the seconds between them, and the size of a row in pixels.
MOMENTS, STEP, WIDTH, HEIGHT = 9, 0.7, 1800, 300
#: The first moment, seconds: people begin a speech at rest.
BEGIN = 4.0

_STYLE = """
const style = document.createElement("style");
style.textContent = `#views, header, #transport, footer, #panel, #labels { display: none !important; }`;
document.head.append(style);
a2gPlayer.view({ yaw: -0.22, pitch: 0.1 });
"""


def film_strips(path: Path, speech: Speech, rows: Sequence[Row]) -> None:
    """Write a picture with a row of moments for the speaker and for each run, 0.7 s apart.

    Args:
        speech: the only speech of the rows, or their first.

    Raises:
        InputError: no Playwright or Chromium.
    """
    shown: list[tuple[str, Motion]] = []
    if speech.truth is not None:
        shown.append(("truth" if speech.recording else "the person", speech.truth))
    for row in rows:
        assert row.draw is not None
        shown.append((row.name, row.draw(0)[0]))
    times = BEGIN + STEP * np.arange(MOMENTS)
    times = times[times < min(motion.seconds for _, motion in shown) - 0.1]
    pictures = [strip(motion, times) for _, motion in shown]
    whole = Image.new("RGB", (WIDTH, HEIGHT * len(shown) + 26), "white")
    pen, font = ImageDraw.Draw(whole), ImageFont.load_default(17)
    for number, ((name, _), picture) in enumerate(zip(shown, pictures, strict=True)):
        whole.paste(picture, (0, HEIGHT * number))
        pen.text((10, HEIGHT * number + 8), name, fill="#1c2530", font=font)
    for number, time in enumerate(times):
        place = (WIDTH * (number + 0.5) / len(times), HEIGHT * len(shown) + 13)
        pen.text(place, f"{time:.1f} s", fill="#5b6675", font=font, anchor="mm")
    with atomic_path(path) as temporary:
        whole.quantize(256, dither=Image.Dither.NONE).save(temporary, format="png", optimize=True)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def strip(motion: Motion, times: Sequence[float] | np.ndarray) -> Image.Image:
    """The figure at these times, side by side: a page for each, since the page places several figures in ranks."""
    width = WIDTH // len(times)
    whole = Image.new("RGB", (WIDTH, HEIGHT), "white")
    with tempfile.TemporaryDirectory() as folder:
        page, shot = Path(folder) / "strip.html", Path(folder) / "strip.png"
        for number, time in enumerate(times):
            frame = min(round(float(time) * motion.fps), motion.frames - 1)
            figure = Figure(motion.clip(frame, frame + 1), " ")
            write_page(page, [figure], np.zeros(0, np.float32), 16000, title="strip")
            screenshot_page(page, shot, width=width, height=HEIGHT, script=_STYLE)
            with Image.open(shot) as image:
                whole.paste(image.convert("RGB"), (width * number, 0))
    return whole
