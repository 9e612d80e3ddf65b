"""Table 6: edits of the codes' DCT bands.

    python -m experiments.audio2gestures.table6 --corpus CORPUS --features RUN [--budget MINUTES]

One run with a latent space of DCT bands for each seed; edits act on it in generation.
"""

from experiments.audio2gestures.settings import BASE
from experiments.tables.claims import Claim
from experiments.tables.markdown import make
from experiments.tables.setting import Variant

DCT = "A2G with DCT"
#: Bands take the place of steps of several frames; 128 points need clips of 128 frames.
_SETTINGS = {**BASE, "latent": "dct", "specific_frames": 1, "specific_jitter": 0}


def _edited(*edits: str) -> Variant:
    return Variant(_SETTINGS, generation={"edits": edits}, trained_as=DCT)


VARIANTS = {
    "A2G": Variant(BASE),
    DCT: Variant(_SETTINGS),
    "S_A[100:] = 0": _edited("shared keep 100"),
    "S_A[50:] = 0": _edited("shared keep 50"),
    "S_A[10:] = 0": _edited("shared keep 10"),
    "I_R[10:] = 0": _edited("specific keep 10"),
    "I_R[1:] = 0": _edited("specific keep 1"),
    "I_R = 0": _edited("specific keep 0"),
    "I_R[10:] drawn anew": _edited("specific sample 10:128 1"),
    "I_R[:10] drawn anew": _edited("specific sample 0:10 1"),
}

CLAIMS = (
    Claim("the DCT space is about as good as time (FID not higher)", DCT, "A2G", "fgd", -1),
    Claim("dropping high bands of S_A slows the motion (speed error)", "S_A[10:] = 0", DCT, "speed_l1", -1),
    Claim("dropping high bands of S_A calms the motion (jerk)", "S_A[10:] = 0", DCT, "jerk", -1),
    Claim("dropping high bands of S_A raises position L1", "S_A[10:] = 0", DCT, "position_l1", 1),
    Claim("bands of I_R above 10 hardly matter (position L1 rises)", "I_R[10:] = 0", DCT, "position_l1", 1),
    Claim("without I_R position L1 rises", "I_R = 0", DCT, "position_l1", 1),
    Claim("without I_R multimodality falls", "I_R = 0", DCT, "multimodality", -1),
)

PAPER = {
    "A2G": "PCK 0.81 (0.83), STFT 1.13, FID 2.22 (1.65), multimodality 4.10",
    DCT: "PCK 0.80 (0.81), STFT 1.17, FID 1.58 (1.51), multimodality 4.27",
    "S_A[100:] = 0": "PCK 0.80, STFT 1.17, FID 1.61, multimodality 4.29",
    "S_A[50:] = 0": "position L1 8.24 (7.99), PCK 0.79, STFT 1.15, FID 1.58, multimodality 4.28",
    "S_A[10:] = 0": "PCK 0.77, STFT 1.12, FID 2.23, multimodality 6.15",
    "I_R[10:] = 0": "PCK 0.79, STFT 1.16, FID 1.62, multimodality 4.27",
    "I_R[1:] = 0": "position L1 8.24 (8.01), PCK 0.79, STFT 1.16, multimodality 4.25",
    "I_R = 0": "PCK 0.62, STFT 1.18, no multimodality",
}

if __name__ == "__main__":
    make("audio2gestures/table6", "Table 6: edits of latent DCT bands", VARIANTS, CLAIMS, PAPER, steps=2000)
