"""Table 2: what the global encoder and the gesture perceptual loss add, by the protocol of TED.

    python -m experiments.stylized_flow.table2 --corpus TED --features FEATURES_TED [--budget MINUTES]

The baseline is MoGlow with GRUs for its LSTMs, as in the paper. Bits per dimension on held-out motion stand beside.
"""

from typing import Any

from a2g_jax.evaluation.likelihood import bits_per_dim, gaussian_bits_per_dim
from a2g_jax.training.run import Run
from experiments.stylized_flow.protocol import TED, continued
from experiments.stylized_flow.settings import flow, moglow
from experiments.stylized_flow.tables import with_nulls
from experiments.tables.claims import Claim
from experiments.tables.markdown import compute, draw
from experiments.tables.runs import Ruler, arguments, setting

TABLE = "stylized_flow/table2"
FULL, NO_LOSS, NO_ENCODER, BASELINE = "proposed", "without L_gp", "without global encoder", "baseline"
VARIANTS = {
    FULL: flow("ted"),
    NO_LOSS: flow("ted", perceptual_weight=0.0),
    NO_ENCODER: flow("ted", global_channels=0),
    BASELINE: moglow("ted", cell="gru"),
}
CLAIMS = (
    Claim("without L_gp FGD is worse", NO_LOSS, FULL, "fgd", 1),
    Claim("without the global encoder FGD is worse", NO_ENCODER, FULL, "fgd", 1),
    Claim("the proposed model has a lower FGD than the baseline", FULL, BASELINE, "fgd", -1),
    Claim("the proposed model is more diverse than the baseline", FULL, BASELINE, "diversity", 1),
    Claim("L_gp without the encoder is no better than the baseline (FGD)", NO_ENCODER, BASELINE, "fgd", 1),
)
PAPER = {
    FULL: "FGD 3.30, PCK 0.850, diversity 52 mm",
    NO_LOSS: "4.62, 0.845, 51",
    NO_ENCODER: "6.26, 0.848, 50",
    BASELINE: "6.10, 0.850, 49",
}


def score(name: str, run: Run, ruler: Ruler, seed: int) -> dict[str, Any]:
    """Scores of continued clips, and bits per dimension of held-out motion seen through the training's noise."""
    found: dict[str, Any] = continued(TED)(name, run, ruler, seed)
    for title, likelihood in (
        ("bits_per_dim", bits_per_dim(run, ruler.corpus)),
        ("gaussian_bits_per_dim", gaussian_bits_per_dim(run.config, ruler.corpus)),
    ):
        found[title] = {**likelihood.noisy._asdict(), "floor": likelihood.floor}
    return found


def main() -> None:
    """Train and score what is missing, and draw the table."""
    options = arguments("Table 2: the components of the flow").parse_args()
    if options.corpus is not None:
        with_nulls(TABLE, setting(options), TED)
        compute(
            TABLE,
            VARIANTS,
            setting(options),
            options.only.split(",") if options.only else None,
            score,
            "ted, with bits",
        )
    draw(TABLE, "Table 2: the components of the stylized flow", VARIANTS, CLAIMS, PAPER)


if __name__ == "__main__":
    main()
