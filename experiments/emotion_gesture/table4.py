"""Table IV: the length of the transition, padding instead of prompts, and the seam to the given poses.

    python -m experiments.emotion_gesture.table4 --corpus CORPUS --features RUN --judge RUN [--budget MINUTES]

Without a corpus the table is rendered from the existing records.
"""

from dataclasses import replace
from typing import Any

from experiments.emotion_gesture.settings import FULL, ours
from experiments.emotion_gesture.table import Table, command
from experiments.emotion_gesture.table3 import WHOLE
from experiments.tables.claims import Claim
from experiments.tables.setting import Variant

LENGTHS = (2, 4, 6, 8, 10)
ZERO, DUPLICATE, LONGEST = "zero", "duplicate", "L = 10"
TINY_ZERO, TINY_DUPLICATE, TINY_PROMPTS = "tiny with zero", "tiny with duplicate", "tiny with L = 10"


def _changed(**changes: Any) -> Variant:
    """A row with the other settings of Table III's full one, so that the longest transition shares its run."""
    return replace(FULL, changes={**FULL.changes, **changes})


def _tiny(prompter: str) -> Variant:
    """The preset with all steps of its main stage, without the stages of sampled features, which seams do not have."""
    return replace(ours(prompter=prompter, seam_frames=0, vae_steps=0, sampled_steps=0), steps=WHOLE)


VARIANTS = {
    ZERO: _changed(prompter="zero"),
    DUPLICATE: _changed(prompter="duplicate"),
    **{f"L = {frames}": _changed(transition_frames=frames) for frames in LENGTHS},
    TINY_ZERO: _tiny("zero"),
    TINY_DUPLICATE: _tiny("duplicate"),
    TINY_PROMPTS: _tiny("spatial-temporal"),
}

CLAIMS = (
    *(
        Claim(f"L2 is lower with prompts than with padding ({name})", LONGEST, name, "position_l2", -1)
        for name in (ZERO, DUPLICATE)
    ),
    *(
        Claim(f"FGD is lower with prompts than with padding ({name})", LONGEST, name, "fgd", -1)
        for name in (ZERO, DUPLICATE)
    ),
    Claim("beat alignment is higher with prompts than with zeros", LONGEST, ZERO, "beat_alignment", 1),
    *(
        Claim(f"emotion accuracy is higher than with padding ({name})", LONGEST, name, "emotion_balanced", 1)
        for name in (ZERO, DUPLICATE)
    ),
    Claim("a longer transition lowers L2 (10 and 2)", LONGEST, "L = 2", "position_l2", -1),
    Claim("a longer transition lowers FGD (10 and 2)", LONGEST, "L = 2", "fgd", -1),
    Claim("even L = 2 has the lower L2 than duplicates", "L = 2", DUPLICATE, "position_l2", -1),
    *(
        Claim(
            f"the {what} across the seam is closer to the truth's than with {name}",
            LONGEST,
            name,
            f"seam_{what}_error",
            -1,
        )
        for what in ("speed", "jerk")
        for name in (ZERO, DUPLICATE)
    ),
    *(
        Claim(f"(ours) {text} than with {name}", TINY_PROMPTS, name, metric, -1)
        for text, metric in (
            ("the speed across the seam is closer to the truth's", "seam_speed_error"),
            ("the jerk across the seam is closer to the truth's", "seam_jerk_error"),
            ("L2 is lower", "position_l2"),
        )
        for name in (TINY_ZERO, TINY_DUPLICATE)
    ),
)

PAPER = {
    ZERO: "L2 2.11, MPJRE 3.49, FGD 1.00, BA 0.21, EA 65.4 %",
    DUPLICATE: "1.96, 3.39, 0.78, 0.88, 73.8 %",
    "L = 2": "1.69, 2.91, 0.57, 0.91, 76.1 %",
    "L = 4": "1.62, 2.78, 0.54, 0.91, 76.6 %",
    "L = 6": "1.61, 2.76, 0.52, 0.92, 78.1 %",
    "L = 8": "1.60, 2.69, 0.49, 0.92, 78.9 %",
    "L = 10": "1.59, 2.69, 0.47, 0.93, 81.2 %",
}

COLUMNS = (
    *("position_l2", "mpjre", "fgd", "beat_alignment", "emotion_accuracy", "emotion_balanced"),
    *("seam_speed", "seam_jerk", "wrist_speed", "jerk"),
)

TABLE = Table(
    "table4",
    "Table IV: the transition and its length, and padding",
    VARIANTS,
    COLUMNS,
    CLAIMS,
    PAPER,
    (
        "Seams are as the decoder leaves them: no offset is faded out (`--seam-frames 0`). All rows add a share of the"
        " last given pose to the output, whatever the prompt; without it rows of so few steps stay at the mean pose."
        " The last three are the preset `tiny` with all steps of its main stage and without sampled features.",
    ),
    requests=False,
)

if __name__ == "__main__":
    command(TABLE)
