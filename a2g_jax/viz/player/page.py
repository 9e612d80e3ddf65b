"""The page: template, data and audio in one HTML file that needs no network."""

import html
import json
import os
import re
from collections.abc import Mapping, Sequence
from importlib.resources import files

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.files import atomic_path
from a2g_jax.io.words import Word
from a2g_jax.viz.player.encode import encode_positions
from a2g_jax.viz.player.figure import Figure, Lane
from a2g_jax.viz.player.parts import Shape
from a2g_jax.viz.player.shape import build_shape
from a2g_jax.viz.player.skin import Bound, bind
from a2g_jax.viz.player.sound import encode_audio, playback_note
from a2g_jax.viz.player.stage import placement, shape_points

#: Parts of the script, in their order in the page.
_SCRIPTS = (
    "math",
    "unpack",
    "figures",
    "shaders",
    "soup",
    "shadows",
    "webgl",
    "canvas",
    "layout",
    "lanes",
    "hover",
    "timeline",
    "controls",
    "labels",
    "player",
    "page",
)


def write_page(
    path: str | os.PathLike[str],
    figures: Sequence[Figure],
    audio: Float[np.ndarray, " N"],
    sample_rate: int,
    *,
    title: str,
    subtitle: str = "",
    words: Sequence[Word] = (),
    lanes: Sequence[Lane] = (),
    footer: str = "",
) -> None:
    """Write one self-contained HTML file that plays the figures side by side, in sync with the audio.

    The page works from disk in any browser with WebGL 2 (or, with a plainer picture, a 2D canvas), makes no requests,
    and follows the reader's light or dark theme. Figures may differ in skeleton, frame rate and length; all start at
    time zero of the audio, and one that ends before the audio holds its last frame.

    Example:
        >>> import a2g_jax
        >>> speech = a2g_jax.talk(2.0, seed=1)
        >>> figures = [a2g_jax.Figure(speech.motion, "the talker")]
        >>> a2g_jax.write_page("page.html", figures, speech.audio, speech.sample_rate, title="Two seconds")

    Args:
        path: the file to write; replaced atomically.
        figures: at least one.
        audio: mono samples in -1 to 1; empty for a silent page as long as the longest motion.
        sample_rate: of the audio, samples per second.
        title: heading, also the name of the browser tab.
        subtitle: a line under the heading.
        words: spoken words, written under the waveform.
        lanes: further lanes of the speech, drawn under the words and above those of the figures.
        footer: a line at the foot of the page.

    Raises:
        InputError: no figures, a motion without frames, values that are not finite, or a motion spanning over 65 m.
    """
    page = page_html(
        figures, audio, sample_rate, title=title, subtitle=subtitle, words=words, lanes=lanes, footer=footer
    )
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8", newline="\n")


def page_html(
    figures: Sequence[Figure],
    audio: Float[np.ndarray, " N"],
    sample_rate: int,
    *,
    title: str = "",
    subtitle: str = "",
    words: Sequence[Word] = (),
    lanes: Sequence[Lane] = (),
    footer: str = "",
) -> str:
    """The text of the page that :func:`write_page` writes.

    Raises:
        InputError: as there.
    """
    if not figures:
        raise InputError("the page has no figures; give at least one.")
    data = {
        "audio": encode_audio(audio, sample_rate),
        "duration": audio.size / sample_rate if audio.size else max(figure.motion.seconds for figure in figures),
        "words": [[word.text, word.start, word.end] for word in words],
        "lanes": [lane.encoded() for lane in lanes],
    }
    bound = _bound(figures)
    data["figures"] = [_figure(figure, bound) for figure in figures]
    data["meshes"] = [one.encoded() for one in bound.values()]
    footer = " ".join(filter(None, (footer, playback_note(audio))))
    return fill_template(
        _template("page.html"),
        {
            "title": html.escape(title),
            "subtitle": html.escape(subtitle),
            "footer": html.escape(footer),
            "style": style(),
            "script": scripts(_SCRIPTS),
            "data": script_json(data),
        },
    )


def scripts(names: Sequence[str]) -> str:
    """Parts of the player's script, one after the other; they share one scope."""
    return "\n".join(_template(f"{name}.js") for name in names)


def style() -> str:
    """The player's style sheet."""
    return _template("player.css")


def fill_template(template: str, values: dict[str, str]) -> str:
    """Replace each ``{{name}}`` by its value, in one pass, so that nothing inside a value is replaced."""
    return re.sub(r"\{\{(\w+)\}\}", lambda found: values[found.group(1)], template)


def script_json(value: dict) -> str:
    """JSON that is safe inside a script element: without ``<``, ``>`` or ``&`` in any string."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    # Lone surrogates cannot be written as UTF-8; JSON can spell them.
    return "".join(f"\\u{ord(c):04x}" if "\ud800" <= c <= "\udfff" else c for c in text) if _lone(text) else text


def _lone(text: str) -> bool:
    return re.search("[\ud800-\udfff]", text) is not None


def _bound(figures: Sequence[Figure]) -> dict[str, Bound]:
    """The meshes of the figures, each once, by the content of their skins."""
    skins = {figure.skin.content: figure.skin for figure in figures if figure.skin is not None}
    return {key: bind(skin, _motions(figures, key)) for key, skin in skins.items()}


def _motions(figures: Sequence[Figure], content: str) -> list[Motion]:
    """Those of a mesh."""
    of = [figure for figure in figures if figure.skin is not None and figure.skin.content == content]
    return [figure.motion for figure in of if figure.motion.frames]


def moved_points(figures: Sequence[Figure]) -> int:
    """The largest number of points of a figure that the page has in every frame: three of each bone of a mesh, else the
    joints."""
    bones = {key: 3 * len(bound.joints) for key, bound in _bound(figures).items()}
    return max(
        figure.motion.skeleton.joints if figure.skin is None else bones[figure.skin.content] for figure in figures
    )


def _figure(figure: Figure, bound: Mapping[str, Bound]) -> dict:
    motion = figure.motion
    if motion.frames == 0:
        raise InputError(f"figure {figure.label!r}: the motion has no frames; give it at least one.")
    if not motion.fps > 0:
        raise InputError(f"figure {figure.label!r}: {motion.fps} frames per second; give a positive number.")
    body, points = drawn_body(motion)
    if figure.skin is not None:
        mesh = bound[figure.skin.content]
        body, shape = drawn_mesh(body, mesh)
        points = shape_points(motion, shape)
        body["mesh"] = list(bound).index(figure.skin.content)
    encoded = encode_positions(points, figure.label)
    return {
        "label": figure.label,
        "note": figure.note,
        "number": figure.number,
        "frames": motion.frames,
        "tracks": [track.encoded() for track in figure.tracks],
        "files": list(figure.files),
        **body,
        **encoded,
    }


def drawn_body(motion: Motion) -> tuple[dict, Float[np.ndarray, "T P 3"]]:
    """What the page needs to draw our figure at any positions of its points, cones between them and its place; and the
    points."""
    shape = build_shape(motion.skeleton)
    points = shape_points(motion, shape)
    about = {"fps": motion.fps, "joints": list(motion.skeleton.names), "place": placement(motion, points)}
    return {**about, **drawn_shape(shape)}, points


def drawn_mesh(body: dict, mesh: Bound) -> tuple[dict, Shape]:
    """What the page needs to draw a mesh in place of our figure, and the shape whose points it needs."""
    shape = mesh.shape()
    tall = round(float(np.ptp(mesh.skin.places[:, 1])), 4)
    place = {**body["place"], "height": max(body["place"]["height"], tall)}
    return {**body, **drawn_shape(shape), "place": place}, shape


def drawn_shape(shape: Shape) -> dict:
    """A shape as JSON for the page."""
    return {
        "points": len(shape.points),
        "axes": shape.frames,
        "shapes": [cone.encoded() for cone in shape.cones],
        "wrists": list(shape.wrists),
    }


def _template(name: str) -> str:
    return files("a2g_jax.viz.player").joinpath("template", name).read_text(encoding="utf-8")
