"""Freedom of the poses of a scenario file."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

from knotwork.files.documents import Location, Places
from knotwork.task import FreePose, JointWaypoint, PathWaypoint, PlainTask, PoseWaypoint, Torch
from knotwork.task.poses import Velocity
from knotwork.task.scenario.scenario import ScenarioPath
from knotwork.task.si_units import si_factors
from knotwork.waypoints import PoseFreedom, TorchRanges

Freedoms = list[PoseFreedom | None]
# Maximum turn of a range in each direction.
MAX_FREE_TURNS = 2


def read_freedoms(file: PlainTask, places: Places, normals: Collection[int] = ()) -> Freedoms:
    """Freedom of the poses of all waypoints; `None` without freedom or without a pose.

    Args:
        file: Content of the file, in SI.
        places: Locations of its parts in the file, for errors.
        normals: Waypoints, by index, at the end of paths with normals, which free the turn.

    Raises:
        DocumentError: A turn does not contain the pose or reaches beyond `MAX_FREE_TURNS`; a tilt
            is too large; or a velocity is given in free axes.
    """
    tool = None if file.tool is None else file.tool.free
    freedoms: Freedoms = []
    for i, waypoint in enumerate(file.waypoints):
        own_freedom = None if isinstance(waypoint, JointWaypoint) else waypoint.free
        if own_freedom == "none" and i in normals:
            raise places.error(
                ("waypoints", i, "free"),
                "is none, but normals leave the turn about the tool axis open",
                "turn: z, or columns qx, qy, qz, qw",
            )
        if isinstance(waypoint, JointWaypoint) or own_freedom == "none":
            freedoms.append(None)
        elif own_freedom is None and tool is None:
            freedoms.append(PoseFreedom((-math.inf, math.inf)) if i in normals else None)
        else:
            place: Location = (
                ("waypoints", i, "free") if own_freedom is not None else ("tool", "free")
            )
            freedom = _read(own_freedom or tool, places, place, file, _torch_at(file, i))  # type: ignore[arg-type]
            if isinstance(waypoint, PoseWaypoint) and isinstance(waypoint.velocity, Velocity):
                _check_velocity(waypoint.velocity, freedom, places, i)
            freedoms.append(freedom)
    return freedoms


def _check_velocity(velocity: Velocity, freedom: PoseFreedom, places: Places, i: int) -> None:
    """Refuse a velocity in free axes of the tool, whose direction planning chooses."""
    if velocity.axes != "tool":
        return
    across = [*velocity.linear[:2], *velocity.angular[:2]]
    is_tilted = freedom.tilt and any([*velocity.linear, *velocity.angular])
    if is_tilted or (freedom.turn[0] < freedom.turn[1] and any(across)):
        raise places.error(
            ("waypoints", i, "velocity", "in"),
            "is tool, whose axes are free at this pose",
            "base or a named frame, or free: none"
            + ("" if freedom.tilt else "; or a velocity along and about the tool's z axis alone"),
        )


def _torch_at(file: PlainTask, i: int) -> Torch | None:
    """The angles to a seam of a pose, given there or by its path."""
    waypoint, onward = file.waypoints[i], file.waypoints[i + 1 : i + 2]
    if isinstance(waypoint, JointWaypoint):
        return None
    if waypoint.pose.torch is not None:
        return waypoint.pose.torch
    along = (waypoint, *onward) if isinstance(waypoint, PathWaypoint) else onward
    for step in along:
        if isinstance(step, PathWaypoint) and isinstance(step.orientation, Torch):
            return step.orientation
    goes_on = isinstance(waypoint, PathWaypoint) and not waypoint.pose.turned and i > 0
    return _torch_at(file, i - 1) if goes_on else None


def _torch_ranges(
    pose: FreePose, torch: Torch | None, places: Places, location: Location, file: PlainTask
) -> TorchRanges:
    """Ranges of a torch's angles, relative to those of its pose."""
    from knotwork.curves.tool_paths.seam import TOOL_AXES

    unit = si_factors(file.units)[1]
    if torch is None:
        raise places.error(
            location,
            "gives angles to a seam, and the pose has none",
            "torch: {seam, normal, …} in the pose, or orientation: {normal, …} along the path",
        )
    ranges = []
    for name in ("work_angle", "travel_angle"):
        angle = getattr(torch, name)
        low, high = getattr(pose, name) or (angle, angle)
        if not -0.5 * math.pi < low <= angle <= high < 0.5 * math.pi:
            raise places.error(
                (*location, name),
                f"is [{low / unit:g}, {high / unit:g}] {file.units.angle}",
                f"a range with the pose's {angle / unit:g} in it, below a quarter of a turn",
            )
        ranges.append((low - angle, high - angle))
    axis_angle = TOOL_AXES[torch.tangent]
    return TorchRanges(ranges[0], ranges[1], torch.travel_angle, torch.work_angle, axis_angle)


def _read(
    pose: FreePose, places: Places, location: Location, file: PlainTask, own_torch: Torch | None
) -> PoseFreedom:
    unit = si_factors(file.units)[1]
    if pose.tilt is not None and pose.tilt >= 0.5 * math.pi:
        raise places.error(
            (*location, "tilt"),
            f"is {pose.tilt / unit:.6g} {file.units.angle}",
            f"an angle below a quarter of a turn, {0.5 * math.pi / unit:.6g}",
        )
    box = PoseFreedom.box
    if pose.position is not None:
        ranges = (pose.position.x, pose.position.y, pose.position.z)
        box = tuple((0.0, 0.0) if bounds is None else (bounds[0], bounds[1]) for bounds in ranges)
    torch, tilt = None, pose.tilt or 0.0
    if pose.work_angle is not None or pose.travel_angle is not None:
        torch = _torch_ranges(pose, own_torch, places, location, file)
        tilt = sum(max(-low, high) for low, high in (torch.work, torch.travel))
    if pose.turn is None:
        return PoseFreedom((0.0, 0.0), tilt, box, torch)
    if pose.turn == "z":
        return PoseFreedom((-math.inf, math.inf), tilt, box, torch)
    low, high = pose.turn
    max_turn = MAX_FREE_TURNS * 2.0 * math.pi
    if not (low <= 0.0 <= high and max(-low, high) <= max_turn * (1.0 + 1e-12)):
        half = f"{max_turn / unit:.6g}"
        raise places.error(
            (*location, "turn"),
            f"is [{low / unit:g}, {high / unit:g}] {file.units.angle}",
            f"turns from the pose: a lower bound from -{half} to 0, and an upper bound from 0 to "
            f"{half}; or z, for any turn",
        )
    return PoseFreedom((low, high), tilt, box, torch)


def freedom_of(path: ScenarioPath, freedoms: Freedoms, places: Places) -> PoseFreedom | None:
    """Freedom of the poses along a path.

    Args:
        path: A path; its first waypoint is the file's.
        freedoms: Freedom at all waypoints.
        places: Locations in the file, for errors.

    Raises:
        DocumentError: The freedom changes along the path, includes the position, or the path begins
            with another one.
    """
    along: Sequence[PoseFreedom | None] = freedoms[path.first + 1 : path.last + 1]
    for i, freedom in enumerate(along, path.first + 1):
        if freedom is not None and freedom.position_is_free:
            raise places.error(
                ("waypoints", i, "free"),
                "leaves the position open along a path, which defines the position",
                "position at poses where the tool stops",
            )
        if freedom != along[0]:
            raise places.error(
                ("waypoints", i, "free"),
                "differs from the freedom of the previous path",
                "one freedom for a whole path, or stop: true where it changes",
            )
    begins = freedoms[path.first]
    if begins is not None and not begins.is_within(along[0]):
        raise places.error(
            ("waypoints", path.first + 1),
            "the pose at the start of the path has more freedom than the path",
            "no more freedom at the pose than along the path, for example free: none",
        )
    return along[0]
