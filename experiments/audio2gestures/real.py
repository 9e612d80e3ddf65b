"""Real recordings: trained on the first part of one take, scored on the rest of it.

    a2g prepare beat DIR --out BEAT --fps 30 --random-split
    a2g prepare zeroeggs DIR --out ZEGGS --fps 30 --random-split
    python -m experiments.audio2gestures.real --beat BEAT --zeroeggs ZEGGS [--steps 200]

A take of a minute says little about a method: the intervals are over clips of one recording and over seeds. There is no
feature network, because one trained on a minute of motion would not be informative. Weights trained on research-only
recordings stay in the folder of ``--runs``.
"""

from dataclasses import replace
from pathlib import Path

from experiments.audio2gestures.settings import BASE
from experiments.tables.claims import Claim
from experiments.tables.markdown import compute, draw
from experiments.tables.setting import Variant, arguments, setting

VARIANTS = {
    "Audio2Gestures without split": Variant({**BASE, "split": False, "sample_codes": True}),
    "Audio2Gestures": Variant(BASE),
    "Speech2Gesture without GAN": Variant({"adversarial_weight": 0.0}, model="speech2gesture"),
}

CLAIMS = (
    Claim(
        "split raises multimodality from near zero",
        "Audio2Gestures",
        "Audio2Gestures without split",
        "multimodality",
        1,
    ),
    Claim(
        "split harms position L1 compared with Speech2Gesture",
        "Audio2Gestures",
        "Speech2Gesture without GAN",
        "position_l1",
        1,
    ),
)


def main() -> None:
    """Train and score what is missing, and render a table for each take."""
    parser = arguments("Real takes: trained on the first part, scored on the rest", steps=200)
    parser.add_argument("--beat", type=Path, help="a corpus of BEAT, at 30 fps")
    parser.add_argument("--zeroeggs", type=Path, help="a corpus of ZeroEGGS, at 30 fps")
    options = parser.parse_args()
    for name in ("beat", "zeroeggs"):
        corpus = getattr(options, name)
        if corpus is not None:
            where = replace(setting(options), corpus=corpus, features=None)
            compute(f"audio2gestures/real_{name}", VARIANTS, where, options.only.split(",") if options.only else None)
        draw(f"audio2gestures/real_{name}", f"A take of {name.upper()}", VARIANTS, CLAIMS, {})


if __name__ == "__main__":
    main()
