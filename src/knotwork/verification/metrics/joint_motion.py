"""Metrics of a joint motion: misses, jumps, peaks, fluctuation, effort.

Extrema, variations and integrals come from the polynomials; only the integral of the effort is
numerical.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial.extrema import locate_extremum_candidates
from knotwork.curves.polynomial.splitting import split_at
from knotwork.curves.trajectory import JointTrajectory
from knotwork.waypoints import JointWaypoints

if TYPE_CHECKING:
    from knotwork.robot import Robot


@dataclass(frozen=True)
class Peak:
    """Peak magnitude of a quantity: of the joint nearest its limit, or else the largest.

    Attributes:
        value: Magnitude, in the unit of the quantity.
        joint: Name of the joint.
        time: Time of the peak [s].
        utilisation: Magnitude relative to the limit; `None` if no joint has one.
    """

    value: float
    joint: str
    time: float
    utilisation: float | None


def position_miss(trajectory: JointTrajectory, waypoints: JointWaypoints) -> float:
    """Largest distance of a joint from a waypoint at its time [rad or m].

    >>> task = kw.JointWaypoints(["lift"], [0, 1, 2], [[0], [1], [0]], [[0], [0.5], [0]])
    >>> position_miss(kw.interpolation.get_planner("cubic")(task), task)
    0.0
    >>> round(position_miss(kw.interpolation.get_planner("parabolic-blend")(task), task), 6)
    0.1

    Args:
        trajectory: The motion.
        waypoints: The waypoints.

    Raises:
        TimeRangeError: A waypoint lies outside the motion's time.
    """
    return float(np.abs(trajectory.position(waypoints.time) - waypoints.position).max())


def velocity_miss(trajectory: JointTrajectory, waypoints: JointWaypoints) -> float:
    """Largest difference of a joint's velocity from its waypoint's [rad/s or m/s].

    >>> task = kw.JointWaypoints(["lift"], [0, 1, 2], [[0], [1], [0]], [[0], [0.5], [0]])
    >>> velocity_miss(kw.interpolation.get_planner("cubic")(task), task)
    0.0
    >>> round(velocity_miss(kw.interpolation.get_planner("bspline")(task), task), 6)
    0.5

    Args:
        trajectory: The motion.
        waypoints: The waypoints.

    Raises:
        TimeRangeError: A waypoint lies outside the motion's time.
    """
    return float(np.abs(trajectory.velocity(waypoints.time) - waypoints.velocity).max())


def acceleration_jump(trajectory: JointTrajectory) -> float:
    """Largest jump of a joint's acceleration at a break [rad/s² or m/s²].

    >>> task = kw.JointWaypoints(["lift"], [0, 1, 2], [[0], [1], [0]], [[0], [0.5], [0]])
    >>> round(acceleration_jump(kw.interpolation.get_planner("cubic")(task)), 6)
    4.0
    >>> round(acceleration_jump(kw.interpolation.get_planner("modified-hermite")(task)), 6)
    0.0

    Args:
        trajectory: The motion.
    """
    return float(np.abs(trajectory.polynomial.jumps(2)).max(initial=0.0))


def end_acceleration(trajectory: JointTrajectory) -> float:
    """Largest magnitude of a joint's acceleration at start and end [rad/s² or m/s²].

    >>> task = kw.JointWaypoints(["lift"], [0, 1, 2], [[0], [1], [0]], [[0], [0.5], [0]])
    >>> round(end_acceleration(kw.interpolation.get_planner("cubic")(task)), 6)
    7.0
    >>> round(end_acceleration(kw.interpolation.get_planner("quintic")(task)), 6)
    0.0

    Args:
        trajectory: The motion.
    """
    ends = trajectory.acceleration([trajectory.start_time, trajectory.end_time])
    return float(np.abs(ends).max())


def peak(trajectory: JointTrajectory, order: int, limit: FloatArray) -> Peak:
    """Find the peak of a derivative.

    >>> motion = kw.plan("paper_case").trajectory
    >>> found = peak(motion, 1, limit=np.array([0.5]))
    >>> found.joint, round(found.value, 3), round(found.utilisation, 3)
    ('joint_1', 0.207, 0.413)

    Args:
        trajectory: The motion.
        order: Order of the derivative.
        limit: Magnitude limit of each joint, infinite where there is none, shape (d,).
    """
    extrema = trajectory.polynomial.extrema(order)
    limited = np.isfinite(limit)
    worst = int(np.argmax(extrema.peak / limit if limited.any() else extrema.peak))
    return Peak(
        float(extrema.peak[worst]),
        trajectory.joint_names[worst],
        float(extrema.peak_time[worst]),
        float(extrema.peak[worst] / limit[worst]) if limited.any() else None,
    )


def velocity_fluctuation(trajectory: JointTrajectory, waypoints: JointWaypoints) -> FloatArray:
    """Variation of each joint's velocity beyond the minimum of its task [rad/s or m/s], shape (d,).

    On the interval between two waypoints, with given velocities v₀ and v₁ at its ends and the mean
    velocity m = Δq/h of its displacement, every motion has a variation of at least
    `|m − v₀| + |m − v₁|`. The velocity has its mean value somewhere, so it changes from v₀ to m and
    from m to v₁. The excess is the fluctuation,

        F = |v(t₀) − v₀| + ∫ |a| dt + |v₁ − v(t₁)| − |m − v₀| − |m − v₁| ≥ 0,

    where velocities missed at the waypoints count as instantaneous changes. The displacement is
    that of the motion: a miss of position is a separate metric. The fluctuation of a joint is the
    sum over the intervals. A velocity that changes monotonically from v₀ to v₁, or is constant, has
    zero fluctuation.

    >>> task = kw.JointWaypoints(["lift"], [0, 1, 2], [[0], [1], [0]], [[0], [0.5], [0]])
    >>> for name in "cubic", "quintic":
    ...     planner = kw.interpolation.get_planner(name)
    ...     print(velocity_fluctuation(planner(task), task).round(3))
    [2.044]
    [3.54]

    Args:
        trajectory: The motion.
        waypoints: The waypoints.
    """
    inside = waypoints.time[1:-1]
    curve = split_at(trajectory.polynomial, inside)
    values, _ = locate_extremum_candidates(curve.x, curve.derivative().c)
    variation = np.abs(np.diff(values, axis=0)).sum(axis=0)
    # A jump of velocity inside an interval is a variation as well. At a waypoint it is a miss.
    jumps = np.abs(values[0, 1:] - values[-1, :-1])
    variation[:-1] += np.where(np.isin(curve.x[1:-1], inside)[:, np.newaxis], 0.0, jumps)

    first = np.searchsorted(curve.x, waypoints.time[:-1])
    last = np.append(first[1:] - 1, curve.x.size - 2)
    total = np.add.reduceat(variation, first, axis=0)
    start, end = values[0, first], values[-1, last]
    mean = np.diff(curve(waypoints.time), axis=0) / np.diff(waypoints.time)[:, np.newaxis]
    v0, v1 = waypoints.velocity[:-1], waypoints.velocity[1:]
    forced = np.abs(mean - v0) + np.abs(mean - v1)
    actual = np.abs(start - v0) + total + np.abs(v1 - end)
    return np.asarray(np.maximum(actual - forced, 0.0).sum(axis=0))


def squared_effort(robot: Robot, trajectory: JointTrajectory) -> float:
    """Integral over time of the sum of the joints' efforts squared [N² m² s].

    It uses Gauss-Legendre quadrature with six nodes in each piece.

    >>> plan = kw.plan("ur5_deburring")
    >>> squared_effort(plan.joints.robot, plan.trajectory) > 0
    True

    Args:
        robot: The arm, with its tool.
        trajectory: The motion.
    """
    times, weights = _quadrature(trajectory.breaks, 6)
    states = zip(*(trajectory.polynomial(times, order) for order in range(3)), strict=True)
    return float(weights @ [(robot.effort(*state) ** 2).sum() for state in states])


def integral_of_square(trajectory: JointTrajectory, order: int) -> float:
    """Integral over time of the square of a derivative, summed over the joints.

    >>> lift = kw.JointTrajectory.from_knots(["lift"], [0, 1], [[0], [1]], [[0], [0]])
    >>> round(integral_of_square(lift, 2), 6)
    12.0

    Args:
        trajectory: The motion.
        order: Order of the derivative.
    """
    curve = trajectory.polynomial.derivative(order)
    times, weights = _quadrature(curve.x, curve.degree + 1)  # exact for the square
    return float(weights @ (curve(times) ** 2).sum(axis=1))


def _quadrature(breaks: FloatArray, nodes: int) -> tuple[FloatArray, FloatArray]:
    """Times and weights [s] of Gauss-Legendre quadrature, with some nodes in each piece."""
    points, weights = np.polynomial.legendre.leggauss(nodes)
    half = 0.5 * np.diff(breaks)[:, np.newaxis]
    return (breaks[:-1, np.newaxis] + half * (1.0 + points)).ravel(), (half * weights).ravel()
