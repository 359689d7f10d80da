"""Sample times at a fixed rate, and a trajectory's values at them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import InputError
from knotwork.errors.arguments import require_number

SAMPLE_COINCIDENCE = 1e-6
"""Minimum last step, relative to a period. The end replaces a sample that is closer."""

MAX_SAMPLES = 20_000_000
"""Maximum number of samples. Each takes 32 bytes per joint."""

MIN_PERIOD = 16
"""Minimum ratio of a sample period to the resolution of the times."""


@dataclass(frozen=True, eq=False)
class Knots:
    """The knots of a trajectory: its breaks, with the states there.

    For degree three or less they define the whole curve.

    Attributes:
        time: Times [s], shape (m,), strictly increasing.
        position: Positions [rad or m], shape (m, d).
        velocity: Velocities [rad/s or m/s], shape (m, d).
        acceleration: Accelerations [rad/s² or m/s²], shape (m, d); of the next piece at a jump.
    """

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, eq=False)
class Samples(Knots):
    """A trajectory at a sequence of times, with the values of `Knots` and the jerk.

    Attributes:
        jerk: Jerks [rad/s³ or m/s³], shape (s, d); at a break that of the next piece.
    """

    jerk: FloatArray


def make_sample_times(
    start: float, end: float, rate: float, max_samples: int = MAX_SAMPLES
) -> FloatArray:
    """Make times at intervals of 1/rate from the start on, and the end time."""
    rate = require_number(rate, "the sample rate", "Hz", positive=True)
    duration = end - start
    periods = duration * rate
    if periods > max_samples - 1:
        max_rate = 0.999 * (max_samples - 1) / duration
        raise InputError(
            f"a rate of {rate:g} Hz over {duration:g} s gives {periods:.3g} samples; at most "
            f"{max_samples} are taken: a rate up to {max_rate:.4g} Hz is accepted"
        )
    resolution = math.ulp(max(abs(start), abs(end)))
    if periods > 1.0 and 1.0 / rate < MIN_PERIOD * resolution:
        raise InputError(
            f"at a rate of {rate:g} Hz the samples are too close for times near {end:g} s, which "
            f"are resolved to {resolution:.3g} s; choose at most "
            f"{1.0 / (MIN_PERIOD * resolution):.6g} Hz"
        )
    count = max(1, math.ceil(periods - max(SAMPLE_COINCIDENCE, 2.0 * resolution * rate)))
    time = np.empty(count + 1)
    np.divide(np.arange(count), rate, out=time[:-1])
    time[:-1] += start
    time[-1] = end
    return time
