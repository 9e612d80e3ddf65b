"""Table 5: backbones of the encoders; the decoder is a TCN in every row.

    python -m experiments.audio2gestures.table5 --corpus CORPUS --features RUN [--budget MINUTES]

The paper trains the Transformer on sequences of 512 frames; here all rows have clips of 64.
"""

from experiments.audio2gestures.settings import BASE
from experiments.tables.claims import Claim
from experiments.tables.markdown import make
from experiments.tables.setting import Variant

VARIANTS = {
    "baseline (TCN without split)": Variant({**BASE, "split": False, "sample_codes": True}),
    "A2G (TCN)": Variant(BASE),
    "A2G (GRU)": Variant({**BASE, "backbone": "gru"}),
    "A2G (Transformer)": Variant({**BASE, "backbone": "transformer"}),
}

CLAIMS = (
    Claim(
        "GRU multimodality is far above the baseline's", "A2G (GRU)", "baseline (TCN without split)", "multimodality", 1
    ),
    Claim(
        "Transformer multimodality is above the baseline's",
        "A2G (Transformer)",
        "baseline (TCN without split)",
        "multimodality",
        1,
    ),
    Claim("the Transformer has a lower position L1 than the TCN", "A2G (Transformer)", "A2G (TCN)", "position_l1", -1),
    Claim("the Transformer is less multimodal than the TCN", "A2G (Transformer)", "A2G (TCN)", "multimodality", -1),
    Claim("the Transformer has a higher STFT distance than the TCN", "A2G (Transformer)", "A2G (TCN)", "stft", 1),
    Claim("the GRU has a higher STFT distance than the TCN", "A2G (GRU)", "A2G (TCN)", "stft", 1),
    Claim("the GRU has a lower speed error than the TCN", "A2G (GRU)", "A2G (TCN)", "speed_l1", -1),
)

PAPER = {
    "baseline": "position L1 7.64, speed 0.60, STFT 1.74, FID 2.94, diversity 5.35, multimodality 0.41",
    "A2G": "7.86, 0.67, 1.13, 2.22, 6.58, 4.10",
    "A2G (GRU)": "8.05, 0.64, 1.28, 1.95, 6.44, 4.39",
    "A2G (Transformer)": "7.53, 0.61, 1.41, 2.55, 5.18, 2.27",
}

if __name__ == "__main__":
    make("audio2gestures/table5", "Table 5: backbones of the encoders", VARIANTS, CLAIMS, PAPER)
