"""What is added to a task by hand: a waypoint where the arm stands, and a box."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from knotwork.documents import Location
from knotwork.editing.handles import ANGLE_STEP, LENGTH_STEP, numbers, orientation
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.task import JointWaypoint, PathWaypoint, PlainTask, Task
from knotwork.task.poses import ORIENTATIONS
from knotwork.task.units import si_factors
from knotwork.waypoints import FloatArray

Change = Mapping[str, Any]


def waypoint_here(
    scenario: Scenario,
    robot: Robot,
    q: FloatArray,
    after: int,
    *,
    share: float = 0.5,
    joints: bool = False,
) -> list[Change]:
    """The changes that put a waypoint where the arm stands between two others.

    Args:
        scenario: The task.
        robot: Its robot.
        q: Joint positions, joints in the robot's order, shape (d,).
        after: Index in the file of the waypoint before it; -1 for the start.
        share: Part of the time between the two that the arm takes to it.
        joints: Give it by joint values, not by the pose of the tool.
    """
    task = scenario.task
    length, angle = si_factors(task.units)
    beside = task.waypoints[max(after, 0)]
    following = after + 1 < len(task.waypoints)
    added, changes = _timing(task, after, share)
    if joints:
        steps = {"rad": (angle, ANGLE_STEP), "m": (length, LENGTH_STEP)}
        added["joints"] = {
            name: numbers([value], *steps[unit])[0]
            for name, unit, value in zip(robot.joint_names, robot.joint_units, q, strict=True)
        }
        added.pop("along", None)
    else:
        own = None if isinstance(beside, JointWaypoint) else beside.frame
        name = own or task.frame or "base"
        around = scenario.frames.get(name)
        pose = robot.forward(q) if around is None else around.actInv(robot.forward(q))
        given = None if isinstance(beside, JointWaypoint) else beside.pose
        form = next((one for one in ORIENTATIONS if getattr(given, one, None) is not None), "rpy")
        form = "rpy" if form == "euler" else form
        if own is not None:
            added["frame"] = own
        added["pose"] = {"position": numbers(pose.translation, length, LENGTH_STEP)}
        if "along" not in added:
            added["pose"][form] = orientation(pose.rotation, form, angle)
    if following and "along" not in added:
        added["velocity"] = "free"
    item = {"at": ("waypoints", after + 1), "value": added, "insert": True}
    return [*changes, item]


def _timing(task: PlainTask, after: int, share: float) -> tuple[dict[str, Any], list[Change]]:
    """When a new waypoint is passed, and what changes for the next; or the last, which stops."""
    added: dict[str, Any] = {}
    if after + 1 == len(task.waypoints):
        last = task.waypoints[after]
        passing = isinstance(last, PathWaypoint) or last.stop or last.wait
        moves = passing or getattr(last, "velocity", None) or getattr(last, "speed", None)
        at: Location = ("waypoints", after, "stop")
        if task.times is None:
            given = last.after if isinstance(last.after, float) else 1.0
            added["after"] = given if last.after in (None, given) else "fastest"
        return added, [] if moves else [{"at": at, "value": True}]
    following = task.waypoints[after + 1]
    at = ("waypoints", after + 1)
    changes: list[Change] = []
    if isinstance(following, PathWaypoint) and following.along == "line":
        added = {"along": "line"}
        if following.speed is not None:
            added["speed"] = following.to_dict()["speed"]
    if isinstance(following.after, float):
        first = round(share * following.after, 3)
        added["after"] = first
        changes = [{"at": (*at, "after"), "value": round(following.after - first, 6)}]
    elif following.time is not None:
        before = task.waypoints[after].time if after >= 0 else 0.0
        if before is None:  # what the times between add up to is not written anywhere
            added["after"] = 1.0
        else:
            added["time"] = round(before + share * (following.time - before), 3)
    elif following.after is not None:
        added["after"] = "fastest"
    elif "along" not in added and task.times is None and task.ways is None:
        added["after"] = 1.0
    return added, changes


def box_at(task: Task, point: FloatArray, size: float) -> list[Change]:
    """The change that puts a box, a cube, into the scene.

    Args:
        task: The task.
        point: Its middle in the base frame [m], shape (3,).
        size: Its edge [m].
    """
    length, _ = si_factors(task.units)
    taken = task.scene.objects
    names = ("box", *(f"box {k}" for k in range(2, len(taken) + 3)))
    name = next(one for one in names if one not in taken)
    value = {
        "box": numbers(np.full(3, size), length, 1e-3),
        "position": numbers(point, length, 1e-3),
    }
    return [{"at": ("scene", "objects", name), "value": value}]
