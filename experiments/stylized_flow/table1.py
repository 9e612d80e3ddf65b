"""Table 1: the flow compared with MoGlow, Audio2Gestures and Speech2Gesture, by the protocols of Trinity and TED.

    a2g prepare talker --out TRINITY --minutes 90 --seed 6 --features stylized-flow
    a2g prepare talker --out TED --minutes 90 --seed 6 --view ted --features stylized-flow-ted
    python -m experiments.stylized_flow.table1 --corpus TRINITY --features experiments/features/talker_20fps \\
        --perceptual TRINITY_LOSS --corpus-ted TED --features-ted experiments/features/talker_ted \\
        --perceptual-ted TED_LOSS [--budget MINUTES]

Feature networks are made by ``a2g train motion_autoencoder --steps 2000``: for scores with ``--clip-frames 47`` (two
vectors from the 95 frames of a clip) and 30, and for the perceptual loss others with ``--seed 1``. Those in
``experiments/features`` had 64 and 30 frames.

The flow and MoGlow are trained as published and with our linear first layer, MoGlow for as long as the flow, not for as
many steps.
Without a corpus the tables are rendered from the existing records.
"""

import argparse
from dataclasses import replace
from pathlib import Path

from experiments.audio2gestures.settings import BASE
from experiments.stylized_flow.bits import GAUSSIAN, continued_with_bits, with_gaussian
from experiments.stylized_flow.protocol import PROTOCOLS
from experiments.stylized_flow.settings import OTHERS, flow, moglow, published
from experiments.stylized_flow.tables import with_nulls
from experiments.tables.claims import Claim
from experiments.tables.markdown import compute, draw
from experiments.tables.setting import Variant, arguments, setting

#: The paper's flow and MoGlow, and the same with our linear first layer.
PUBLISHED, MOGLOW = "stylized flow as published", "MoGlow"
OURS, LINEAR = "stylized flow", "MoGlow with the linear layer"
A2G, S2G, GAN = "Audio2Gestures", "Speech2Gesture without GAN", "Speech2Gesture"

#: In the paper's words; the sign is the direction.
CLAIMS = (
    Claim("FGD is lower than MoGlow's", PUBLISHED, MOGLOW, "fgd", -1),
    Claim("PCK is higher than MoGlow's", PUBLISHED, MOGLOW, "pck", 1),
    Claim("diversity is higher than MoGlow's", PUBLISHED, MOGLOW, "diversity", 1),
    Claim("beat alignment is higher than MoGlow's", PUBLISHED, MOGLOW, "beat_alignment", 1),
    Claim("MoGlow is the more multimodal (Trinity)", MOGLOW, PUBLISHED, "multimodality", 1, MOGLOW),
    Claim("FGD is lower than Speech2Gesture's", PUBLISHED, GAN, "fgd", -1),
    Claim("FGD is lower than MoGlow's, both with the linear layer", OURS, LINEAR, "fgd", -1),
    Claim("PCK is higher than MoGlow's, both with the linear layer", OURS, LINEAR, "pck", 1),
    Claim("diversity is higher than MoGlow's, both with the linear layer", OURS, LINEAR, "diversity", 1),
    Claim("FGD is lower than that of a model that averages", OURS, S2G, "fgd", -1),
    Claim("a model that averages has the higher PCK (TED)", S2G, OURS, "pck", 1, S2G),
    Claim("(ours) bits per dimension are below MoGlow's", PUBLISHED, MOGLOW, "bits_per_dim", -1),
    Claim("(ours) bits are below MoGlow's, both with the linear layer", OURS, LINEAR, "bits_per_dim", -1),
    Claim("(ours) the linear layer lowers bits per dimension", OURS, PUBLISHED, "bits_per_dim", -1),
    Claim("(ours) bits per dimension are below the conditional Gaussian's", OURS, GAUSSIAN, "bits_per_dim", -1),
)
PAPER = {
    "trinity": {
        "Gesticulator": "FGD 9.95, PCK 0.701, diversity 3.50, BA 0.844",
        "MoGlow": "7.61, 0.726, 3.81, 0.852, multimodality 2.12",
        "stylized flow": "6.76, 0.730, 4.34, 0.875, multimodality 1.60",
    },
    "ted": {
        "S2G": "FGD 19.25, PCK 0.877, diversity 44.46 mm, BA 0.620",
        "MoGlow": "5.15, 0.842, 50.63, 0.617, multimodality 22.56",
        "GTC": "4.40, 0.850, 48.70, 0.618",
        "S2AG": "7.22, 0.861, 47.25, 0.619",
        "stylized flow": "3.30, 0.850, 52.00, 0.622, multimodality 22.63",
    },
}


def rows(protocol: str) -> dict[str, Variant]:
    """The rows of a protocol's table."""
    clip = {"clip_frames": 64}
    return {
        MOGLOW: moglow(protocol, predictor=False),
        LINEAR: moglow(protocol, predictor=True),
        PUBLISHED: published(protocol),
        OURS: flow(protocol),
        A2G: Variant({**BASE, **clip}, steps=OTHERS[protocol]["a2g"]),
        S2G: Variant({**clip, "adversarial_weight": 0.0}, model="speech2gesture", steps=OTHERS[protocol]["s2g"]),
        GAN: Variant(clip, model="speech2gesture", steps=OTHERS[protocol]["s2g"]),
    }


def ted_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of the second protocol's corpus."""
    parser.add_argument("--corpus-ted", type=Path, help="bone directions at 15 fps")
    parser.add_argument("--features-ted", type=Path, help="a run of motion_autoencoder on it, clips of 30 frames")
    parser.add_argument("--perceptual-ted", type=Path, help="another such run, for the perceptual loss")


def main() -> None:
    """Train and score what is missing, and render both tables."""
    parser = arguments("Table 1: the flow compared with other models", steps=700)
    ted_arguments(parser)
    parser.add_argument("--steps-ted", type=int, default=600, help="training steps on TED (default: 600)")
    options = parser.parse_args()
    where = setting(options)
    given = {
        "trinity": where,
        "ted": replace(
            where,
            corpus=options.corpus_ted,
            features=options.features_ted,
            steps=options.steps_ted,
            perceptual=options.perceptual_ted,
        ),
    }
    for protocol, place in given.items():
        table = f"stylized_flow/table1_{protocol}"
        if place.corpus is not None:
            with_nulls(table, place, PROTOCOLS[protocol])
            with_gaussian(table, place, flow(protocol))
            only = options.only.split(",") if options.only else None
            score = continued_with_bits(PROTOCOLS[protocol])
            compute(table, rows(protocol), place, only, score, f"{protocol}, with bits")
        draw(table, f"Table 1, by the protocol of {protocol.capitalize()}", rows(protocol), CLAIMS, PAPER[protocol])


if __name__ == "__main__":
    main()
