"""Table 2: the components one after another.

    python -m experiments.audio2gestures.table2 --corpus CORPUS --features RUN [--budget MINUTES]

"The paper's weights" is the preset ``paper`` (alignment 0.1, KL 1e-3, bicycle 0.1, diversity 0.1) on the tables'
networks; the last row is the preset ``tiny`` itself, whose adversarial stage comes after the table's steps. Without a
corpus the table is rendered from the existing records.
"""

from dataclasses import asdict, fields

from a2g_jax.models import find_model
from experiments.audio2gestures.settings import BASE
from experiments.tables.claims import Claim
from experiments.tables.markdown import make
from experiments.tables.setting import Variant

#: The losses on sampled motions that the authors' code adds to the paper's relaxed loss.
AUTHORS_LOSSES = {"sampled_rotation_weight": 1.0, "sampled_speed_weight": 5.0}
_OFF = {"bicycle_weight": 0.0, "diversity_weight": 0.0}

_ENTRY = find_model("audio2gestures")
#: Everything of the paper's preset but its networks' sizes; ramps longer than a third of the training are cut to it.
PAPER_WEIGHTS = {
    field.name: getattr(_ENTRY.presets["paper"], field.name)
    for field in fields(_ENTRY.config)
    if not field.name.endswith("_channels") and field.name != "clip_frames"
}

VARIANTS = {
    "baseline": Variant({**BASE, "split": False, "sample_codes": True}),
    "+ split": Variant({**BASE, **_OFF, "mapping": False}),
    "+ mapping net": Variant({**BASE, **_OFF}),
    "+ bicycle constraint": Variant({**BASE, "diversity_weight": 0.0}),
    "+ diversity loss": Variant(BASE),
    "full, authors' losses on samples": Variant({**BASE, **AUTHORS_LOSSES}),
    "full, no loss on samples": Variant({**BASE, "relaxed_weight": 0.0}),
    "full, the paper's weights": Variant(
        {"clip_frames": BASE["clip_frames"], **PAPER_WEIGHTS, **asdict(_ENTRY.sampling())}
    ),
    "ours: codes of training clips, adversary": Variant({"clip_frames": BASE["clip_frames"]}),
}

CLAIMS = (
    Claim("split raises multimodality from near zero", "+ split", "baseline", "multimodality", 1),
    Claim("split harms position L1", "+ split", "baseline", "position_l1", 1),
    Claim("the mapping net restores position L1", "+ mapping net", "+ split", "position_l1", -1),
    Claim("the mapping net lowers FID", "+ mapping net", "+ split", "fgd", -1),
    Claim("the mapping net raises diversity", "+ mapping net", "+ split", "diversity", 1),
    Claim("the bicycle constraint raises multimodality", "+ bicycle constraint", "+ mapping net", "multimodality", 1),
    Claim("the diversity loss raises multimodality", "+ diversity loss", "+ bicycle constraint", "multimodality", 1),
    Claim("the full model has a lower FID than the baseline", "+ diversity loss", "baseline", "fgd", -1),
    Claim("the full model has a lower STFT distance than the baseline", "+ diversity loss", "baseline", "stft", -1),
)

PAPER = {
    "baseline": "position L1 7.64 (7.63) cm, PCK 0.82, STFT 1.74, FID 2.94 (2.93), diversity 5.35, multimodality 0.41",
    "+ split": "position L1 8.30 (7.86), PCK 0.79, STFT 1.12, FID 2.94 (2.16), diversity 5.03, multimodality 5.95",
    "+ mapping net": "position L1 7.73 (7.45), PCK 0.81, STFT 1.11, FID 2.19 (1.86), diversity 6.13,"
    " multimodality 3.59",
    "+ bicycle constraint": "position L1 7.69 (7.36), PCK 0.82, STFT 1.14, FID 2.16, diversity 6.35,"
    " multimodality 3.99",
    "+ diversity loss": "position L1 7.86 (7.55), PCK 0.81, STFT 1.13, FID 2.22 (1.65), diversity 6.58,"
    " multimodality 4.10",
}


if __name__ == "__main__":
    make(
        "audio2gestures/table2", "Table 2: the components of Audio2Gestures one after another", VARIANTS, CLAIMS, PAPER
    )
