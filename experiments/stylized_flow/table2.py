"""Table 2: effect of the global encoder and of the gesture perceptual loss, by the protocol of TED.

    python -m experiments.stylized_flow.table2 --corpus TED --features FEATURES_TED --perceptual LOSS_TED \\
        [--budget MINUTES]

Components are compared with our linear first layer, and the whole flow is trained without it too. The baseline is
MoGlow with GRUs for its LSTMs, as in the paper. Bits per dimension on held-out motion are added.
"""

from experiments.stylized_flow.bits import continued_with_bits, with_gaussian
from experiments.stylized_flow.protocol import TED
from experiments.stylized_flow.settings import baseline, flow, published
from experiments.stylized_flow.tables import with_nulls
from experiments.tables.claims import Claim
from experiments.tables.markdown import compute, draw
from experiments.tables.setting import arguments, setting

TABLE = "stylized_flow/table2"
FULL, NO_LOSS, NO_ENCODER, BASELINE = "proposed", "without L_gp", "without global encoder", "baseline"
PUBLISHED = "proposed as published"
VARIANTS = {
    PUBLISHED: published("ted"),
    FULL: flow("ted"),
    NO_LOSS: flow("ted", perceptual_weight=0.0),
    NO_ENCODER: flow("ted", global_channels=0),
    BASELINE: baseline("ted"),
}
CLAIMS = (
    Claim("without L_gp FGD is worse", NO_LOSS, FULL, "fgd", 1),
    Claim("without the global encoder FGD is worse", NO_ENCODER, FULL, "fgd", 1),
    Claim("the proposed model has a lower FGD than the baseline", FULL, BASELINE, "fgd", -1),
    Claim("the proposed model is more diverse than the baseline", FULL, BASELINE, "diversity", 1),
    Claim("L_gp without the encoder is no better than the baseline (FGD)", NO_ENCODER, BASELINE, "fgd", 1),
    Claim("(ours) the global encoder lowers bits per dimension", FULL, NO_ENCODER, "bits_per_dim", -1),
    Claim("(ours) bits per dimension are below the baseline's", FULL, BASELINE, "bits_per_dim", -1),
)
PAPER = {
    FULL: "FGD 3.30, PCK 0.850, diversity 52 mm",
    NO_LOSS: "4.62, 0.845, 51",
    NO_ENCODER: "6.26, 0.848, 50",
    BASELINE: "6.10, 0.850, 49",
}


def main() -> None:
    """Train and score what is missing, and render the table."""
    options = arguments("Table 2: the components of the flow", steps=600).parse_args()
    if options.corpus is not None:
        where, only = setting(options), options.only.split(",") if options.only else None
        with_nulls(TABLE, where, TED)
        with_gaussian(TABLE, where, VARIANTS[FULL])
        compute(TABLE, VARIANTS, where, only, continued_with_bits(TED), "ted, with bits")
    draw(TABLE, "Table 2: the components of the stylized flow", VARIANTS, CLAIMS, PAPER)


if __name__ == "__main__":
    main()
