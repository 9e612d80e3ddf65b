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
#: Widths of characters in quads; of bold ones a seventh more.
_WIDTHS = {
    **dict.fromkeys("ijlI.,:;'!|()[]`/", 0.39),
    **dict.fromkeys("ftrs-", 0.4),
    **dict.fromkeys("mwMWGHKNOQUVXY@%&~^", 0.84),
    **dict.fromkeys("↓↑≈±+=<>", 0.9),
    **dict.fromkeys("ABCDEFJLPRSTZ_", 0.77),
    " ": 0.34,
}


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
    quads = sum(_WIDTHS.get(one, 0.56 if one.isascii() else 1.0) for one in text)
    return SIZE * quads * (1.15 if bold else 1.0)
