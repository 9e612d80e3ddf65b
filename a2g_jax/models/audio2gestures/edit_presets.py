"""Edits of DCT bands by plain names, such as ``calmer``.

Effects with the run ``demo``, mean of 16 speeches of 16 s (``python -m experiments.latent_edits``); unedited, wrists
move at 0.32 m/s in a box of 0.27 m a side, with a jerk (90th percentile) of 161 m/s3:

=================  ==========  ======  ==========
name               speed, m/s  box, m  jerk, m/s3
=================  ==========  ======  ==========
calmer                   0.22    0.20         100
livelier                 0.40    0.32         227
smaller                  0.14    0.10          72
larger                   0.44    0.36         225
smoother                 0.27    0.26          51
slower sway              0.16    0.24          32
one posture              0.24    0.15         204
without speech           0.23    0.26          25
=================  ==========  ======  ==========
"""

from collections.abc import Iterable

#: Lines of :mod:`a2g_jax.models.audio2gestures.edits` by name.
EDIT_PRESETS: dict[str, tuple[str, ...]] = {
    "calmer": ("shared scale 1: 0.6", "specific scale 1: 0.6"),
    "livelier": ("shared scale 1: 1.4", "specific scale 1: 1.4"),
    "smaller": ("specific scale 0: 0.5",),
    "larger": ("specific scale 0: 1.25",),
    "smoother": ("shared keep 10",),
    "slower sway": ("shared keep 6", "specific keep 4"),
    "one posture": ("specific keep 1",),
    "without speech": ("shared keep 1",),
}


def expanded(edits: Iterable[str]) -> tuple[str, ...]:
    """Edits with the lines of presets in place of their names; a hyphen or underscore in a name counts as a space."""
    lines: list[str] = []
    for edit in edits:
        name = " ".join(edit.lower().replace("-", " ").replace("_", " ").split())
        lines += EDIT_PRESETS.get(name, (edit,))
    return tuple(lines)
