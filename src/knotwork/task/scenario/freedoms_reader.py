"""Freedom of the poses of a task."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

from knotwork.files.documents import Location, Locations
from knotwork.task import ExpandedTask, FreePose, JointWaypoint, PathWaypoint, Torch, Velocity
from knotwork.task.scenario.scenario import ScenarioPath
from knotwork.task.scenario.task_reading import TaskReading
from knotwork.units import Units
from knotwork.waypoints import PoseFreedom, TorchRanges

Freedoms = list[PoseFreedom | None]
MAX_FREE_TURNS = 2
"""Maximum turn of a range in each direction."""


def read_freedoms(reading: TaskReading, free_turns: Collection[int] = ()) -> Freedoms:
    """Freedom of the poses of all waypoints; `None` without freedom or without a pose.

    Args:
        reading: The task in SI, with its frames.
        free_turns: Waypoints, by index, at the end of paths with normals, which free the turn.

    Raises:
        DocumentError: A turn does not contain the pose or reaches beyond `MAX_FREE_TURNS`; a tilt
            is too large; or a velocity is given in free axes.
    """
    task, locations = reading.task, reading.locations
    tool = None if task.tool is None else task.tool.free
    freedoms: Freedoms = []
    for i, waypoint in enumerate(task.waypoints):
        own_freedom = None if isinstance(waypoint, JointWaypoint) else waypoint.free
        if own_freedom == "none" and i in free_turns:
            raise locations.error(
                ("waypoints", i, "free"),
                "is none, but normals leave the turn about the tool axis open",
                "turn: z, or columns qx, qy, qz, qw",
            )
        if isinstance(waypoint, JointWaypoint) or own_freedom == "none":
            freedoms.append(None)
        elif own_freedom is not None:
            freedoms.append(_read(reading, i, own_freedom, ("waypoints", i, "free")))
        elif tool is not None:
            freedoms.append(_read(reading, i, tool, ("tool", "free")))
        else:
            freedoms.append(PoseFreedom((-math.inf, math.inf)) if i in free_turns else None)
    return freedoms


def _check_velocity(reading: TaskReading, i: int, freedom: PoseFreedom) -> None:
    """Refuse a velocity in free axes of the tool, whose direction planning chooses."""
    waypoint = reading.task.waypoints[i]
    velocity = None if isinstance(waypoint, PathWaypoint) else waypoint.velocity
    if not isinstance(velocity, Velocity) or velocity.axes != "tool":
        return
    across = [*velocity.linear[:2], *velocity.angular[:2]]
    is_tilted = freedom.tilt and any([*velocity.linear, *velocity.angular])
    if is_tilted or (freedom.turn[0] < freedom.turn[1] and any(across)):
        raise reading.locations.error(
            ("waypoints", i, "velocity", "in"),
            "is tool, whose axes are free at this pose",
            "base or a named frame, or free: none"
            + ("" if freedom.tilt else "; or a velocity along and about the tool's z axis alone"),
        )


def _torch_at(task: ExpandedTask, i: int) -> Torch | None:
    """The angles to a seam of a pose, given there or by its path."""
    waypoint, onward = task.waypoints[i], task.waypoints[i + 1 : i + 2]
    if isinstance(waypoint, JointWaypoint):
        return None
    if waypoint.pose.torch is not None:
        return waypoint.pose.torch
    along = (waypoint, *onward) if isinstance(waypoint, PathWaypoint) else onward
    for end in along:
        if isinstance(end, PathWaypoint) and isinstance(end.orientation, Torch):
            return end.orientation
    goes_on = isinstance(waypoint, PathWaypoint) and not waypoint.pose.has_orientation and i > 0
    return _torch_at(task, i - 1) if goes_on else None


def _torch_ranges(reading: TaskReading, i: int, pose: FreePose, location: Location) -> TorchRanges:
    """Ranges of a torch's angles, relative to those of its pose."""
    from knotwork.curves.tool_paths.seam import TOOL_AXES

    torch = _torch_at(reading.task, i)
    if torch is None:
        raise reading.locations.error(
            location,
            "gives angles to a seam, and the pose has none",
            "torch: {seam, normal, …} in the pose, or orientation: {normal, …} along the path",
        )
    ranges = []
    for name in ("work_angle", "travel_angle"):
        angle = getattr(torch, name)
        low, high = getattr(pose, name) or (angle, angle)
        if not -0.5 * math.pi < low <= angle <= high < 0.5 * math.pi:
            raise reading.locations.error(
                (*location, name),
                f"is {_range_text(low, high, reading.units)}",
                f"a range with the pose's {reading.units.text(angle, 'rad')} in it, below a "
                "quarter of a turn",
            )
        ranges.append((low - angle, high - angle))
    axis_angle = TOOL_AXES[torch.tangent]
    return TorchRanges(ranges[0], ranges[1], torch.travel_angle, torch.work_angle, axis_angle)


def _range_text(low: float, high: float, units: Units) -> str:
    """Write a range of angles [rad] as in the file."""
    return f"[{units.number(low, 'rad', 'g')}, {units.number(high, 'rad', 'g')}] {units.angle}"


def _read(reading: TaskReading, i: int, pose: FreePose, location: Location) -> PoseFreedom:
    """Freedom of the pose of a waypoint, which is given at a location."""
    units = reading.units
    tilt = pose.tilt or 0.0
    box = PoseFreedom.box
    torch = None
    if tilt >= 0.5 * math.pi:
        raise reading.locations.error(
            (*location, "tilt"),
            f"is {units.text(tilt, 'rad')}",
            f"an angle below a quarter of a turn, {units.text(0.5 * math.pi, 'rad')}",
        )
    if pose.position is not None:
        ranges = (pose.position.x, pose.position.y, pose.position.z)
        box = tuple((0.0, 0.0) if bounds is None else (bounds[0], bounds[1]) for bounds in ranges)
    if pose.work_angle is not None or pose.travel_angle is not None:
        torch = _torch_ranges(reading, i, pose, location)
        tilt = sum(max(-low, high) for low, high in (torch.work, torch.travel))
    low, high = (-math.inf, math.inf) if pose.turn == "z" else pose.turn or (0.0, 0.0)
    max_turn = MAX_FREE_TURNS * 2.0 * math.pi
    is_in_range = low <= 0.0 <= high and max(-low, high) <= max_turn * (1.0 + 1e-12)
    if pose.turn != "z" and not is_in_range:
        limit = units.text(max_turn, "rad")
        raise reading.locations.error(
            (*location, "turn"),
            f"is {_range_text(low, high, units)}",
            f"turns from the pose: a lower bound from -{limit} to 0, and an upper bound from 0 "
            f"to {limit}; or z, for any turn",
        )
    freedom = PoseFreedom((low, high), tilt, box, torch)
    _check_velocity(reading, i, freedom)
    return freedom


def freedom_of(path: ScenarioPath, freedoms: Freedoms, locations: Locations) -> PoseFreedom | None:
    """Freedom of the poses along a path.

    Args:
        path: A path; its first waypoint is the file's.
        freedoms: Freedom at all waypoints.
        locations: Locations in the file, for errors.

    Raises:
        DocumentError: The freedom changes along the path, includes the position, or the path begins
            with another one.
    """
    along: Sequence[PoseFreedom | None] = freedoms[path.first + 1 : path.last + 1]
    for i, freedom in enumerate(along, path.first + 1):
        if freedom is not None and freedom.position_is_free:
            raise locations.error(
                ("waypoints", i, "free"),
                "leaves the position open along a path, which defines the position",
                "position at poses where the tool stops",
            )
        if freedom != along[0]:
            raise locations.error(
                ("waypoints", i, "free"),
                "differs from the freedom of the previous path",
                "one freedom for a whole path, or stop: true where it changes",
            )
    begins = freedoms[path.first]
    if begins is not None and not begins.is_within(along[0]):
        raise locations.error(
            ("waypoints", path.first + 1),
            "the pose at the start of the path has more freedom than the path",
            "no more freedom at the pose than along the path, for example free: none",
        )
    return along[0]
