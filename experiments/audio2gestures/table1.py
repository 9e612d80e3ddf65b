"""Table 1: Audio2Gestures compared with Speech2Gesture, in 3D and in 2D, and with StyleGestures in 3D.

StyleGestures is MoGlow conditioned on speech, at the table's 30 frames per second and in its 6D rotations.

    python -m experiments.audio2gestures.table1 --corpus CORPUS --features RUN \\
        --corpus-2d CORPUS --features-2d RUN [--budget MINUTES]

The 2D corpus is one of ``a2g prepare talker --minutes 60 --seed 6 --view s2g --features audio2gestures-2d``: 49
keypoints at 15 fps, clips of 64 frames; its network is ``experiments/features/talker_2d`` (1000 steps). Without a
corpus the tables are rendered from the existing records.
"""

from dataclasses import replace
from pathlib import Path

from experiments.audio2gestures.settings import BASE
from experiments.stylized_flow.settings import MOGLOW, TRAINING
from experiments.tables.claims import Claim
from experiments.tables.markdown import compute, draw
from experiments.tables.setting import Variant, arguments, setting

OURS, WITHOUT_GAN, WITH_GAN = "Audio2Gestures", "Speech2Gesture without GAN", "Speech2Gesture"
STYLEGESTURES = "StyleGestures (MoGlow)"
#: As published, at the size of the other rows; frames of StyleGestures at 20 fps.
_STYLEGESTURES = Variant(
    {**MOGLOW, "predictor": False, "history_frames": 5, "lookahead_frames": 20, "clip_frames": 120},
    model="stylized_flow",
    preset="tiny_published",
    training=TRAINING,
)


def _rows() -> dict[str, Variant]:
    clips = {"clip_frames": 64}
    return {
        WITHOUT_GAN: Variant({**clips, "adversarial_weight": 0.0}, model="speech2gesture"),
        WITH_GAN: Variant(clips, model="speech2gesture"),
        OURS: Variant({**BASE, **clips}),
    }


#: By name of the table: title, rows, claims, the paper's figures.
TABLES = {
    "audio2gestures/table1_3d": (
        "Table 1, 3D",
        {STYLEGESTURES: _STYLEGESTURES, **_rows()},
        (
            Claim("without GAN, position L1 is about ours or lower", WITHOUT_GAN, OURS, "position_l1", -1, WITHOUT_GAN),
            Claim("the GAN worsens position L1", WITH_GAN, WITHOUT_GAN, "position_l1", 1),
            Claim("the GAN lowers PCK", WITH_GAN, WITHOUT_GAN, "pck", -1),
            Claim("ours is more diverse than S2G without GAN", OURS, WITHOUT_GAN, "diversity", 1),
            Claim("ours is multimodal, Speech2Gesture is not", OURS, WITHOUT_GAN, "multimodality", 1),
            Claim("position L1 is lower than StyleGestures'", OURS, STYLEGESTURES, "position_l1", -1),
            Claim("ours is more diverse than StyleGestures", OURS, STYLEGESTURES, "diversity", 1),
            Claim("StyleGestures is the more multimodal", STYLEGESTURES, OURS, "multimodality", 1, STYLEGESTURES),
        ),
        {
            "S2G w/o GAN": "position L1 7.71, PCK 0.82, diversity 5.99",
            "S2G": "24.68, 0.39, 2.46",
            "StyleGestures": "18.97 (18.07), 0.34, 2.34, multimodality 7.55",
            "Audio2Gestures": "7.84 (7.65), 0.82 (0.83), 6.32, multimodality 4.11",
        },
    ),
    "audio2gestures/table1_2d": (
        "Table 1, 2D",
        _rows(),
        (
            Claim("without GAN, position L1 is the lowest", WITHOUT_GAN, OURS, "position_l1", -1, WITHOUT_GAN),
            Claim("without GAN, diversity is the lowest", WITHOUT_GAN, OURS, "diversity", -1, WITHOUT_GAN),
            Claim("the GAN worsens position L1", WITH_GAN, WITHOUT_GAN, "position_l1", 1),
            Claim("the GAN raises diversity", WITH_GAN, WITHOUT_GAN, "diversity", 1),
            Claim("ours is multimodal, Speech2Gesture is not", OURS, WITHOUT_GAN, "multimodality", 1),
        ),
        {
            "S2G w/o GAN": "position L1 0.74, PCK 0.37, diversity 0.61",
            "S2G": "1.08, 0.23, 0.89",
            "Audio2Gestures": "0.94 (0.92), 0.33 (0.34), 0.84, multimodality 0.77",
        },
    ),
}


def main() -> None:
    """Train and score what is missing, and render both tables."""
    parser = arguments("Table 1: comparison with Speech2Gesture, in 3D and 2D", steps=500)
    parser.add_argument("--corpus-2d", type=Path, help="made by 'a2g prepare talker --view s2g'")
    parser.add_argument("--features-2d", type=Path, help="a run of motion_autoencoder on it")
    options = parser.parse_args()
    where = setting(options)
    given = {
        "audio2gestures/table1_3d": where,
        "audio2gestures/table1_2d": replace(where, corpus=options.corpus_2d, features=options.features_2d),
    }
    only = options.only.split(",") if options.only else None
    for name, (title, rows, claims, paper) in TABLES.items():
        if given[name].corpus is not None:
            compute(name, rows, given[name], only)
        draw(name, title, rows, claims, paper)


if __name__ == "__main__":
    main()
