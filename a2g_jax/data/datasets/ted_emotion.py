"""TED Emotion (Qi et al., "EmotionGesture", Sec. IV-A2): talks of TED with emotions that a classifier of audio gives.

The poses and sounds are those of TED-Expressive (:mod:`~a2g_jax.data.datasets.ted_expressive`: 43 joints). A classifier
that was trained on BEAT labels windows of 60 frames; those below a confidence of 0.9 are left out, and so are disgust
and contempt, of which talks have little. Six emotions remain.

The table of labels, ``emotions.csv`` in the data set's folder, is made by ``a2g label ted-expressive TED --classifier
RUN``.
"""

from a2g_jax.data.datasets import ted_expressive
from a2g_jax.data.datasets.source import DataSet, LabelRule

#: The eight of BEAT without disgust and contempt.
EMOTIONS = ("neutral", "happiness", "anger", "sadness", "surprise", "fear")

DATASET = DataSet(
    name="ted-emotion",
    title="TED Emotion",
    fps=ted_expressive.FPS,
    find=ted_expressive.find,
    read=ted_expressive.read,
    pose="directions",
    labels=LabelRule(0.9, EMOTIONS, "emotions.csv"),
    about=(
        "TED-Expressive's databases or clips, with emotions by a classifier of audio in emotions.csv: first 'a2g label"
        " ted-expressive TED --classifier RUN'. Six emotions at a confidence of 0.9 or more; other windows are left out"
        " and counted."
    ),
)
