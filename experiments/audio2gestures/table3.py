"""Table 3: the threshold of the relaxed motion loss.

    python -m experiments.audio2gestures.table3 --corpus CORPUS --features RUN [--budget MINUTES]

The tiny preset's losses on sampled motions, which the papers do not have, would hide the threshold; they are off.
"""

from experiments.audio2gestures.settings import BASE
from experiments.tables.claims import Claim
from experiments.tables.markdown import make
from experiments.tables.setting import Variant

#: Metres.
THRESHOLDS = (0.0, 0.001, 0.002, 0.005, 0.02, 0.05)


def _name(threshold: float) -> str:
    return f"rho {100 * threshold:g} cm"


VARIANTS = {_name(rho): Variant({**BASE, "relaxed_threshold": rho}) for rho in THRESHOLDS}

CLAIMS = (
    Claim("position L1 rises with the threshold", _name(0.05), _name(0.0), "position_l1", 1),
    Claim("PCK falls with the threshold", _name(0.05), _name(0.0), "pck", -1),
    Claim("multimodality rises with the threshold", _name(0.05), _name(0.0), "multimodality", 1),
    Claim("0.2 cm has a lower FID than 0", _name(0.002), _name(0.0), "fgd", -1),
)

PAPER = {
    "rho 0 (from the text)": "position L1 7.42 cm, PCK 0.83, LPIPS 44.2, FID 1.81, multimodality 3.59",
    "rho 0.1 cm": "position L1 7.61 (7.35), PCK 0.821, FID 2.25, diversity 6.20, multimodality 3.51",
    "rho 0.5 cm": "position L1 7.59 (7.43), PCK 0.826, FID 2.06, diversity 6.51, multimodality 3.33",
    "rho 2 cm": "position L1 7.86 (7.42), PCK 0.817, FID 2.16, diversity 6.23, multimodality 4.24",
    "rho 5 cm": "position L1 7.71 (7.50), PCK 0.822, FID 2.14, multimodality 3.92",
}

if __name__ == "__main__":
    make("audio2gestures/table3", "Table 3: the threshold of the relaxed motion loss", VARIANTS, CLAIMS, PAPER)
