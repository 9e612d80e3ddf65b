"""Real takes by the paper's protocols: trained on the first part of a take, scored on its end.

    a2g prepare zeroeggs DIR --out ZEGGS --features stylized-flow --random-split
    a2g prepare beat DIR --out BEAT --features stylized-flow --fps 20 --random-split
    a2g prepare ted-expressive DIR --out TED --features stylized-flow-ted --random-split
    python -m experiments.stylized_flow.real --zeroeggs ZEGGS --beat BEAT --ted TED [--steps 100]

A take of a minute says little about a method, and its end is one or two clips of the Trinity protocol. There is no
feature network, because one trained on a minute of motion would not be informative; so there is no FGD and no
perceptual loss. Weights trained on research-only recordings stay in the folder of ``--runs``.
"""

from dataclasses import replace
from pathlib import Path

from experiments.stylized_flow.bits import GAUSSIAN, continued_with_bits, with_gaussian
from experiments.stylized_flow.protocol import PROTOCOLS
from experiments.stylized_flow.table1 import A2G, LINEAR, MOGLOW, OURS, S2G, rows
from experiments.stylized_flow.tables import with_nulls
from experiments.tables.claims import Claim
from experiments.tables.markdown import compute, draw
from experiments.tables.setting import Variant, arguments, setting

#: Takes, and the protocol of each.
TAKES = {"zeroeggs": "trinity", "beat": "trinity", "ted": "ted"}
CLAIMS = (
    Claim("bits per dimension are below MoGlow's", OURS, MOGLOW, "bits_per_dim", -1),
    Claim("bits per dimension are below MoGlow's with the linear layer", OURS, LINEAR, "bits_per_dim", -1),
    Claim("bits per dimension are below the conditional Gaussian's", OURS, GAUSSIAN, "bits_per_dim", -1),
    Claim("PCK is higher than MoGlow's", OURS, MOGLOW, "pck", 1),
    Claim("a model that averages has the higher PCK", S2G, OURS, "pck", 1),
    Claim("ours is multimodal, a model that averages is not", OURS, S2G, "multimodality", 1),
    Claim("ours is more multimodal than Audio2Gestures", OURS, A2G, "multimodality", 1),
)


def without_perceptual(protocol: str) -> dict[str, Variant]:
    """The rows of Table 1, without the loss that needs a feature network."""
    return {
        name: replace(row, changes={**row.changes, "perceptual_weight": 0.0}) if row.model == "stylized_flow" else row
        for name, row in rows(protocol).items()
    }


def main() -> None:
    """Train and score what is missing, and render a table for each take."""
    parser = arguments("Real takes: trained on the first part, scored on the end", steps=100)
    for name, protocol in TAKES.items():
        parser.add_argument(f"--{name}", type=Path, help=f"a corpus with the features of the {protocol} protocol")
    options = parser.parse_args()
    for name, protocol in TAKES.items():
        table, variants, corpus = f"stylized_flow/real_{name}", without_perceptual(protocol), getattr(options, name)
        if corpus is not None:
            where = replace(setting(options), corpus=corpus, features=None)
            with_nulls(table, where, PROTOCOLS[protocol])
            with_gaussian(table, where, variants[OURS])
            only = options.only.split(",") if options.only else None
            score = continued_with_bits(PROTOCOLS[protocol])
            compute(table, variants, where, only, score, f"{protocol}, with bits")
        draw(table, f"{name.upper()}, by the protocol of {protocol.capitalize()}", variants, CLAIMS, {})


if __name__ == "__main__":
    main()
