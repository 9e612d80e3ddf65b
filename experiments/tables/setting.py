"""Rows of a table, and the setting in which they are trained and scored, with its command line."""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Variant:
    """A row of a table: a model, its preset and changes of its settings."""

    changes: Mapping[str, Any]
    model: str = "audio2gestures"
    preset: str = "tiny"
    training: Mapping[str, Any] | None = None
    """Changes of the tiny preset's training settings."""
    generation: Mapping[str, Any] | None = None
    """Changes of settings that act only in generation, applied after training."""
    trained_as: str = ""
    """Variant whose weights are used; empty for its own."""
    steps: float = 1.0
    """Training steps relative to the table's: above 1 for cheaper steps at equal computing."""


@dataclass(frozen=True)
class Setting:
    """Folder of runs, corpus, and length of training."""

    corpus: Path
    features: Path | None
    """The network that scores; without one there is no FGD and no LPIPS."""
    runs: Path
    steps: int
    samples: int
    seeds: tuple[int, ...]
    minutes: float
    """Minutes after which no new training starts."""
    perceptual: Path | None = None
    """The network of perceptual losses, which is not the one that scores."""
    split: str = "test"
    """The split that is scored."""
    judge: Path | None = None
    """A classifier of emotions in motion; without one there is no emotion accuracy."""


def arguments(description: str, steps: int = 1000, seeds: str = "0,1,2") -> argparse.ArgumentParser:
    """Command line of all tables.

    Args:
        steps: of the committed records, so that the plain command continues from them.
        seeds: the default of ``--seeds``.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--corpus", type=Path, help="made by 'a2g prepare'; without one, the table is only rendered")
    parser.add_argument("--features", type=Path, help="a run of motion_autoencoder on it, for FGD and LPIPS")
    parser.add_argument(
        "--perceptual", type=Path, help="another such run, of another seed, for rows with a perceptual loss"
    )
    parser.add_argument("--runs", type=Path, default=Path("runs"), help="folder for trained runs (default: runs)")
    parser.add_argument("--steps", type=int, default=steps, help="training steps of each run (default: %(default)s)")
    parser.add_argument("--samples", type=int, default=20)
    parser.add_argument("--seeds", default=seeds, help="comma-separated (default: %(default)s)")
    parser.add_argument("--budget", type=float, default=1e9, help="minutes after which no new training starts")
    parser.add_argument("--only", help="variants, comma-separated (default: all)")
    return parser


def setting(options: argparse.Namespace) -> Setting:
    """The setting given by the flags."""
    seeds = tuple(int(seed) for seed in options.seeds.split(","))
    return Setting(
        options.corpus,
        options.features,
        options.runs,
        options.steps,
        options.samples,
        seeds,
        options.budget,
        options.perceptual,
    )
