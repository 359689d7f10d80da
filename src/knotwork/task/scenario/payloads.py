"""The mass of a tool and of held objects: as given in a file, and over a motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial.splitting import cut_curve
from knotwork.curves.trajectory import Load
from knotwork.files.documents import Location, Locations
from knotwork.robot.payload import Payload, find_payload_fault
from knotwork.task import HeldObject, Tool
from knotwork.task.scenario.scenario import Scenario

if TYPE_CHECKING:
    from knotwork.curves.trajectory import JointTrajectory
    from knotwork.robot import Robot


def read_payload(
    part: Tool | HeldObject, locations: Locations, location: Location
) -> Payload | None:
    """The mass of a tool or of a held object, in SI as the file is; `None` without one.

    Raises:
        DocumentError: The mass and inertia are not physical.
    """
    if part.mass is None:
        return None
    inertia = None
    if (i := part.inertia) is not None:
        inertia = np.array([[i.ixx, i.ixy, i.ixz], [i.ixy, i.iyy, i.iyz], [i.ixz, i.iyz, i.izz]])
    fault = find_payload_fault(part.mass, inertia)
    if fault is not None:
        field, fault_text, accepted = fault
        raise locations.error((*location, field), fault_text, accepted)
    default_centre = part.position if isinstance(part, HeldObject) else (0.0, 0.0, 0.0)
    return Payload(part.mass, np.array(part.centre_of_mass or default_centre), inertia)


@dataclass(frozen=True, eq=False)
class LoadedRobots:
    """The arm with its load in each phase.

    Attributes:
        start: Start of each phase [s], shape (m,). The first phase also holds before its start.
        robots: The arm in each phase; the same object for the same load.
        by_interval: The arm from each waypoint of the scenario to the next.
    """

    start: FloatArray
    robots: tuple[Robot, ...]
    by_interval: tuple[Robot, ...]

    def robot_at(self, time: float) -> Robot:
        """The arm at a time [s]; at a change of load, with the new one."""
        return self.robots[max(int(np.searchsorted(self.start, time, side="right")) - 1, 0)]

    def parts(self, motion: JointTrajectory) -> Iterator[tuple[Robot, JointTrajectory]]:
        """A motion split at changes of load: the arm in each part, and the part."""
        inside = (self.start > motion.start_time) & (self.start < motion.end_time)
        if not inside.any():
            yield self.robot_at(motion.start_time), motion
            return
        times = [motion.start_time, *self.start[inside].tolist(), motion.end_time]
        for start, end in pairwise(times):
            cut = cut_curve(motion.polynomial, start, end)
            yield self.robot_at(start), replace(motion, polynomial=cut, waypoint_times=None)

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
    import pinocchio as pin

    payloads = [*robot.held_payloads, *([] if robot.payload is None else [robot.payload])]
    bodies = [pin.Inertia(load.mass, load.centre_of_mass, load.inertia) for load in payloads]
    placed = [robot.tool_offset.act(body) for body in bodies[: len(robot.held_payloads)]]
    total_body = sum([*placed, *bodies[len(placed) :]], pin.Inertia.Zero())
    # point masses are reported as one
    has_inertia = any(np.any(load.inertia) for load in payloads)
    total = np.array(total_body.inertia) if has_inertia else np.zeros((3, 3))
    mass, centre = float(total_body.mass), np.array(total_body.lever)
    x, y, z = centre.tolist()
    moments = (*np.diag(total).tolist(), total[0, 1].item(), total[0, 2].item(), total[1, 2].item())
    return Load(time, mass, (x, y, z), robot.tool_frame or "", moments)


def robots_with_loads(scenario: Scenario, robot: Robot) -> LoadedRobots:
    """The loads of a scenario's arm over its motion.

    Args:
        scenario: The scenario.
        robot: Its robot, with its tool.
    """
    held = [
        (item.payload, range(item.taken_at, item.released_at))
        for item in scenario.scene.held
        if item.payload is not None
    ]
    arms_by_load: dict[tuple[bytes, ...], Robot] = {(): robot}
    arms = []
    for i in range(len(scenario.waypoints)):
        load = [payload for payload, interval in held if i in interval]
        key = tuple(payload.key for payload in load)
        if key not in arms_by_load:
            arms_by_load[key] = robot.with_held(*load)
        arms.append(arms_by_load[key])
    changes = [i for i, (before, arm) in enumerate(pairwise([robot, *arms])) if arm is not before]
    starts = [-np.inf, *scenario.expected_times[changes].tolist()]
    return LoadedRobots(np.array(starts), (robot, *(arms[i] for i in changes)), tuple(arms[:-1]))
