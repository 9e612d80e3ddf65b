"""Table 4: structured and perceptual training losses; rows of the truth with noise are among the baselines.

    python -m experiments.audio2gestures.table4 --corpus CORPUS --features RUN --perceptual RUN [--budget MINUTES]

The paper does not give the losses' weights. Ours make each term about as large as the position loss early in training.
"""

from experiments.audio2gestures.settings import BASE
from experiments.tables.claims import Claim
from experiments.tables.markdown import make
from experiments.tables.setting import Variant

STFT, SSIM, LPIPS = {"stft_weight": 0.05}, {"ssim_weight": 0.1}, {"lpips_weight": 0.002}

VARIANTS = {
    "A2G": Variant(BASE),
    "+ STFT": Variant({**BASE, **STFT}),
    "+ SSIM": Variant({**BASE, **SSIM}),
    "+ LPIPS": Variant({**BASE, **LPIPS}),
    "+ STFT + SSIM + LPIPS": Variant({**BASE, **STFT, **SSIM, **LPIPS}),
}

CLAIMS = (
    Claim("the STFT loss lowers the STFT distance", "+ STFT", "A2G", "stft", -1),
    Claim("the STFT loss lowers the speed error", "+ STFT", "A2G", "speed_l1", -1),
    Claim("the STFT loss lowers the acceleration error", "+ STFT", "A2G", "acceleration_l1", -1),
    Claim("the SSIM loss raises SSIM", "+ SSIM", "A2G", "ssim", 1),
    Claim("the SSIM loss lowers the speed error", "+ SSIM", "A2G", "speed_l1", -1),
    Claim("the LPIPS loss lowers FID", "+ LPIPS", "A2G", "fgd", -1),
    Claim("the LPIPS loss raises multimodality", "+ LPIPS", "A2G", "multimodality", 1),
    Claim("the LPIPS loss raises position L1", "+ LPIPS", "A2G", "position_l1", 1),
)

PAPER = {
    "A2G": "position L1 7.86, speed 0.668, acceleration 0.243, STFT 1.13, SSIM 0.859, LPIPS 48.6, FID 2.22, diversity"
    " 6.58, multimodality 4.10",
    "+ STFT": "7.94, 0.657, 0.226, 1.02, 0.862, 49.8, 2.88, 5.06, 4.88",
    "+ SSIM": "7.86, 0.638, 0.221, 1.10, 0.865, 49.9, 2.98, 5.19, 4.83",
    "+ LPIPS": "8.42, 0.668, 0.252, 1.17, 0.855, 48.3, 1.90, 6.04, 5.74",
    "truth with noise of 1 degree": "1.16, 1.24, 2.14, STFT 2.78, SSIM 0.845, LPIPS 0.51, FID 0.0004, diversity 10.1",
    "truth with noise of 5 degrees": "4.44, 6.06, 10.5, STFT 4.06, SSIM 0.275, LPIPS 12.2, FID 0.2001, diversity 11.7",
}

if __name__ == "__main__":
    make("audio2gestures/table4", "Table 4: structured and perceptual training losses", VARIANTS, CLAIMS, PAPER)
