"""Continuation: the joints' motion along a tool path, from several starts at once.

The joint velocities of eq (4) are integrated from each start (Runge-Kutta, fourth order). After
each step Newton's method brings the tool back onto the path. It moves along the row space of the
Jacobian, so it does not change the self-motion of a redundant arm. Branch and turns stay the same.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import BoolArray, FloatArray, IndexArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.curves.polynomial.two_point import two_point_coefficients
from knotwork.curves.tool_paths import TimedPath
from knotwork.errors import FollowingObstruction
from knotwork.robot import Robot
from knotwork.robot.kinematics.chain.joint_ranges import LIMIT_TOLERANCE, position_limits
from knotwork.robot.kinematics.chain.velocity import plausible_speeds
from knotwork.robot.kinematics.following.joint_field import JointField, SelfMotionTarget
from knotwork.robot.kinematics.following.obstruction import find_obstruction
from knotwork.robot.kinematics.following.steps import Stages, take_step

JOINT_STEP = 0.1
"""Largest motion of a joint in one step [rad or m]."""
REPEAT_FACTOR = 2.0
"""Factor on `JOINT_STEP`. A step in which a joint moves by more is repeated."""
FASTER_FACTOR = 1.3
"""Factor on the joint speeds above which steps that were planned together are planned again."""
STEPS_AT_ONCE = 16
"""Number of steps for which the path is evaluated at once."""
MIN_STEPS = 4
"""Smallest number of steps between given times and breaks of a path."""
ROUNDING = 1e-9
"""Rounding of a number of steps."""
ACCELERATION_DIFFERENCE = 2e-3
"""Joint motion of the finite differences for accelerations [rad or m]."""


class Continuation(NamedTuple):
    """Joint motions along a path from m starts, NaN after the point where a start is blocked.

    Attributes:
        step_index: Index of the step at each of the k given times, shape (k,).
        time: Time of every step [s], shape (n,).
        position: Joint positions at the steps [rad or m], shape (n, m, d).
        velocity: Joint velocities at the steps [rad/s or m/s], shape (n, m, d).
        blocked_time: Time at which each start is blocked [s], shape (m,); infinite for a start that
            reaches the end.
        smallest_singular_value: Smallest singular values at those times, shape (m,).
        step: Largest motion of a joint between corrections [rad or m].
    """

    step_index: IndexArray
    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    blocked_time: FloatArray
    smallest_singular_value: FloatArray
    step: float

    def select(self, start: int, turns: FloatArray) -> Continuation:
        """The continuation from one start, by index, with each joint turned by an angle [rad]."""
        return self._replace(
            position=self.position[:, [start]] + turns,
            velocity=self.velocity[:, [start]],
            blocked_time=self.blocked_time[[start]],
            smallest_singular_value=self.smallest_singular_value[[start]],
        )

    def is_feasible(self, robot: Robot, starts: IndexArray, turns: FloatArray) -> BoolArray:
        """Whether the path can be followed from starts, offset by whole turns.

        Args:
            robot: The arm.
            starts: Indices of the starts, shape (k,).
            turns: Offset of each joint from each start [rad], shape (k, d).

        Returns:
            Shape (k,). `obstruction` names the reason for the others.
        """
        reaches = np.isinf(self.blocked_time)
        if not reaches.any():
            return np.zeros(len(starts), dtype=bool)
        n, d = len(self.time), robot.dof
        q, v = (values[:, reaches].reshape(n, -1) for values in (self.position, self.velocity))
        curve = interpolate_curve(self.time, q, v)
        extrema = curve.extrema()
        utilisations = curve.extrema(1).peak.reshape(-1, d) / plausible_speeds(robot)
        row = np.cumsum(reaches)[starts] - 1
        high, low = (side.reshape(-1, d)[row] for side in (extrema.maximum, extrema.minimum))
        lower, upper = (bound - turns for bound in position_limits(robot))
        feasible = (np.maximum(high - upper, lower - low) <= LIMIT_TOLERANCE).all(axis=1)
        feasible &= (utilisations[row] <= 1.0 + LIMIT_TOLERANCE).all(axis=1)
        return np.asarray(reaches[starts] & feasible)

    def obstruction(
        self, robot: Robot, start: int, turns: FloatArray
    ) -> FollowingObstruction | None:
        """The first obstruction from a start that is offset by whole turns.

        Args:
            robot: The arm.
            start: Index of the start.
            turns: Offset of each joint from the start [rad], shape (d,).
        """
        n = int(np.isfinite(self.position[:, start, 0]).sum())
        time, q, v = self.time[:n], self.position[:n, start] + turns, self.velocity[:n, start]
        curve = interpolate_curve(time, q, v) if time[-1] > time[0] else None
        blocked = float(self.blocked_time[start]), float(self.smallest_singular_value[start])
        return find_obstruction(robot, curve, blocked)


def interpolate_curve(time: FloatArray, *derivatives: FloatArray) -> PiecewisePolynomial:
    """Interpolate positions, velocities, … at times, two of which may be equal.

    Args:
        time: Times of steps [s], shape (n,). Where a piece of a path ends and the next one begins
            there are two steps.
        derivatives: Positions, velocities, … at the steps, shape (n, d) each.
    """
    begins = np.flatnonzero(np.diff(time) > 0.0)
    ends = np.column_stack((begins, begins + 1)).ravel()
    c = two_point_coefficients(time[ends], tuple(values[ends] for values in derivatives))
    return PiecewisePolynomial(c[:, ::2], np.append(time[begins], time[-1]))


def continue_along(
    robot: Robot,
    path: TimedPath,
    starts: FloatArray,
    times: FloatArray,
    *,
    target: SelfMotionTarget = 0.0,
    step: float = JOINT_STEP,
) -> Continuation:
    """Follow a path from several starts at once, regardless of limits.

    Args:
        robot: The arm.
        path: Poses of the tool over time.
        starts: Joint positions at the first of the times [rad or m], shape (m, d).
        times: Increasing times [s], shape (k,).
        target: See `JointField`.
        step: Largest motion of a joint between corrections [rad or m].
    """
    field = JointField(robot, target, path.full_speed)
    plausible = plausible_speeds(robot)
    q = np.array(starts, dtype=float)
    step_index = np.zeros(len(times), dtype=np.intp)
    stops = sort_distinct(times, [t for t in path.breaks if times[0] < t < times[-1]])
    steps: list[tuple[float, FloatArray, FloatArray]] = []
    blocked_time, smallest_singular_value = np.full(len(q), np.inf), np.full(len(q), np.nan)
    for start, end in pairwise(stops.tolist()):
        now, inside, max_h = start, 0.5 * (start + end), (end - start) / MIN_STEPS
        v = _evaluate_velocities(field, q, Stages.evaluate(field, path, np.array([now]), inside), 0)
        h = _step_duration(v, step, max_h)
        while now < end and np.isfinite(q).any():
            count = int(np.ceil((end - now) / h - ROUNDING))
            block_steps = min(count, STEPS_AT_ONCE)
            block_end = end if block_steps == count else now + block_steps * (end - now) / count
            when = np.linspace(now, block_end, 2 * block_steps + 1)
            stages = Stages.evaluate(field, path, when, inside)
            for k in range(0, 2 * block_steps, 2):
                alive = np.flatnonzero(np.isfinite(q).all(axis=1))
                step_end = take_step(field, path, plausible, q[alive], v[alive], stages.of_step(k))
                max_move = float(np.nanmax(np.abs(step_end.q - q[alive]), initial=0.0))
                duration = float(when[k + 2] - when[k])
                if max_move > REPEAT_FACTOR * step:
                    h = duration * step / max_move
                    break
                steps.append((now, q.copy(), v))
                q[alive] = step_end.q
                blocked = np.isnan(step_end.q).any(axis=1)
                blocked_time[alive[blocked]] = step_end.reached[blocked]
                smallest_singular_value[alive[blocked]] = step_end.smallest_singular_value[blocked]
                v = _evaluate_velocities(field, q, stages, k + 2)
                now, h = float(when[k + 2]), _step_duration(v, step, max_h)
                if FASTER_FACTOR * h < duration:
                    break
        steps.append((now, q.copy(), v))
        step_index[times == end] = len(steps) - 1
    time, positions, velocities = (np.array(column) for column in zip(*steps, strict=True))
    return Continuation(
        step_index, time, positions, velocities, blocked_time, smallest_singular_value, step
    )


def _step_duration(v: FloatArray, step: float, longest: float) -> float:
    """Duration in which no joint moves by more than a step, up to the longest one [s]."""
    fastest = float(np.nanmax(np.abs(v), initial=0.0))
    return min(longest, step / fastest) if fastest else longest


def _evaluate_velocities(field: JointField, q: FloatArray, stages: Stages, k: int) -> FloatArray:
    """Joint velocities at the k-th time; NaN for blocked starts."""
    v = np.full(q.shape, np.nan)
    alive = np.flatnonzero(np.isfinite(q).all(axis=1))
    if alive.size:
        v[alive] = stages.velocities(field, q[alive], k)
    return v


def velocity_on_path(
    robot: Robot, path: TimedPath, q: FloatArray, time: float, target: SelfMotionTarget = 0.0
) -> FloatArray:
    """Joint velocities that follow a path at a time [rad/s or m/s], shape (d,)."""
    field = JointField(robot, target, path.full_speed)
    time = min(max(time, path.start_time), path.end_time)
    motion = Stages.evaluate(field, path, np.array([time]), time)
    return np.asarray(motion.velocities(field, q[None], 0)[0])


def compute_rates_on_path(
    robot: Robot,
    path: TimedPath,
    q: FloatArray,
    times: FloatArray,
    side: ArrayLike,
    *,
    target: SelfMotionTarget = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Compute joint velocities and accelerations on a path, one-sided limits at times, (k, d) each.

    The acceleration is the derivative of the field of joint velocities. The field is linear in the
    motion of the tool, and the path gives the derivative of this motion. Thus finite differences
    are only needed over the joints (central, fourth order, relative error about 1e-10). Differences
    over time would fail near rest, where the joints hardly move while the path changes.

    Args:
        robot: The arm.
        path: Poses of the tool over time.
        q: Joint positions at the times [rad or m], shape (k, d).
        times: Times [s], shape (k,).
        side: `"right"` or `"left"`, or one for each time, shape (k,).
        target: See `JointField`.
    """
    field = JointField(robot, target, path.full_speed)
    _, _, twist, change = path.state(times, side=side)
    speed = np.linalg.norm(twist[:, :3], axis=1)
    tangential_acceleration = np.einsum("ki,ki->k", twist[:, :3], change[:, :3])
    tangential_acceleration = np.divide(
        tangential_acceleration, speed, out=np.zeros_like(speed), where=speed > 0.0
    )
    speed_fraction = speed / path.full_speed
    arc_length = field.arc_lengths(path, times)
    v = field.velocities(q, twist, speed_fraction, arc_length)
    h = ACCELERATION_DIFFERENCE / np.maximum(np.abs(v).max(axis=1), 1e-300)
    offsets = np.multiply.outer([-1.0, -0.5, 0.5, 1.0], h)
    neighbours = (q + offsets[:, :, None] * v).reshape(-1, q.shape[1])
    same = np.tile(twist, (4, 1)), np.tile(speed_fraction, 4), np.tile(arc_length, 4)
    f = field.velocities(neighbours, *same).reshape(4, *q.shape)
    coarse, fine = (f[3] - f[0]) / (2.0 * h[:, None]), (f[2] - f[1]) / h[:, None]
    at_fixed_joints = field.accelerations_at_fixed_joints(
        q, change, speed, tangential_acceleration, arc_length
    )
    return v, at_fixed_joints + (4.0 * fine - coarse) / 3.0
