"""The smooth motion behind the samples of a log: cubic splines by weighted least squares.

Knots are added where the samples require them: an interval is halved as long as the mean square of
its residuals exceeds the noise. Then all intervals are halved once more, so that the error of the
curve is small compared with the uncertainty due to noise. The reported uncertainty is the standard
error of the least squares, combined with the change of the curve in the last halving, which exceeds
the change that finer knots would make.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.two_point import two_point_coefficients
from knotwork.curves.trajectory import JointTrajectory
from knotwork.verification.recording.log_reading import Recording
from knotwork.verification.recording.noise import Noise, largest_near, noise_of, slopes_of

NOISE_SLACK = 1.1
"""Tolerated ratio of the mean squares of residuals and estimated noise."""
EXTENSION_PERIODS = 3.0
"""Number of sample periods by which the curve extends beyond the first and the last sample."""
MIN_IN_INTERVAL = 4
"""Minimum number of samples in an interval."""
MISS_DEVIATIONS = 3.0
"""Standard deviations of white noise beyond which residuals show that the curve is too coarse."""
DEGREE = 3
"""Degree of the splines, whose acceleration is continuous."""
ERROR_ORDERS = range(DEGREE + 1)
"""Orders of the quantities with standard errors: position, velocity, acceleration and jerk."""


@dataclass(frozen=True, eq=False)
class Smoothed:
    """A smooth motion (C2) behind a log.

    Attributes:
        trajectory: The motion, with time since the first sample [s]. It extends beyond the samples
            by three sample periods at each end.
        log: The samples.
        noise: The noise of the samples.
        grid: Times at which the standard errors are given [s], shape (g,).
        errors: Standard errors of position, velocity, acceleration and jerk at these times [rad or
            m, per s, per s², per s³], shape (4, g, d), including the change in the last halving.
        residuals: Samples minus motion [rad or m], shape (n, d).
        sigma: Standard deviation of each sample [rad or m], shape (n, d).
    """

    trajectory: JointTrajectory
    log: Recording
    noise: Noise
    grid: FloatArray
    errors: FloatArray
    residuals: FloatArray
    sigma: FloatArray

    def curve_of(self, position: FloatArray) -> PiecewisePolynomial:
        """Smooth another motion with the same knots and weights.

        Args:
            position: Positions of that motion at the times of the log [rad or m], shape (n, d).
        """
        return Fit(self.log.time, self.trajectory.breaks, position, self.sigma).polynomial


def smoothed(log: Recording, noise: float | None = None) -> Smoothed:
    r"""Estimate the smooth motion behind a log.

    >>> from pathlib import Path
    >>> time = np.arange(100) / 50
    >>> random = np.random.default_rng(1).normal(0.0, 1e-4, 100)
    >>> lines = [f"{t},{q:.6f}" for t, q in zip(time, np.sin(time) + random)]
    >>> characters = Path("log.csv").write_text("\n".join(["time,lift", *lines]))
    >>> curve = smoothed(kw.recording.read_log("log.csv", ["lift"], ["m"]))
    >>> abs(curve.trajectory.velocity(1.0)[0] - np.cos(1.0)) < 0.01
    np.True_

    Args:
        log: The log.
        noise: Standard deviation of its positions [rad or m]; by default it is estimated.

    Raises:
        InputError: The noise is not a positive number.
    """
    estimate = noise_of(log, noise)
    sigma = estimate.of_samples(slopes_of(log.time, log.position))
    coarse, fit = _fits(log, sigma)
    grid = _grid(log, fit.polynomial.x)
    trajectory = JointTrajectory(
        log.joint_names,
        fit.polynomial,
        joint_units=log.joint_units,
        origin=f"{log.source} (log)",
    )
    residuals = log.position - fit.polynomial(log.time)
    noise_errors = np.stack([fit.standard_errors(grid, order) for order in ERROR_ORDERS])
    changes = [
        fit.polynomial(grid, order) - coarse.polynomial(grid, order) for order in ERROR_ORDERS
    ]
    errors = np.hypot(noise_errors, largest_near(np.abs(changes), 2, axis=1))
    return Smoothed(trajectory, log, estimate, grid, errors, residuals, sigma)


def _grid(log: Recording, breaks: FloatArray) -> FloatArray:
    """Times of standard errors: breaks, their midpoints, and half periods beyond the samples."""
    middles = 0.5 * (breaks[1:] + breaks[:-1])
    beyond = np.arange(0.0, EXTENSION_PERIODS, 0.5) * log.period
    ends = (log.time[0] - beyond, log.time[-1] + beyond)
    return np.unique(np.concatenate((breaks, middles, *ends)))


def _fits(log: Recording, sigma: FloatArray) -> tuple[Fit, Fit]:
    """The fit with intervals that follow the samples within their noise, and one with halves."""
    n = log.time.size
    count = max(1, min(8, n // (2 * MIN_IN_INTERVAL)))
    cuts = np.unique(np.linspace(0, n, count + 1).astype(int))
    while True:
        fit = Fit(log.time, _times(log, cuts), log.position, sigma)
        shares = (log.position - fit.polynomial(log.time)) / sigma
        halves = _halve(cuts, _misses(shares, cuts))
        if halves.size == cuts.size:
            break
        cuts = halves
    finer = _halve(cuts, np.ones(cuts.size - 1, dtype=bool))
    return fit, Fit(log.time, _times(log, finer), log.position, sigma)


def _misses(shares: FloatArray, cuts: Any) -> Any:
    """Find intervals in which the curve misses the samples, from residuals relative to the noise.

    In them the mean square of one joint or of all joints is too large, or successive residuals have
    the same sign too often, compared with white noise.
    """
    sizes, joints = np.diff(cuts), shares.shape[1]
    means = np.add.reduceat(shares**2, cuts[:-1], axis=0) / sizes[:, None]
    slack = MISS_DEVIATIONS * np.sqrt(2.0 / sizes)
    alone = (means > NOISE_SLACK * (1.0 + slack)[:, None]).any(axis=1)
    together = means.mean(axis=1) > NOISE_SLACK * (1.0 + slack / np.sqrt(joints))
    products = np.zeros(len(shares))
    products[1:] = (shares[1:] * shares[:-1]).mean(axis=1)
    means = np.add.reduceat(products, cuts[:-1]) / sizes
    return alone | together | (means > MISS_DEVIATIONS / np.sqrt(sizes * joints))


def _halve(cuts: Any, chosen: Any) -> Any:
    """Halve the chosen intervals that have enough samples."""
    chosen = chosen & (np.diff(cuts) >= 2 * MIN_IN_INTERVAL)
    return np.sort(np.concatenate((cuts, ((cuts[:-1] + cuts[1:]) // 2)[chosen])))


def _times(log: Recording, cuts: Any) -> FloatArray:
    """Breaks between the samples, and the ends of the curve."""
    time, inner, extension = log.time, cuts[1:-1], EXTENSION_PERIODS * log.period
    middles = 0.5 * (time[inner - 1] + time[inner])
    return np.concatenate((time[:1] - extension, middles, time[-1:] + extension))


class Fit:
    """A weighted least-squares spline with given knots, joint by joint.

    At any time only `DEGREE` + 1 consecutive B-splines are nonzero.

    Args:
        time: Times of the samples [s], shape (n,).
        breaks: Knots, and the ends of the curve [s].
        position: Samples [rad or m], shape (n, d).
        sigma: Standard deviation of each sample [rad or m], shape (n, d).

    Attributes:
        polynomial: The spline as a piecewise polynomial.
    """

    def __init__(
        self, time: FloatArray, breaks: FloatArray, position: FloatArray, sigma: FloatArray
    ) -> None:
        from scipy.interpolate import BSpline
        from scipy.linalg import cho_solve_banded, cholesky_banded

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
        spline = BSpline(knots, np.column_stack(columns), DEGREE)
        ends = (spline(breaks), spline(breaks, 1))
        self.polynomial = PiecewisePolynomial(two_point_coefficients(breaks, ends), breaks)
        # column k is the sum of the B-splines k, k + 4, …, of which only one is nonzero at a time
        sums = np.eye(DEGREE + 1)[np.arange(size) % (DEGREE + 1)]
        self._basis_sums = BSpline(knots, sums, DEGREE)

    def standard_errors(self, at: FloatArray, order: int) -> FloatArray:
        """Standard errors of a derivative at times [s] due to the noise, shape (n, d)."""
        first = np.searchsorted(self.polynomial.x[1:-1], at, side="right")
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


def inverse_within_band(factors: FloatArray) -> FloatArray:
    """Entries of the inverse of A = L Lᵀ at the nonzero entries of A, for several matrices at once.

    From the last row backwards, row i follows from Lᵀ A⁻¹ = L⁻¹, whose entries right of the
    diagonal are zero (Takahashi's equations). Each row only needs the p rows after it.

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
    block = np.zeros((count, width, width))  # the inverse in rows and columns i to i + p
    for i in range(size - 1, -1, -1):
        row = -(block[:, :-1, :-1] @ shares[i])
        block[:, 1:, 1:] = block[:, :-1, :-1].copy()
        block[:, 0, 0] = pivots[i] - (shares[i] * row).sum(axis=(1, 2))
        block[:, 0, 1:] = block[:, 1:, 0] = row[..., 0]
        inverse[i] = block[:, 0]
    return np.ascontiguousarray(inverse.transpose(2, 0, 1))
