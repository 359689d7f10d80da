"""Additions to a task: a waypoint at the arm's present state, and a box."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.errors import InputError
from knotwork.errors.plain_text import default_waypoint_name
from knotwork.robot import Robot
from knotwork.task import PathWaypoint, Task
from knotwork.task.scenario import Scenario
from knotwork.view.editing.handles import (
    ANGLE_STEP,
    FORMS,
    LENGTH_STEP,
    file_values,
    orientation_value,
)
from knotwork.waypoints import CartesianWaypoint

Change = Mapping[str, Any]
CORNER_BLEND = 0.01
"""Rounding radius of a corner added on a line [m]."""
LINE_STEP, SNAP_DISTANCE = 1e-9, 1e-3
"""Rounding of positions on a line, and distance within which positions snap to it [m]."""
POSE_COORDINATES = 6  # coordinates of a pose; arms with fewer joints can't reach a rounded one


def waypoint_here(
    scenario: Scenario,
    robot: Robot,
    q: FloatArray,
    after: int,
    *,
    fraction: float = 0.5,
    joints: bool = False,
) -> list[Change]:
    """Make the changes that add a waypoint at the arm's present state, between two others.

    Args:
        scenario: The scenario.
        robot: The robot of the task.
        q: Joint positions, joints in the robot's order, shape (d,).
        after: Index in `scenario.task` of the previous waypoint; -1 for the start.
        fraction: Time of the new waypoint, as a fraction of the time between its neighbours.
        joints: Whether joint values define the waypoint, not the pose of the tool. For an arm with
            few joints they always do.

    Raises:
        InputError: The waypoint is on a curved tool path, or on a line with joint values.
    """
    task = scenario.task
    length, angle = task.units.in_si
    neighbour_waypoint = task.waypoints[max(after, 0)]
    added, changes = _time_between(scenario, after, fraction)
    line = "along" in added
    if joints and line:
        raise InputError("on a tool path a waypoint can't be given by joint values")
    if joints or robot.dof < POSE_COORDINATES:
        steps = {"rad": (angle, ANGLE_STEP), "m": (length, LENGTH_STEP)}
        added["joints"] = {
            name: file_values([value], *steps[unit])[0]
            for name, unit, value in zip(robot.joint_names, robot.joint_units, q, strict=True)
        }
    else:
        frame = getattr(neighbour_waypoint, "frame", None)
        parent_name = task.frame_of(neighbour_waypoint)
        if task.is_moving_frame(parent_name):
            frame = parent_name = "base"
        parent = scenario.frame_placements.get(parent_name, pin.SE3.Identity())
        pose = robot.forward(q)
        if line:
            _snap(scenario, after, pose)
        pose = parent.actInv(pose)
        neighbour = getattr(neighbour_waypoint, "pose", None)
        forms = (name for name in FORMS if getattr(neighbour, name, None) is not None)
        form = next(forms, "rpy").replace("euler", "rpy")
        added |= {"frame": frame} if frame is not None else {}
        step = LINE_STEP if line else LENGTH_STEP
        added["pose"] = {"position": file_values(pose.translation, length, step)}
        added["pose"] |= {} if line else {form: orientation_value(pose.rotation, form, angle)}
    where = scenario.locations.in_file(("waypoints", after)) if after >= 0 else ("waypoints", -1)
    at = (*where[:-1], int(where[-1]) + 1)
    return [*changes, {"at": at, "value": added, "insert": True}]


def _snap(scenario: Scenario, after: int, pose: pin.SE3) -> None:
    """Move a pose onto the line between two waypoints, if it is near."""
    ends = (scenario.waypoints[scenario.task_index.index(i)] for i in (after, after + 1))
    start, end = (cast(CartesianWaypoint, end).pose.translation for end in ends)
    along = (end - start) / np.linalg.norm(end - start)
    nearest = start + along * (along @ (pose.translation - start))
    if np.linalg.norm(nearest - pose.translation) < SNAP_DISTANCE:
        pose.translation = nearest


def _time_between(
    scenario: Scenario, after: int, fraction: float
) -> tuple[dict[str, Any], list[Change]]:
    """Keys of a new waypoint except its place, and the changes of its neighbours."""
    task = scenario.task
    if after + 1 == len(task.waypoints):
        return _at_the_end(scenario, after)
    following = task.waypoints[after + 1]
    has_way = task.ways or following.way
    added: dict[str, Any] = {"stop": True} if has_way else {"velocity": "free"}
    changes: list[Change] = []
    if isinstance(following, PathWaypoint):
        if following.along != "line":
            name = following.name or default_waypoint_name(after + 1)
            raise InputError(
                f"no waypoint can be added on the path to {name!r}, which is not a line; "
                "choose a time before or after it"
            )
        path = following.to_dict()
        added = {key: path[key] for key in ("along", "speed") if key in path}
        added["blend"] = file_values([CORNER_BLEND], task.units.in_si[0], LENGTH_STEP)[0]
    if isinstance(following.after, float):
        first = round(fraction * following.after, 3)
        added["after"] = first
        remaining = round(following.after - first, 6)
        at = (*scenario.locations.in_file(("waypoints", after + 1)), "after")
        changes = [{"at": at, "value": remaining}]
    elif following.time is not None:
        before = task.waypoints[after].time if after >= 0 else 0.0
        if before is None:
            added["after"] = 1.0
        else:
            added["time"] = round(before + fraction * (following.time - before), 3)
    elif following.after is not None:
        added["after"] = "fastest"
    return added, changes


def _at_the_end(scenario: Scenario, after: int) -> tuple[dict[str, Any], list[Change]]:
    """Keys of a new last waypoint; the previous one becomes a stop.

    The new motion takes as long as the previous one.
    """
    task = scenario.task
    last = task.waypoints[after]
    has_motion = getattr(last, "velocity", None) or getattr(last, "speed", None)
    is_settled = isinstance(last, PathWaypoint) or last.stop or last.wait_time or has_motion
    stop = {"at": (*scenario.locations.in_file(("waypoints", after)), "stop"), "value": True}
    added = {"after": last.after if isinstance(last.after, float) else 1.0}
    return added, [] if is_settled else [stop]


def box_at(task: Task, point: FloatArray, size: float) -> list[Change]:
    """Make the change that adds a cube to the scene.

    Args:
        task: The task.
        point: Centre of the cube in the base frame [m], shape (3,).
        size: Edge length of the cube [m].
    """
    length, _ = task.units.in_si
    taken_names = {*task.scene.objects, *(task.tool.holds if task.tool is not None else ())}
    names = ("box", *(f"box {k}" for k in range(2, len(taken_names) + 3)))
    name = next(name for name in names if name not in taken_names)
    value = {
        "box": file_values(np.full(3, size), length, 1e-3),
        "position": file_values(point, length, 1e-3),
    }
    return [{"at": ("scene", "objects", name), "value": value}]
