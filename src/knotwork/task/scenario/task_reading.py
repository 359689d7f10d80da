"""`TaskReading`: what the readers of the parts of a task share."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from knotwork.files.documents import Locations
from knotwork.task import ExpandedTask, Placement, TaskUnits
from knotwork.task.scenario.pose_frames import PoseFrames
from knotwork.task.scenario.unknowns_reader import WaypointUnknowns, read_waypoint_unknowns
from knotwork.units import Units

if TYPE_CHECKING:
    import pinocchio as pin


@dataclass(frozen=True, eq=False)
class TaskReading:
    """Common data of the readers of a task's parts. Waypoints are counted as in the task.

    Attributes:
        task: The task, in SI except joint values.
        locations: Locations of its parts in its file, for errors.
        file_units: Units of its file; those of `task` are SI.
    """

    task: ExpandedTask
    locations: Locations
    file_units: TaskUnits

    @property
    def units(self) -> Units:
        """Units of the file, for messages."""
        return self.file_units.for_output

    @property
    def metres_per_unit(self) -> float:
        """The file's unit of length [m], in which files of points and meshes are."""
        return self.file_units.in_si[0]

    @cached_property
    def pose_frames(self) -> PoseFrames:
        """The frames of its poses."""
        return PoseFrames(self.task, self.locations, self.units)

    @cached_property
    def waypoint_unknowns(self) -> tuple[WaypointUnknowns, ...]:
        """The unknowns at each waypoint, and on the way to it from the one before."""
        return tuple(read_waypoint_unknowns(self.task, i) for i in range(len(self.task.waypoints)))

    def placement(self, placement: Placement, *location: str | int) -> pin.SE3:
        """A placement at a location of the task, in its parent frame."""
        from knotwork.task.scenario.geometry import read_placement

        return read_placement(placement, self.locations, location)

    def stops(self, i: int) -> bool:
        """Whether the arm stops at a waypoint: for `stop` or a wait, or at an end of the task."""
        waypoint = self.task.waypoints[i]
        at_start = i == 0 and self.task.start is None
        at_end = i == len(self.task.waypoints) - 1
        return bool(waypoint.stop or waypoint.wait_time) or at_start or at_end
