"""Utilisation of each limit, as a fraction of it: of given states, and along a path at any speeds.

Along a path q(s) and its derivatives are computed once. With q̇ = q' ṡ, q̈ = q'' ṡ² + q' s̈ and
q⃛ = q''' ṡ³ + 3 q'' ṡ s̈ + q' s⃛ every utilisation then follows from ṡ, s̈ and s⃛.
"""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.curves.interpolation import ModifiedHermiteSpline
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.tool_paths import TimedPath, Timing, speed_profile
from knotwork.joint_quantities import RATE_QUANTITIES
from knotwork.planning.choosing.free_sections import FreeTask
from knotwork.planning.task_to_joint import knots_of
from knotwork.robot import Robot
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


class SpeedBound(NamedTuple):
    """A bound of a speed along a path: a limit of a joint, a frame or the tool, or another one.

    Attributes:
        subject: Name of a joint or a frame; empty for the tool and for other bounds.
        quantity: Limited quantity, or name of the bound.
        order: Power of the speed along a path with which it grows; 0 for other bounds.
        size: Number of components of the quantity.
    """

    subject: str
    quantity: str
    order: int = 0
    size: int = 1


class LimitUtilisation:
    """Utilisation of each limit of a task by joint states on a path; 1 is the limit.

    Args:
        solved: The scenario and its IK solutions.
        path: The path, whose load the efforts depend on.

    Attributes:
        bounds: The limits, length m: velocity, acceleration and jerk of each joint come first.
        orders: Powers of the speed with which they grow, shape (m,).
    """

    def __init__(self, solved: FreeTask, path: ScenarioPath) -> None:
        space, motion = solved.space, solved.scenario.motion_limits
        self.robot = robot = cast(Robot, space.robot)  # only robots follow paths
        self._joint_limits = space.limits
        efforts = bool(np.isfinite(space.limits["effort"]).any())
        self._effort = solved.dynamics(path.first) if efforts else None
        orders = dict(zip(RATE_QUANTITIES, (1, 2, 3), strict=True)) | (
            {"effort": 2} if efforts else {}
        )
        limits = [
            SpeedBound(j, name, order) for name, order in orders.items() for j in space.joint_names
        ]
        velocity, acceleration = pin.getFrameVelocity, pin.getFrameClassicalAcceleration
        frames = [
            (SpeedBound(frame.frame, "speed", 1, 3), velocity, frame.speed)
            for frame in motion.frame_speeds
        ]
        if motion.tool_speed is not None:
            bound = (1.0 - TOOL_MARGIN) * motion.tool_speed
            frames.append((SpeedBound("", "tool speed", 1, 3), velocity, bound))
        if motion.tool_acceleration is not None:
            bound = motion.tool_acceleration
            frames.append((SpeedBound("", "tool acceleration", 2, 3), acceleration, bound))
        self.bounds = (*limits, *(limit for limit, _, _ in frames))
        self._frames = [
            (
                robot.frame_index(limit.subject) if limit.subject else robot.require_tool(),
                read,
                bound,
            )
            for limit, read, bound in frames
        ]
        sizes = np.array([limit.size for limit in self.bounds])
        self.starts = np.cumsum(sizes) - sizes
        self.orders = np.array([limit.order for limit in self.bounds])

    def components(self, q: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray) -> FloatArray:
        """Signed components of the quantities, each divided by its limit, shape (n, c).

        Args:
            q: Joint positions, shape (n, d).
            v: Joint velocities, shape (n, d).
            a: Joint accelerations, shape (n, d).
            j: Joint jerks, shape (n, d).
        """
        limits = self._joint_limits
        columns = [
            rate / limits[name] for name, rate in zip(RATE_QUANTITIES, (v, a, j), strict=True)
        ]
        if self._effort is not None:
            columns.append(self._effort.effort(q, v, a) / limits["effort"])
        if self._frames:
            columns.append(np.array([self._of_frames(*row) for row in zip(q, v, a, strict=True)]))
        return np.hstack(columns)

    def _of_frames(self, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        model, data = self.robot.model, self.robot.data
        pin.forwardKinematics(model, data, q, v, a)
        axes = pin.LOCAL_WORLD_ALIGNED
        return np.concatenate(
            [read(model, data, frame, axes).linear / bound for frame, read, bound in self._frames]
        )

    def combine(self, components: FloatArray) -> FloatArray:
        """Utilisation of each limit, shape (n, m), from components of shape (n, c)."""
        return np.asarray(np.sqrt(np.add.reduceat(components**2, self.starts, axis=1)))

    def of_motion(self, solved: FreeTask, path: ScenarioPath) -> FloatArray:
        """Largest utilisation by the planned motion on each part of a path, shape (n, 3, m).

        Args:
            solved: A scenario with known speeds along its paths.
            path: The path in this scenario.
        """
        rows, points = solved.rows, solved.waypoints
        inserted = slice(rows[path.first], rows[path.last] + 1)
        time, q, v, a = (
            np.asarray(values)[inserted]
            for values in (points.time, points.position, points.velocity, points.acceleration)
        )
        curve = ModifiedHermiteSpline(time, q, v, knots=knots_of(solved.scenario), acceleration=a)
        t, *states = _states(curve)
        ends = path.motion.start_time + _parts(path.motion.timing)
        return _largest_by_part(self.combine(self.components(*states)), t, ends)


def _states(curve: PiecewisePolynomial) -> tuple[FloatArray, ...]:
    """Sample a curve: parameters, and the value and three derivatives there."""
    x = (curve.x[:-1, None] + np.diff(curve.x)[:, None] * PIECE_FRACTIONS).ravel()
    return x, *(curve(x, order) for order in range(4))


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
        limits: Utilisation of its limits by states.
    """

    def __init__(self, solved: FreeTask, path: ScenarioPath, limits: LimitUtilisation) -> None:
        self._limits, lengths = limits, path.requested.lengths
        # at 1 m/s time is the arc length
        timing = speed_profile(lengths, np.ones(len(lengths)), acceleration=1.0)
        unit = TimedPath(path.motion.path, timing)
        robot, start, pull = solved.solution.starts[path.first]
        self._s, *states = _states(JointsOnPath(robot, unit, start, pull).curve)
        q, d1, d2, d3 = (values[:, : limits.robot.dof] for values in states)
        zero = np.zeros_like(q)
        at_rest = limits.components(q, zero, zero, zero)
        # the factors of 1, ṡ to the power of the order, s̈, ṡ s̈ and s⃛
        factors = ((d1, d2, d3), (zero, d1, zero), (zero, zero, 3.0 * d2), (zero, zero, d1))
        terms = [limits.components(q, *factor) - at_rest for factor in factors]
        self._terms = np.stack([at_rest, *terms], axis=1)
        self._powers = np.repeat(limits.orders, [limit.size for limit in limits.bounds])
        self._ends = timing.times

    def with_timing(self, timing: Timing) -> FloatArray:
        """Largest utilisation on each part of n stretches with a timing, shape (n, 3, m)."""
        curve = timing.arc_length
        t = (curve.x[:-1, None] + np.diff(curve.x)[:, None] * TIMING_FRACTIONS).ravel()
        t = np.union1d(t, np.interp(self._s, curve(t), t))
        s, v, a, j = (curve(t, order)[:, None] for order in range(4))
        after = np.clip(np.searchsorted(self._s, s[:, 0]), 1, len(self._s) - 1)
        low, high = self._s[after - 1], self._s[after]
        weight = np.clip((s[:, 0] - low) / (high - low), 0.0, 1.0)[:, None, None]
        terms = (1.0 - weight) * self._terms[after - 1] + weight * self._terms[after]
        components = terms[:, 0] + terms[:, 1] * v**self._powers
        components += terms[:, 2] * a + terms[:, 3] * v * a + terms[:, 4] * j
        return _largest_by_part(self._limits.combine(components), t, _parts(timing))

    def max_speeds(self, allowed: FloatArray) -> FloatArray:
        """Maximum constant speeds in the middle of each stretch [m/s], in closed form.

        Near its ends the speed may change.

        Args:
            allowed: Largest permitted utilisation of each limit on each stretch, shape (n, m).

        Returns:
            The speed that each limit allows on each stretch, shape (n, m).
        """
        starts = self._limits.starts
        at_rest, factor = self._terms[:, 0][:, starts], self._terms[:, 1]
        sizes = self._limits.combine(factor)
        at_rest = at_rest * np.sign(factor[:, starts])
        index = np.clip(np.searchsorted(self._ends, self._s) - 1, 0, len(allowed) - 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            unused = np.maximum(allowed[index] - at_rest, 0.0)
            speeds = np.where(sizes > 0.0, unused / sizes, np.inf) ** (1.0 / self._limits.orders)
        fraction = (self._s - self._ends[index]) / np.diff(self._ends)[index]
        index[np.abs(fraction - 0.5) > MIDDLE_HALF_WIDTH] = -1
        return np.array([speeds[index == k].min(axis=0) for k in range(len(allowed))])
