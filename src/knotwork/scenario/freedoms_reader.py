"""What the poses of a scenario file leave open."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

from knotwork.documents import Location, Places
from knotwork.scenario.model import ScenarioPath
from knotwork.task import FreePose, JointWaypoint, PlainTask
from knotwork.task.units import si_factors
from knotwork.waypoints import PoseFreedom

Freedoms = list[PoseFreedom | None]


def read_freedoms(file: PlainTask, places: Places, normals: Collection[int] = ()) -> Freedoms:
    """What the poses of all waypoints leave open; `None` for nothing, and where there is no pose.

    Args:
        file: What the file says, in SI.
        places: Where it says it, for errors.
        normals: Waypoints, by index, to which paths with normals lead: these free the turn.

    Raises:
        DocumentError: A turn does not contain the pose, reaches beyond half a turn, or differs
            from that of another waypoint; or a tilt is too large, or given with a range.
    """
    tool = None if file.tool is None else file.tool.free
    general = None if tool is None else _read(tool, places, ("tool", "free"), file)
    found: Freedoms = []
    for i, waypoint in enumerate(file.waypoints):
        own = None if isinstance(waypoint, JointWaypoint) else waypoint.free
        if own == "none" and i in normals:
            raise places.error(
                ("waypoints", i, "free"),
                "is none, but normals do not say how the tool is turned about its axis",
                "turn: z, or columns qx, qy, qz, qw",
            )
        if isinstance(waypoint, JointWaypoint) or own == "none":
            found.append(None)
        elif own is None:
            implied = PoseFreedom((-math.inf, math.inf)) if i in normals else None
            found.append(general or implied)
        else:
            found.append(_read(own, places, ("waypoints", i, "free"), file))
    known = [one for one in found if one is not None]
    for i, one in enumerate(found):
        if one is not None and one != known[0]:
            raise places.error(
                ("waypoints", i, "free"),
                "differs from what other poses leave open",
                "the same wherever one is free",
            )
    return found


def _read(given: FreePose, places: Places, location: Location, file: PlainTask) -> PoseFreedom:
    unit = si_factors(file.units)[1]
    if given.tilt is not None and given.tilt >= 0.5 * math.pi:
        raise places.error(
            (*location, "tilt"),
            f"is {given.tilt / unit:.6g} {file.units.angle}",
            f"an angle below a quarter of a turn, {0.5 * math.pi / unit:.6g}",
        )
    ranges = (
        [] if given.position is None else [given.position.x, given.position.y, given.position.z]
    )
    for axis, own in zip("xyz", ranges, strict=False):
        if own is not None and not own[0] <= 0.0 <= own[1]:
            length = si_factors(file.units)[0]
            raise places.error(
                (*location, "position", axis),
                f"is [{own[0] / length:g}, {own[1] / length:g}] {file.units.length}",
                "places from the pose: a least one up to 0, and a greatest one from 0",
            )
    box = tuple((0.0, 0.0) if own is None else (own[0], own[1]) for own in ranges)
    box = box or PoseFreedom.box
    if given.turn is None:
        return PoseFreedom(box=box)
    if given.turn == "z":
        return PoseFreedom((-math.inf, math.inf), given.tilt or 0.0, box)
    if given.tilt is not None:
        raise places.error(
            (*location, "tilt"), "is given together with a range of turns", "tilt with turn: z"
        )
    low, high = given.turn
    if not (low <= 0.0 <= high and max(-low, high) <= math.pi * (1.0 + 1e-12)):
        half = f"{math.pi / unit:.6g}"
        raise places.error(
            (*location, "turn"),
            f"is [{low / unit:g}, {high / unit:g}] {file.units.angle}",
            f"turns from the pose: a least one from -{half} to 0, and a greatest one from 0 to "
            f"{half}; or z, for any turn",
        )
    return PoseFreedom((low, high), box=box)


def freedom_of(path: ScenarioPath, freedoms: Freedoms, places: Places) -> PoseFreedom | None:
    """What the poses along a path leave open.

    Args:
        path: A path, its first waypoint that of the file.
        freedoms: Of all waypoints.
        places: Of the file, for errors.

    Raises:
        DocumentError: It is not the same all along, leaves the position open, or the path begins
            free and goes on fixed.
    """
    own: Sequence[PoseFreedom | None] = freedoms[path.first + 1 : path.last + 1]
    for i, one in enumerate(own, path.first + 1):
        if one is not None and one.moves:
            raise places.error(
                ("waypoints", i, "free"),
                "leaves the position open along a path, which says where the tool is",
                "position at poses where the tool stops",
            )
    for i, one in enumerate(own, path.first + 1):
        if one != own[0]:
            raise places.error(
                ("waypoints", i, "free"),
                "is not what the path before it leaves open",
                "the same all along a path, or stop: true where it changes",
            )
    if own[0] is None and freedoms[path.first] is not None:
        raise places.error(
            ("waypoints", path.first + 1),
            "the path begins at a pose that is free, and is not free itself",
            "free: with the path, too, or free: none where it begins",
        )
    return own[0]
