"""A Gaussian whose mean is linear in its conditioning: the baseline of a learned density.

Ridge regression gives the mean; the covariance is that of its residuals, the same for every frame. Ridge regression is
the mode of Gaussian weights (Bishop, "Pattern Recognition and Machine Learning", Sec. 3.3.1), and the residuals'
variance counts the degrees of freedom that the weights take (Hastie et al., "The Elements of Statistical Learning",
Eq. 3.50).
"""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import linalg


class ConditionalGaussian(NamedTuple):
    """The density of C values conditioned on D others."""

    weights: Float[np.ndarray, "D C"]
    offset: Float[np.ndarray, " C"]
    covariance: Float[np.ndarray, "C C"]

    def log_density(self, given: Float[np.ndarray, "N D"], values: Float[np.ndarray, "N C"]) -> Float[np.ndarray, " N"]:
        """Log-density of every row, nats."""
        residual = np.asarray(values, np.float64) - np.asarray(given, np.float64) @ self.weights - self.offset
        factor = np.linalg.cholesky(self.covariance)
        white = linalg.solve_triangular(factor, residual.T, lower=True)
        constant = np.log(np.diag(factor)).sum() + 0.5 * len(self.offset) * math.log(2 * math.pi)
        density: Float[np.ndarray, " N"] = -0.5 * np.square(white).sum(axis=0) - constant
        return density


class Regression:
    """Moments of rows that arrive in batches, in float64, from which a fit for any ridge strength follows."""

    def __init__(self) -> None:
        self.count = 0
        self._sums: np.ndarray | float = 0.0
        self._products: np.ndarray | float = 0.0
        self._inputs = 0

    def add(self, given: Float[np.ndarray, "N D"], values: Float[np.ndarray, "N C"]) -> None:
        """Add N rows."""
        rows = np.concatenate([np.asarray(given, np.float64), np.asarray(values, np.float64)], axis=1)
        self._inputs, self.count = given.shape[1], self.count + len(rows)
        self._sums = self._sums + rows.sum(axis=0)
        self._products = self._products + rows.T @ rows

    def fit(self, strengths: tuple[float, ...], floor: float = 1e-6) -> list[ConditionalGaussian]:
        """One distribution for each strength.

        Args:
            strengths: weights of the squared-weight penalty relative to mean squared residuals.
            floor: added to the variance of every value; constant values have no density without it.

        Raises:
            ValueError: too few rows for a covariance of their values.
        """
        split, values = self._inputs, len(np.atleast_1d(self._sums)) - self._inputs
        mean = np.asarray(self._sums) / max(self.count, 1)
        if self.count <= values + 1:
            raise ValueError(f"Expected more than {values + 1} rows; got {self.count}.")
        moments = np.asarray(self._products) / self.count - np.outer(mean, mean)
        inner, cross, outer = moments[:split, :split], moments[:split, split:], moments[split:, split:]
        spectrum, axes = np.linalg.eigh(inner)
        spectrum, projected = np.maximum(spectrum, 0.0), axes.T @ cross
        fits = []
        for strength in strengths:
            weights = axes @ (projected / (spectrum + strength)[:, None])
            residual = outer - weights.T @ cross - cross.T @ weights + weights.T @ inner @ weights
            freedom = 1.0 + (spectrum / (spectrum + strength)).sum()
            # With hardly more rows than weights the correction diverges; the factor 2 bounds it.
            residual *= self.count / max(self.count - freedom, self.count / 2)
            covariance = 0.5 * (residual + residual.T) + floor * np.eye(values)
            fits.append(ConditionalGaussian(weights, mean[split:] - mean[:split] @ weights, covariance))
        return fits
