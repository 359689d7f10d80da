"""Utilisation of each limit along a path, as a fraction of it: as planned, and at any speeds.

Along a path q(s) and its derivatives are computed once. With q̇ = q' ṡ, q̈ = q'' ṡ² + q' s̈ and
q⃛ = q''' ṡ³ + 3 q'' ṡ s̈ + q' s⃛ the ratio of each quantity to its limit is a sum,

    at rest + by_speed ṡ^order + by_acceleration s̈ + by_both ṡ s̈ + by_jerk s⃛,

whose five terms depend on s alone. For the acceleration of a joint, of order 2, they are 0, q'',
q', 0 and 0, divided by its limit. Ratios are vectors of three components, of which joints use one;
their norm is the utilisation.
"""

from __future__ import annotations

from typing import cast

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.interpolation import ModifiedHermiteSpline
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.tool_paths import TimedPath, Timing, speed_profile
from knotwork.joint_quantities import MOTION_QUANTITIES
from knotwork.planning.choosing.solved_scenario import SolvedScenario
from knotwork.planning.task_to_joint import knots_of
from knotwork.planning.timing.state_limits import TOOL_SPEED, LimitedQuantity, StateLimits
from knotwork.robot.kinematics.following.joints_on_path import JointsOnPath
from knotwork.task.scenario import ScenarioPath

PIECE_FRACTIONS = np.array([1e-6, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0 - 1e-6])
"""Evaluation points in each piece of a curve: both ends, where it may jump, and points between
them.
"""

TIMING_FRACTIONS = np.linspace(1e-6, 1.0 - 1e-6, 33)
"""Evaluation points in each piece of a timing."""

TOOL_MARGIN = 1e-3
"""Fraction by which the tool stays below its limit along a path, as a margin for the approach."""

MIDDLE_HALF_WIDTH = 0.25
"""Half width of the middle of a stretch, as a fraction of its length."""

CONSTANT_SPEED_PART = 1
"""Index of the part of a stretch with its own speed."""


def path_state_limits(solved: SolvedScenario, path: ScenarioPath) -> StateLimits:
    """The limits of joint states on a path, whose load the efforts depend on."""
    joints, limits = solved.joints, solved.scenario.motion_limits
    frames = {LimitedQuantity(link, name): limit for name, link, limit in limits.frame_limits}
    if TOOL_SPEED in frames:
        frames[TOOL_SPEED] *= 1.0 - TOOL_MARGIN
    dynamics = solved.dynamics[path.first]
    robot = joints.robot if dynamics is None else dynamics.robot
    return StateLimits(joints.joint_names, joints.limits, robot, frames)


def planned_utilisation(
    solved: SolvedScenario, path: ScenarioPath, limits: StateLimits
) -> FloatArray:
    """Largest utilisation by the planned motion on each part of a path, shape (n, 3, m).

    Args:
        solved: A scenario with known speeds along its paths.
        path: The path in this scenario.
        limits: Its limits.
    """
    rows, points = solved.rows, solved.joint_waypoints
    inserted = slice(rows[path.first], rows[path.last] + 1)
    time, q, v, a = (
        np.asarray(values)[inserted]
        for values in (points.time, points.position, points.velocity, points.acceleration)
    )
    curve = ModifiedHermiteSpline(time, q, v, knots=knots_of(solved.scenario), acceleration=a)
    t = _sample_points(curve)
    ends = path.timed_path.start_time + _parts(path.timed_path.timing)
    return _largest_by_part(limits.utilisation(curve, t), t, ends)


def _sample_points(curve: PiecewisePolynomial) -> FloatArray:
    """Parameters of a curve at `PIECE_FRACTIONS` of its pieces, shape (n,)."""
    return np.ravel(curve.x[:-1, None] + np.diff(curve.x)[:, None] * PIECE_FRACTIONS)


def _parts(timing: Timing) -> FloatArray:
    """Start times of the parts of n stretches, and the end time of the last [s], shape (3n + 1,).

    A stretch has a change of speed at its start, its own speed, and a change of speed at its end.
    """
    return np.append(
        np.column_stack((timing.times[:-1], timing.full_speed_intervals)), timing.times[-1]
    )


def _largest_by_part(utilisation: FloatArray, x: FloatArray, ends: FloatArray) -> FloatArray:
    """Largest utilisation on each part of n stretches, shape (n, 3, m).

    Args:
        utilisation: Utilisation of each limit, shape (k, m).
        x: Parameters of these values, shape (k,).
        ends: Ends of the parts, as from `_parts`.
    """
    largest = np.zeros((len(ends) - 1, utilisation.shape[1]))
    index = np.clip(np.searchsorted(ends, x, "right") - 1, 0, len(largest) - 1)
    np.maximum.at(largest, index, utilisation)
    return largest.reshape(-1, 3, utilisation.shape[1])


class PathUtilisation:
    """Utilisation of each limit along a path, at any speeds and without another solution.

    Args:
        solved: The scenario and its IK solutions.
        path: One of its paths.

    Attributes:
        limits: The limits of joint states on it, m in total.
        orders: Powers of the speed with which the limited quantities grow, shape (m,).
    """

    def __init__(self, solved: SolvedScenario, path: ScenarioPath) -> None:
        self.limits = limits = path_state_limits(solved, path)
        self.orders = np.array([limited.order for limited in limits.quantities])
        lengths = path.requested.lengths
        # at 1 m/s time is the arc length
        timing = speed_profile(lengths, np.ones(len(lengths)), acceleration=1.0)
        followed = cast(JointsOnPath, solved.solution.tracks[path.first].followed)
        curve = followed.with_timing(TimedPath(path.timed_path.tool_path, timing)).curve
        joint_count = len(limits.joint_names)
        self._s = _sample_points(curve)  # shape (k,)
        orders = range(len(MOTION_QUANTITIES))
        # positions and their derivatives by s, shape (k, d) each
        q, *derivatives = (curve(self._s, order)[:, :joint_count] for order in orders)
        (d1, d2, *_), zero = derivatives, np.zeros_like(q)
        at_rest = limits.ratios(q)  # shape (k, m, 3), as of the other terms
        by_speed, by_acceleration, by_both, by_jerk = (
            limits.ratios(q, *rates) - at_rest
            for rates in (derivatives, (zero, d1), (zero, zero, 3.0 * d2), (zero, zero, d1))
        )
        # shape (5, k, m, 3)
        self._terms = np.stack((at_rest, by_speed, by_acceleration, by_both, by_jerk))
        self._ends = timing.times

    def with_timing(self, timing: Timing) -> FloatArray:
        """Largest utilisation on each part of n stretches with a timing, shape (n, 3, m)."""
        curve = timing.arc_length
        t = (curve.x[:-1, None] + np.diff(curve.x)[:, None] * TIMING_FRACTIONS).ravel()
        t = np.union1d(t, np.interp(self._s, curve(t), t))
        s = curve(t)  # shape (l,)
        # linear interpolation; very short pieces may have equal points
        after = np.clip(np.searchsorted(self._s, s), 1, len(self._s) - 1)
        low, high = self._s[after - 1], self._s[after]
        weight = np.clip((s - low) / (high - low), 0.0, 1.0)[:, None, None]
        terms = (1.0 - weight) * self._terms[:, after - 1] + weight * self._terms[:, after]
        at_rest, by_speed, by_acceleration, by_both, by_jerk = terms  # shape (l, m, 3) each
        v, a, j = (curve(t, order)[:, None, None] for order in (1, 2, 3))
        ratios = at_rest + by_speed * v ** self.orders[:, None]
        ratios += by_acceleration * a + by_both * v * a + by_jerk * j
        return _largest_by_part(np.linalg.norm(ratios, axis=-1), t, _parts(timing))

    def max_speeds(self, allowed: FloatArray) -> FloatArray:
        """Maximum constant speeds in the middle of each stretch [m/s], in closed form.

        Near its ends the speed may change.

        Args:
            allowed: Largest permitted utilisation of each limit on each stretch, shape (n, m).

        Returns:
            The speed that each limit allows on each stretch, shape (n, m).
        """
        at_rest, by_speed, *_ = self._terms
        sizes = np.linalg.norm(by_speed, axis=-1)  # shape (k, m)
        at_rest = (at_rest * np.sign(by_speed)).sum(axis=-1)  # only efforts are not 0 at rest
        # the stretch of each sample point
        index = np.clip(np.searchsorted(self._ends, self._s) - 1, 0, len(allowed) - 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            unused = np.maximum(allowed[index] - at_rest, 0.0)
            speeds = np.where(sizes > 0.0, unused / sizes, np.inf) ** (1.0 / self.orders)
        fraction = (self._s - self._ends[index]) / np.diff(self._ends)[index]
        index[np.abs(fraction - 0.5) > MIDDLE_HALF_WIDTH] = -1
        return np.array([speeds[index == k].min(axis=0) for k in range(len(allowed))])
