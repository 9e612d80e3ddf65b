"""Motions as MP4 films with sound: the page's own picture of every frame, encoded by ffmpeg."""

import base64
import os
import shutil
import subprocess
import tempfile
from collections.abc import Generator, Iterable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import IO, Any

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.audio import write_audio
from a2g_jax.io.files import atomic_path
from a2g_jax.progress import counted_steps
from a2g_jax.viz.player.figure import Figure
from a2g_jax.viz.player.page import write_page
from a2g_jax.viz.player.screenshot import BROWSER_ARGUMENTS, find_browser
from a2g_jax.viz.player.skin import Skin

#: Width and height of the picture, pixels. The page draws stills at twice the pixels of its window without a GPU.
SIZE = 720
#: Most frames of a film: ten minutes at 30 frames a second. A frame takes a tenth of a second or more to draw.
MOST_FRAMES = 18_000
_INSTALL = "install both with: pip install 'a2g_jax[video]'"
#: The page leaves room for its labels, which a film has not.
_NEAR = "a2gPlayer.view({ zoom: 1.35 });"
#: The figure alone.
_STYLE = """() => {
  const style = document.createElement("style");
  style.textContent = "#panel, header, #views, #labels { display: none !important; }";
  document.head.append(style);
}"""
#: The picture is read in the frame in which it is drawn, on the page's background: the browser shows it later.
_FRAME = """time => new Promise(done => {
  const view = document.getElementById("view");
  a2gPlayer.seek(time);
  a2gPlayer.still();
  requestAnimationFrame(() => {
    const flat = document.createElement("canvas"), pen = flat.getContext("2d");
    flat.width = view.width; flat.height = view.height;
    pen.fillStyle = getComputedStyle(document.getElementById("stage")).backgroundColor;
    pen.fillRect(0, 0, flat.width, flat.height);
    pen.fillStyle = getComputedStyle(document.body).backgroundColor;
    pen.fillRect(0, 0, flat.width, flat.height);
    pen.drawImage(view, 0, 0);
    done(flat.toDataURL("image/jpeg", 0.94).split(",")[1]);
  });
})"""


def find_ffmpeg() -> str | None:
    """Path of an ffmpeg: that of the package imageio-ffmpeg, else the first one on the PATH."""
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        return shutil.which("ffmpeg")


def check_video() -> None:
    """Refuse to make films where a program is missing.

    Raises:
        InputError: no Playwright, Chromium or ffmpeg.
    """
    try:
        import playwright  # noqa: F401
    except ImportError:
        raise InputError(f"mp4 needs playwright and imageio-ffmpeg; {_INSTALL}; and a Chromium.") from None
    browser = find_browser()
    if browser is None or not Path(browser).exists():
        raise InputError("mp4 needs a Chromium, which draws the page; install it, or set A2G_CHROMIUM to its path.")
    if find_ffmpeg() is None:
        raise InputError("mp4 needs ffmpeg; install it with: pip install 'a2g_jax[video]'")


def write_video(
    path: str | os.PathLike[str],
    motion: Motion,
    audio: Float[np.ndarray, " N"] | tuple[()],
    sample_rate: int,
    skin: Skin | None = None,
) -> None:
    """Write a motion with its speech as MP4 (H.264, AAC), a picture for each frame of the motion, 720 x 720 pixels.

    Args:
        audio: mono samples in -1 to 1; empty for a silent film.
        sample_rate: of the audio, Hz.
        skin: mesh of a character on the motion's skeleton, in place of our figure.

    Raises:
        InputError: a program is missing or fails, or the film would be too long.
        OutputError: the file cannot be written.
        KeyboardInterrupt: Ctrl-C; nothing is left of the film.
    """
    check_video()
    if motion.frames > MOST_FRAMES:
        raise InputError(f"{path}: not written: {motion.frames} frames, and films have {MOST_FRAMES} at most; cut it.")
    sound = np.asarray(audio, np.float32)
    with atomic_path(path) as temporary, tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        write_page(page, [Figure(motion, "", skin=skin)], sound[:0], sample_rate, title="")
        speech = None
        if sound.size:
            speech = Path(folder) / "speech.wav"
            write_audio(speech, sound, sample_rate)
        times = np.arange(motion.frames) / motion.fps
        with (
            _encoder(temporary, motion.fps, speech) as pictures,
            counted_steps(motion.frames, f"drawing {Path(path).name}", "frame") as step,
            closing(page_pictures(page, times, script=_NEAR)) as drawn,
        ):
            for picture in drawn:
                pictures.write(picture)
                step()


def page_pictures(
    page: Path, times: Iterable[float], width: int = SIZE, height: int = SIZE, script: str = ""
) -> Generator[bytes, None, None]:
    """The figures of a page at some moments, as JPEG.

    Args:
        times: seconds.
        script: JavaScript to run first, such as ``a2gPlayer.view({yaw: 0.6})``.

    Raises:
        InputError: the browser fails.
    """
    from playwright.sync_api import Error, sync_playwright

    with sync_playwright() as playwright:
        try:
            # Ctrl-C reaches this process, which closes the browser itself.
            browser = playwright.chromium.launch(
                executable_path=find_browser(), args=list(BROWSER_ARGUMENTS), handle_sigint=False
            )
            try:
                view = browser.new_page(viewport={"width": width // 2, "height": height // 2}, color_scheme="light")
                view.goto(page.resolve().as_uri())
                view.evaluate("a2gPlayer.ready")
                view.evaluate(_STYLE)
                view.evaluate(f"() => {{ {script} }}")
                view.evaluate("a2gPlayer.still()")
                for time in times:
                    yield base64.b64decode(view.evaluate(_FRAME, float(time)))
            finally:
                browser.close()
        except Error as error:
            raise InputError(f"{page}: the browser could not draw it ({error.message.splitlines()[0]}).") from None


@contextmanager
def _encoder(path: Path, fps: float, speech: Path | None) -> Iterator[IO[bytes]]:
    """A pipe that takes JPEG pictures and encodes them to a file.

    Raises:
        InputError: ffmpeg fails.
    """
    sound: list[Any] = [] if speech is None else ["-i", str(speech), "-c:a", "aac", "-b:a", "160k"]
    command = [
        find_ffmpeg(), "-nostdin", "-hide_banner", "-v", "error", "-y",
        "-f", "image2pipe", "-c:v", "mjpeg", "-framerate", f"{fps:.8g}", "-i", "pipe:0", *sound,
        "-vf", f"scale={SIZE}:{SIZE}:flags=area", "-c:v", "libx264", "-preset", "medium", "-crf", "18",
        "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", str(path),
    ]  # fmt: skip
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen([str(part) for part in command], stdin=subprocess.PIPE, stderr=errors)
        assert process.stdin is not None
        try:
            with suppress(BrokenPipeError):  # its exit status says that ffmpeg has stopped
                yield process.stdin
            with suppress(BrokenPipeError):
                process.stdin.close()
        except BaseException:
            process.kill()
            process.wait()
            raise
        if process.wait():
            errors.seek(0)
            reason = " ".join(errors.read(2000).decode("utf-8", "replace").split())[:300]
            raise InputError(f"{path}: ffmpeg could not encode the film ({reason}); try another ffmpeg.")
