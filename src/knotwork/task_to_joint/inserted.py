"""Joint waypoints, with those inserted along tool paths and the accelerations of waits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np

from knotwork.errors import PathError
from knotwork.scenario import Scenario, ScenarioPath
from knotwork.scenario.joint_space import JointSpace
from knotwork.waypoints import CartesianWaypoint, FloatArray, JointWaypoints

if TYPE_CHECKING:
    from knotwork.kinematics.following.continuation import Continuation
    from knotwork.kinematics.following.joint_field import Pull
    from knotwork.task_to_joint.dependent_waypoints import DependentWaypoints


def completed_waypoints(
    scenario: Scenario,
    space: JointSpace,
    positions: FloatArray,
    velocities: FloatArray,
    knots: Any,
    dependent: DependentWaypoints | None = None,
) -> JointWaypoints:
    """Joint waypoints from the solutions at a scenario's waypoints.

    Along a tool path waypoints are inserted until the motion keeps its tolerances; there, and
    during waits, accelerations are known as well.

    Args:
        scenario: The task.
        space: The joints of the scenario.
        positions: Joint positions at its waypoints [rad or m], shape (n, d).
        velocities: Joint velocities at its waypoints [rad/s or m/s], shape (n, d).
        knots: Knot placement of the motion: see `ModifiedHermiteSpline`.
        dependent: Starts of paths and continuations along them; not needed without paths.

    Raises:
        PathError: The tolerances need too many waypoints, or are too fine to be proved.
    """
    times = scenario.provisional_times
    known = np.full(positions.shape, np.nan)
    known[[k for i in space.waits for k in (i, i + 1)]] = 0.0
    names = np.array([waypoint.name for waypoint in scenario.waypoints], dtype=object)
    columns = times, names, positions, velocities, known, np.ones(len(names), dtype=bool)
    parts: list[tuple[Any, ...]] = []
    done = 0
    for path in scenario.paths:
        dependent = cast("DependentWaypoints", dependent)  # nothing else follows paths
        _hold(positions, space.waits)
        parts.append(tuple(one[done : path.first] for one in columns))
        start = positions[path.first]
        robot, q, pull = dependent.start(path, start)
        known_way = dependent.known_continuation(path, q)
        followed = list(followed_path(scenario, robot, path, q, knots, known_way, pull))
        chain = dependent.chain(path)
        followed[2:5] = [chain.put(values) for values in followed[2:5]]
        followed[2][0] = start  # without a rounding difference to a wait before the path
        positions[path.last] = followed[2][-1]
        # where another path follows, its first waypoint replaces the last of this one
        joined = any(other.first == path.last for other in scenario.paths)
        parts.append(tuple(part[: len(part) - joined] for part in followed))
        done = path.last + 1 - joined
    _hold(positions, space.waits)
    parts.append(tuple(one[done:] for one in columns))
    return _joined(parts, space)


def _joined(parts: list[tuple[Any, ...]], space: JointSpace) -> JointWaypoints:
    """Joint waypoints of the columns of several parts, one after the other."""
    time, name, position, velocity, acceleration, asked = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    return JointWaypoints(
        joint_names=space.joint_names,
        time=time,
        position=position,
        velocity=velocity,
        names=tuple(str(one) for one in name),
        joint_units=space.joint_units,
        acceleration=None if np.isnan(acceleration).all() else acceleration,
        asked=tuple(np.flatnonzero(asked).tolist()),
    )


def _ends(path: ScenarioPath) -> FloatArray:
    """Times at which the stretches of a path begin and end [s]."""
    return np.array([path.stretches[0].start, *(one.end for one in path.stretches)])


def _hold(positions: FloatArray, still: tuple[int, ...]) -> None:
    """Make the arm end each wait exactly where the wait began."""
    for i in still:
        positions[i + 1] = positions[i]


def followed_path(
    scenario: Scenario,
    robot: Any,
    path: ScenarioPath,
    start: FloatArray,
    knots: Any,
    found: Continuation | None = None,
    pull: Pull | None = None,
) -> tuple[Any, ...]:
    """Times, names, positions, velocities, accelerations along a path; a mask of given waypoints.

    `found` is the continuation from its start, if it is known, and `pull` the target of
    self-motion, by default the scenario's.
    """
    from knotwork.kinematics.following.insertion import with_waypoints_inserted
    from knotwork.kinematics.following.joints_on_path import JointsOnPath
    from knotwork.kinematics.following.proof import PathTolerance

    tolerances = scenario.tolerances
    tolerance = PathTolerance(tolerances.path, tolerances.path_orientation, tolerances.path_speed)
    ends = _ends(path)
    try:
        pull = scenario.task.pull_to_middle if pull is None else pull
        joints = JointsOnPath(robot, path.motion, start, pull, found)
        followed = with_waypoints_inserted(joints, tolerance, times=ends, knots=knots)
    except PathError as error:
        error.locate(scenario.waypoints[path.last].where)
        raise
    index = np.searchsorted(followed.time, ends)
    scale, unit = scenario.shown_length
    along = path.motion.arc_length(followed.time)
    names = np.empty(len(along), dtype=object)
    for k, low in enumerate(index):
        waypoint = scenario.waypoints[path.first + k]
        names[low] = waypoint.name
        high = index[k + 1] if k + 1 < len(index) else low + 1
        for i in range(low + 1, high):
            names[i] = f"{waypoint.name} + {scale * (along[i] - along[low]):.4g} {unit}"
    velocity, acceleration = followed.velocity.copy(), followed.acceleration.copy()
    for row, waypoint in ((0, scenario.waypoints[path.first]), (-1, scenario.waypoints[path.last])):
        if isinstance(waypoint, CartesianWaypoint) and not waypoint.twist.vector.any():
            velocity[row] = acceleration[row] = 0.0  # exactly, where the tool stops
    asked = np.isin(np.arange(len(along)), index)
    return followed.time, names, followed.position, velocity, acceleration, asked
