"""Bits per dimension in addition to the scores of continued clips, and the row of the conditional Gaussian."""

from dataclasses import replace
from typing import Any

from a2g_jax.evaluation.likelihood import Likelihood, bits_per_dim, gaussian_bits_per_dim
from a2g_jax.training.run import Run
from experiments.stylized_flow.protocol import Protocol, continued
from experiments.tables.records import append, records
from experiments.tables.ruler import Ruler, measure
from experiments.tables.runs import Score
from experiments.tables.setting import Setting, Variant
from experiments.tables.training import described

GAUSSIAN = "conditional Gaussian"


def continued_with_bits(protocol: Protocol) -> Score:
    """A score of runs: continued clips, and for flows the bits per dimension of held-out motion (with noise)."""
    scored = continued(protocol)

    def score(name: str, run: Run, ruler: Ruler, seed: int) -> dict[str, Any]:
        found: dict[str, Any] = scored(name, run, ruler, seed)
        if run.config.build().density is not None:
            found["scores"]["bits_per_dim"] = _row(bits_per_dim(run, ruler.corpus, seed=seed))
        return found

    return score


def with_gaussian(table: str, where: Setting, variant: Variant) -> None:
    """Score the Gaussian with the context of a flow, for every seed without a record.

    Args:
        variant: the flow, whose clips, history, lookahead and noise the Gaussian has.
    """
    ruler, measured = measure(table, where)
    # The Gaussian has the clips and noise of the flow, but not its losses.
    variant = replace(variant, changes={**variant.changes, "perceptual_weight": 0.0})
    for seed in where.seeds:
        identity = {"variant": GAUSSIAN, "seed": seed, **measured, "steps": 0}
        if any(identity.items() <= record.items() for record in records(table)):
            continue
        _, config = described("", variant, {}, seed, ruler.corpus, where)
        found = gaussian_bits_per_dim(config, ruler.corpus, seed=seed)
        append(table, {**identity, "floor": found.floor, "scores": {"bits_per_dim": _row(found)}})


def _row(found: Likelihood) -> dict[str, Any]:
    return {**found.noisy._asdict(), "best": None}
