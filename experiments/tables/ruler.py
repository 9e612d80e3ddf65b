"""Means of measurement: the corpus, the networks that score, and the units of a table's paper."""

from dataclasses import dataclass
from typing import Any

from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.evaluation.emotion_judge import EmotionJudge, load_emotion_judge
from a2g_jax.evaluation.feature_network import FeatureNetwork, load_feature_network
from a2g_jax.metrics.units import OURS, UNITS, Units
from a2g_jax.training.perceptual import load_perceptual
from experiments.tables.records import name_of
from experiments.tables.setting import Setting


@dataclass(frozen=True)
class Ruler:
    """Means of measurement, the same for all rows of a table."""

    corpus: Corpus
    network: FeatureNetwork | None
    samples: int
    units: Units = OURS
    split: str = "test"
    judge: EmotionJudge | None = None
    """For emotion accuracy."""


def measure(table: str, where: Setting) -> tuple[Ruler, dict[str, Any]]:
    """The ruler of a setting, in the units of the table's paper, and the fields that identify it in records.

    Raises:
        InputError: the perceptual loss would use the network that scores.
    """
    corpus = Corpus.open(where.corpus)
    network = None if where.features is None else load_feature_network(where.features, corpus)
    measured = {
        "corpus": name_of(corpus),
        "feature_network": None if network is None else network.fingerprint[:16],
        "samples": where.samples,
        "units": units_of(table).key,
        "split": where.split,
    }
    judge = None if where.judge is None else load_emotion_judge(where.judge, corpus)
    if judge is not None:
        measured["emotion_classifier"] = judge.fingerprint[:16]
    ruler = Ruler(corpus, network, where.samples, units_of(table), where.split, judge)
    check_networks(where, ruler)
    return ruler, measured


def units_of(table: str) -> Units:
    """The units of a table's paper, so that its figures can be compared with ours; ours where it has none."""
    return UNITS.get(table.split("/")[0].replace("_", "-"), OURS)


def check_networks(where: Setting, ruler: Ruler) -> None:
    """Refuse a perceptual loss on the network that scores.

    Raises:
        InputError: ``--perceptual`` and ``--features`` have the same weights.
    """
    if where.perceptual is None or ruler.network is None:
        return
    if load_perceptual(where.perceptual, ruler.corpus).fingerprint == ruler.network.fingerprint:
        raise InputError(
            f"--perceptual: {where.perceptual} has the weights of --features {where.features}, which would favour the"
            " rows with a perceptual loss; train another one (a2g train motion_autoencoder --seed 1)."
        )
