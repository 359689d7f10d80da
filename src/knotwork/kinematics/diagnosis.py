"""Saying why a pose has no solution: outside the limits, out of reach, or badly turned."""

from __future__ import annotations

from typing import NoReturn

import numpy as np

from knotwork.errors import OutsideLimitsError, UnreachablePoseError
from knotwork.kinematics.levenberg_marquardt import LocalSolution, PoseSearch
from knotwork.kinematics.restarts import FULL_TURN, BoolArray, low_discrepancy, nearest_turns
from knotwork.robot import Robot
from knotwork.waypoints import FloatArray

# Searches for each question; the questions are asked only once a waypoint has failed.
SEARCHES = 60
# How much more a metre counts than a radian when the point is to be kept and the tool turned.
POINT_FIRST = 1e3


def raise_unsolved(search: PoseSearch, near: FloatArray, *, waypoint: str, where: str) -> NoReturn:
    """Find out why no solution was found, and raise the error that says so.

    Args:
        search: The pose, and the robot.
        near: Configuration whose surroundings matter most, shape (d,).
        waypoint: Name of the waypoint.
        where: Where it is defined.

    Raises:
        OutsideLimitsError: Joints outside their position limits would reach the pose.
        UnreachablePoseError: No joint positions would.
    """
    robot = search.robot
    found = _unlimited(search, near)
    solutions = [solution for solution in found if solution.converged]
    if solutions:
        _raise_outside_limits(robot, solutions, near, waypoint, where)
    closest = min(found, key=lambda s: s.position_error**2 + s.orientation_error**2)
    point = _with_weights(search, 1.0, 0.0)
    at_point = [s for s in _unlimited(point, near) if s.converged]
    if at_point:
        turned = _with_weights(search, POINT_FIRST, 1.0)
        starts = [closest, *sorted(at_point, key=lambda s: s.orientation_error)[:8]]
        reached = [_refine(turned, point, start.q) for start in starts]
        reached = [s for s in reached if s.converged]
        best = min([*reached, *at_point], key=lambda s: s.orientation_error)
        raise UnreachablePoseError(
            waypoint,
            "the point is reachable, but not in this orientation: the nearest found is off by "
            f"{_angle(best.orientation_error)}",
            position_shortfall=best.position_error,
            orientation_shortfall=best.orientation_error,
            where=where,
        )
    nearest = min(
        (_with_weights(search, 1.0, 0.0).solve(closest.q, *_no_limits(robot)), closest),
        key=lambda s: s.position_error,
    )
    raise UnreachablePoseError(
        waypoint,
        f"the pose is out of reach: the nearest point found is "
        f"{_length(nearest.position_error)} away in any orientation, the nearest pose "
        f"{_length(closest.position_error)} and {_angle(closest.orientation_error)}",
        position_shortfall=closest.position_error,
        orientation_shortfall=closest.orientation_error,
        where=where,
    )


def _with_weights(search: PoseSearch, position: float, orientation: float) -> PoseSearch:
    return search.reweighted(position_weight=position, orientation_weight=orientation)


def _no_limits(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Limits for a search that ignores them."""
    return np.full(robot.dof, -np.inf), np.full(robot.dof, np.inf)


def _unlimited(search: PoseSearch, near: FloatArray) -> list[LocalSolution]:
    """Search without position limits, from a full turn of each revolute joint."""
    robot = search.robot
    bounded = np.isfinite(robot.lower_position_limit) & np.isfinite(robot.upper_position_limit)
    revolute = _revolute(robot)
    lower = np.where(revolute | ~bounded, near - np.pi, robot.lower_position_limit)
    width = np.where(revolute | ~bounded, FULL_TURN, robot.upper_position_limit - lower)
    points = low_discrepancy(robot.dof)
    starts = [near, *(lower + next(points) * width for _ in range(SEARCHES))]
    return [search.solve(start, *_no_limits(robot)) for start in starts]


def _refine(turned: PoseSearch, point: PoseSearch, q: FloatArray) -> LocalSolution:
    """Turn the tool as far as the point allows, then put it exactly on the point."""
    limits = _no_limits(turned.robot)
    return point.solve(turned.solve(q, *limits).q, *limits)


def _revolute(robot: Robot) -> BoolArray:
    return np.array([unit == "rad" for unit in robot.joint_units])


def _raise_outside_limits(
    robot: Robot, solutions: list[LocalSolution], near: FloatArray, waypoint: str, where: str
) -> NoReturn:
    lower, upper = robot.lower_position_limit, robot.upper_position_limit
    turned = [nearest_turns(s.q, near, lower, upper, _revolute(robot)) for s in solutions]

    def excess(q: FloatArray) -> FloatArray:
        return np.maximum(np.maximum(lower - q, q - upper), 0.0)

    best = min(turned, key=lambda q: (float(excess(q).sum()), float(np.linalg.norm(q - near))))
    joints = [
        (robot.joint_names[i], float(best[i]), float(lower[i]), float(upper[i]))
        for i in np.flatnonzero(excess(best))
    ]
    units = dict(zip(robot.joint_names, robot.joint_units, strict=True))
    said = "; ".join(
        f"{name} at {value:.6g} {units[name]}, outside [{low:.6g}, {high:.6g}]"
        for name, value, low, high in joints
    )
    raise OutsideLimitsError(
        waypoint,
        f"the pose is reachable only outside the joint limits: the solution found that is least "
        f"outside has {said}",
        joints=joints,
        where=where,
    )


def _length(value: float) -> str:
    return f"{value:.4g} m"


def _angle(value: float) -> str:
    return f"{value:.4g} rad ({np.degrees(value):.3g}°)"
