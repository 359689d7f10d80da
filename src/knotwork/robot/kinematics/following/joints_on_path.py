"""`JointsOnPath`: the joints of an arm that follows a path, at any time, from one integration."""

from __future__ import annotations

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.curves.tool_paths import TimedPath
from knotwork.errors import FollowingObstruction
from knotwork.robot import Robot
from knotwork.robot.kinematics.following.continuation import (
    JOINT_STEP,
    MIN_STEPS,
    Continuation,
    compute_rates_on_path,
    continue_along,
    interpolate_curve,
)
from knotwork.robot.kinematics.following.joint_field import JointField, SelfMotionTarget
from knotwork.robot.kinematics.following.obstruction import (
    find_obstruction,
    make_following_error,
)
from knotwork.robot.kinematics.following.steps import MAX_CORRECTION, PATH_ERROR

SELF_MOTION_STEP = 0.05
"""Largest motion of a joint in a step with self-motion [rad or m].

The projection onto the path does not correct self-motion. With this step it is exact to about 1e-9.
"""
FINE_STEPS = 8
"""Number of steps in place of one when limits are violated."""
CURVE_TOLERANCE = 1e-6
"""Tolerance on limits of a curve close to the path [rad or m, relative]."""


class JointsOnPath:
    """The joint motion along a path from a start, at any time.

    The path is integrated once. Between two steps the joints are a quintic through the positions,
    velocities and accelerations of both, projected onto the path. All times use the same integral,
    so self-motion is continuous.

    Args:
        robot: The arm.
        path: Poses of the tool over time.
        start: Joint positions near the start of the path [rad or m], shape (d,).
        target: See `JointField`.
        continuation: The continuation from there with the same target, if known. For a redundant
            arm it is recomputed if its steps are too long.

    Attributes:
        robot, path, target: The arguments.
        continuation: The continuation in use.
        start: Joint positions at the start of the path [rad or m], shape (1, d).
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
        target: SelfMotionTarget,
        continuation: Continuation | None = None,
    ) -> None:
        self.robot, self.path, self.target = robot, path, target
        self.field = JointField(robot, target, path.full_speed)
        self._step = SELF_MOTION_STEP if robot.is_redundant else JOINT_STEP
        if continuation is None or continuation.step > self._step:
            q = self.field.project(start[None], *path.state([path.start_time])[:2])[0]
            continuation = self._continue(q, path.breaks, self._step)
        if np.isfinite(continuation.blocked_time[0]):
            self._refuse(continuation.obstruction(robot, 0, np.zeros(robot.dof)))
        self.continuation, self.start = continuation, continuation.position[0]
        time, q = continuation.time, continuation.position[:, 0]
        sides = np.append(np.where(np.diff(time) == 0.0, "left", "right"), "left")
        _, a = compute_rates_on_path(robot, path, q, time, sides, target=target)
        self.curve = interpolate_curve(time, q, continuation.velocity[:, 0], a)

    def _continue(self, q: FloatArray, times: FloatArray, step: float) -> Continuation:
        return continue_along(self.robot, self.path, q, times, target=self.target, step=step)

    def with_timing(self, path: TimedPath) -> JointsOnPath:
        """The motion along the same path with another timing.

        The joints are the same function of arc length, so nothing is integrated again, except for
        a pull to the middle of the joints' ranges, which depends on time.

        Args:
            path: The path with this timing; neither has a moving frame or a weave.
        """
        q = self.continuation.position[:, 0]
        if self.field.rates_to_middle.any():
            return JointsOnPath(self.robot, path, self.start[0], self.target)
        travel = np.append(0.0, np.cumsum(np.abs(np.diff(q, axis=0)).max(axis=1)))
        reached = _times_at(path, self.path.arc_length(self.continuation.time))
        # on each side of a break there is a step
        fixed = np.linspace(path.breaks[:-1], path.breaks[1:], MIN_STEPS + 1).T.ravel()
        steps = np.arange(0.0, travel[-1], self._step)
        gaps = np.abs(steps[:, None] - np.interp(fixed, reached, travel)).min(axis=1)
        steps = np.interp(steps[gaps > 0.5 * self._step], travel, reached)
        time = np.sort(np.concatenate((fixed, steps)))
        q = self.positions(_times_at(self.path, path.arc_length(time)))
        v, _ = compute_rates_on_path(self.robot, path, q, time, "right", target=self.target)
        at_ends = np.abs(time[:, None] - path.start_time - path.timing.times).argmin(axis=0)
        continuation = self.continuation._replace(
            step_index=at_ends, time=time, position=q[:, None], velocity=v[:, None]
        )
        return JointsOnPath(self.robot, path, q[0], self.target, continuation)

    def check(self, curve: PiecewisePolynomial | None = None) -> None:
        """Check that the joints keep their limits.

        Args:
            curve: A curve along the path; by default the motion on the path itself.

        Raises:
            FollowingError: A limit is violated.
        """
        robot = self.robot
        obstruction = find_obstruction(robot, curve or self.curve, slack=CURVE_TOLERANCE)
        if obstruction is None:
            return
        # at peaks of joint speeds, short steps are nearer to the path
        fine = self._continue(self.start, self.path.breaks, self._step / FINE_STEPS)
        on_path = fine.obstruction(robot, 0, np.zeros(robot.dof))
        self._refuse(on_path if curve is None else on_path or obstruction)

    def _refuse(self, obstruction: FollowingObstruction | None) -> None:
        if obstruction is not None:
            begin = "the path can't be followed from this start"
            accepted = "another path or orientation of the tool, or a start at another solution"
            raise make_following_error(self.path, obstruction, begin, accepted)

    def positions(self, times: FloatArray) -> FloatArray:
        """Joint positions at times [rad or m], shape (k, d)."""
        guess = self.curve(times)
        q, error = self.field.project(guess, *self.path.state(times)[:2])
        off_path = ~(np.abs(q - guess).max(axis=1, initial=0.0) <= MAX_CORRECTION) | ~(
            error <= PATH_ERROR
        )
        steps = self.curve.x
        before = np.searchsorted(steps, times, "right") - 1
        for i in sort_distinct(before[off_path]):  # the nearest one could be of another branch
            rows = off_path & (before == i)
            start, wanted = self.curve(steps[[i]]), np.append(steps[i], times[rows])
            path = self._continue(start, wanted, self._step)
            q[rows] = path.position[path.step_index[1:], 0]
        return q

    def rates(self, times: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Velocities and accelerations; at a jump of the acceleration the mean of both sides."""
        inner = np.flatnonzero(np.isin(times, self.path.breaks[1:-1]))
        rows, n = np.append(np.arange(len(times)), inner), len(times)
        sides = np.repeat(["right", "left"], [n, len(inner)])
        v, a = compute_rates_on_path(
            self.robot, self.path, q[rows], times[rows], sides, target=self.target
        )
        a[inner] = 0.5 * (a[inner] + a[n:])
        return v[:n], a[:n]


def _times_at(path: TimedPath, s: FloatArray) -> FloatArray:
    """Times at which a path reaches arc lengths [s], shape (k,)."""
    return np.clip(path.start_time + path.timing.time_of(s), path.start_time, path.end_time)
