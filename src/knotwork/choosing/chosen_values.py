"""Chosen values as edits of the scenario's document."""

from __future__ import annotations

from typing import Any

import numpy as np

from knotwork.choosing.segments import Segment
from knotwork.choosing.task import FreeTask
from knotwork.documents import REMOVED, Location
from knotwork.scenario import JointTarget, Scenario
from knotwork.timing import TimedMotion
from knotwork.waypoints import CartesianWaypoint, FloatArray

STANDING = 1e-9
"""A chosen speed below this is a stop [m/s]."""


def chosen_values(task: FreeTask, found: list[tuple[Segment, TimedMotion]]) -> dict[Location, Any]:
    """The edits that put chosen values in place of all that is free.

    Args:
        task: The task.
        found: The segments and what was found for them.
    """
    free = task.free
    units = _Units(task)
    edits: dict[Location, Any] = {
        (key,): REMOVED for key in ("times", "duration", "objective") if key in free.document.data
    }
    if free.document.data.get("knots") == "optimal":
        edits[("knots",)] = REMOVED
    edits |= _solutions(task, units)
    for segment, motion in found:
        for k, i in enumerate(segment.waypoints):
            place: Location = ("waypoints", free.index[i])
            if k and free.duration[i - 1]:
                edits[(*place, "after")] = float(motion.time[k] - motion.time[k - 1])
            q = task.waypoints.position[segment.rows[k]]
            edits |= _speed(task, i, place, q, motion.velocity[k], units)
    if not found:
        return edits
    timed = task.with_edits(edits)
    edits[("chosen",)] = [_chosen(timed, free.speed, *one, units) for one in found]
    return edits


class _Units:
    """What a joint's values are divided by to be in the units of the file."""

    def __init__(self, task: FreeTask) -> None:
        space = task.space
        units = task.free.document.data.get("units") or {}
        self.length = 1e-3 if units.get("length") == "mm" else 1.0
        self.angle = np.pi / 180.0 if units.get("angle") == "deg" else 1.0
        self.names = space.joint_names
        self.scales = [self.angle if unit == "rad" else self.length for unit in space.joint_units]

    def by_joint(self, values: FloatArray) -> dict[str, float]:
        return {
            name: float(value / scale)
            for name, value, scale in zip(self.names, values, self.scales, strict=True)
        }


def _solutions(task: FreeTask, units: _Units) -> dict[Location, Any]:
    """The solutions of the poses, so that they are the same ones again."""
    index, paths = task.free.index, task.scenario.paths
    # in the file, where the end of a path and of the wait there are one waypoint
    on_paths = {index[i] for path in paths for i in range(path.first + 1, path.last + 1)}
    edits: dict[Location, Any] = {}
    for i, waypoint in enumerate(task.scenario.waypoints):
        place: Location = ("waypoints", index[i], "near")
        if (
            isinstance(waypoint, CartesianWaypoint)
            and index[i] not in on_paths
            and place not in edits
        ):
            edits[place] = units.by_joint(task.waypoints.position[task.rows[i]])
    return edits


def _speed(
    task: FreeTask, i: int, place: Location, q: FloatArray, v: FloatArray, units: _Units
) -> dict[Location, Any]:
    """Speed or velocity at a waypoint where it was chosen."""
    kind, robot = task.free.speed[i], task.space.robot
    if kind == "given":
        return {}
    if robot is None or isinstance(task.scenario.waypoints[i], JointTarget):
        return {(*place, "velocity"): units.by_joint(v)}
    twist = robot.twist(q, v)
    if kind == "free":
        return {
            (*place, "velocity"): {
                "linear": (twist.linear / units.length).tolist(),
                "angular": (twist.angular / units.angle).tolist(),
                "in": "base",
            }
        }
    speed = float(np.linalg.norm(twist.linear))
    if speed < STANDING:
        return {(*place, "speed"): REMOVED, (*place, "stop"): True}
    return {(*place, "speed"): speed / units.length}


def _chosen(
    timed: Scenario, kinds: tuple[str, ...], segment: Segment, motion: TimedMotion, units: _Units
) -> dict[str, Any]:
    """A segment as the file has it; knots begin where the waypoint before them is in the file."""
    x = motion.trajectory.breaks
    a = motion.trajectory.acceleration(x)
    times = x.copy()
    for k, i in enumerate(segment.waypoints):
        later = x >= motion.time[k] - 1e-12
        times[later] = timed.waypoints[i].time + (x[later] - motion.time[k])
    found: dict[str, Any] = {
        "times": times.tolist(),
        "accelerations": {
            name: (a[:, j] / scale).tolist()
            for j, (name, scale) in enumerate(zip(units.names, units.scales, strict=True))
        },
    }
    velocities = {
        timed.waypoints[i].name: units.by_joint(motion.velocity[k])
        for k, i in enumerate(segment.waypoints)
        if kinds[i] != "given"
    }
    return found | ({"velocities": velocities} if velocities else {})
