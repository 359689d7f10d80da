"""Saying why a pose has no solution: outside the limits, out of reach, or badly turned."""

from __future__ import annotations

from dataclasses import dataclass
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
# Solutions beyond the limits that searches inside them start from, the nearest first.
TRIED_INSIDE = 12
# A joint is at its limit, or an excess over it is rounding, within this [rad or m].
AT_LIMIT = 1e-9
# Below these the nearest pose inside the limits is as near as the nearest of all [m, rad].
AS_NEAR = 1e-4


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
        _raise_outside_limits(search, solutions, near, waypoint, where)
    closest = min(found, key=_size)
    point = _with_weights(search, 1.0, 0.0)
    at_point = [s for s in _unlimited(point, near) if s.converged]
    if at_point:
        turned = _with_weights(search, POINT_FIRST, 1.0)
        starts = [closest, *sorted(at_point, key=lambda s: s.orientation_error)[:8]]
        reached = [_refine(turned, point, start.q) for start in starts]
        reached = [s for s in reached if s.converged]
        best = min([*reached, *at_point], key=lambda s: s.orientation_error)
        inside = _closest_inside(turned, [*reached, *at_point], near, POINT_FIRST)
        raise UnreachablePoseError(
            waypoint,
            "the point is reachable, but not in this orientation: the nearest found is off by "
            f"{_angle(best.orientation_error)}{inside.said(best)}",
            position_shortfall=best.position_error,
            orientation_shortfall=best.orientation_error,
            closest=inside.solution.q.tolist(),
            held=inside.held,
            where=where,
        )
    inside = _closest_inside(search, found, near)
    nearest = min(
        (_with_weights(search, 1.0, 0.0).solve(closest.q, *_no_limits(robot)), closest),
        key=lambda s: s.position_error,
    )
    raise UnreachablePoseError(
        waypoint,
        f"the pose is out of reach: the nearest point found is "
        f"{_length(nearest.position_error)} away in any orientation, the nearest pose "
        f"{_length(closest.position_error)} and {_angle(closest.orientation_error)}"
        f"{inside.said(closest)}",
        position_shortfall=closest.position_error,
        orientation_shortfall=closest.orientation_error,
        closest=inside.solution.q.tolist(),
        held=inside.held,
        where=where,
    )


@dataclass(frozen=True, eq=False)
class _Inside:
    """How near the arm comes inside its limits, and the joints that are held there."""

    solution: LocalSolution
    held: tuple[str, ...]

    def said(self, beyond: LocalSolution | None = None) -> str:
        """Say it, where it is worse than what was found beyond the limits."""
        distance, angle = self.solution.position_error, self.solution.orientation_error
        if (
            beyond is not None
            and distance <= beyond.position_error + AS_NEAR
            and angle <= beyond.orientation_error + AS_NEAR
        ):
            return "; no joint limit makes it worse"
        names = ", ".join(self.held)
        said = f"; inside the limits {_length(distance)} and {_angle(angle)} are left"
        return f"{said}, held back by the limits of {names}" if names else said


def _closest_inside(
    search: PoseSearch, found: list[LocalSolution], near: FloatArray, metre: float = 1.0
) -> _Inside:
    """Come as near as the limits allow, from the nearest of what was found beyond them.

    Args:
        search: The pose, weighted as `metre` says.
        found: What was found beyond the limits.
        near: Configuration that whole turns are to be near to, shape (d,).
        metre: How many radians a metre counts.
    """

    def size(solution: LocalSolution) -> float:
        return _size(solution, metre)

    robot = search.robot
    lower, upper = robot.lower_position_limit, robot.upper_position_limit
    reached = []
    for solution in sorted(found, key=size)[:TRIED_INSIDE]:
        q = nearest_turns(solution.q, near, lower, upper, _revolute(robot))
        reached.append(search.solve(np.minimum(np.maximum(q, lower), upper), lower, upper))
    best = min(reached, key=size)
    slope = search.gradient(best.q)
    out = ((best.q <= lower + AT_LIMIT) & (slope < 0)) | (
        (best.q >= upper - AT_LIMIT) & (slope > 0)
    )
    return _Inside(best, tuple(robot.joint_names[i] for i in np.flatnonzero(out)))


def _size(solution: LocalSolution, metre: float = 1.0) -> float:
    return (metre * solution.position_error) ** 2 + solution.orientation_error**2


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
    search: PoseSearch,
    solutions: list[LocalSolution],
    near: FloatArray,
    waypoint: str,
    where: str,
) -> NoReturn:
    robot = search.robot
    lower, upper = robot.lower_position_limit, robot.upper_position_limit
    turned = [nearest_turns(s.q, near, lower, upper, _revolute(robot)) for s in solutions]

    def excess(q: FloatArray) -> FloatArray:
        beyond: FloatArray = np.maximum(lower - q, q - upper)
        return np.where(beyond > AT_LIMIT, beyond, 0.0)

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
    inside = _closest_inside(search, solutions, near)
    raise OutsideLimitsError(
        waypoint,
        f"the pose is reachable only outside the joint limits: the solution found that is least "
        f"outside has {said}{inside.said()}",
        joints=joints,
        closest=inside.solution.q.tolist(),
        held=inside.held,
        where=where,
    )


def _length(value: float) -> str:
    return f"{value:.4g} m"


def _angle(value: float) -> str:
    return f"{value:.4g} rad ({np.degrees(value):.3g}°)"
