"""The mass of a tool and of held objects: as given in a file, and over a motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from knotwork.files.documents import Location, Places
from knotwork.robot.payload import Payload, payload_fault
from knotwork.scenario.scenario import Scenario
from knotwork.spline.polynomial.refined import part
from knotwork.spline.trajectory import Load
from knotwork.task import HeldObject, Tool
from knotwork.waypoints import FloatArray

if TYPE_CHECKING:
    from knotwork.robot import Robot
    from knotwork.spline.trajectory import JointTrajectory


def read_payload(part: Tool | HeldObject, places: Places, place: Location) -> Payload | None:
    """The mass of a tool or of a held object, in SI as the file is; `None` without one.

    Raises:
        DocumentError: The mass and inertia are not physical.
    """
    if part.mass is None:
        return None
    i, inertia = part.inertia, None
    if i is not None:
        inertia = np.array([[i.ixx, i.ixy, i.ixz], [i.ixy, i.iyy, i.iyz], [i.ixz, i.iyz, i.izz]])
    fault = payload_fault(part.mass, inertia)
    if fault is not None:
        field, fault_text, accepted = fault
        raise places.error((*place, field), fault_text, accepted)
    default_centre = part.position if isinstance(part, HeldObject) else (0.0, 0.0, 0.0)
    return Payload(part.mass, np.array(part.centre_of_mass or default_centre), inertia)


@dataclass(frozen=True, eq=False)
class Carrying:
    """The arm with its loads, phase by phase.

    Attributes:
        start: Start of each phase [s], shape (m,); the first one holds before it, too.
        robots: The arm in each phase; the same object for the same load.
    """

    start: FloatArray
    robots: tuple[Robot, ...]

    def at(self, time: float) -> Robot:
        """The arm at a time [s]; at a change of load, with the new one."""
        return self.robots[max(int(np.searchsorted(self.start, time, side="right")) - 1, 0)]

    def parts(self, motion: JointTrajectory) -> Iterator[tuple[Robot, JointTrajectory]]:
        """A motion split at changes of load: the arm in each part, and the part."""
        inside = (self.start > motion.start_time) & (self.start < motion.end_time)
        if not inside.any():
            yield self.at(motion.start_time), motion
            return
        times = [motion.start_time, *self.start[inside].tolist(), motion.end_time]
        for start, end in pairwise(times):
            cut = part(motion.polynomial, start, end)
            yield self.at(start), replace(motion, polynomial=cut, waypoint_times=None)

    def loads(self, start: float) -> tuple[Load, ...]:
        """Loads for exports; empty if the task gives no mass.

        Args:
            start: Start of the motion [s].
        """
        loads = {}
        for time, robot in zip(self.start.tolist(), self.robots, strict=True):
            time = max(time, start)
            loads[time] = _load(time, robot)
        return tuple(loads.values()) if any(load.mass for load in loads.values()) else ()


def _load(time: float, robot: Robot) -> Load:
    """The whole load of an arm as one body."""
    turn = robot.tool_offset.rotation
    bodies = [
        (payload.mass, robot.tool_offset * payload.centre_of_mass, turn @ payload.inertia @ turn.T)
        for payload in robot.held
    ]
    if (tool_payload := robot.payload) is not None:
        bodies.append((tool_payload.mass, tool_payload.centre_of_mass, tool_payload.inertia))
    mass = sum(body_mass for body_mass, *_ in bodies)
    moment = sum((body_mass * centre for body_mass, centre, _ in bodies), np.zeros(3))
    centre = moment / mass if mass else moment
    total = np.zeros((3, 3))
    if any(inertia.any() for *_, inertia in bodies):  # else point masses, as given
        for point_mass, at, inertia in bodies:
            d = at - centre
            total += inertia + point_mass * (d @ d * np.eye(3) - np.outer(d, d))
    x, y, z = centre.tolist()
    moments = (*np.diag(total).tolist(), total[0, 1].item(), total[0, 2].item(), total[1, 2].item())
    return Load(time, mass, (x, y, z), robot.tool_frame or "", moments)


def carrying(scenario: Scenario, robot: Robot) -> Carrying:
    """The loads of a scenario's arm over its motion, at provisional times if times are free.

    Args:
        scenario: The task.
        robot: Its robot, with its tool.
    """
    times = {waypoint.name: waypoint.time for waypoint in scenario.waypoints}
    held = [
        (item.payload, times[item.take], times[item.leave])
        for item in scenario.scene.held
        if item.payload is not None
    ]
    starts, arms = [-np.inf], [robot]
    arms_by_load: dict[tuple[bytes, ...], Robot] = {(): robot}
    for start in sorted({time for _, *ends in held for time in ends}):
        load = [payload for payload, start_time, release in held if start_time <= start < release]
        key = tuple(payload.key for payload in load)
        if key not in arms_by_load:
            arms_by_load[key] = robot.with_held(*load)
        if arms_by_load[key] is not arms[-1]:
            starts.append(start)
            arms.append(arms_by_load[key])
    return Carrying(np.array(starts), tuple(arms))
