"""The smooth motion behind the samples of a log: cubic splines by weighted least squares.

Knots are put where the samples ask for them. An interval is halved as long as the curve is off its
samples by more than their noise, in mean square; after that all intervals are halved once more. So
what the curve can't follow is small beside what the noise leaves unknown. What is unknown in the
end is the standard error of the least squares, and beside it by how much the last halving has
changed the curve, which is more than finer knots would.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.hermite import two_point_coefficients
from knotwork.recording.banded import inverse_within_band
from knotwork.recording.limits import of_missed, of_pieces, of_rounding
from knotwork.recording.noise import Noise, noise_of, slopes_of
from knotwork.recording.reading import Recording
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import FloatArray

DEGREE = 3
_ALLOWED = 1.1  # by how much the estimated noise may be too small
FEWEST = 4
"""An interval has at least so many samples."""
SURE = 5.0
"""The curve misses the samples for sure beyond this many standard deviations of white noise."""
ORDERS = 4
"""Standard errors are known of position, velocity, acceleration and jerk."""
AGREEING = 2.0
"""Recorded velocities count if they are off the slope of the positions by less than this many
standard deviations, in root mean square."""


@dataclass(frozen=True, eq=False)
class Smoothed:
    """A smooth motion (C2) behind a log.

    Attributes:
        trajectory: The motion; its times are those of the log, since its first sample [s].
        log: The samples.
        noise: What they may be off by.
        grid: Times at which the standard errors are given [s], shape (g,).
        errors: Standard errors there of position, velocity, acceleration and jerk [rad or m, per s,
            per s², per s³], shape (4, g, d), with the change by the last halving of the knots.
        residuals: Samples minus motion [rad or m], shape (n, d).
        sigma: Standard deviation of each sample [rad or m], shape (n, d).
        missed: Spans of time [s] in which the curve can't follow the samples, though it has a piece
            for every few of them: the motion changes faster there than the log shows.
        velocities: How the recorded velocities were used, in words.
        velocity_sigma: Their standard deviations [rad/s or m/s], shape (d,), where they were used.
    """

    trajectory: JointTrajectory
    log: Recording
    noise: Noise
    grid: FloatArray
    errors: FloatArray
    residuals: FloatArray
    sigma: FloatArray
    missed: tuple[tuple[float, float], ...]
    velocities: str
    velocity_sigma: FloatArray | None

    def curve_of(self, position: FloatArray, velocity: FloatArray) -> PiecewisePolynomial:
        """What the same knots and weights make of samples of another motion.

        Args:
            position: Of that motion at the times of the log [rad or m], shape (n, d).
            velocity: Its velocity there [rad/s or m/s], shape (n, d).
        """
        rates = velocity if self.velocity_sigma is not None else None
        breaks = self.trajectory.breaks
        fit = _Fit(self.log.time, breaks, position, self.sigma, rates, self.velocity_sigma)
        return fit.polynomial()


def smoothed(log: Recording, noise: float | None = None) -> Smoothed:
    r"""Find the smooth motion behind a log.

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
        InputError: The noise is no positive number.
    """
    known = noise_of(log, noise)
    sigma = known.of_samples(slopes_of(log.time, log.position))
    coarse_ends, ends, missed = _knots(log, sigma)
    coarse = _Fit(log.time, coarse_ends, log.position, sigma)
    fit = _Fit(log.time, ends, log.position, sigma)
    velocities, velocity_sigma = "none are recorded", None
    if log.velocity is not None and known.velocity is not None:
        middles = 0.5 * (ends[1:] + ends[:-1])
        place = np.searchsorted(ends[1:-1], log.time)
        unknown = np.hypot(known.velocity, fit.standard_errors(middles, 1)[place])
        off = np.sqrt((((log.velocity - fit.values(1)) / unknown) ** 2).mean(axis=0))
        if (off <= AGREEING).all():
            fit = _Fit(log.time, ends, log.position, sigma, log.velocity, known.velocity)
            velocity_sigma = known.velocity
            velocities = "used, for they agree with the positions"
        else:
            j = int(off.argmax())
            velocities = (
                f"left out: those of joint {log.joint_names[j]!r} are off the slope of its "
                f"positions by {off[j]:.3g} times their noise"
            )
    grid = _grid(fit.breaks)
    trajectory = JointTrajectory(
        log.joint_names,
        fit.polynomial(),
        joint_units=log.joint_units,
        planner=f"{log.source} (log)",
    )
    residuals = log.position - fit.values(0)
    errors = np.stack(
        [
            np.hypot(fit.standard_errors(grid, order), _changes(coarse, fit, grid, order))
            for order in range(ORDERS)
        ]
    )
    errors = np.hypot(errors, of_rounding(log, grid))
    errors = np.hypot(errors, of_pieces(fit.polynomial(), grid))
    spans = tuple((float(coarse_ends[i]), float(coarse_ends[i + 1])) for i in missed)
    errors = np.maximum(errors, of_missed(log, residuals, spans, grid))
    return Smoothed(
        trajectory, log, known, grid, errors, residuals, sigma, spans, velocities, velocity_sigma
    )


def _changes(coarse: _Fit, fit: _Fit, grid: FloatArray, order: int) -> FloatArray:
    """How much the last halving has changed the curve, at each time and beside it, shape (g, d)."""
    change = np.abs(fit.values(order, grid) - coarse.values(order, grid))
    most = change.copy()
    for k in (1, 2):
        most[k:] = np.maximum(most[k:], change[:-k])
        most[:-k] = np.maximum(most[:-k], change[k:])
    return np.asarray(most)


def _grid(breaks: FloatArray) -> FloatArray:
    """Breaks and middles between them."""
    return np.sort(np.concatenate((breaks, 0.5 * (breaks[1:] + breaks[:-1]))))


def _knots(log: Recording, sigma: FloatArray) -> tuple[FloatArray, FloatArray, list[int]]:
    """Ends of intervals that follow the samples within their noise, and of their halves [s].

    The last are those of the first that still miss the samples, for they are too short to halve.
    """
    n = log.time.size
    cuts = np.unique(np.linspace(0, n, max(1, min(8, n // (2 * FEWEST))) + 1).astype(int))
    while True:
        fit = _Fit(log.time, _times(log.time, cuts), log.position, sigma)
        shares = (log.position - fit.values(0)) / sigma
        halved = _halved(cuts, _misses(shares, cuts))
        if halved.size == cuts.size:
            finer = _halved(cuts, np.ones(cuts.size - 1, dtype=bool))
            missed = np.flatnonzero(_misses(shares, cuts, SURE)).tolist()
            return _times(log.time, cuts), _times(log.time, finer), missed
        cuts = halved


def _misses(shares: FloatArray, cuts: Any, certain: float = 3.0) -> Any:
    """Intervals in which the curve does not follow the samples, from what is left over their noise.

    There the squares are too large in the mean, of one joint or of all, or what is left has the
    same sign from sample to sample; each by so many standard deviations of white noise.
    """
    sizes, joints = np.diff(cuts), shares.shape[1]
    each = np.add.reduceat(shares**2, cuts[:-1], axis=0) / sizes[:, None]
    alone = (each > _ALLOWED * (1.0 + certain * np.sqrt(2.0 / sizes))[:, None]).any(axis=1)
    together = each.mean(axis=1) > _ALLOWED * (1.0 + certain * np.sqrt(2.0 / (sizes * joints)))
    products = np.zeros(len(shares))
    products[1:] = (shares[1:] * shares[:-1]).mean(axis=1)
    signs = np.add.reduceat(products, cuts[:-1]) / sizes > certain / np.sqrt(sizes * joints)
    return alone | together | signs


def _halved(cuts: Any, which: Any) -> Any:
    """Halve intervals that have samples enough."""
    which = which & (np.diff(cuts) >= 2 * FEWEST)
    return np.sort(np.concatenate((cuts, ((cuts[:-1] + cuts[1:]) // 2)[which])))


def _times(time: FloatArray, cuts: Any) -> FloatArray:
    inner = cuts[1:-1]
    return np.concatenate((time[:1], 0.5 * (time[inner - 1] + time[inner]), time[-1:]))


class _Fit:
    """A weighted least-squares spline with given knots, joint by joint."""

    def __init__(
        self,
        time: FloatArray,
        breaks: FloatArray,
        position: FloatArray,
        sigma: FloatArray,
        velocity: FloatArray | None = None,
        velocity_sigma: FloatArray | None = None,
    ) -> None:
        from scipy.linalg import cho_solve_banded, cholesky_banded

        self.breaks, self._time = breaks, time
        self._knots = np.concatenate(([breaks[0]] * DEGREE, breaks, [breaks[-1]] * DEGREE))
        rows, slopes = self._basis(time, 0), None
        if velocity is not None:
            slopes = self._basis(time, 1)
        self._factors, columns = [], []
        for j in range(position.shape[1]):
            weight = sigma[:, j] ** -2
            normal = rows.T @ rows.multiply(weight[:, None])
            right = rows.T @ (weight * position[:, j])
            if slopes is not None and velocity is not None and velocity_sigma is not None:
                normal = normal + slopes.T @ slopes * velocity_sigma[j] ** -2
                right = right + slopes.T @ velocity[:, j] * velocity_sigma[j] ** -2
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
        """The curve or a derivative of it, at the samples or at other times, shape (n, d)."""
        at = self._time if at is None else at
        return np.asarray(self._basis(at, order) @ self._coefficients)

    def standard_errors(self, at: FloatArray, order: int) -> FloatArray:
        """What the noise leaves unknown of a derivative at times, shape (n, d)."""
        # at a time no more B-splines differ from zero than the inverse's band is wide
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
        """The curve as polynomials between its breaks."""
        ends = tuple(
            np.asarray(self._basis(self.breaks, order) @ self._coefficients) for order in range(2)
        )
        return PiecewisePolynomial(two_point_coefficients(self.breaks, ends), self.breaks)
