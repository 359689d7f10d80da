"""Speed along a path: constant on each stretch, with smooth ramps between speeds.

A ramp is v = v0 + (v1 - v0)(3 u² - 2 u³), u = t/T. Its acceleration is zero at both ends and at
most 1.5 |v1 - v0| / T. Its length is (v0 + v1) T / 2.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray, checked_array
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.critical_points import horner
from knotwork.curves.polynomial.monotone import first_times
from knotwork.errors import PathError, RampError
from knotwork.errors.arguments import require_number

PROFILE_TOLERANCE = 1e-9
"""Relative difference up to which lengths, speeds or durations of a profile are equal."""

SNAP_TOLERANCE = 1e-12
"""Distance from the end of a stretch, relative to the path, within which a point is this end."""

RAMP_RESOLUTION = 1e-12
"""Minimum duration of a change of speed, relative to the path's, for the resolution of time."""


@dataclass(frozen=True, eq=False)
class Timing:
    """Timing of a tool along its path.

    >>> timing = kw.tool_paths.speed_profile([0.3], [0.05], acceleration=0.5)
    >>> round(timing.duration, 6), timing([3.0]), timing([3.0], 1)
    (6.0, array([0.15]), array([0.05]))

    Attributes:
        arc_length: Arc length over time from 0 [m], of degree 4.
        times: Times at the ends of the stretches [s], shape (n + 1,).
        full_speed_intervals: Interval in which each stretch has its full speed [s], shape (n, 2).
        speeds: Full speed of each stretch [m/s], shape (n,).
    """

    arc_length: PiecewisePolynomial
    times: FloatArray
    full_speed_intervals: FloatArray
    speeds: FloatArray

    @property
    def duration(self) -> float:
        """Duration of the path [s]."""
        return float(self.times[-1])

    @cached_property
    def _curves(self) -> tuple[PiecewisePolynomial, ...]:
        """Arc length over time, speed and its derivative."""
        return tuple(self.arc_length.derivative(order) for order in range(3))

    def __call__(self, t: ArrayLike, order: int = 0, at: ArrayLike | None = None) -> FloatArray:
        """Arc length at times, or its derivatives with respect to time.

        Args:
            t: Times [s], shape (k,).
            order: Order of the derivative, 0 to 2.
            at: Times that choose the pieces, by default t [s], shape (k,): a piece is extended
                smoothly beyond its ends.
        """
        curve, t = self._curves[order], np.asarray(t, dtype=float)
        chosen = t if at is None else np.asarray(at, dtype=float)
        piece = np.clip(np.searchsorted(curve.x, chosen, "right") - 1, 0, len(curve.x) - 2)
        return horner(curve.c[:, piece], t - curve.x[piece])

    def time_of(self, s: ArrayLike) -> FloatArray:
        """Times at which the tool reaches arc lengths [s], shape (k,); exact at stretch ends."""
        s, breaks = np.asarray(s, dtype=float), self.arc_length.x
        reached = self.arc_length(breaks)
        nearest = np.abs(s[:, None] - reached).argmin(axis=1)
        snapped = np.abs(s - reached[nearest]) <= SNAP_TOLERANCE * reached[-1]
        return np.where(snapped, breaks[nearest], first_times(self.arc_length, s))


def make_wait(duration: float, speed: float) -> Timing:
    """Make the timing of a tool that stays at the start of a path.

    Args:
        duration: Duration [s].
        speed: Reference speed [m/s].
    """
    still = PiecewisePolynomial(np.zeros((5, 1)), np.array([0.0, duration]))
    return Timing(still, still.x, np.zeros((1, 2)), np.array([speed]))


def speed_profile(
    lengths: ArrayLike,
    speeds: ArrayLike,
    *,
    acceleration: float,
    start_speed: float | None = None,
    end_speed: float | None = None,
    stops: Collection[int] = (),
) -> Timing:
    """Make the timing of a path with a speed for each stretch.

    Between two speeds, the ramp is in the faster stretch.

    Args:
        lengths: Lengths of the stretches [m], shape (n,), n >= 1.
        speeds: Their speeds [m/s], shape (n,), > 0.
        acceleration: Maximum acceleration along the path where speeds change [m/s²].
        start_speed: Speed at the start of the path [m/s]; by default that of the first stretch.
        end_speed: Speed at the end [m/s]; by default that of the last stretch.
        stops: Indices of the stretches that end at a stop.

    Raises:
        ArrayError: Arrays are not finite or have a wrong shape.
        InputError: A speed at an end is negative, or the acceleration is not positive.
        PathError: A length or speed is not positive, or time does not resolve the ramps.
        RampError: A stretch is too short for its ramps; the error has feasible values.

    >>> ends = {"start_speed": 0.0, "end_speed": 0.0}
    >>> timing = kw.tool_paths.speed_profile([0.1], [0.05], acceleration=0.5, **ends)
    >>> timing.full_speed_intervals.round(6), round(timing.duration, 6)
    (array([[0.15, 2.  ]]), 2.15)
    """
    acceleration = require_number(acceleration, "acceleration", "m/s²", positive=True)
    length, speed = _check_stretches(lengths, speeds)
    count = len(length)
    end_speed = 0.0 if count - 1 in stops and end_speed is None else end_speed
    first = speed[0] if start_speed is None else checked_end_speed(start_speed, "start_speed")
    last = speed[-1] if end_speed is None else checked_end_speed(end_speed, "end_speed")
    inner = np.minimum(speed[:-1], speed[1:])  # at a junction the lower of two speeds
    inner[[i for i in stops if i < count - 1]] = 0.0
    junction_speeds = [float(first), *inner.tolist(), float(last)]
    totals = np.concatenate(([0.0], np.cumsum(length)))
    breaks, times = [0.0], [0.0]
    coefficients, full_speed_intervals, ramps = [], [], []
    for i, (v, ends) in enumerate(zip(speed.tolist(), pairwise(junction_speeds), strict=True)):
        fixed = i == 0 and start_speed is not None, i == count - 1 and end_speed is not None
        stretch = i if count > 1 else None
        shrink = _find_shortening(stretch, float(length[i]), v, ends, fixed, acceleration)
        pieces = _make_pieces(totals[i : i + 2], v, ends, acceleration / shrink)
        starts = times[-1] + np.concatenate(([0.0], np.cumsum([T for T, _ in pieces])))
        full_speed_intervals.append(starts[1:3])
        for end, (_, c) in zip(starts[1:].tolist(), pieces, strict=True):
            if end > breaks[-1]:
                breaks.append(end)
                coefficients.append(c)
        times.append(float(starts[-1]))
        ramps += [pieces[0][0], pieces[2][0]]
    _check_resolved(ramps, np.diff(times), speed)
    arc_length = PiecewisePolynomial(np.array(coefficients).T, breaks)
    return Timing(arc_length, np.array(times), np.array(full_speed_intervals), speed)


def _check_resolved(ramps: list[float], durations: FloatArray, speeds: FloatArray) -> None:
    """Refuse a ramp or stretch [s] that is too short for the duration of the path.

    A piece of constant speed between ramps may be short.
    """
    shortest = min(T for T in (*ramps, *durations) if T > 0.0)
    min_duration = RAMP_RESOLUTION * float(durations.sum())
    if shortest >= min_duration:
        return
    k = int(durations.argmax())
    # the duration of a ramp is proportional to the speed, that of the path inversely
    raise PathError(
        f"stretch {k + 1} takes {durations[k]:.6g} s at {speeds[k]:.6g} m/s: too slow to resolve "
        f"its changes of speed in time, which take {shortest:.3g} s; accepted: at least "
        f"{math.sqrt(min_duration / shortest) * speeds[k]:.6g} m/s"
    )


def _check_stretches(lengths: ArrayLike, speeds: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Check lengths [m] and speeds [m/s] of stretches: positive, shape (n,) each, n >= 1."""
    count = len(np.atleast_1d(np.asarray(lengths)))
    length = checked_array(lengths, (count,), "lengths")
    speed = checked_array(speeds, (count,), "speeds")
    for quantity, values, unit in (("length", length, "m"), ("speed", speed, "m/s")):
        if (values <= 0.0).any():
            i = int((values <= 0.0).argmax())
            raise PathError(
                f"{quantity} of stretch {i + 1} is {values[i]:.9g} {unit}; "
                "it must be greater than 0"
            )
    if not count:
        raise PathError("no stretches are given; a path needs at least one")
    return length, speed


def _make_pieces(
    s: FloatArray, v: float, ends: tuple[float, float], acceleration: float
) -> list[tuple[float, list[float]]]:
    """Make the pieces of a stretch from s[0] to s[1]: durations and coefficients of arc length."""
    # Speeds that are equal within rounding have no ramp, because it would be too short.
    v0, v1 = (v if math.isclose(v, end, rel_tol=PROFILE_TOLERANCE) else end for end in ends)
    T0, T1 = (1.5 * abs(v - end) / acceleration for end in (v0, v1))
    covered = 0.5 * (v0 + v) * T0, 0.5 * (v + v1) * T1
    even = (float(s[1] - s[0]) - sum(covered)) / v
    even = even if even > PROFILE_TOLERANCE * (T0 + T1) else 0.0
    return [
        (T0, _make_ramp(v0, v, T0, float(s[0]))),
        (even, [0.0, 0.0, 0.0, v, s[0] + covered[0]]),
        (T1, _make_ramp(v, v1, T1, float(s[1]) - covered[1])),
    ]


def checked_end_speed(speed: float, name: str) -> float:
    """Return a speed at an end of the path [m/s], 0 or greater."""
    return require_number(speed, name, "m/s", minimum=0.0)


def _find_shortening(
    stretch: int | None,
    length: float,
    v: float,
    ends: tuple[float, float],
    fixed: tuple[bool, bool],
    acceleration: float,
) -> float:
    """Find the factor, 1 or just below, by which the ramps of a stretch are shortened.

    Raises:
        RampError: The ramps are longer than the stretch.
    """
    part = 0.75 * sum(abs(v**2 - end**2) for end in ends)
    needed = part / acceleration
    if needed <= length:
        return 1.0
    if needed <= length * (1.0 + PROFILE_TOLERANCE):
        return length / needed
    highest = _find_highest_speed(length, ends, fixed, acceleration)
    min_acceleration = part / length
    if highest is not None and highest >= v:  # the ends are faster, so a lower speed does not help
        highest = None
    named = "the path" if stretch is None else f"stretch {stretch + 1}"
    slower = f"a speed of at most {highest:.6g} m/s, " if highest else ""
    raise RampError(
        f"{named} is {length:.6g} m long, but to reach {v:.6g} m/s and leave it again "
        f"takes {needed:.6g} m; accepted: {slower}an acceleration of at least "
        f"{min_acceleration:.6g} m/s² or a longer stretch",
        stretch=stretch or 0,
        length=length,
        needed=needed,
        highest_speed=highest,
        lowest_acceleration=min_acceleration,
    )


def _find_highest_speed(
    length: float, ends: tuple[float, float], fixed: tuple[bool, bool], acceleration: float
) -> float | None:
    """Find the maximum feasible speed of a stretch; `None` if no speed is feasible.

    Speeds at fixed ends are kept, and neighbours adapt to it.
    """
    (low, _), (high, high_fixed) = sorted(zip(ends, fixed, strict=True))
    reach = 4.0 * acceleration * length / 3.0
    if reach >= high**2 - low**2:
        return math.sqrt(0.5 * (reach + low**2 + high**2))
    return None if high_fixed else math.sqrt(low**2 + reach)


def _make_ramp(v0: float, v1: float, T: float, offset: float) -> list[float]:
    """Make the coefficients of arc length on a ramp, highest power first."""
    change = v1 - v0
    return [-0.5 * change / T**3, change / T**2, 0.0, v0, offset] if T > 0.0 else []
