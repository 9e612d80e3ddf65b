"""Joints of two rigs that correspond."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Pair:
    """A joint of the target and the joint of the source whose pose it copies."""

    target: int
    source: int
    role: str
    how: str
    """``"name"``, ``"shape"`` (topology), ``"order"`` (spines and necks) or ``"same name"``."""


@dataclass(frozen=True)
class Share:
    """A joint of the target between two matched ones, posed by interpolation between their poses."""

    target: int
    above: int
    below: int
    weight: float
