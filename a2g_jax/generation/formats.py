"""The table of output formats: one writer each, for generated motions and for the generated corpus alike.

Importable without JAX: writers are imported when they write.
"""

import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2g_jax.errors import InputError
from a2g_jax.io.staging import staged
from a2g_jax.plugins import FORMATS as GROUP
from a2g_jax.plugins import entry_points_of, load_entry_point, load_object

if TYPE_CHECKING:
    from a2g_jax.geometry.motion import Motion
    from a2g_jax.viz.player.skin import Skin


@dataclass(frozen=True)
class MotionFormat:
    """An output format with one file for each motion."""

    suffix: str
    """Suffix of its files, such as ``.bvh``."""
    writer: str
    """``module:function`` of ``write(path, motion)``, which writes a whole file or none."""
    sound: bool = False
    """Whether the writer takes the speech as well: ``write(path, motion, audio, sample_rate)``."""
    drawn: bool = False
    """Whether the writer draws the motion, and takes the mesh of a character as ``skin=``."""
    check: str = ""
    """``module:function`` that raises an ``InputError`` where files cannot be written for lack of a program."""

    def write(self, path: Path, motion: "Motion", speech: "Speech | None" = None, skin: "Skin | None" = None) -> None:
        """Write a motion to a file.

        Args:
            speech: samples and their rate, for a writer that takes them.
            skin: mesh of the character, for a writer that draws.
        """
        writer = load_object(self.writer, "writer")
        sound = (speech or ((), 16_000)) if self.sound else ()
        writer(path, motion, *sound, **({"skin": skin} if self.drawn else {}))


#: Mono samples in -1 to 1, and their rate in Hz.
Speech = tuple[Any, int]


#: The formats of this package by their names in ``--formats``.
MOTION_FORMATS: dict[str, MotionFormat] = {
    "bvh": MotionFormat(".bvh", "a2g_jax.io.bvh:write_bvh"),
    "npz": MotionFormat(".npz", "a2g_jax.io.npz:write_motion_npz"),
}
#: Formats of this package that are written on request only.
MORE_FORMATS: dict[str, MotionFormat] = {
    "glb": MotionFormat(".glb", "a2g_jax.viz.mannequin_glb:write_mannequin_glb"),
    "smplx": MotionFormat(".smplx.npz", "a2g_jax.generation.smplx:write_smplx_npz"),
    "mp4": MotionFormat(
        ".mp4",
        "a2g_jax.viz.player.video:write_video",
        sound=True,
        drawn=True,
        check="a2g_jax.viz.player.video:check_video",
    ),
}
#: The name of the page of all motions, which :func:`a2g_jax.viz.player.write_page` writes.
PAGE = "html"
#: Orders of samples on the page: by number, or by score (:mod:`a2g_jax.generation.ranking`).
ORDERS = ("number", "best")
#: Names of the reports of generation beside the motions, a regular expression: those of an earlier call belong to other
#: motions.
REPORTS = r"(pins|checks|style)\.json"
#: Most joint positions that a page may hold: about 200 MB of HTML.
_PAGE_LIMIT = 20_000_000


#: Formats with one file for all motions, whose names no other package may take.
_OTHERS = ("wav", "textgrid", "json", PAGE)


def format_names() -> tuple[str, ...]:
    """Names of the formats of motions, and of the page, that are written unless others are requested: this package's,
    then those of the entry-point group ``a2g_jax.formats``. Nothing is imported."""
    taken = (*MOTION_FORMATS, *MORE_FORMATS, *_OTHERS)
    added = (name for name in entry_points_of(GROUP) if name not in taken)
    return (*MOTION_FORMATS, *added, PAGE)


def known_formats() -> tuple[str, ...]:
    """Names of all formats that can be requested: :func:`format_names` and :data:`MORE_FORMATS`."""
    return (*format_names(), *MORE_FORMATS)


def motion_format(name: str) -> MotionFormat | None:
    """The format of that name; None where it has no file for each motion.

    Raises:
        InputError: a format of another package cannot be loaded.
    """
    own = MOTION_FORMATS | MORE_FORMATS
    if name in own or name in _OTHERS:
        return own.get(name)
    point = entry_points_of(GROUP)[name]
    found = load_entry_point(point, "format")
    if not isinstance(found, MotionFormat):
        raise InputError(f"format {name!r} ({point.value}): expected a MotionFormat; got {type(found).__name__}.")
    return found


def talk_formats() -> tuple[str, ...]:
    """Names of the formats of a generated recording: of its speech and truth, of motions, and the page."""
    return ("wav", "textgrid", "json", *format_names())


def chosen_formats(text: str, available: Sequence[str]) -> tuple[str, ...]:
    """The formats in a comma-separated list.

    Raises:
        InputError: an empty list, or an unknown format.
    """
    formats = tuple(dict.fromkeys(part.strip().lower() for part in text.split(",") if part.strip()))
    unknown = [name for name in formats if name not in available]
    if unknown or not formats:
        reason = f"no format {unknown[0]!r}" if unknown else f"no format in {text!r}"
        raise InputError(f"{reason}; there are: {', '.join(available)}.")
    return formats


def check_page_size(motions: int, frames: int, points: int) -> None:
    """Refuse a page that is too large for a browser.

    Args:
        points: of a figure in a frame: its joints, or three of each bone of a mesh.

    Raises:
        InputError: too many positions.
    """
    if motions * frames * points > _PAGE_LIMIT:
        raise InputError(
            f"a page of {motions} motions of {frames} frames would be too large for a browser;"
            " reduce --samples or the length, or leave html out of --formats."
        )


class MotionFiles:
    """The files of several motions in a folder: ``sample_00.bvh``, ``sample_00.npz``, ...; a context manager.

    When the block ends, they take the place of those of an earlier call. After an error that refuses a motion, or
    Ctrl-C, those before it do; on a full disk the earlier ones stay (:func:`~a2g_jax.io.staging.staged`).
    """

    def __init__(
        self,
        out: str | os.PathLike[str],
        stems: Sequence[str],
        formats: Sequence[str],
        others: str = "",
        *,
        speech: Speech | None = None,
        writers: Mapping[str, Callable[[Path, Any], Any]] | None = None,
    ) -> None:
        """
        Args:
            stems: beginnings of the files' names.
            formats: names of formats; those without a file for each motion are ignored.
            others: a regular expression for further files that are replaced.
            speech: of the motions, for formats with sound.
            writers: by format, in place of the usual ones.

        Raises:
            InputError: a format that cannot be used, or not here.
        """
        found = {name: motion_format(name) for name in formats}
        self._formats = {name: each for name, each in found.items() if each is not None}
        for each in self._formats.values():
            if each.check:
                load_object(each.check, "check")()
        self._speech, self._writers = speech, dict(writers or {})
        all_formats = MOTION_FORMATS | MORE_FORMATS | self._formats
        suffixes = "|".join(re.escape(each.suffix) for each in all_formats.values())
        begin = "|".join(map(re.escape, stems))
        own = re.compile(rf"(?:{begin})_\d\d+({suffixes})|index\.html" + (f"|{others}" if others else ""))
        self._stem = stems[0]
        self._staged = staged(out, lambda name: own.fullmatch(name) is not None, (InputError, KeyboardInterrupt))

    def __enter__(self) -> "MotionFiles":
        self.folder = self._staged.__enter__()
        """Where further files are written that belong to the motions."""
        return self

    def __exit__(self, *error: Any) -> bool | None:
        return self._staged.__exit__(*error)

    @property
    def drawn(self) -> bool:
        """Whether a format is drawn."""
        return any(each.drawn for each in self._formats.values())

    def names(self, number: int, stem: str = "") -> tuple[str, ...]:
        """Names of the files of a motion."""
        return tuple(f"{stem or self._stem}_{number:02d}{each.suffix}" for each in self._formats.values())

    def write(
        self,
        number: int,
        motion: "Motion",
        stem: str = "",
        own: Mapping[str, "Motion"] | None = None,
        skin: "Skin | None" = None,
    ) -> dict[str, Any]:
        """Write the files of a motion.

        Args:
            own: motions of other skeletons for some formats, by name.
            skin: mesh of the character that the motion is of, for formats that are drawn.

        Returns:
            What the given writers returned, by format.
        """
        returned = {}
        for name, each in self._formats.items():
            path = self.folder / f"{stem or self._stem}_{number:02d}{each.suffix}"
            moved = (own or {}).get(name, motion)
            if name in self._writers:
                returned[name] = self._writers[name](path, moved)
            else:
                each.write(path, moved, self._speech, skin)
        return returned
