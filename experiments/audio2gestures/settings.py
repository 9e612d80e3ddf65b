"""Common settings of the tables of Audio2Gestures.

``python -m experiments.audio2gestures.select`` compares settings on seeds and recordings that the tables do not report.
"""

#: Changes of the tiny preset for every row of Audio2Gestures: the paper's mapping net and losses on its random codes,
#: with what keeps small trainings from collapse (codes that begin with little noise, a hinge on the shared ones, slow
#: specific ones, relative losses), and without what the paper lacks: codes of training clips, the adversary, and
#: smoothing of quiet frames.
BASE = {
    "clip_frames": 128,
    "stored_codes": False,
    "adversarial_steps": 0,
    "relaxed_weight": 1.0,
    "bicycle_weight": 0.1,
    "diversity_weight": 0.1,
    "redraw_frames": 0,
    "rest_smoothing": 0,
}
