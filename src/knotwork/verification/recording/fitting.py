"""Cubic splines by weighted least squares, and their uncertainty."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.polynomial.two_point import two_point_coefficients
from knotwork.waypoints import FloatArray

DEGREE = 3


class Fit:
    """A weighted least-squares spline with given knots, joint by joint.

    At any time only `DEGREE` + 1 consecutive B-splines are nonzero.
    """

    def __init__(
        self, time: FloatArray, breaks: FloatArray, position: FloatArray, sigma: FloatArray
    ) -> None:
        from scipy.interpolate import BSpline
        from scipy.linalg import cho_solve_banded, cholesky_banded

        self.breaks, self._time = breaks, time
        knots = np.concatenate(([breaks[0]] * DEGREE, breaks, [breaks[-1]] * DEGREE))
        rows = BSpline.design_matrix(time, knots, DEGREE)
        size = rows.shape[1]
        self._factors, columns = [], []
        for j in range(position.shape[1]):
            weight = sigma[:, j] ** -2
            normal = rows.T @ rows.multiply(weight[:, None])
            # the normal equations have as many diagonals as the degree has, on each side
            band = np.zeros((DEGREE + 1, size))
            for k in range(DEGREE + 1):
                band[k, : size - k] = normal.diagonal(-k)
            factor = cholesky_banded(band, lower=True)
            self._factors.append(factor)
            columns.append(cho_solve_banded((factor, True), rows.T @ (weight * position[:, j])))
        self._spline = BSpline(knots, np.column_stack(columns), DEGREE)
        # column k is the sum of the B-splines k, k + 4, …, of which only one is nonzero at a time
        sums = np.eye(DEGREE + 1)[np.arange(size) % (DEGREE + 1)]
        self._basis_sums = BSpline(knots, sums, DEGREE)

    def values(self, order: int, at: FloatArray | None = None) -> FloatArray:
        """The curve or a derivative, at the samples or at other times, shape (n, d)."""
        return np.asarray(self._spline(self._time if at is None else at, order))

    def standard_errors(self, at: FloatArray, order: int) -> FloatArray:
        """Standard errors of a derivative at times due to the noise, shape (n, d)."""
        first = np.searchsorted(self.breaks[1:-1], at, side="right")
        columns = first[:, None] + np.arange(DEGREE + 1)
        sums = self._basis_sums(at, order)
        basis = np.take_along_axis(sums, columns % (DEGREE + 1), axis=1)[:, :, None]
        variance = np.zeros((len(at), len(self._factors)))
        for k, diagonal in enumerate(self._covariance):
            end = DEGREE + 1 - k
            products = basis[:, :end] * basis[:, k:] * diagonal[columns[:, :end]]
            variance += (2.0 if k else 1.0) * products.sum(axis=1)
        return np.sqrt(np.maximum(variance, 0.0))

    @cached_property
    def _covariance(self) -> FloatArray:
        """Covariances of coefficients i and i + k, by joint, shape (k, i, d)."""
        return inverse_within_band(np.stack(self._factors, axis=-1))

    def polynomial(self) -> PiecewisePolynomial:
        """The curve as a piecewise polynomial."""
        ends = (self.values(0, self.breaks), self.values(1, self.breaks))
        return PiecewisePolynomial(two_point_coefficients(self.breaks, ends), self.breaks)


def inverse_within_band(factors: FloatArray) -> FloatArray:
    """Entries of the inverse of A = L Lᵀ where A has some, for several matrices at once.

    With the last rows known, row i follows from Lᵀ A⁻¹ = L⁻¹, whose entries right of the diagonal
    are zero (Takahashi's equations). Each step needs the inverse next to it only.

    Args:
        factors: Diagonals of the L below each other, as from `scipy.linalg.cholesky_banded`
            with `lower=True`, shape (p + 1, K, d).

    Returns:
        Diagonal k of the inverse in row k, starting at its first entry, shape (p + 1, K, d).
    """
    width, size, count = factors.shape
    columns = np.moveaxis(factors, 1, 0)
    shares = (columns[:, 1:] / columns[:, :1]).transpose(0, 2, 1)[..., None]  # (K, d, p, 1)
    pivots = columns[:, 0] ** -2.0
    inverse = np.empty((size, count, width))
    known = np.zeros((count, width, width))  # that of rows i to i + p
    for i in range(size - 1, -1, -1):
        beside = -(known[:, :-1, :-1] @ shares[i])
        known[:, 1:, 1:] = known[:, :-1, :-1].copy()
        known[:, 0, 0] = pivots[i] - (shares[i] * beside).sum(axis=(1, 2))
        known[:, 0, 1:] = known[:, 1:, 0] = beside[..., 0]
        inverse[i] = known[:, 0]
    return np.ascontiguousarray(inverse.transpose(2, 0, 1))
