"""Baseline rows."""

from experiments.stylized_flow.protocol import Protocol, nulls
from experiments.tables.records import append, records
from experiments.tables.ruler import measure
from experiments.tables.setting import Setting


def with_nulls(table: str, where: Setting, protocol: Protocol) -> None:
    """Score the truth, other true motions and static poses, once for a corpus and a feature network."""
    ruler, measured = measure(table, where)
    if any(record["steps"] == 0 and measured.items() <= record.items() for record in records(table)):
        return
    for name, scores in nulls(ruler, protocol).items():
        append(table, {"variant": name, "seed": 0, **measured, "steps": 0, "scores": scores})
