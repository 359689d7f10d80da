"""The noise of a log, estimated from the log itself.

Each sample is compared with the cubic through its four neighbours, two on each side, at the times
recorded. A smooth motion has no such residual, so it comes from the noise of the five values and
from errors of their times. With independent errors its variance is

    (1 + sum w²) (σ² + v² τ²)

where w are the weights of the neighbours, σ is the noise of the joint, v its velocity, and τ the
jitter of the time stamps, which all joints share. Non-negative least squares find σ and τ from the
median residuals of each joint, in groups of samples of similar speed. Thus jumps and wrong samples
hardly count. σ is at least the rounding error, which is the last digit divided by √12.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from knotwork.arrays import FloatArray
from knotwork.errors.arguments import require_number
from knotwork.verification.recording.log_reading import Recording

SPEED_GROUPS = 8
"""Maximum number of groups of samples of a joint by speed."""
MIN_IN_GROUP = 8
"""Minimum number of samples in a group."""
WEIGHT_ROUNDS = 10
"""Number of fits; each is weighted by the variances that the previous fit predicts."""
MEDIAN_RATIO = 1.4826
"""Standard deviation of normally distributed numbers, relative to their median magnitude."""
DIGIT_ERROR = 12.0**-0.5
"""Standard deviation of rounding to a digit, relative to the digit."""
MIN_NOISE = 1e-12
"""Lower bound of the noise [rad or m]."""


@dataclass(frozen=True, eq=False)
class Noise:
    """Errors of samples, as standard deviations.

    Attributes:
        position: Noise of each joint's positions [rad or m], shape (d,).
        jitter: Jitter of the time stamps [s].
        stated: Whether the noise was given, not estimated.
    """

    position: FloatArray
    jitter: float
    stated: bool

    def of_samples(self, slopes: FloatArray) -> FloatArray:
        """Standard deviation of each sample, from the largest velocity next to it, shape (n, d)."""
        # at starts and stops, the slope at a sample is too small; its neighbours have the right one
        fast = largest_near(np.abs(slopes), 2)
        return np.sqrt(self.position**2 + (fast * self.jitter) ** 2)


def noise_of(log: Recording, stated: float | None = None) -> Noise:
    """Estimate the noise of a log, or use a given noise of positions.

    Args:
        log: The log.
        stated: Standard deviation of all positions [rad or m], jitter included.

    Raises:
        InputError: The given noise is not a positive number.
    """
    floor = np.maximum(log.resolution * DIGIT_ERROR, MIN_NOISE)
    sigma, jitter = _by_speed(*_residuals(log.time, log.position), floor)
    position = np.maximum(sigma, floor)
    if stated is not None:
        size = require_number(stated, "noise", "rad or m", positive=True)
        position, jitter = np.full_like(position, size), 0.0
    return Noise(position, jitter, stated is not None)


def largest_near(values: FloatArray, steps: int, axis: int = 0) -> FloatArray:
    """The maximum of each value and its neighbours, up to some steps away along an axis."""
    from scipy.ndimage import maximum_filter1d

    return np.asarray(maximum_filter1d(values, 2 * steps + 1, axis=axis, mode="nearest"))


def slopes_of(time: FloatArray, values: FloatArray) -> FloatArray:
    """Rough velocities at samples, from the neighbours two before and two after, shape (n, d)."""
    n = len(time)
    low, high = np.maximum(np.arange(n) - 2, 0), np.minimum(np.arange(n) + 2, n - 1)
    return np.asarray((values[high] - values[low]) / (time[high] - time[low])[:, None])


def _residuals(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Residual of each inner sample, scaled to its own noise, and its velocity, (n - 4, d)."""
    neighbours = [0, 1, 3, 4]
    offset = sliding_window_view(time, 5)[:, neighbours].T - time[2:-2]
    around = sliding_window_view(values, 5, axis=0)[:, :, neighbours]
    weights = np.stack(
        [
            np.prod([-offset[j] / (offset[i] - offset[j]) for j in range(4) if j != i], axis=0)
            for i in range(4)
        ]
    )
    misses = values[2:-2] - np.einsum("kdi,ik->kd", around, weights)
    residuals = misses / np.sqrt(1.0 + (weights**2).sum(axis=0))[:, None]
    # Next to a gap a neighbour is far away, so a cubic is not meaningful.
    far = np.abs(offset).max(axis=0) > 4.0 * np.median(np.diff(time))
    residuals[far] = np.nan
    return np.asarray(residuals), slopes_of(time, values)[2:-2]


def _by_speed(
    residuals: FloatArray, slopes: FloatArray, floor: FloatArray
) -> tuple[FloatArray, float]:
    """Noise of each joint and their common jitter, from the variances of groups.

    The error of a variance is relative to the variance, so each group is weighted by one over the
    square of the expected variance. With measured variances instead, small ones would count too
    much, and the noise of short logs would come out a third too small.
    """
    from scipy.optimize import nnls

    count = residuals.shape[1]
    rows: list[FloatArray] = []
    variances: list[float] = []
    for j in range(count):
        # constant values are rounded and have no information on their noise
        moving = np.flatnonzero(np.isfinite(residuals[:, j]) & (residuals[:, j] != 0.0))
        by_speed = moving[np.argsort(np.abs(slopes[moving, j]), kind="stable")]
        groups = min(SPEED_GROUPS, len(moving) // MIN_IN_GROUP)
        for group in np.array_split(by_speed, groups) if groups else ():
            row = np.zeros(count + 1)
            row[j], row[count] = 1.0, float(np.median(slopes[group, j] ** 2))
            size = MEDIAN_RATIO * float(np.median(np.abs(residuals[group, j])))
            rows.append(row)
            variances.append(max(size, float(floor[j])) ** 2)
    if not rows:
        return np.zeros(count), 0.0
    matrix, solution = np.array(rows), np.zeros(count + 1)
    expected = measured = np.array(variances)
    for _ in range(WEIGHT_ROUNDS):
        weighted = matrix / expected[:, None]
        scale = np.maximum(weighted.max(axis=0), np.finfo(float).tiny)
        solution = nnls(weighted / scale, measured / expected)[0] / scale
        expected = np.maximum(matrix @ solution, measured.min())
    sigma = np.sqrt(solution)
    return np.asarray(sigma[:count]), float(sigma[count])
