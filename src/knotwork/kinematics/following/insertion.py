"""Waypoints along a tool path: as many as hold the curve between them to the path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.errors import PathError
from knotwork.interpolation import ModifiedHermiteSpline
from knotwork.kinematics.chain.joint_axes import joint_axes
from knotwork.kinematics.following.continuation import (
    accelerations,
    continue_along,
)
from knotwork.kinematics.following.joint_field import JointField
from knotwork.robot import Robot
from knotwork.tool_paths import TimedPath
from knotwork.tool_paths.rotations import angle_of
from knotwork.waypoints import FloatArray

# Places in each interval where the curve is compared with the path: where its error is largest.
SAMPLES = (0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875)
# Waypoints are inserted until the errors there are down to this part of the tolerances.
PART = 0.9
# Beyond so many the tolerances are refused.
MOST = 100_000
MOST_PARTS = 8
EVEN_ROUNDS = 3
# Waypoints are not nearer to each other than this [s].
SHORTEST = 1e-5
# Joints of an arm that has self-motion move by no more than this in a step [rad or m], so that
# it is exact to about 1e-9; others are brought back onto the path after any step.
STEP, LONG_STEP = 0.05, 0.2


@dataclass(frozen=True)
class PathTolerance:
    """How near a motion has to be to its path.

    Attributes:
        position: Distance from the path [m].
        orientation: Angle from the orientation there [rad].
        speed: Difference of speed, as a part of the path's.
    """

    position: float
    orientation: float
    speed: float


@dataclass(frozen=True, eq=False)
class FollowedPath:
    """Waypoints that hold the joints to a path.

    Attributes:
        time: [s], shape (k,).
        position, velocity, acceleration: Of the joints, shape (k, d).
    """

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


def follow_path(
    robot: Robot,
    path: TimedPath,
    start: FloatArray,
    tolerance: PathTolerance,
    *,
    times: FloatArray | None = None,
    pull: float = 0.0,
) -> FollowedPath:
    """Find waypoints along a path that hold the modified Hermite curve to it.

    Between two waypoints whose positions, velocities and accelerations are those of the path the
    curve is a section of its own. Its error falls with the fourth power of the interval, so few
    are needed. Where the curvature of the path jumps the acceleration is the mean of both sides,
    and waypoints gather there.

    Args:
        robot: The arm.
        path: Poses of the tool over time.
        start: Joint positions where it begins [rad or m], shape (d,).
        tolerance: What to hold.
        times: Times to have a waypoint at, besides those where something begins anew [s].
        pull: See `JointField`.

    Raises:
        PathError: The tolerances take more waypoints than can be.
    """
    ends = np.union1d(path.breaks, [] if times is None else times)
    begin, turned, _, _ = path.state([path.start_time])
    start = JointField(robot, pull).corrected(start[None], begin[0], turned[0])[0][0]
    count = np.ones(len(ends) - 1, dtype=int)
    followed = _at(robot, path, start, ends, pull)
    for _ in range(EVEN_ROUNDS):  # even intervals first: fewest waypoints where all is smooth
        use = _use(robot, path, followed, tolerance)
        worst = np.maximum.reduceat(use, np.concatenate(([0], np.cumsum(count)[:-1])))
        if (worst <= 1.0).all():
            return followed
        more = np.ceil(count * np.minimum(worst, MOST_PARTS**4) ** 0.25).astype(int)
        count = np.where(worst > 1.0, np.maximum(more, count + 1), count)
        _check_count(count.sum(), tolerance)
        pieces = zip(ends[:-1], ends[1:], count, strict=True)
        wanted = [np.linspace(a, b, n + 1)[:-1] for a, b, n in pieces]
        followed = _at(robot, path, start, np.append(np.concatenate(wanted), ends[-1]), pull)
    while True:  # then only where it is needed, as beside a jump of the curvature
        use = _use(robot, path, followed, tolerance)
        if (use <= 1.0).all():
            return followed
        _check_count(len(use) + (use > 1.0).sum(), tolerance)
        _check_lengths(path, followed, use)
        middle = 0.5 * (followed.time[1:] + followed.time[:-1])[use > 1.0]
        if robot.dof > 6:  # one integration, or self-motion would jump where two of them meet
            followed = _at(robot, path, start, np.union1d(followed.time, middle), pull)
        else:
            followed = _with(robot, path, followed, middle, pull)


def _check_count(count: int, tolerance: PathTolerance) -> None:
    if count > MOST:
        raise PathError(
            f"the tolerances {tolerance.position:g} m, {tolerance.orientation:g} rad and "
            f"{tolerance.speed:g} of the speed would take more than {MOST} waypoints along the "
            "path; wider ones would do, or a round corner where its curvature jumps"
        )


def _check_lengths(path: TimedPath, followed: FollowedPath, use: FloatArray) -> None:
    """Refuse intervals so short that no others would do either."""
    short = np.flatnonzero((use > 1.0) & (np.diff(followed.time) < SHORTEST))
    if short.size:
        i = int(short[use[short].argmax()])
        along = float(path.arc_length(followed.time[i : i + 1])[0])
        raise PathError(
            f"{along:.6g} m along the path no waypoints hold the motion to it: even on "
            f"{SHORTEST:g} s it uses {PART * use[i]:.3g} times the tolerances; wider ones, a lower "
            "speed or a round corner there would do"
        )


def _at(
    robot: Robot, path: TimedPath, start: FloatArray, times: FloatArray, pull: float
) -> FollowedPath:
    step = STEP if robot.dof > 6 else LONG_STEP
    q = continue_along(robot, path, start[None], times, pull=pull, step=step).q[:, 0]
    return FollowedPath(times, q, *_rates(robot, path, times, q, pull))


def _rates(
    robot: Robot, path: TimedPath, times: FloatArray, q: FloatArray, pull: float
) -> tuple[FloatArray, FloatArray]:
    """Velocities and accelerations; at a jump of the acceleration the mean of both sides."""
    v, a = np.empty(q.shape), np.empty(q.shape)
    for side, own in (("left", times == path.end_time), ("right", times < path.end_time)):
        if own.any():
            v[own], a[own] = accelerations(robot, path, q[own], times[own], side, pull=pull)
    inner = np.isin(times, path.breaks[1:-1])
    if inner.any():
        _, before = accelerations(robot, path, q[inner], times[inner], "left", pull=pull)
        a[inner] = 0.5 * (a[inner] + before)
    return v, a


def _with(
    robot: Robot, path: TimedPath, known: FollowedPath, more: FloatArray, pull: float
) -> FollowedPath:
    """Add waypoints, each followed from the one before it that is known."""
    before = np.searchsorted(known.time, more, "right") - 1
    q = np.empty((len(more), known.position.shape[1]))
    for i in np.unique(before):
        own = np.flatnonzero(before == i)
        times = np.concatenate((known.time[i : i + 1], more[own]))
        start = known.position[i : i + 1]
        step = STEP if robot.dof > 6 else LONG_STEP
        q[own] = continue_along(robot, path, start, times, pull=pull, step=step).q[1:, 0]
    rates = _rates(robot, path, more, q, pull)
    time = np.concatenate((known.time, more))
    order = np.argsort(time)
    values = zip((known.position, known.velocity, known.acceleration), (q, *rates), strict=True)
    return FollowedPath(time[order], *(np.concatenate(both)[order] for both in values))


def _use(
    robot: Robot, path: TimedPath, followed: FollowedPath, tolerance: PathTolerance
) -> FloatArray:
    """The part of the tolerances that each interval uses, shape (k - 1,)."""
    spline = ModifiedHermiteSpline(
        followed.time,
        followed.position,
        followed.velocity,
        acceleration=followed.acceleration,
    )
    start, length = followed.time[:-1, None], np.diff(followed.time)[:, None]
    times = (start + length * np.array(SAMPLES)).ravel()
    use = errors(robot, path, spline(times), spline(times, 1), times) / (
        PART * np.array([tolerance.position, tolerance.orientation, tolerance.speed])
    )
    return np.asarray(use.reshape(len(start), -1).max(axis=1))


def errors(
    robot: Robot, path: TimedPath, q: FloatArray, v: FloatArray, times: FloatArray
) -> FloatArray:
    """Distance [m], angle [rad] and part of the speed by which joints are off a path; (k, 3)."""
    axes = joint_axes(robot)
    tip, columns, points, directions = axes.forward(q)
    J = axes.jacobian(tip, points, directions).transpose(2, 0, 1)
    moved = np.einsum("nij,nj->ni", J, v)[:, :3]
    rotations = columns.transpose(2, 1, 0)
    _, distance, gap = path.path.gaps(tip.T, rotations, path.arc_length(times))
    wanted = path.state(times)[2][:, :3]
    fastest = max(float(np.linalg.norm(wanted, axis=1).max()), 1e-12)
    off = np.abs(np.linalg.norm(moved, axis=1) - np.linalg.norm(wanted, axis=1)) / fastest
    return np.stack((distance, angle_of(gap), off), axis=1)
