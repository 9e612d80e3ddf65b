"""Distances between sets of motions: of deep features (FID, FGD), and of speeds."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, Shaped

Features = Float[np.ndarray, "_ F"]
Rows = Int[np.ndarray, " _"]

#: Fewest vectors of a Fréchet distance in a report, as a multiple of their features: each half of the truth, the floor,
#: then still has as many vectors as features; a covariance of fewer is singular.
LEAST_VECTORS = 2
#: Fewest recordings whose vectors stay together when a set is halved.
_WHOLE = 4


class FrechetDistance(NamedTuple):
    """A Fréchet distance with its numbers of samples: for equal distributions it falls as they grow."""

    value: float
    samples: int
    reference: int


def frechet_distance(features: Features, reference: Features) -> FrechetDistance:
    """Fréchet distance of the Gaussians fitted to two sets of features (Audio2Gestures, extended, Eq. 25).

    NaN where a feature is NaN.

    Raises:
        ValueError: fewer than two vectors in a set, or vectors of different lengths.
    """
    for name, values in (("features", features), ("reference", reference)):
        if len(values) < 2:
            raise ValueError(f"expected two or more vectors of {name} for a covariance; got {len(values)}")
    moments = [(values.mean(axis=0), _covariance(values)) for values in (_double(features), _double(reference))]
    return FrechetDistance(gaussian_distance(*moments[0], *moments[1]), len(features), len(reference))


def gaussian_distance(
    mean: Float[np.ndarray, " F"],
    covariance: Float[np.ndarray, "F F"],
    other_mean: Float[np.ndarray, " F"],
    other_covariance: Float[np.ndarray, "F F"],
) -> float:
    """``|m1 - m2|^2 + tr(C1 + C2 - 2 (C1 C2)^(1/2))`` in float64.

    The trace of the root is the sum of the singular values of ``C1^(1/2) C2^(1/2)``, which
    avoids complex roots of a product that is only nearly positive.
    """
    if not all(np.isfinite(part).all() for part in (mean, covariance, other_mean, other_covariance)):
        return float("nan")
    root, other_root = _root(covariance), _root(other_covariance)
    cross = np.linalg.svd(root @ other_root, compute_uv=False).sum()
    distance = np.sum((mean - other_mean) ** 2) + np.trace(covariance) + np.trace(other_covariance) - 2.0 * cross
    return float(max(distance, 0.0))


def enough_vectors(vectors: int, features: int) -> bool:
    """Whether a report shows a Fréchet distance of so many vectors."""
    return vectors >= max(LEAST_VECTORS * features, 4)


def halvings(owners: Shaped[np.ndarray, " n"], rng: np.random.Generator, repeats: int = 10) -> list[tuple[Rows, Rows]]:
    """Random halves of a set, as rows, all of the same size.

    Vectors of one recording stay in one half: they depend on each other, so that halves with vectors of the same
    recordings are nearer than two sets of recordings. Where recordings are too few or too unequal for that, vectors are
    halved one by one.

    Args:
        owners: the recording of each vector.

    Raises:
        ValueError: fewer than four vectors.
    """
    if len(owners) < 4:
        raise ValueError(f"expected four or more vectors to halve; got {len(owners)}")
    names, owner = np.unique(owners, return_inverse=True)
    members = [np.flatnonzero(owner == one) for one in range(len(names))]
    made = []
    for _ in range(repeats):
        halves: tuple[list[int], list[int]] = ([], [])
        for one in rng.permutation(len(members)):
            min(halves, key=len).extend(members[one])
        made.append(halves)
    half = min(len(rows) for halves in made for rows in halves)
    if len(members) < _WHOLE or 4 * half < len(owners):
        half = len(owners) // 2
        orders = [rng.permutation(len(owners)) for _ in range(repeats)]
        return [(order[:half], order[half : 2 * half]) for order in orders]
    return [(rng.permutation(first)[:half], rng.permutation(second)[:half]) for first, second in made]


def split_floor(
    reference: Features,
    rng: np.random.Generator,
    repeats: int = 10,
    owners: Shaped[np.ndarray, " n"] | None = None,
) -> FrechetDistance:
    """Fréchet distance of two halves of one set, mean over random halvings: the floor for that number of samples.

    Args:
        owners: the recording of each vector (:func:`halvings`); None if each is one of its own.
    """
    halves = halvings(np.arange(len(reference)) if owners is None else owners, rng, repeats)
    values = [frechet_distance(reference[first], reference[second]).value for first, second in halves]
    return FrechetDistance(float(np.mean(values)), len(halves[0][0]), len(halves[0][1]))


def speed_hellinger(
    speeds: Float[np.ndarray, " n"], reference: Float[np.ndarray, " m"], width: float = 0.05, most: float = 3.0
) -> float:
    """Hellinger distance of histograms of speeds, 0 to 1 (as in the GENEA challenges).

    Args:
        width: width of a bin, in the unit of the speeds.
        most: speeds beyond it share one bin.
    """
    if np.isnan(speeds).any() or np.isnan(reference).any():
        return float("nan")
    edges = np.append(np.arange(0.0, most + width / 2, width), np.inf)
    first, second = (np.histogram(np.abs(values), edges)[0] / max(1, len(values)) for values in (speeds, reference))
    # The sum of roots may exceed one by rounding.
    return float(np.sqrt(max(0.0, 1.0 - np.sum(np.sqrt(first * second)))))


def _double(values: Features) -> Features:
    return np.asarray(values, np.float64)


def _covariance(values: Features) -> Float[np.ndarray, "F F"]:
    return np.atleast_2d(np.cov(values, rowvar=False))


def _root(matrix: Float[np.ndarray, "F F"]) -> Float[np.ndarray, "F F"]:
    """Square root of a symmetric matrix; tiny negative eigenvalues count as zero."""
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    return (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
