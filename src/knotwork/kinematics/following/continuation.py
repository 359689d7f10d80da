"""Continuation: the joints' motion along a tool path, from several starts at once.

The joint velocities of eq (4) are integrated from each start (Runge-Kutta, fourth order), and after
each step Newton's method brings the tool back onto the path along the row space of the Jacobian, so
that the self-motion of a redundant arm stays that of the integral. Branch and turns are kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from knotwork.kinematics.chain.joint_axes import joint_axes, pose_errors
from knotwork.kinematics.chain.joint_ranges import BoolArray, limits_of, middle
from knotwork.kinematics.chain.velocity import FASTEST_JOINT, joint_scales
from knotwork.robot import Robot
from knotwork.tool_paths import TimedPath
from knotwork.waypoints import FloatArray

# Joints move by no more than this in one step [rad or m].
STEP = 0.1
# And each stretch takes so many of them at least.
LEAST_STEPS = 4
# The tool is brought back onto the path to within this [m, rad]; if that fails it can't go on.
ON_PATH = 1e-11
LOST = 1e-7
CORRECTIONS = 6
# Joint speeds so many times the limits end a continuation: the arm is singular there.
HOPELESS = 30.0
# Differences that give the accelerations: joints move by so much [rad or m] ...
DIFFERENCE = 2e-3
# ... or this part of a stretch of the path goes by.
DIFFERENCE_TIME = 1e-2
# A limit is broken beyond this part of it, so that rounding does not decide [rad or m, relative].
AT_LIMIT = 1e-9


@dataclass(frozen=True)
class Obstacle:
    """What keeps the arm from following a path from some start.

    Attributes:
        kind: `"joint limit"`, `"velocity limit"`, or `"singularity"` where the tool can't stay on
            the path whatever the joints do.
        time: When it begins [s].
        joint: Index of the joint that is farthest beyond its limit.
        value: The joint's worst value [rad or m, or per second].
        limit: The limit it is beyond.
        worst: When it is worst [s].
        smallest_singular_value: Of the Jacobian where it begins.
    """

    kind: str
    time: float
    joint: int
    value: float
    limit: float
    worst: float
    smallest_singular_value: float


@dataclass(frozen=True, eq=False)
class Continuation:
    """Joint positions along a path from m starts.

    Attributes:
        q: At k times [rad or m], shape (k, m, d); NaN where a start leads no further.
        obstacles: For each start the first thing that is in its way, or `None`.
    """

    q: FloatArray
    obstacles: tuple[Obstacle | None, ...]


class JointField:
    """The joint velocities that follow a path: eq (4), and a pull to the middle of the ranges.

    Args:
        robot: The arm.
        pull: For an arm of more than six joints, how fast self-motion pulls its joints to the
            middle of their ranges [1/s].
    """

    def __init__(self, robot: Robot, pull: float = 0.0) -> None:
        self.axes, self.scale = joint_axes(robot), joint_scales(robot)
        limits = limits_of(robot)
        self.pull = np.where(np.isfinite(limits).all(axis=0), pull, 0.0)
        self.middle = middle(limits)

    def velocities(self, q: FloatArray, twist: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint velocities and smallest singular values, shape (n, d) and (n,).

        Args:
            q: Joint positions [rad or m], shape (n, d).
            twist: Of the tool, in base axes [m/s, rad/s], shape (n, 6) or (6,).
        """
        J = self.axes.jacobians(q)
        U, s, Vt = np.linalg.svd(J * self.scale, full_matrices=False)
        w = _inverse(U, s, Vt, np.broadcast_to(twist, (len(q), 6)))
        if self.pull.any():
            free = self.pull * (self.middle - q) / self.scale
            w += free - np.einsum("nkd,nk->nd", Vt, np.einsum("nkd,nd->nk", Vt, free))
        return w * self.scale, s[:, -1]

    def corrected(
        self, q: FloatArray, position: FloatArray, rotation: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Bring the tool to a pose by Newton's method.

        Args:
            q: Joint positions near it [rad or m], shape (n, d).
            position: Of the pose [m], shape (3,).
            rotation: Of the pose, shape (3, 3).

        Returns:
            Joint positions, shape (n, d), and the error left [m, rad], shape (n,).
        """
        target = np.broadcast_to(rotation.T[:, :, None], (3, 3, len(q)))
        error = np.full(len(q), np.inf)
        for _ in range(CORRECTIONS):
            tip, turned, points, axes = self.axes.forward(q)
            twist, _, _ = pose_errors(tip, turned, position[:, None], target)
            before, error = error, np.abs(twist).max(axis=0)
            # stop where it is on the path, and where rounding lets it come no nearer
            if (error <= ON_PATH).all() or not (error < 0.5 * before).any():
                break
            J = self.axes.jacobian(tip, points, axes).transpose(2, 0, 1)
            U, s, Vt = np.linalg.svd(J * self.scale, full_matrices=False)
            q = q + _inverse(U, s, Vt, twist.T) * self.scale
        return q, error


def _inverse(U: FloatArray, s: FloatArray, Vt: FloatArray, twist: FloatArray) -> FloatArray:
    part = np.einsum("nik,ni->nk", U, twist)
    part *= np.where(s > 1e-12 * s[:, :1], 1.0 / np.maximum(s, 1e-300), 0.0)
    return np.einsum("nkd,nk->nd", Vt, part)


def continue_along(
    robot: Robot,
    path: TimedPath,
    starts: FloatArray,
    times: FloatArray,
    *,
    pull: float = 0.0,
    step: float = STEP,
) -> Continuation:
    """Follow a path from some starts.

    Args:
        robot: The arm.
        path: Poses of the tool over time.
        starts: Joint positions at the first of the times [rad or m], shape (m, d).
        times: Increasing [s], shape (k,).
        pull: See `JointField`.
        step: Joints move by no more than this between corrections [rad or m].
    """
    field = JointField(robot, pull)
    progress = _Progress(robot, starts)
    q = np.array(starts, dtype=float)
    result = np.full((len(times), *q.shape), np.nan)
    result[0] = q
    stops = np.union1d(times, [t for t in path.breaks if times[0] < t < times[-1]])
    at = {float(t): i for i, t in enumerate(times)}
    for start, end in pairwise(stops):
        now = float(start)
        while now < end:
            v = progress.look(field, path, q, now, "right")
            alive = np.flatnonzero(~progress.lost)
            if not alive.size:
                return Continuation(result, tuple(progress.obstacles))
            fastest, left = float(np.abs(v[alive]).max()), end - now
            parts = max(
                1, np.ceil(left * fastest / step), np.ceil(LEAST_STEPS * left / (end - start))
            )
            q[alive], error = _step(field, path, q[alive], now, left / parts)
            now = float(end) if parts == 1 else now + left / parts
            progress.stray(now, alive, error)
        progress.look(field, path, q, float(end), "left")
        if float(end) in at:
            result[at[float(end)]] = np.where(progress.lost[:, None], np.nan, q)
    return Continuation(result, tuple(progress.obstacles))


def _twists(path: TimedPath, t: FloatArray, at: float, side: str) -> FloatArray:
    return path.state(t, at=at, side=side)[2]


def _step(
    field: JointField, path: TimedPath, q: FloatArray, t: float, h: float
) -> tuple[FloatArray, FloatArray]:
    """One Runge-Kutta step and its correction."""
    when = np.array([t, t + 0.5 * h, t + h])
    position, rotation, twist, _ = path.state(when, at=t + 0.5 * h)
    k1, _ = field.velocities(q, twist[0])
    k2, _ = field.velocities(q + 0.5 * h * k1, twist[1])
    k3, _ = field.velocities(q + 0.5 * h * k2, twist[1])
    k4, _ = field.velocities(q + h * k3, twist[2])
    q = q + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return field.corrected(q, position[2], rotation[2])


class _Progress:
    """How far each start has come, and what it met."""

    def __init__(self, robot: Robot, starts: FloatArray) -> None:
        self.lower, self.upper = limits_of(robot)
        self.limit = np.minimum(robot.velocity_limit, FASTEST_JOINT)
        self.lost: BoolArray = np.zeros(len(starts), dtype=bool)
        self.smallest = np.full(len(starts), np.nan)
        self.obstacles: list[Obstacle | None] = [None] * len(starts)

    def look(
        self, field: JointField, path: TimedPath, q: FloatArray, time: float, side: str
    ) -> FloatArray:
        """Note limits that are broken, and return the joint velocities, shape (m, d)."""
        rows = np.flatnonzero(~self.lost)
        v = np.zeros(q.shape)
        v[rows], self.smallest[rows] = field.velocities(
            q[rows], _twists(path, np.array([time]), time, side)[0]
        )
        beyond = np.maximum(q - self.upper, self.lower - q)
        use = np.abs(v) / self.limit
        for row in rows:
            if use[row].max() > 1.0 + AT_LIMIT:
                j = int(use[row].argmax())
                self._note(row, "velocity limit", time, j, abs(v[row, j]), self.limit[j])
                self.lost[row] = use[row, j] > HOPELESS
            elif beyond[row].max() > AT_LIMIT:
                j = int(beyond[row].argmax())
                limit = self.upper[j] if q[row, j] > self.upper[j] else self.lower[j]
                self._note(row, "joint limit", time, j, q[row, j], limit)
        return v

    def stray(self, time: float, rows: Any, error: FloatArray) -> None:
        """Give up starts from which the tool can't stay on the path."""
        for row in rows[~(error <= LOST)]:
            self.lost[row] = True
            if self.obstacles[row] is None:
                self._note(row, "singularity", time, 0, 0.0, 0.0)

    def _note(
        self, row: int, kind: str, time: float, joint: int, value: float, limit: float
    ) -> None:
        """Keep the first obstacle, with the worst value it comes to."""
        known = self.obstacles[row]
        if known is None:
            smallest = float(self.smallest[row])
            known = Obstacle(kind, time, joint, float(value), float(limit), time, smallest)
        elif (
            known.kind == kind
            and known.joint == joint
            and abs(value - limit) > abs(known.value - known.limit)
        ):
            known = replace(known, value=float(value), limit=float(limit), worst=time)
        self.obstacles[row] = known


def accelerations(
    robot: Robot,
    path: TimedPath,
    q: FloatArray,
    time: float,
    side: str,
    *,
    pull: float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Joint velocities and accelerations on the path, from one side of a time; shape (d,) each.

    The acceleration is the derivative of the field of joint velocities along itself, by central
    differences of fourth order: exact to about 1e-10 of its size.
    """
    field = JointField(robot, pull)
    v, _ = field.velocities(q[None], _twists(path, np.array([time]), time, side)[0])
    fastest, length = float(np.abs(v).max()), _piece_duration(path, time, side)
    h = DIFFERENCE_TIME * length if fastest == 0.0 else min(DIFFERENCE / fastest, length)
    offsets = h * np.array([-1.0, -0.5, 0.5, 1.0])
    twists = _twists(path, time + offsets, time, side)
    f, _ = field.velocities(q + offsets[:, None] * v, twists)
    coarse, fine = (f[3] - f[0]) / (2.0 * h), (f[2] - f[1]) / h
    return v[0], (4.0 * fine - coarse) / 3.0


def _piece_duration(path: TimedPath, time: float, side: str) -> float:
    breaks = np.asarray(path.breaks)
    index = np.searchsorted(breaks, time, "right" if side == "right" else "left")
    index = min(max(int(index), 1), len(breaks) - 1)
    return float(breaks[index] - breaks[index - 1])
