"""`TaskInSI`: a task in SI, with the frames of its poses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.files.documents import Location, Locations
from knotwork.task import ExpandedTask, JointWaypoint, Placement, TaskUnits
from knotwork.units import Units

if TYPE_CHECKING:
    import pinocchio as pin

    from knotwork.curves.tool_paths.moving_frame import MovingFrame
    from knotwork.task.scenario.geometry import Frames


@dataclass(frozen=True, eq=False)
class TaskInSI:
    """A task in SI except joint values, with its frames; waypoints by `task_index`.

    The readers of its parts share it. Moving frames carry poses, and the robot follows them.

    Attributes:
        task: The task.
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
    def length(self) -> float:
        """The file's unit of length [m], in which files of points and meshes are."""
        return self.file_units.in_si[0]

    @cached_property
    def frames(self) -> Frames:
        """The named frames, placed in the base."""
        from knotwork.task.scenario.geometry import Frames

        return Frames(self.task.frames, self.locations)

    @cached_property
    def pose_frames(self) -> dict[int, str]:
        """Name of the frame of each pose, by index of the waypoint."""
        names = {}
        for i, waypoint in enumerate(self.task.waypoints):
            if isinstance(waypoint, JointWaypoint):
                continue
            is_own = waypoint.frame is not None
            location: Location = ("waypoints", i, "frame") if is_own else ("frame",)
            names[i] = self.frames.find(self.task.frame_of(waypoint), location)
        return names

    @cached_property
    def pose_frame_link(self) -> str:
        """Link of the robot that carries poses, else the file's frame; empty for the base.

        Raises:
            DocumentError: Several links carry poses.
        """
        moving = self.frames.moving
        if not self.pose_frames:
            return moving[self.task.frame or "base"].link
        posed = [*self.pose_frames.items()]
        first, *further = [item for item in posed if moving[item[1]].link] or posed
        pose_frame_link = moving[first[1]].link
        for i, name in further:
            if moving[name].link != pose_frame_link:
                raise self.locations.error(
                    ("waypoints", i),
                    f"is in frame {name!r}, {link_text(moving[name].link)}, and earlier poses are "
                    f"in frame {first[1]!r}, {link_text(pose_frame_link)}",
                    "poses in frames on one link or in the base",
                )
        return pose_frame_link

    def frame(self, i: int) -> pin.SE3:
        """Frame of a pose, at rest in the base."""
        return self.frames[self.pose_frames[i]]

    def carrier(self, i: int) -> MovingFrame | None:
        """The moving frame of a pose; `None` for a fixed pose or joint values."""
        if i not in self.pose_frames:
            return None
        frame = self.frames.moving[self.pose_frames[i]]
        return replace(frame, link="") if frame.is_moving else None

    def in_world(self, i: int) -> bool:
        """Whether a pose is in the world frame, while joints move other poses."""
        if i not in self.pose_frames or not self.pose_frame_link:
            return False
        return not self.frames.moving[self.pose_frames[i]].link

    def axes(self, i: int) -> FloatArray:
        """Axes of the orientation of a pose at rest, shape (3, 3)."""
        name = getattr(self.task.waypoints[i], "orientation_in", None) or self.pose_frames[i]
        self.frames.find(name, ("waypoints", i, "orientation_in"))
        return np.array(self.frames[name].rotation)

    def placement(self, placement: Placement, *location: str | int) -> pin.SE3:
        """A placement at a location of the task, in its parent frame."""
        from knotwork.task.scenario.geometry import read_placement

        return read_placement(placement, self.locations, location)

    def stops(self, i: int) -> bool:
        """Whether the tool stops at a waypoint where a path begins or ends."""
        waypoint = self.task.waypoints[i]
        at_start = i == 0 and self.task.start is None
        return (
            bool(waypoint.stop or waypoint.dwell) or at_start or i == len(self.task.waypoints) - 1
        )


def link_text(link: str) -> str:
    """Name the link that carries a frame, for messages."""
    return f"on link {link!r}" if link else "in the base"
