"""Joint waypoints, including inserted ones along tool paths, and the accelerations of waits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from knotwork.arrays import BoolArray, FloatArray
from knotwork.curves.interpolation import BalancedKnots
from knotwork.curves.interpolation.knots import KnotPlacement
from knotwork.errors import PathError
from knotwork.task import Balanced
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.waypoints import CartesianWaypoint, JointWaypoints

if TYPE_CHECKING:
    from knotwork.planning.task_to_joint.path_track import PathTrack


class JointRows(NamedTuple):
    """Columns of joint waypoints.

    Attributes:
        time: Times [s], shape (k,).
        name: Names, shape (k,).
        position, velocity: Joint positions and velocities, shape (k, d).
        acceleration: Joint accelerations, NaN where unknown, shape (k, d).
        requested: Whether each is a waypoint of the scenario, shape (k,).
    """

    time: FloatArray
    name: NDArray[Any]
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    requested: BoolArray

    def slice(self, start: int, stop: int) -> JointRows:
        """The rows from `start` up to `stop`."""
        columns: Any = (column[start:stop] for column in self)
        return JointRows(*columns)


def knots_of(scenario: Scenario) -> KnotPlacement:
    """Knot placement of the motion: see `ModifiedHermiteSpline`.

    With `knots: optimal` it is `"paper"`: knots are chosen only outside tool paths.
    """
    knots = scenario.task.knots
    if isinstance(knots, Balanced):
        return BalancedKnots(knots.balanced)
    return "paper" if knots == "optimal" else knots


def complete_waypoints(
    scenario: Scenario,
    joints: ScenarioJoints,
    positions: FloatArray,
    velocities: FloatArray,
    knots: KnotPlacement,
    tracks: Sequence[PathTrack],
) -> tuple[JointWaypoints, dict[int, PathTrack]]:
    """Joint waypoints from the solutions at a scenario's waypoints, and tracks by first waypoint.

    Along a tool path waypoints are inserted until the motion keeps its tolerances. Accelerations
    are known there and during waits.

    Args:
        scenario: The scenario.
        joints: The joints of the scenario.
        positions: Joint positions at its waypoints [rad or m], shape (n, d).
        velocities: Joint velocities at its waypoints [rad/s or m/s], shape (n, d).
        knots: Knot placement of the motion: see `ModifiedHermiteSpline`.
        tracks: The arm along each path; those returned have the motion as well.

    Raises:
        PathError: The tolerances need too many waypoints, or are too fine to be proved.
    """
    rows = _rows_at_waypoints(scenario, joints, positions, velocities)
    parts: list[JointRows] = []
    followed_tracks: dict[int, PathTrack] = {}
    done = 0
    for track in tracks:
        path = track.path
        _hold(rows, joints.rest_intervals)
        followed_tracks[path.first], followed = _insert_waypoints(
            scenario, track, rows.position[path.first], knots
        )
        rows.position[path.last] = followed.position[-1]
        # where another path follows, its first waypoint replaces the last of this one
        shared = 1 if any(following.path.first == path.last for following in tracks) else 0
        parts += rows.slice(done, path.first), followed.slice(0, len(followed.time) - shared)
        done = path.last + 1 - shared
    _hold(rows, joints.rest_intervals)
    parts.append(rows.slice(done, len(positions)))
    rows = JointRows(*map(np.concatenate, zip(*parts, strict=True)))
    waypoints = JointWaypoints(
        joint_names=joints.joint_names,
        time=rows.time,
        position=rows.position,
        velocity=rows.velocity,
        names=tuple(map(str, rows.name)),
        joint_units=joints.joint_units,
        acceleration=None if np.isnan(rows.acceleration).all() else rows.acceleration,
        waypoint_rows=tuple(np.flatnonzero(rows.requested).tolist()),
    )
    return waypoints, followed_tracks


def _rows_at_waypoints(
    scenario: Scenario, joints: ScenarioJoints, positions: FloatArray, velocities: FloatArray
) -> JointRows:
    """Rows of a scenario's waypoints; accelerations are known where the arm rests."""
    accelerations = np.full(positions.shape, np.nan)
    for i in joints.rest_intervals:
        accelerations[i : i + 2] = 0.0
    return JointRows(
        time=scenario.expected_times,
        name=np.array([waypoint.name for waypoint in scenario.waypoints], dtype=object),
        position=positions.copy(),
        velocity=velocities,
        acceleration=accelerations,
        requested=np.ones(len(positions), dtype=bool),
    )


def _hold(rows: JointRows, rest_intervals: tuple[int, ...]) -> None:
    """Make the positions at the end of each of these intervals equal to those at its start."""
    for i in rest_intervals:
        rows.position[i + 1] = rows.position[i]


def _insert_waypoints(
    scenario: Scenario, track: PathTrack, start: FloatArray, knots: KnotPlacement
) -> tuple[PathTrack, JointRows]:
    """A track with the motion along it, and its rows with inserted waypoints.

    Args:
        scenario: The scenario.
        track: The arm along the path.
        start: Joint positions at its start [rad or m], shape (d,).
        knots: Knot placement of the motion: see `ModifiedHermiteSpline`.
    """
    from knotwork.planning.task_to_joint.waypoint_insertion import insert_path_waypoints

    path, tolerances = track.path, scenario.tolerances
    try:
        joints_on_path = track.joints_on_path(start)
        followed = insert_path_waypoints(joints_on_path, tolerances, times=path.times, knots=knots)
    except PathError as error:
        error.path_start = path.first
        error.locate(scenario.waypoints[path.last].where)
        raise
    requested = np.isin(followed.time, followed.time[np.searchsorted(followed.time, path.times)])
    scale, unit = scenario.units.per_metre, scenario.units.length
    along = scale * path.timed_path.arc_length(followed.time)
    names, k = np.empty(len(along), dtype=object), path.first - 1
    for row, is_requested in enumerate(requested):
        if is_requested:
            k, passed = k + 1, along[row]
        name = scenario.waypoints[k].name
        names[row] = name if is_requested else f"{name} + {along[row] - passed:.4g} {unit}"
    velocity, acceleration = followed.velocity.copy(), followed.acceleration.copy()
    for row, waypoint in ((0, scenario.waypoints[path.first]), (-1, scenario.waypoints[path.last])):
        if isinstance(waypoint, CartesianWaypoint) and not waypoint.twist.vector.any():
            velocity[row] = acceleration[row] = 0.0  # exactly, where the tool stops
    scatter = track.chain.scatter
    position = scatter(followed.position)
    position[0] = start  # without a rounding difference from a wait before the path
    return track._replace(followed=joints_on_path), JointRows(
        time=followed.time,
        name=names,
        position=position,
        velocity=scatter(velocity),
        acceleration=scatter(acceleration),
        requested=requested,
    )
