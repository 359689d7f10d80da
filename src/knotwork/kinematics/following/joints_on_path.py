"""`JointsOnPath`: the joints of an arm that follows a path, at any time, from one integration."""

from __future__ import annotations

import numpy as np

from knotwork.kinematics.following.continuation import accelerations, continue_along
from knotwork.kinematics.following.hindrance import following_error
from knotwork.kinematics.following.joint_field import JointField
from knotwork.kinematics.following.steps import LOST, STRAY
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.hermite import two_point_coefficients
from knotwork.robot import Robot
from knotwork.tool_paths import TimedPath
from knotwork.waypoints import FloatArray

# Joints of an arm that has self-motion move by no more than this in a step [rad or m], so that
# it is exact to about 1e-9; others are brought back onto the path after any step.
STEP, LONG_STEP = 0.05, 0.2


class JointsOnPath:
    """The joints along a path from a start.

    The path is integrated once. Between two steps the joints are those of the cubic through the
    positions and velocities of both, brought onto the path. All times see the same integral, so
    that self-motion does not jump from one to the next.

    Args:
        robot: The arm.
        path: Poses of the tool over time.
        start: Joint positions near where it begins [rad or m], shape (d,).
        pull: See `JointField`.

    Raises:
        FollowingError: The arm can't go on somewhere.
    """

    def __init__(self, robot: Robot, path: TimedPath, start: FloatArray, pull: float) -> None:
        self.robot, self.path, self.pull = robot, path, pull
        self.field = JointField(robot, pull)
        place, rotation, _, _ = path.state([path.start_time])
        q = self.field.corrected(start[None], place, rotation)[0]
        self.step = STEP if robot.dof > 6 else LONG_STEP
        found = continue_along(robot, path, q, path.breaks, pull=pull, step=self.step)
        one = found.hindrance(robot, 0, np.zeros(robot.dof))
        if one is not None and np.isfinite(found.lost[0]):
            what, remedy = "the path can't be followed:", "begin it in another way"
            raise following_error(robot, path, one, what, remedy)
        # where a piece ends and the next begins there are two steps at one time
        last = np.append(np.diff(found.time) > 0.0, True)
        self.time, self.position = found.time[last], found.position[last, 0]
        states = self.position, found.velocity[last, 0]
        self._cubic = PiecewisePolynomial(two_point_coefficients(self.time, states), self.time)

    def positions(self, times: FloatArray) -> FloatArray:
        """Joint positions at times [rad or m], shape (k, d)."""
        guess = self._cubic(times)
        s, path = self.path.arc_length(times), self.path.path
        q, error = self.field.corrected(guess, path.position(s), path.rotation(s))
        stray = ~(np.abs(q - guess).max(axis=1, initial=0.0) <= STRAY) | ~(error <= LOST)
        before = np.searchsorted(self.time, times, "right") - 1
        for i in np.unique(before[stray]):  # the cubic could lead to another branch there
            own = stray & (before == i)
            asked = np.append(self.time[i], times[own])
            q[own] = continue_along(
                self.robot, self.path, self.position[[i]], asked, pull=self.pull, step=self.step
            ).q[1:, 0]
        return q

    def rates(self, times: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Velocities and accelerations; at a jump of the acceleration the mean of both sides."""
        robot, path, pull = self.robot, self.path, self.pull
        v, a = np.empty(q.shape), np.empty(q.shape)
        for side, own in (("left", times == path.end_time), ("right", times < path.end_time)):
            if own.any():
                v[own], a[own] = accelerations(robot, path, q[own], times[own], side, pull=pull)
        inner = np.isin(times, path.breaks[1:-1])
        if inner.any():
            _, before = accelerations(robot, path, q[inner], times[inner], "left", pull=pull)
            a[inner] = 0.5 * (a[inner] + before)
        return v, a
