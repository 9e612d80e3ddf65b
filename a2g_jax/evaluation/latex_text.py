"""Text for LaTeX: escapes, and widths in the font of the tables (Computer Modern)."""

import re

#: Points from one line to the next, and size of the type, of ``\\footnotesize`` in a document of 10 points.
LINE, SIZE = 9.5, 8.0
_ESCAPES = {
    **{character: "\\" + character for character in "&%$#_{}"},
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': "''",
    "↓": r"$\downarrow$",
    "↑": r"$\uparrow$",
    "≈": r"$\approx$",
    "°": r"$^\circ$",
    "±": r"$\pm$",
}
#: Widths of characters of Computer Modern Roman at 10 points, in quads; its type of 8 points is wider, bold more so.
_WIDTHS = {
    **dict(
        zip(
            "abcdefghijklm",
            (0.5, 0.556, 0.445, 0.556, 0.445, 0.306, 0.5, 0.556, 0.278, 0.306, 0.528, 0.278, 0.834),
            strict=True,
        )
    ),
    **dict(
        zip(
            "nopqrstuvwxyz",
            (0.556, 0.5, 0.556, 0.528, 0.392, 0.395, 0.389, 0.556, 0.528, 0.723, 0.528, 0.528, 0.445),
            strict=True,
        )
    ),
    **dict.fromkeys("ijl.,:;'!|[]`", 0.3),
    **dict.fromkeys("()-", 0.39),
    **dict.fromkeys("0123456789/*", 0.5),
    **dict.fromkeys("SILJZPF", 0.69),
    **dict.fromkeys("W%&@", 1.03),
    **dict.fromkeys("≈+=<>", 0.78),
    **{" ": 0.334, "±": 1.25, "↓": 0.5, "↑": 0.5, "°": 0.5},
}
_OTHER = 0.92
_EIGHT, _BOLD = 1.0625, 1.16


def escape(text: str) -> str:
    """The text as LaTeX prints it, on one line, without anything that is a command."""
    text = " ".join("".join(one if one.isprintable() else " " for one in text).split())
    escaped = "".join(_ESCAPES.get(one, one) for one in text)
    # No ligatures of dashes, and no optional argument of the line break before it.
    escaped = re.sub(r"-(?=-)", "-{}", escaped)
    return "{}" + escaped if escaped[:1] in ("[", "*") else escaped


def comment(text: str) -> str:
    """A line that LaTeX does not read."""
    return "% " + " ".join("".join(one if one.isprintable() else " " for one in text).split())


def unit_text(name: str) -> str:
    """A unit, its powers raised: ``m/s2``."""
    return re.sub(r"(?<=[a-z])(\d)$", r"$^\1$", escape(name))


def width(text: str, bold: bool = False) -> float:
    """Points that plain text takes at most in a table."""
    quads = sum(_WIDTHS.get(one, _OTHER) for one in text)
    return SIZE * _EIGHT * quads * (_BOLD if bold else 1.0)
