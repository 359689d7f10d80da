"""Continuation: the joints' motion along a tool path, from several starts at once.

The joint velocities of eq (4) are integrated from each start (Runge-Kutta, fourth order), and after
each step Newton's method brings the tool back onto the path along the row space of the Jacobian, so
that the self-motion of a redundant arm stays that of the integral. Branch and turns are kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from knotwork.kinematics.chain.joint_axes import joint_axes, pose_errors
from knotwork.kinematics.chain.joint_ranges import limits_of, middle
from knotwork.kinematics.chain.velocity import FASTEST_JOINT, joint_scales
from knotwork.robot import Robot
from knotwork.tool_paths import TimedPath
from knotwork.waypoints import FloatArray

# Joints move by no more than this in one step [rad or m].
STEP = 0.1
# And each stretch takes so many of them at least.
LEAST_STEPS = 4
# The path is evaluated for so many steps at once.
TOGETHER = 16
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
        smallest_singular_value: Of the Jacobian when it is worst.
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
    """Joints along a path from m starts; NaN where a start leads no further.

    Attributes:
        q: At the k times asked for [rad or m], shape (k, m, d).
        time: Of every step [s], shape (n,).
        position: Joint positions then [rad or m], shape (n, m, d).
        velocity: Joint velocities then [rad/s or m/s], shape (n, m, d).
        smallest: Smallest singular values then, shape (n, m).
    """

    q: FloatArray
    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    smallest: FloatArray

    def obstacle(self, robot: Robot, start: int, turns: FloatArray) -> Obstacle | None:
        """The first thing that is in the way of a start, whole turns away from it.

        Args:
            robot: The arm.
            start: Index of the start.
            turns: How far each joint is turned from it [rad], shape (d,).
        """
        q, v = self.position[:, start] + turns, self.velocity[:, start]
        limit = np.minimum(robot.velocity_limit, FASTEST_JOINT)
        lower, upper = limits_of(robot)
        over = np.maximum(q - upper, lower - q)
        use = np.abs(v) / limit
        found = []
        for kind, values, beyond in (
            ("velocity limit", np.abs(v), use > 1.0 + AT_LIMIT),
            ("joint limit", q, over > AT_LIMIT),
        ):
            when = np.flatnonzero(beyond.any(axis=1))
            if when.size:
                measure = use if kind == "velocity limit" else over
                j = int(np.nanargmax(measure[when[0]]))
                k = int(np.nanargmax(measure[:, j]))
                bound = (
                    limit[j]
                    if kind == "velocity limit"
                    else (upper[j], lower[j])[int(q[k, j] < lower[j])]
                )
                found.append(
                    Obstacle(
                        kind,
                        float(self.time[when[0]]),
                        j,
                        float(values[k, j]),
                        float(bound),
                        float(self.time[k]),
                        float(self.smallest[k, start]),
                    )
                )
        lost = np.flatnonzero(np.isnan(q).any(axis=1))
        if lost.size and not found:
            last = max(int(lost[0]) - 1, 0)
            time = float(self.time[last])
            found.append(
                Obstacle("singularity", time, 0, 0.0, 0.0, time, float(self.smallest[last, start]))
            )
        return min(found, key=lambda one: one.time, default=None)


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

    def velocities(
        self, q: FloatArray, twist: FloatArray, share: ArrayLike = 1.0
    ) -> tuple[FloatArray, FloatArray]:
        """Joint velocities and smallest singular values, shape (n, d) and (n,).

        Args:
            q: Joint positions [rad or m], shape (n, d).
            twist: Of the tool, in base axes [m/s, rad/s], shape (n, 6) or (6,).
            share: Part of its full speed that the tool has, so that self-motion rests where the
                tool does; a number, or shape (n,).
        """
        J = self.axes.jacobians(q)
        U, s, Vt = np.linalg.svd(J * self.scale, full_matrices=False)
        w = _inverse(U, s, Vt, np.broadcast_to(twist, (len(q), 6)))
        if self.pull.any():
            free = np.multiply.outer(np.asarray(share), np.ones(1)) * self.pull
            free = free * (self.middle - q) / self.scale
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
    return np.asarray(np.einsum("nkd,nk->nd", Vt, part))


def continue_along(
    robot: Robot,
    path: TimedPath,
    starts: FloatArray,
    times: FloatArray,
    *,
    pull: float = 0.0,
    step: float = STEP,
) -> Continuation:
    """Follow a path from some starts, whatever limits are broken on the way.

    Args:
        robot: The arm.
        path: Poses of the tool over time.
        starts: Joint positions at the first of the times [rad or m], shape (m, d).
        times: Increasing [s], shape (k,).
        pull: See `JointField`.
        step: Joints move by no more than this between corrections [rad or m].
    """
    field = JointField(robot, pull)
    limit = np.minimum(robot.velocity_limit, FASTEST_JOINT)
    q = np.array(starts, dtype=float)
    result = np.full((len(times), *q.shape), np.nan)
    result[0] = q
    stops = np.union1d(times, [t for t in path.breaks if times[0] < t < times[-1]])
    at = {float(t): i for i, t in enumerate(times)}
    steps: list[tuple[float, FloatArray, FloatArray, FloatArray]] = []
    for start, end in pairwise(stops):
        now, least = float(start), (end - start) / LEAST_STEPS
        v, smallest = _velocities(field, path, q, now, "right")
        while now < end and np.isfinite(q).any():
            fastest = float(np.nanmax(np.abs(v), initial=0.0))
            h = min(least, step / fastest) if fastest else least
            parts = int(np.ceil((end - now) / h - 1e-9))
            h = (end - now) / parts
            parts = min(parts, TOGETHER)
            last = float(end) if now + (parts + 0.5) * h > end else now + parts * h
            when = np.linspace(now, last, 2 * parts + 1)
            position, rotation, twist, _ = path.state(when, at=0.5 * (now + last))
            share = np.linalg.norm(twist[:, :3], axis=1) / path.full_speed
            for k in range(0, 2 * parts, 2):
                steps.append((float(when[k]), q.copy(), v, smallest))
                q[(np.abs(v) > HOPELESS * limit).any(axis=1)] = np.nan
                alive = np.flatnonzero(np.isfinite(q).all(axis=1))
                if alive.size:
                    stages = slice(k, k + 3)
                    moved = _step(
                        field,
                        q[alive],
                        v[alive],
                        twist[stages],
                        share[stages],
                        2 * (when[k + 1] - when[k]),
                    )
                    moved, error = field.corrected(moved, position[k + 2], rotation[k + 2])
                    moved[~(error <= LOST)] = np.nan
                    q[alive] = moved
                v, smallest = _finite_velocities(field, q, twist[k + 2], share[k + 2])
            now = last
        steps.append((now, q.copy(), v, smallest))
        if float(end) in at:
            result[at[float(end)]] = q
    time, positions, velocities, values = zip(*steps, strict=True)
    return Continuation(
        result, np.array(time), np.array(positions), np.array(velocities), np.array(values)
    )


def _velocities(
    field: JointField, path: TimedPath, q: FloatArray, time: float, side: str
) -> tuple[FloatArray, FloatArray]:
    """Joint velocities and smallest singular values; NaN for starts that lead no further."""
    (twist,), (share,) = _demand(path, np.array([time]), time, side)
    return _finite_velocities(field, q, twist, share)


def _finite_velocities(
    field: JointField, q: FloatArray, twist: FloatArray, share: float
) -> tuple[FloatArray, FloatArray]:
    v, smallest = np.full(q.shape, np.nan), np.full(len(q), np.nan)
    alive = np.flatnonzero(np.isfinite(q).all(axis=1))
    if alive.size:
        v[alive], smallest[alive] = field.velocities(q[alive], twist, share)
    return v, smallest


def _demand(path: TimedPath, t: FloatArray, at: float, side: str) -> tuple[FloatArray, FloatArray]:
    """Twists of the tool, and the part of the path's full speed that it has."""
    twist = path.state(t, at=at, side=side)[2]
    speed = np.linalg.norm(twist[:, :3], axis=1)
    return twist, speed / path.full_speed


def _step(
    field: JointField, q: FloatArray, v: FloatArray, twist: FloatArray, share: FloatArray, h: float
) -> FloatArray:
    """One Runge-Kutta step; `v` are the velocities at its start, twists are at three times."""
    k2, _ = field.velocities(q + 0.5 * h * v, twist[1], share[1])
    k3, _ = field.velocities(q + 0.5 * h * k2, twist[1], share[1])
    k4, _ = field.velocities(q + h * k3, twist[2], share[2])
    return np.asarray(q + h / 6.0 * (v + 2.0 * k2 + 2.0 * k3 + k4))


def velocity_on_path(
    robot: Robot, path: TimedPath, q: FloatArray, time: float, pull: float = 0.0
) -> FloatArray:
    """Joint velocities that follow a path at a time [rad/s or m/s], shape (d,)."""
    side = "left" if time >= path.end_time else "right"
    time = min(max(time, path.start_time), path.end_time)
    v, _ = JointField(robot, pull).velocities(q[None], *_demand(path, np.array([time]), time, side))
    return np.asarray(v[0])


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
    v, _ = field.velocities(q[None], *_demand(path, np.array([time]), time, side))
    fastest, length = float(np.abs(v).max()), _piece_duration(path, time, side)
    h = DIFFERENCE_TIME * length if fastest == 0.0 else min(DIFFERENCE / fastest, length)
    offsets = h * np.array([-1.0, -0.5, 0.5, 1.0])
    f, _ = field.velocities(q + offsets[:, None] * v, *_demand(path, time + offsets, time, side))
    coarse, fine = (f[3] - f[0]) / (2.0 * h), (f[2] - f[1]) / h
    return v[0], (4.0 * fine - coarse) / 3.0


def _piece_duration(path: TimedPath, time: float, side: str) -> float:
    breaks = np.asarray(path.breaks)
    found = int(np.searchsorted(breaks, time, "right" if side == "right" else "left"))
    index = min(max(found, 1), len(breaks) - 1)
    return float(breaks[index] - breaks[index - 1])
