"""Reasons why a pose has no solution: outside limits, out of reach, or a wrong orientation."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from knotwork.errors import OutsideLimitsError, UnreachablePoseError
from knotwork.kinematics.chain.batch import Targets, solve_batch
from knotwork.kinematics.chain.joint_ranges import (
    LIMIT_TOLERANCE,
    Limits,
    clip,
    held_joints,
    joint_distances,
    limits_of,
    nearest_turns,
    no_limits,
    spread_starts,
    turn_inside,
    turning_limits,
)
from knotwork.kinematics.chain.levenberg_marquardt import (
    PATIENT_EFFORT,
    LocalSolution,
    PoseSearch,
)
from knotwork.kinematics.pose_arguments import FINEST_TOLERANCE
from knotwork.robot import Robot
from knotwork.robot.joint_axes import joint_axes
from knotwork.units import SI, Units, readable
from knotwork.waypoints import FloatArray

# Weight of a metre relative to a radian while the tool turns about a fixed point.
POINT_FIRST = 1e3
# Increase of the error, as a fraction, above which the limits are a cause.
LIMIT_ERROR_FACTOR = 1e-3
# Minimum share of the descent direction with which a joint counts as blocking.
BLOCKING_SHARE = 1e-6
# Additional searches for the point alone, and the number of successful ones that are refined by
# turning the tool.
POINT_SEARCHES = 30
POINT_REFINED = 5


# Number of searches in one batch, with limits and without. They stop near a minimum. At most
# `MAX_REFINED` of the best are refined, with at least this distance between them [rad or m].
CLOSEST_SEARCHES = 120
MAX_REFINED = 8
SAME_MINIMUM = 0.1
# Error [m, rad] within which a search may still converge at simultaneous singularities.
SMALL_ERROR = 1e-2
# Maximum steps of the minimisation, and the gradient at which it ends [m or rad per joint unit].
MINIMISER_STEPS = 500
FLAT_GRADIENT = 1e-10


def solution_or_reason(
    search: PoseSearch,
    near: FloatArray,
    waypoint: str,
    where: str,
    units: Units = SI,
) -> LocalSolution:
    """Search for a pose from starts all over joint space, and diagnose why there is no solution.

    Args:
        search: The pose, and the robot.
        near: Preferred configuration, shape (d,).
        waypoint: Name of the waypoint.
        where: Location of its definition.
        units: Units of the message.

    Returns:
        A solution inside the limits, if one is found after all.

    Raises:
        OutsideLimitsError: Only joint positions outside their limits reach the pose.
        UnreachablePoseError: No joint positions reach the pose.
    """
    robot = search.robot
    beyond, inside = _search_everywhere(search, near)
    solutions = [s for s in inside if s.converged]
    if solutions:
        return min(solutions, key=lambda s: float(np.linalg.norm(s.q - near)))
    closest = min(inside, key=squared_error)
    held = _blocking_joints(search, closest)
    data: dict[str, Any] = {
        "where": where,
        "closest": closest.q.tolist(),
        "closest_distance": closest.position_error,
        "closest_angle": closest.orientation_error,
    }
    at_pose = [nearest_turns(robot, s.q, near) for s in beyond if s.converged]
    if at_pose:
        joints = _least_outside(robot, at_pose, near)
        sentence = _outside_sentence(robot, joints, units)
        sentence += _closest_sentence(closest, held, units)
        raise OutsideLimitsError(waypoint, sentence, joints=joints, held=held, **data)
    # Searches that ignore the limits may miss this minimum.
    least = min([*beyond, come_close(search, closest.q, no_limits(robot))], key=squared_error)
    point = _on_point(search, [*beyond, *inside], near)
    sentence = _miss_sentence(search, least, point, units)
    if squared_error(closest) > (1.0 + LIMIT_ERROR_FACTOR) ** 2 * squared_error(least):
        sentence += _closest_sentence(closest, held, units)
    else:
        held, sentence = (), f"{sentence}; joint limits are not the cause"
    raise UnreachablePoseError(
        waypoint,
        sentence,
        held=held,
        position_shortfall=least.position_error,
        orientation_shortfall=least.orientation_error,
        point_shortfall=point[0],
        angle_at_point=point[1],
        **data,
    )


def _search_everywhere(
    search: PoseSearch, near: FloatArray
) -> tuple[list[LocalSolution], list[LocalSolution]]:
    """The closest configurations without limits, and those inside the limits."""
    robot = search.robot
    beyond = closest_poses(search, near, no_limits(robot))
    limits, minima = turning_limits(robot), beyond
    if np.isfinite(limits).any():  # else it is the same search
        pulled = [turn_inside(robot, s.q, near) for s in beyond]
        minima = closest_poses(search, near, limits, pulled)
    return beyond, [search.measure(turn_inside(robot, s.q, near)) for s in minima]


def _least_outside(
    robot: Robot, solutions: list[FloatArray], near: FloatArray
) -> list[tuple[str, float, float, float]]:
    """Joints outside their limits at the solution with the smallest excess: values and limits."""
    lower, upper = limits_of(robot)

    def excess(q: FloatArray) -> FloatArray:
        return np.asarray(np.maximum(np.maximum(lower - q, q - upper), 0.0))

    best = min(solutions, key=lambda q: (float(excess(q).sum()), float(np.linalg.norm(q - near))))
    over = excess(best)
    # An excess within rounding is not reported if another joint is outside.
    return [
        (robot.joint_names[i], float(best[i]), float(lower[i]), float(upper[i]))
        for i in np.flatnonzero(over > min(LIMIT_TOLERANCE, 0.5 * over.max()))
    ]


def _outside_sentence(
    robot: Robot, joints: list[tuple[str, float, float, float]], units: Units
) -> str:
    """Sentence about the solution with the given joints outside their limits."""
    parts = []
    for name, value, low, high in joints:
        kind = robot.joint_units[robot.joint_names.index(name)]
        by = max(low - value, value - high)
        range_ = ", ".join(f"{units.shown(limit, kind)[0]:.6g}" for limit in (low, high))
        # too small to appear in the printed digits
        excess = f" by {units.text(by, kind, '.3g')}" if by < 1e-4 else ""
        parts.append(f"{name} at {units.text(value, kind)}, outside [{range_}]{excess}")
    return (
        "the pose is reachable only outside the joint limits: the solution found that is least "
        f"outside has {'; '.join(parts)}"
    )


def _miss_sentence(
    search: PoseSearch,
    least: LocalSolution,
    point: tuple[float, float | None, bool],
    units: Units,
) -> str:
    """Text about how far the pose is out of reach; `point` is the result of `_on_point`."""
    distance, angle, inside = point
    miss = _miss_text(least, units)
    if angle is None:
        return (
            "the pose is out of reach: the nearest point found is "
            f"{_length_text(distance, units)} away in any orientation, the closest pose {miss}"
        )
    but = ", but" if inside else " only outside the joint limits, and"
    sentence = (
        f"the point is reachable{but} not in this orientation: on the point the nearest found "
        f"is off by {_angle_text(angle, units)}"
    )
    if search.is_within(least.position_error, 0.0):
        return sentence
    return f"{sentence}; the closest pose found is {miss} away"


def _on_point(
    search: PoseSearch, nearby: list[LocalSolution], near: FloatArray
) -> tuple[float, float | None, bool]:
    """Bring the TCP to the point, then turn the tool, inside the limits if possible.

    Returns:
        Remaining distance [m], remaining angle at the point [rad] (`None` if the TCP does not reach
        it), and whether the point is reached inside the limits.
    """
    robot = search.robot
    tolerances = search.tolerances
    point = PoseSearch(robot, search.pose, *tolerances, orientation_weight=0.0)
    turned = PoseSearch(robot, search.pose, *tolerances, position_weight=POINT_FIRST)
    choices = [(True, turning_limits(robot)), (False, no_limits(robot))]
    if not np.isfinite(choices[0][1]).any():
        choices.pop()
    # no search can succeed if the arm is too short
    missed = joint_axes(robot).certain_miss(search.pose.translation) > search.tolerances[0]
    for inside, limits in [] if missed else choices:
        starts = [*(s.q for s in nearby), *starts_from(robot, near, limits, POINT_SEARCHES)]
        at_point = [s for s in (point.solve(q, limits) for q in starts) if s.converged]
        if at_point:
            at_point.sort(key=lambda s: s.orientation_error)
            first = distinct_minima(robot, [s.q for s in at_point], POINT_REFINED)
            refined = [come_close(turned, q, limits).q for q in first]
            at_point += [s for s in (point.solve(q, limits) for q in refined) if s.converged]
            best = min(at_point, key=lambda s: s.orientation_error)
            return best.position_error, best.orientation_error, inside
    nearest = (come_close(point, s.q, choices[-1][1]) for s in nearby[:POINT_REFINED])
    return min(s.position_error for s in nearest), None, False


def _blocking_joints(search: PoseSearch, closest: LocalSolution) -> tuple[str, ...]:
    """Joints at a limit that would have to move beyond it."""
    robot = search.robot
    margin = BLOCKING_SHARE * squared_error(closest) ** 0.5
    held = held_joints(
        closest.q, -search.value_and_gradient(closest.q)[1], limits_of(robot), margin
    )
    return tuple(robot.joint_names[i] for i in np.flatnonzero(held))


def _closest_sentence(closest: LocalSolution, held: tuple[str, ...], units: Units) -> str:
    miss = _miss_text(closest, units)
    sentence = f"; the closest pose found within the limits misses by {miss}"
    return f"{sentence}, blocked by the limits of {', '.join(held)}" if held else sentence


def _miss_text(solution: LocalSolution, units: Units) -> str:
    length, angle = solution.position_error, solution.orientation_error
    return f"{_length_text(length, units)} and {_angle_text(angle, units)}"


def _length_text(value: float, units: Units) -> str:
    return units.text((value if value > FINEST_TOLERANCE else 0.0), "m", ".4g")


def _angle_text(value: float, units: Units) -> str:
    value = value if value > FINEST_TOLERANCE else 0.0
    in_degrees = f" ({readable(np.degrees(value), '.3g')}°)" if units.angle == "rad" else ""
    return f"{units.text(value, 'rad', '.4g')}{in_degrees}"


def squared_error(solution: LocalSolution) -> float:
    """The minimised quantity: distance² + angle², one metre counting as one radian."""
    return solution.position_error**2 + solution.orientation_error**2


def closest_poses(
    search: PoseSearch, near: FloatArray, limits: Limits, more: Iterable[FloatArray] = ()
) -> list[LocalSolution]:
    """Find the poses closest to one that limits allow, from starts all over joint space.

    Args:
        search: The pose, and the robot.
        near: Preferred configuration, shape (d,).
        limits: Joint limits.
        more: Additional starts, shape (d,) each.

    Returns:
        The closest minima found, the closest first.
    """
    robot = search.robot
    begin = np.vstack(
        [starts_from(robot, near, limits, CLOSEST_SEARCHES), *(q[None] for q in more)]
    )
    ended = solve_batch(
        robot, Targets.from_poses([search.pose]), begin, tolerance=1e-9, limits=limits
    )
    size = ended.position_error**2 + ended.orientation_error**2
    ends = distinct_minima(robot, ended.q[np.argsort(size, kind="stable")], MAX_REFINED)
    return sorted((come_close(search, q, limits) for q in ends), key=squared_error)


def starts_from(robot: Robot, near: FloatArray, limits: Limits, count: int) -> FloatArray:
    """A configuration and others spread over a box around it within limits, shape (n, d)."""
    return np.vstack([near, spread_starts(robot, limits, count, around=near)])


def distinct_minima(
    robot: Robot, configurations: Iterable[FloatArray], most: int
) -> list[FloatArray]:
    """Select configurations in order, and skip those close to one already selected."""
    revolute = joint_axes(robot).revolute
    selected: list[FloatArray] = []
    for q in configurations:
        if all(joint_distances(q, p, revolute) > SAME_MINIMUM for p in selected):
            selected.append(q)
            if len(selected) == most:
                break
    return selected


def come_close(search: PoseSearch, q: FloatArray, limits: Limits) -> LocalSolution:
    """Minimise the pose error from a configuration, to a true minimum.

    Damped least squares converges to a solution if there is one. Otherwise it is slow, and |e|²/2
    is minimised with its exact gradient instead (L-BFGS-B).

    Args:
        search: The pose, weighted, and the robot.
        q: Start, shape (d,).
        limits: Joint limits.
    """
    solution = search.solve(q, limits)
    if not solution.converged and squared_error(solution) < SMALL_ERROR**2:
        solution = search.solve(solution.q, limits, PATIENT_EFFORT)
    if solution.converged:
        return solution
    from scipy.optimize import minimize

    options = {"ftol": 0.0, "gtol": FLAT_GRADIENT, "maxiter": MINIMISER_STEPS}
    bounds, least = np.transpose(limits), search.value_and_gradient
    ended = minimize(least, solution.q, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
    return search.measure(clip(ended.x, limits))
