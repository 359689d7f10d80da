"""`JointsOnPath`: the joints of an arm that follows a path, at any time, from one integration."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.distinct import distinct
from knotwork.curves.polynomial.two_point import two_point_coefficients
from knotwork.curves.tool_paths import TimedPath
from knotwork.errors import FollowingError
from knotwork.robot import Robot
from knotwork.robot.kinematics.chain.joint_ranges import LIMIT_TOLERANCE
from knotwork.robot.kinematics.following.continuation import (
    JOINT_STEP,
    Continuation,
    accelerations,
    at_full_speed,
    continue_along,
)
from knotwork.robot.kinematics.following.joint_field import JointField, Pull
from knotwork.robot.kinematics.following.limiting_constraint import (
    LimitingConstraint,
    Steps,
    following_error,
    limiting_constraint,
)
from knotwork.robot.kinematics.following.steps import MAX_CORRECTION, PATH_ERROR
from knotwork.waypoints import FloatArray

# Largest motion of a joint in a step with self-motion [rad or m]. The projection onto the path does
# not correct self-motion. With this step it is exact to about 1e-9.
SELF_MOTION_STEP = 0.05
# Number of parts of each step when limits are violated.
STEP_PARTS = 8
# Tolerance on limits of a curve that is close to the path [rad or m, relative].
CURVE_TOLERANCE = 1e-6


class JointsOnPath:
    """The joints along a path from a start.

    The path is integrated once. Between two steps the joints are a quintic through the positions,
    velocities and accelerations of both, projected onto the path. All times use the same integral,
    so that self-motion is continuous.

    Args:
        robot: The arm.
        path: Poses of the tool over time.
        start: Joint positions near the start of the path [rad or m], shape (d,).
        pull: See `JointField`.
        continuation: The continuation from there with the same pull, if known. For a redundant arm
            it is recomputed if its steps are too long.

    Attributes:
        robot, path: The arguments.
        time: Times of the steps [s], shape (n,).
        position: Joint positions at the steps [rad or m], shape (n, d).
        curve: Quintics through positions, velocities and accelerations of the steps, close to the
            path, C2 except where the path's acceleration jumps.

    Raises:
        FollowingError: The arm can't follow the path, even without limits.
    """

    def __init__(
        self,
        robot: Robot,
        path: TimedPath,
        start: FloatArray,
        pull: Pull,
        continuation: Continuation | None = None,
    ) -> None:
        self.robot, self.path, self.pull = robot, path, pull
        self.field = JointField(robot, pull, path.full_speed)
        self._step = SELF_MOTION_STEP if robot.dof > 6 else JOINT_STEP
        if continuation is None or not self._fine(continuation):
            place, rotation, _, _ = path.state([path.start_time])
            q = self.field.project(start[None], place, rotation)[0]
            continuation = continue_along(robot, path, q, path.breaks, pull=pull, step=self._step)
        constraint = continuation.limiting_constraint(robot, 0, np.zeros(robot.dof))
        if constraint is not None and np.isfinite(continuation.lost[0]):
            raise self._error(constraint)
        self._exceeds_limits = constraint is not None
        # where a piece ends and the next begins there are two steps at one time
        steps = np.flatnonzero(np.diff(continuation.time) > 0.0)
        rows = np.append(steps, len(continuation.time) - 1)
        self.time, self.position = continuation.time[rows], continuation.position[rows, 0]
        self.curve = PiecewisePolynomial(self._quintics(continuation, steps), self.time)

    def _fine(self, continuation: Continuation) -> bool:
        """Whether the steps of a continuation are short enough."""
        if self.robot.dof <= 6:
            return True
        far = np.abs(np.diff(continuation.position[:, 0], axis=0)).max(initial=0.0)
        return self.field.guide is None and bool(far <= self._step)

    def _quintics(self, continuation: Continuation, steps: NDArray[np.intp]) -> FloatArray:
        """Coefficients of the polynomials between steps, by index, and those after them."""
        pairs = np.column_stack((steps, steps + 1)).ravel()
        time, q, v = (
            continuation.time[pairs],
            continuation.position[pairs, 0],
            continuation.velocity[pairs, 0],
        )
        a = np.empty(q.shape)
        for row, side in enumerate(("right", "left")):
            _, a[row::2] = accelerations(
                self.robot, self.path, q[row::2], time[row::2], side, pull=self.pull
            )
        return two_point_coefficients(time, (q, v, a))[:, ::2]

    def check(self) -> None:
        """Check the limits between the steps of the integral, if they are violated at the steps.

        Raises:
            FollowingError: A limit is violated.
        """
        constraint = self._constraint_between_steps() if self._exceeds_limits else None
        if constraint is not None:
            raise self._error(constraint)

    def check_curve(self, curve: PiecewisePolynomial) -> None:
        """Check that a cubic curve along the whole path keeps the limits, between steps too.

        Raises:
            FollowingError: A limit is violated.
        """
        extrema = curve.extrema()
        time = distinct(curve.x, extrema.minimum_time, extrema.maximum_time)
        constraint = self._constraint(time, curve(time), curve(time, 1), CURVE_TOLERANCE)
        if constraint is not None:
            raise self._error(self._constraint_between_steps() or constraint)

    def _constraint_between_steps(self) -> LimitingConstraint | None:
        """The limiting constraint on the path itself, at more times than the steps."""
        starts, lengths = self.time[:-1, None], np.diff(self.time)[:, None]
        inner = (starts + lengths * np.arange(STEP_PARTS) / STEP_PARTS).ravel()
        time = np.append(inner, self.time[-1])
        q = self.positions(time)
        return self._constraint(time, q, self.rates(time, q)[0], LIMIT_TOLERANCE)

    def _constraint(
        self, time: FloatArray, q: FloatArray, v: FloatArray, slack: float
    ) -> LimitingConstraint | None:
        """The limiting constraint of a motion given at times."""
        still, full = np.zeros(self.robot.dof), at_full_speed(self.path, time)
        steps = Steps(time, q, v, still, self.field.smallest(q), full)
        return limiting_constraint(self.robot, steps, np.inf, np.nan, slack)

    def _error(self, constraint: LimitingConstraint) -> FollowingError:
        """The error that names the limiting constraint."""
        begin = "the path can't be followed from start:"
        remedy = "Move the path, turn the tool, or start from another solution"
        return following_error(self.robot, self.path, constraint, begin, remedy)

    def positions(self, times: FloatArray) -> FloatArray:
        """Joint positions at times [rad or m], shape (k, d)."""
        guess = self.curve(times)
        q, error = self.field.project(guess, *self.path.state(times)[:2])
        stray = ~(np.abs(q - guess).max(axis=1, initial=0.0) <= MAX_CORRECTION) | ~(
            error <= PATH_ERROR
        )
        before = np.searchsorted(self.time, times, "right") - 1
        for i in distinct(before[stray]):  # the nearest one could be of another branch
            rows = stray & (before == i)
            wanted = np.append(self.time[i], times[rows])
            path = continue_along(
                self.robot,
                self.path,
                self.position[[i]],
                wanted,
                pull=self.pull,
                step=self._step,
            )
            q[rows] = path.position[path.at[1:], 0]
        return q

    def rates(self, times: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Velocities and accelerations; at a jump of the acceleration the mean of both sides."""
        robot, path, pull = self.robot, self.path, self.pull
        v, a = np.empty(q.shape), np.empty(q.shape)
        for side, rows in (("left", times == path.end_time), ("right", times < path.end_time)):
            if rows.any():
                v[rows], a[rows] = accelerations(robot, path, q[rows], times[rows], side, pull=pull)
        inner = np.isin(times, path.breaks[1:-1])
        if inner.any():
            _, before = accelerations(robot, path, q[inner], times[inner], "left", pull=pull)
            a[inner] = 0.5 * (a[inner] + before)
        return v, a
