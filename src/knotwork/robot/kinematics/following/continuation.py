"""Continuation: the joints' motion along a tool path, from several starts at once.

The joint velocities of eq (4) are integrated from each start (Runge-Kutta, fourth order). After
each step Newton's method brings the tool back onto the path. It moves along the row space of the
Jacobian, so it does not change the self-motion of a redundant arm. Branch and turns stay the same.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knotwork.curves.polynomial.distinct import distinct
from knotwork.curves.tool_paths import TimedPath
from knotwork.robot import Robot
from knotwork.robot.kinematics.chain.joint_ranges import LIMIT_TOLERANCE, limits_of
from knotwork.robot.kinematics.chain.velocity import FASTEST_JOINT
from knotwork.robot.kinematics.following.joint_field import JointField, Pull
from knotwork.robot.kinematics.following.limiting_constraint import (
    LimitingConstraint,
    Steps,
    fastest,
    limiting_constraint,
)
from knotwork.robot.kinematics.following.steps import Stages, take_step
from knotwork.waypoints import FloatArray

# Largest motion of a joint in one step [rad or m].
JOINT_STEP = 0.1
# Factor on the joint speeds above which steps that were planned together are planned again.
FASTER_FACTOR = 1.3
# Factor on `JOINT_STEP`. A step in which a joint moves by more is repeated.
REPEAT_FACTOR = 2.0
# Smallest number of steps for each piece of a path.
MIN_STEPS = 4
# Number of steps for which the path is evaluated at once.
STEPS_AT_ONCE = 16
# Relative tolerance within which the tool is at full speed.
FULL_SPEED_TOLERANCE = 1e-9
# Joint motion of the finite differences for accelerations [rad or m].
ACCELERATION_DIFFERENCE = 2e-3


class Continuation(NamedTuple):
    """Joints along a path from m starts; NaN after the point where a start is blocked.

    Attributes:
        at: Index of the step at each of the k given times, shape (k,).
        time: Time of every step [s], shape (n,).
        position: Joint positions at the steps [rad or m], shape (n, m, d).
        velocity: Joint velocities at the steps [rad/s or m/s], shape (n, m, d).
        full: Whether the tool has the full speed of its stretch at each step, shape (n,).
        lost: Time at which each start is blocked [s], shape (m,); infinite if it reaches the end.
        smallest_lost: Smallest singular values at those times, shape (m,).
    """

    at: NDArray[np.intp]
    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    full: NDArray[np.bool_]
    lost: FloatArray
    smallest_lost: FloatArray

    def select(self, start: int, turns: FloatArray) -> Continuation:
        """The continuation from one start, by index, with each joint turned by an angle [rad]."""
        return self._replace(
            position=self.position[:, [start]] + turns,
            velocity=self.velocity[:, [start]],
            lost=self.lost[[start]],
            smallest_lost=self.smallest_lost[[start]],
        )

    def is_feasible(
        self, robot: Robot, starts: NDArray[np.intp], turns: FloatArray
    ) -> NDArray[np.bool_]:
        """Whether the path can be followed from starts, offset by whole turns.

        Args:
            robot: The arm.
            starts: Indices of the starts, shape (k,).
            turns: Offset of each joint from each start [rad], shape (k, d).

        Returns:
            Shape (k,). `limiting_constraint` names the reason for the others.
        """
        leads = np.isinf(self.lost)
        speeds = fastest(self.time, self.position[:, leads], self.velocity[:, leads])
        use = speeds.max(axis=0) / np.minimum(robot.velocity_limit, FASTEST_JOINT)
        leads[leads] = (use <= 1.0 + LIMIT_TOLERANCE).all(axis=1)
        lower, upper = (bound - turns for bound in limits_of(robot))
        most, least = self.position.max(axis=0)[starts], self.position.min(axis=0)[starts]
        with np.errstate(invalid="ignore"):
            inside = (np.maximum(most - upper, lower - least) <= LIMIT_TOLERANCE).all(axis=1)
        return np.asarray(leads[starts] & inside)

    def limiting_constraint(
        self, robot: Robot, start: int, turns: FloatArray
    ) -> LimitingConstraint | None:
        """The first constraint that a start, offset by whole turns, violates.

        Args:
            robot: The arm.
            start: Index of the start.
            turns: Offset of each joint from the start [rad], shape (d,).
        """
        steps = Steps(
            self.time, self.position[:, start], self.velocity[:, start], turns,
            JointField(robot).smallest(self.position[:, start]), self.full,
        )  # fmt: skip
        return limiting_constraint(
            robot, steps, float(self.lost[start]), float(self.smallest_lost[start])
        )


def continue_along(
    robot: Robot,
    path: TimedPath,
    starts: FloatArray,
    times: FloatArray,
    *,
    pull: Pull = 0.0,
    step: float = JOINT_STEP,
) -> Continuation:
    """Follow a path from some starts, and ignore limits.

    Args:
        robot: The arm.
        path: Poses of the tool over time.
        starts: Joint positions at the first of the times [rad or m], shape (m, d).
        times: Increasing times [s], shape (k,).
        pull: See `JointField`.
        step: Largest motion of a joint between corrections [rad or m].
    """
    field = JointField(robot, pull, path.full_speed)
    limit = np.minimum(robot.velocity_limit, FASTEST_JOINT)
    q = np.array(starts, dtype=float)
    at = np.zeros(len(times), dtype=np.intp)
    stops = distinct(times, [t for t in path.breaks if times[0] < t < times[-1]])
    steps: list[tuple[float, FloatArray, FloatArray]] = []
    lost, smallest_lost = np.full(len(q), np.inf), np.full(len(q), np.nan)
    for start, end in pairwise(stops):
        now = float(start)
        least = min(_piece_duration(path, 0.5 * (start + end)) / MIN_STEPS, end - start)
        stage = Stages.evaluate(field, path, np.array([now]), 0.5 * (now + float(end)))
        v = _velocities(field, q, stage, 0)
        most = float(np.nanmax(np.abs(v), initial=0.0))
        while now < end and np.isfinite(q).any():
            h = min(least, step / most) if most else least
            h, when = _next_times(now, float(end), h)
            stages = Stages.evaluate(field, path, when, 0.5 * (now + float(when[-1])))
            for k in range(0, len(when) - 1, 2):
                alive = np.flatnonzero(np.isfinite(q).all(axis=1))
                end_of = take_step(field, path, limit, q[alive], v[alive], stages[k : k + 3])
                far = float(np.nanmax(np.abs(end_of.q - q[alive]), initial=0.0))
                if far > REPEAT_FACTOR * step:
                    most = max(far / h, most)
                    break  # joints became faster: shorter steps from here
                steps.append((float(when[k]), q.copy(), v))
                q[alive] = end_of.q
                gone = np.isnan(end_of.q).any(axis=1)
                lost[alive[gone]] = end_of.reached[gone]
                smallest_lost[alive[gone]] = end_of.smallest[gone]
                v = _velocities(field, q, stages, k + 2)
                now = float(when[k + 2])
                most = float(np.nanmax(np.abs(v), initial=0.0))
                if h * most > FASTER_FACTOR * step:
                    break  # joints have become faster: shorter steps from here
        steps.append((now, q.copy(), v))
        at[times == end] = len(steps) - 1
    time, positions, velocities = (np.array(column) for column in zip(*steps, strict=True))
    full = at_full_speed(path, time)
    return Continuation(at, time, positions, velocities, full, lost, smallest_lost)


def _next_times(now: float, end: float, most: float) -> tuple[float, FloatArray]:
    """Length of equal steps to an end, up to a maximum [s], and times of the next steps.

    The times include the middles of the steps.
    """
    parts = int(np.ceil((end - now) / most - 1e-9))
    h = (end - now) / parts
    parts = min(parts, STEPS_AT_ONCE)
    last = end if now + (parts + 0.5) * h > end else now + parts * h
    return h, np.linspace(now, last, 2 * parts + 1)


def at_full_speed(path: TimedPath, time: FloatArray) -> NDArray[np.bool_]:
    """Whether the tool has the full speed of its stretch at times, shape (k,).

    The speed of a carried path includes that of its frame, which does not depend on the stretch.
    """
    if path.carrier is not None:
        return np.zeros(time.shape, dtype=bool)
    return np.asarray(path.speed(time) > (1.0 - FULL_SPEED_TOLERANCE) * path.requested_speed(time))


def _velocities(field: JointField, q: FloatArray, stages: Stages, k: int) -> FloatArray:
    """Joint velocities at the k-th time; NaN for blocked starts."""
    v = np.full(q.shape, np.nan)
    alive = np.flatnonzero(np.isfinite(q).all(axis=1))
    if alive.size:
        v[alive] = stages.velocities(field, q[alive], k)
    return v


def velocity_on_path(
    robot: Robot, path: TimedPath, q: FloatArray, time: float, pull: Pull = 0.0
) -> FloatArray:
    """Joint velocities that follow a path at a time [rad/s or m/s], shape (d,)."""
    side = "left" if time >= path.end_time else "right"
    time = min(max(time, path.start_time), path.end_time)
    v, _ = accelerations(robot, path, q[None], np.array([time]), side, pull=pull)
    return np.asarray(v[0])


def accelerations(
    robot: Robot,
    path: TimedPath,
    q: FloatArray,
    times: FloatArray,
    side: str,
    *,
    pull: Pull = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Joint velocities and accelerations on the path, one-sided limits at times; shape (k, d) each.

    The acceleration is the derivative of the field of joint velocities. The field is linear in the
    motion of the tool, and the path gives the derivative of this motion. So finite differences are
    only needed over the joints (central, fourth order, relative error about 1e-10). Differences
    over time would fail near rest, where the joints hardly move while the path changes.

    Args:
        robot: The arm.
        path: Poses of the tool over time.
        q: Joint positions at the times [rad or m], shape (k, d).
        times: Times [s], shape (k,).
        side: `"right"` or `"left"`.
        pull: See `JointField`.
    """
    field = JointField(robot, pull, path.full_speed)
    _, _, twist, change = path.state(times, side=side)
    speed = np.linalg.norm(twist[:, :3], axis=1)
    faster = np.einsum("ki,ki->k", twist[:, :3], change[:, :3])
    faster = np.divide(faster, speed, out=np.zeros_like(speed), where=speed > 0.0)
    share, gain = speed / path.full_speed, faster / path.full_speed
    along = field.arc_lengths(path, times)
    v = field.velocities(q, twist, share, along)
    h = ACCELERATION_DIFFERENCE / np.maximum(np.abs(v).max(axis=1), 1e-300)
    offsets = np.multiply.outer([-1.0, -0.5, 0.5, 1.0], h)
    around = (q + offsets[:, :, None] * v).reshape(-1, q.shape[1])
    same = np.tile(twist, (4, 1)), np.tile(share, 4), np.tile(along, 4)
    f = field.velocities(around, *same).reshape(4, *q.shape)
    coarse, fine = (f[3] - f[0]) / (2.0 * h[:, None]), (f[2] - f[1]) / h[:, None]
    same_joints = field.velocities(q, change, gain, along, share * speed)
    return v, same_joints + (4.0 * fine - coarse) / 3.0


def _piece_duration(path: TimedPath, time: float) -> float:
    """Duration of the piece of a path that contains a time [s]."""
    index = np.searchsorted(path.breaks, time, "right")
    return float(np.diff(path.breaks)[np.clip(index, 1, len(path.breaks) - 1) - 1])
