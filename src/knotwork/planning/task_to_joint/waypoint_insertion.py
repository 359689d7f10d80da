"""Waypoints inserted along a tool path until its tolerances are proved to be kept."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from knotwork.arrays import FloatArray
from knotwork.curves.interpolation import ModifiedHermiteSpline
from knotwork.curves.interpolation.knots import KnotPlacement
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.distinct import sort_distinct
from knotwork.curves.tool_paths import TimedPath
from knotwork.curves.tool_paths.rotations import rotation_angle
from knotwork.errors import PathError
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.robot.kinematics.following.joints_on_path import JointsOnPath
from knotwork.task import ToolTolerances
from knotwork.verification.bounds.path_criteria import PathTolerances
from knotwork.verification.bounds.stretch_bounds import path_bounds, path_rounding

FOLLOWING_SAMPLES = (0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875)
"""Fractions of each interval at which the curve is compared with the path, where errors are
largest.
"""
SAMPLED_SHARE = 0.9
"""Waypoints are inserted until the sampled errors are below this fraction of the tolerances, and
then until the proof succeeds. The proof leaves no margin.
"""
MAX_WAYPOINTS = 100_000
"""Number of waypoints above which tolerances are refused."""
MAX_PARTS, EVEN_ROUNDS = 8, 3
"""Maximum number of parts of an interval in one round of even division, and number of rounds."""
SELF_MOTION_TOLERANCE = 5e-3
"""Tolerance of the self-motion between waypoints [rad or m], relative to the motion whose limits
were checked.
"""
MIN_INTERVAL = 1e-5
"""Duration below which an interval is not divided [s]."""
CLOSE_BREAKS = 2e-4
"""Distance below which breaks of a path are merged [s]. With a shorter interval between waypoints,
rounding of joint positions would appear as acceleration and jerk.
"""

TOLERANCE_NARROWING = 1e-6
"""Fraction by which the tolerances of the proof are narrower. The check rounds differently, and
must reach the same verdict.
"""
ROUNDING_FACTOR = 4.0
"""Minimum ratio of a tolerance to the rounding error of the bounds."""


class PathWaypoints(NamedTuple):
    """Waypoints that keep the joints on a path.

    Attributes:
        time: Times [s], shape (k,).
        position, velocity, acceleration: Joint motion, shape (k, d).
    """

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


def insert_path_waypoints(
    joints_on_path: JointsOnPath,
    tolerance: ToolTolerances,
    *,
    times: FloatArray | None = None,
    knots: KnotPlacement = "paper",
) -> PathWaypoints:
    """Find waypoints along a path with which the modified Hermite curve provably follows it.

    Between two waypoints with the positions, velocities and accelerations of the path the curve is
    an independent section. Its error decreases with the fourth power of the interval, so few
    waypoints are sufficient. Where the curvature of the path jumps, the acceleration is the mean of
    both sides, and waypoints are dense.

    Args:
        joints_on_path: The arm on the path.
        tolerance: Tolerances of the motion.
        times: Times that get a waypoint, in addition to the breaks of the path [s].
        knots: Knot placement of the curve: see `ModifiedHermiteSpline`.

    Raises:
        PathError: The tolerances need too many waypoints, or are too fine to be proved.
    """
    insertion, path = _Insertion(joints_on_path, tolerance, knots), joints_on_path.path
    ends = _waypoint_times(path, [] if times is None else times)
    followed, utilisation = insertion.divide_evenly(ends)
    # not earlier, because rounding errors near a singularity are far larger with fewer waypoints
    _check_tolerance(joints_on_path.robot, insertion.curve(followed), path, tolerance)
    while True:
        if (utilisation <= 1.0).all():
            curve = insertion.curve(followed)
            utilisation = _proved_utilisation(
                joints_on_path.robot, curve, path, tolerance, followed.time
            )
            if (utilisation <= 1.0).all():
                return followed
        followed = insertion.divide(followed, utilisation)
        utilisation = insertion.utilisation(followed)


@dataclass(frozen=True, eq=False)
class _Insertion:
    """Insertion of waypoints along one path."""

    joints_on_path: JointsOnPath
    tolerance: ToolTolerances
    knots: KnotPlacement

    def waypoints_at(self, times: FloatArray) -> PathWaypoints:
        q = self.joints_on_path.positions(times)
        return PathWaypoints(times, q, *self.joints_on_path.rates(times, q))

    def curve(self, followed: PathWaypoints) -> ModifiedHermiteSpline:
        return ModifiedHermiteSpline(
            followed.time,
            followed.position,
            followed.velocity,
            knots=self.knots,
            acceleration=followed.acceleration,
        )

    def divide_evenly(self, ends: FloatArray) -> tuple[PathWaypoints, FloatArray]:
        """Equal intervals between given times, the fewest on a smooth path, and `utilisation`."""
        count = np.ones(len(ends) - 1, dtype=int)
        followed = self.waypoints_at(ends)
        utilisation = self.utilisation(followed)
        for _ in range(EVEN_ROUNDS):
            worst = np.maximum.reduceat(utilisation, np.concatenate(([0], np.cumsum(count)[:-1])))
            if (worst <= 1.0).all():
                break
            parts = np.ceil(count * np.minimum(worst, MAX_PARTS**4) ** 0.25).astype(int)
            count = np.where(worst > 1.0, np.maximum(parts, count + 1), count)
            self._check_count(int(count.sum()))
            pieces = zip(ends[:-1], ends[1:], count, strict=True)
            wanted = [np.linspace(a, b, n + 1)[:-1] for a, b, n in pieces]
            followed = self.waypoints_at(np.append(np.concatenate(wanted), ends[-1]))
            utilisation = self.utilisation(followed)
        return followed, utilisation

    def divide(self, followed: PathWaypoints, utilisation: FloatArray) -> PathWaypoints:
        """Divide the intervals that exceed the tolerances."""
        excess = utilisation > 1.0
        self._check_count(len(utilisation) + int(excess.sum()))
        self._check_lengths(followed, utilisation)
        middles = self.waypoints_at(0.5 * (followed.time[1:] + followed.time[:-1])[excess])
        order = np.argsort(np.concatenate((followed.time, middles.time)))
        values = zip(followed, middles, strict=True)
        return PathWaypoints(*(np.concatenate(columns)[order] for columns in values))

    def utilisation(self, followed: PathWaypoints) -> FloatArray:
        """Sampled error of each interval relative to the tolerances, shape (k - 1,)."""
        spline = self.curve(followed)
        start, length = followed.time[:-1, None], np.diff(followed.time)[:, None]
        times = (start + length * np.array(FOLLOWING_SAMPLES)).ravel()
        allowed, q = self.tolerance, spline(times)
        off = sampled_path_errors(
            self.joints_on_path.robot, self.joints_on_path.path, q, spline(times, 1), times
        )
        limits = np.array([allowed.path, allowed.path_orientation, allowed.path_speed])
        utilisation = (off / (SAMPLED_SHARE * limits)).max(axis=1)
        if self.joints_on_path.robot.is_redundant:  # the tool's error does not include self-motion
            strayed = self._self_motion_error(q, times)
            utilisation = np.maximum(utilisation, strayed / SELF_MOTION_TOLERANCE)
        return np.asarray(utilisation.reshape(len(start), -1).max(axis=1))

    def _self_motion_error(self, q: FloatArray, times: FloatArray) -> FloatArray:
        """Distance of joints (k, d) from the motion on the path at times [rad or m], shape (k,)."""
        strayed = np.abs(q - self.joints_on_path.curve(times)).max(axis=1)
        far = strayed > SELF_MOTION_TOLERANCE
        if far.any():  # that curve is approximate: compute these exactly
            strayed[far] = np.abs(q[far] - self.joints_on_path.positions(times[far])).max(axis=1)
        return np.asarray(strayed)

    def _check_count(self, count: int) -> None:
        if count > MAX_WAYPOINTS:
            raise PathError(
                f"tolerances path, path_orientation and path_speed need more than {MAX_WAYPOINTS} "
                "waypoints along the path; accepted: larger ones, or a rounded corner where its "
                "curvature jumps"
            )

    def _check_lengths(self, followed: PathWaypoints, utilisation: FloatArray) -> None:
        """Refuse intervals below the resolution of time."""
        short = np.flatnonzero((utilisation > 1.0) & (np.diff(followed.time) < MIN_INTERVAL))
        if short.size:
            i = int(short[utilisation[short].argmax()])
            raise PathError(
                f"at {followed.time[i]:.6g} s no waypoints keep the motion within its tolerances: "
                f"even in {MIN_INTERVAL:g} s the error is {utilisation[i]:.3g} times the "
                "tolerance; accepted: larger tolerances, a lower speed, or a rounded corner there"
            )


def _waypoint_times(path: TimedPath, times: ArrayLike) -> FloatArray:
    """Times of the waypoints that every tolerance needs: the given times and the breaks [s].

    A break close to another of these times is left out.
    """
    fixed = sort_distinct(path.breaks[[0, -1]], times)
    ends = list(fixed)
    for time in path.breaks[1:-1]:
        i = bisect_left(ends, time)
        if min(time - ends[i - 1], ends[i] - time) >= CLOSE_BREAKS:
            ends.insert(i, time)
    return np.array(ends)


def sampled_path_errors(
    robot: Robot, path: TimedPath, q: FloatArray, v: FloatArray, times: FloatArray
) -> FloatArray:
    """Errors of joints on a path: distance [m], angle [rad], relative speed; shape (k, 3)."""
    tip, columns, J = joint_axes(robot).compute_poses_and_jacobians(q)
    velocity, rotations = np.einsum("ijn,nj->ni", J[:3], v), columns.transpose(2, 1, 0)
    place, rotations, velocity = path.woven_frame.relative_motion(times, tip.T, rotations, velocity)
    along = path.tool_path.nearest(place, path.arc_length(times))
    distance, rotation = path.tool_path.deviations(place, rotations, along)
    off = np.abs(np.linalg.norm(velocity, axis=1) - path.speed(times)) / path.requested_speed(times)
    return np.stack((distance, rotation_angle(rotation), off), axis=1)


def _check_tolerance(
    robot: Robot, curve: PiecewisePolynomial, path: TimedPath, tolerance: ToolTolerances
) -> None:
    """Refuse tolerances that are too fine to be proved.

    Raises:
        PathError: A tolerance is too fine.
    """
    least = ROUNDING_FACTOR * path_rounding(robot, curve, path)
    slowest = float(path.timing.speeds.min())
    for quantity, value, needed, unit in (
        ("of the distance from the path", tolerance.path, least, " m"),
        ("of the orientation", tolerance.path_orientation, least, " rad"),
        (f"of the speed, a part of {slowest:g} m/s,", tolerance.path_speed, least / slowest, ""),
    ):
        if value < needed:
            raise PathError(
                f"the tolerance {quantity} is {value:g}{unit}: rounding leaves no margin to prove "
                f"it; at least {needed:.2g}{unit} is accepted"
            )


def _proved_utilisation(
    robot: Robot,
    curve: PiecewisePolynomial,
    path: TimedPath,
    tolerance: ToolTolerances,
    times: FloatArray,
) -> FloatArray:
    """Upper bound on the error between waypoints, relative to the tolerances.

    The same proof as in the check: see `verification.bounds.stretch_bounds`.

    Args:
        robot: The arm.
        curve: Joint positions along the whole path, trailing shape (d,).
        path: Poses of the tool over time.
        tolerance: Tolerances of the motion.
        times: Times of the waypoints, including ends of stretches [s], shape (k,).

    Returns:
        Bounds, above 1 where nothing is proved, shape (k - 1,).
    """
    utilisation = np.zeros(len(times) - 1)
    part = 1.0 - TOLERANCE_NARROWING
    timing, start = path.timing, path.start_time
    for i, speed in enumerate(timing.speeds.tolist()):
        begin, end = start + timing.times[i : i + 2]
        low, high = start + timing.full_speed_intervals[i]
        narrowed = PathTolerances.of(tolerance, speed, (low, high), part)
        bounds = path_bounds(robot, curve, path, (begin, end), narrowed)
        middle = 0.5 * (bounds.times[1:] + bounds.times[:-1])
        interval = np.clip(np.searchsorted(times, middle) - 1, 0, len(utilisation) - 1)
        np.maximum.at(utilisation, interval, bounds.utilisation)
    return utilisation
