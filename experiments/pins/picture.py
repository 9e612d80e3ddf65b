"""A film strip of pinned clips, each beside the same sample without it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from a2g_jax.generation.pins.request import pin_of
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.files import atomic_path
from a2g_jax.training.run import Run
from experiments.motion.strips import HEIGHT, WIDTH, strip
from experiments.pins.clips import Take
from experiments.pins.measure import pinned

#: Moments of a row; the first and the last lie beyond the transitions.
MOMENTS = 9
#: Place of the clip in its take, its length, and the second that it is pinned at.
_START, _SECONDS, _AT = 9.0, 2.0, 4.0


def picture(path: Path, runs: Sequence[tuple[str, Run, Motion]], takes: Sequence[Take], limit: float) -> None:
    """Write two rows for each take, of a run in turn: the sample without and with a clip of the take.

    Raises:
        InputError: no Playwright or Chromium.
    """
    rows = []
    for number, take in enumerate(takes):
        name, run, plain = runs[number % len(runs)]
        motion, (row,) = pinned(run, plain, [pin_of(take.cut(_START, _SECONDS), run, take.source, _AT)], limit)
        times = np.linspace(row["start"] - row["before"] - 0.1, row["end"] + row["after"] + 0.1, MOMENTS)
        inside = (times >= row["start"]) & (times < row["end"])
        rows += [
            (f"{name}", plain, times, np.zeros(MOMENTS, bool)),
            (f"{name} with a clip of {take.source}", motion, times, inside),
        ]
    whole = Image.new("RGB", (WIDTH, HEIGHT * len(rows)), "white")
    pen, font = ImageDraw.Draw(whole), ImageFont.load_default(17)
    for number, (title, motion, times, inside) in enumerate(rows):
        top = HEIGHT * number
        whole.paste(strip(motion, times), (0, top))
        pen.text((10, top + 6), title, fill="#1c2530", font=font)
        for column, (time, clip) in enumerate(zip(times, inside, strict=True)):
            middle = WIDTH * (column + 0.5) / MOMENTS
            label = f"{time:.1f} s" + (", clip" if clip else "")
            pen.text((middle, top + HEIGHT - 14), label, fill="#a8481c" if clip else "#5b6675", font=font, anchor="mm")
    with atomic_path(path) as temporary:
        whole.quantize(256, dither=Image.Dither.NONE).save(temporary, format="png", optimize=True)
