"""The full model of Table 2, trained three times as long.

    python -m experiments.audio2gestures.long --corpus CORPUS --features RUN

Table 2 stops where the shared code just begins to affect the motion.
"""

from experiments.audio2gestures.table2 import VARIANTS
from experiments.tables.markdown import make

FULL = "+ diversity loss"

if __name__ == "__main__":
    make("audio2gestures/long", "The full model of Table 2, trained longer", {FULL: VARIANTS[FULL]}, (), {}, steps=3000)
