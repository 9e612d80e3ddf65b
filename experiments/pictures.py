"""The pictures in the README: the demo and its emotions; one sentence and five right motions; the page of the data.

    python -m experiments.pictures [--out docs/pictures] [--seed 4]

Needs playwright, Pillow and Chromium. Writes ``demo.png``, ``emotions.png``, ``talker.png`` and ``talker_page.png``.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from a2g_jax.cli import main as run_command
from a2g_jax.generation.talk.files import right_motions
from a2g_jax.generation.talk.page import busiest_moments, write_talk_page
from a2g_jax.generation.talk.request import TalkRequest
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.files import atomic_path
from a2g_jax.talker.speech import plan_from_json
from a2g_jax.talker.truth import GestureTruth
from a2g_jax.viz.player import screenshot_page

WIDTH = 1600
#: Heights of a row of figures, and of the timeline under the last one, pixels.
ROW, TIMELINE = 470, 380
#: Seconds of the sentence: the range of the zoomed timeline.
SENTENCE = 10.0

_STYLE = """
const style = document.createElement("style");
style.textContent = `#views, header, #transport, footer { display: none !important; }
  #scrubber { height: 0; overflow: hidden; }
  #labels button > span:not(.doing) { display: none; }
  .moment { position: fixed; left: 18px; top: 14px; font-weight: 650; font-size: 17px; z-index: 3; }
  .moment em { font-style: normal; font-weight: 400; color: var(--soft); }
  .when { position: absolute; top: 0; bottom: 0; width: 0; border-left: 1.5px dashed var(--ink); opacity: 0.55; }
  #lanes { position: relative; max-height: none; }`;
document.head.append(style);
"""


def moment_script(number: int, time: float, word: str, times: list[float], last: bool) -> str:
    """JavaScript that turns the page into one row of the picture."""
    script = _STYLE + "a2gPlayer.view({ yaw: -0.22, pitch: 0.1 });"
    text = f"{number}  <em>{time:.1f} s, “{word}”</em>"
    script += f"document.body.insertAdjacentHTML('beforeend', '<div class=moment>{text}</div>');"
    if not last:
        return script + "document.getElementById('panel').style.display = 'none';"
    marks = "".join(f"<div class=when style=left:{100 * time / SENTENCE:.2f}%></div>" for time in times[:-1])
    return script + f"document.getElementById('lanes').insertAdjacentHTML('beforeend', '{marks}');"


def sentence_picture(path: Path, page: Path, shown: list[tuple[Motion, GestureTruth]], words: list[str]) -> None:
    """Rows of the five motions at the largest strokes, the sentence and its strokes underneath."""
    times = busiest_moments([truth for _, truth in shown], 2, 2.5)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for number, time in enumerate(times, start=1):
            last = number == len(times)
            stroke = min(shown[0][1].strokes, key=lambda one: abs(one.apex - time))
            row = Path(folder) / f"{number}.png"
            script = moment_script(number, time, words[stroke.syllable], times, last)
            screenshot_page(page, row, width=WIDTH, height=ROW + last * TIMELINE, time=time, script=script)
            with Image.open(row) as image:
                rows.append(image.convert("RGB"))
    whole = Image.new("RGB", (WIDTH, sum(row.height for row in rows)))
    for index, row in enumerate(rows):
        whole.paste(row, (0, sum(other.height for other in rows[:index])))
    _save(whole, path)


#: Point at the apex of a stroke, so that the box with its values shows.
_POINT = """
a2gPlayer.seek(TIME);
const lanes = document.getElementById("lanes"), box = document.getElementById("detail").getBoundingClientRect();
search: for (let x = 0.62 * box.width; x < box.width; x += 2) for (let y = box.height - 60; y > 80; y -= 3) {
  const lines = a2gPlayer.tell(x, y);
  if (!lines || !lines.some((line) => line && line.startsWith("apex at"))) continue;
  lanes.dispatchEvent(new PointerEvent("pointermove", { clientX: box.left + x, clientY: box.top + y }));
  break search;
}
"""


def page_picture(path: Path, page: Path, time: float) -> None:
    """The page as it opens, with the pointer at a stroke."""
    with tempfile.TemporaryDirectory() as folder:
        shot = Path(folder) / "page.png"
        screenshot_page(page, shot, width=WIDTH, height=1000, time=time, script=_POINT.replace("TIME", str(time)))
        with Image.open(shot) as image:
            _save(image.convert("RGB"), path)


def demo_picture(path: Path, folder: Path, time: float, flags: tuple[str, ...] = (), height: int = 800) -> None:
    """The page of ``a2g demo`` at a moment.

    Args:
        flags: further ones of the command.
    """
    if run_command(["demo", *flags, "--out", str(folder), "--formats", "html"]):
        raise SystemExit("the demo failed")
    screenshot_page(folder / "index.html", path, width=1280, height=height, time=time)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def _save(image: Image.Image, path: Path) -> None:
    """Save with 256 colours, a third of the bytes; most colours go to the shaded figures."""
    pixels = np.asarray(image).reshape(-1, 3)
    vivid = np.ptp(pixels.astype(int), axis=1) > 40
    chosen = np.concatenate([pixels[vivid][::2], pixels[~vivid][::12]])
    sample = Image.fromarray(chosen[: len(chosen) // 500 * 500].reshape(-1, 500, 3))
    palette = sample.quantize(256, kmeans=2)
    with atomic_path(path) as temporary:
        image.quantize(palette=palette, dither=Image.Dither.NONE).save(temporary, optimize=True)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def main() -> None:
    """Write all pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    parser.add_argument("--seed", type=int, default=4)
    parser.add_argument("--time", type=float, default=9.0, help="of the demo's picture, seconds")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        demo_picture(options.out / "demo.png", Path(folder) / "demo", options.time)
        demo_picture(options.out / "emotions.png", Path(folder) / "emotions", options.time, ("--emotions",), 620)
        for name, seconds in (("talker", SENTENCE), ("talker_page", 20.0)):
            recording = TalkRequest(seconds=seconds, seed=options.seed, fingers=True).recording()
            shown = list(right_motions(recording, 5, options.seed))
            page = Path(folder) / f"{name}.html"
            write_talk_page(page, recording, shown)
            if name == "talker":
                plan = plan_from_json(recording.annotations["speech"])
                words = [plan.words[syllable.word].text for syllable in plan.syllables]
                sentence_picture(options.out / "talker.png", page, shown, words)
            else:
                page_picture(options.out / "talker_page.png", page, busiest_moments([shown[0][1]], 1, 0.0)[0])


if __name__ == "__main__":
    main()
