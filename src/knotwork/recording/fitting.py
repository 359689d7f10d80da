"""Cubic splines by weighted least squares, and their uncertainty."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.two_point import two_point_coefficients
from knotwork.recording.banded import inverse_within_band
from knotwork.waypoints import FloatArray

DEGREE = 3


class Fit:
    """A weighted least-squares spline with given knots, joint by joint."""

    def __init__(
        self,
        time: FloatArray,
        breaks: FloatArray,
        position: FloatArray,
        sigma: FloatArray,
    ) -> None:
        from scipy.linalg import cho_solve_banded, cholesky_banded

        self.breaks, self._time = breaks, time
        self._knots = np.concatenate(([breaks[0]] * DEGREE, breaks, [breaks[-1]] * DEGREE))
        rows = self._basis(time, 0)
        self._factors, columns = [], []
        for j in range(position.shape[1]):
            weight = sigma[:, j] ** -2
            normal = rows.T @ rows.multiply(weight[:, None])
            right = rows.T @ (weight * position[:, j])
            # the normal equations have as many diagonals as the degree has, on each side
            band = np.zeros((DEGREE + 1, len(right)))
            for k in range(DEGREE + 1):
                band[k, : len(right) - k] = normal.diagonal(-k)
            factor = cholesky_banded(band, lower=True)
            self._factors.append(factor)
            columns.append(cho_solve_banded((factor, True), right))
        self._coefficients = np.column_stack(columns)

    def _basis(self, at: FloatArray, order: int) -> Any:
        """Values of the derivatives of all B-splines at times, sparse, shape (n, K)."""
        from scipy.interpolate import BSpline
        from scipy.sparse import diags_array

        knots, degree, change = self._knots, DEGREE, None
        for _ in range(order):
            inner = knots[1:-1]
            step = degree / (inner[degree:] - inner[:-degree])
            size = len(step)
            down = diags_array((-step, step), offsets=(0, 1), shape=(size, size + 1))
            change = down if change is None else down @ change
            knots, degree = inner, degree - 1
        matrix = BSpline.design_matrix(at, knots, degree)
        return matrix if change is None else matrix @ change

    def values(self, order: int, at: FloatArray | None = None) -> FloatArray:
        """The curve or a derivative, at the samples or at other times, shape (n, d)."""
        at = self._time if at is None else at
        return np.asarray(self._basis(at, order) @ self._coefficients)

    def standard_errors(self, at: FloatArray, order: int) -> FloatArray:
        """Standard errors of a derivative at times due to the noise, shape (n, d)."""
        # at any time, at most as many B-splines are nonzero as the band of the inverse is wide
        basis = self._basis(at, order).tocsr()
        squares = [(basis @ inverse).multiply(basis).sum(axis=1) for inverse in self._inverses]
        return np.asarray(np.sqrt(np.maximum(np.column_stack(squares), 0.0)))

    @cached_property
    def _inverses(self) -> list[Any]:
        """Covariances of the coefficients within the band of the normal equations, by joint."""
        from scipy.sparse import diags_array

        band = inverse_within_band(np.stack(self._factors, axis=-1))
        size = band.shape[1]
        offsets = range(-DEGREE, DEGREE + 1)
        return [
            diags_array(
                [band[abs(k), : size - abs(k), j] for k in offsets],
                offsets=list(offsets),
                shape=(size, size),
            ).tocsr()
            for j in range(band.shape[2])
        ]

    def polynomial(self) -> PiecewisePolynomial:
        """The curve as a piecewise polynomial."""
        ends = (self.values(0, self.breaks), self.values(1, self.breaks))
        return PiecewisePolynomial(two_point_coefficients(self.breaks, ends), self.breaks)
