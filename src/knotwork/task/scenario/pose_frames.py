"""`PoseFrames`: what moves with what.

Every pose is fixed in a frame, a `TaskFrame`. The frame is placed in the cell or, with the key
`on`, on a link of the robot. If it or a frame around it has the key `moves`, joints with known
positions over time move it, like a belt. Otherwise it is at rest.

All poses on a link must be on the same one, such as a turntable, which planned joints may move.
That link is the base frame, and poses in the cell are then in the world frame.

Objects of the scene have such frames, too. What the tool holds moves with it, as its load
(`LoadedRobots`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors.plain_text import default_waypoint_name, waypoint_text
from knotwork.files.documents import Location, Locations
from knotwork.task import AtMost, ExpandedTask, JointWaypoint, PathWaypoint, PoseWaypoint
from knotwork.task.scenario.unknowns_reader import ScenarioUnknowns
from knotwork.units import Units

MAX_SPEED_JUMP = 1e-3
"""The maximum speed jump of a frame that an arm can follow [m/s, rad/s]."""

if TYPE_CHECKING:
    import pinocchio as pin

    from knotwork.curves.tool_paths.task_frame import TaskFrame
    from knotwork.task.scenario.geometry import Frames


@dataclass(frozen=True, eq=False)
class PoseFrames:
    """The frames of a task's poses, by index of the waypoint.

    Attributes:
        task: The task in SI.
        locations: Locations of its parts in its file, for errors.
        units: Units of the file, for messages.
    """

    task: ExpandedTask
    locations: Locations
    units: Units

    @cached_property
    def named(self) -> Frames:
        """All frames of the task by name, and `"base"`."""
        from knotwork.task.scenario.geometry import Frames

        return Frames(self.task.frames, self.locations)

    @cached_property
    def names(self) -> dict[int, str]:
        """Name of the frame of each pose."""
        names = {}
        for i, waypoint in enumerate(self.task.waypoints):
            if isinstance(waypoint, JointWaypoint):
                continue
            is_own = waypoint.frame is not None
            location: Location = ("waypoints", i, "frame") if is_own else ("frame",)
            names[i] = self.named.checked_name(self.task.frame_of(waypoint), location)
        return names

    @cached_property
    def link(self) -> str:
        """Link that carries the frames of poses, else the file's frame; empty for the cell.

        Raises:
            DocumentError: Several links carry frames of poses.
        """
        if not self.task.frames:
            return ""
        if not self.names:
            return self.named[self.task.frame or "base"].link
        links = {i: self.named[name].link for i, name in self.names.items()}
        first = next((i for i, link in links.items() if link), next(iter(links)))
        for i, link in links.items():
            if link and link != links[first]:
                raise self.locations.error(
                    ("waypoints", i),
                    f"is in frame {self.names[i]!r}, {_link_text(link)}, and earlier poses are "
                    f"in frame {self.names[first]!r}, {_link_text(links[first])}",
                    "poses in frames on one link or in the base",
                )
        return links[first]

    def __getitem__(self, i: int) -> TaskFrame:
        """Frame of a pose; of joint values, that in which poses of the tool are given."""
        if i in self.names:
            return self.named[self.names[i]]
        return replace(self.named["base"], link=self.link)

    def in_world_frame(self, i: int) -> bool:
        """Whether a pose is in the world frame, while a link carries the frames of others."""
        return bool(self.link) and not self[i].link

    def axes(self, i: int) -> FloatArray:
        """Axes of the orientation of a pose at rest, shape (3, 3)."""
        waypoint = self.task.waypoints[i]
        own = None if isinstance(waypoint, JointWaypoint) else waypoint.orientation_in
        name = own or self.names[i]
        self.named.checked_name(name, ("waypoints", i, "orientation_in"))
        return np.array(self.named[name].rest_placement.rotation)

    def axes_at(self, i: int, name: str, time: float) -> FloatArray:
        """Axes of a named frame at a time [s], relative to the frame of a pose."""
        return np.array(self[i].pose_at_rest(self.named[name].placement_at(time), time).rotation)

    def neighbours(
        self, i: int, poses: Mapping[int, pin.SE3], times: Sequence[float]
    ) -> dict[int, pin.SE3]:
        """Poses near a waypoint, each at its time, relative to the frame of its pose.

        Args:
            i: The waypoint.
            poses: Poses of all waypoints, with all frames at rest.
            times: Times of all waypoints [s].
        """
        return {
            k: self[i].pose_at_rest(self[k].pose_at(poses[k], times[k]), times[k])
            for k in (i - 1, i, i + 1)
            if k in poses
        }

    def of_path(self, first: int, last: int) -> TaskFrame:
        """The frame of a path.

        Args:
            first: The waypoint at the start of the path.
            last: The waypoint at its end.

        Raises:
            DocumentError: The waypoints do not move together.
        """
        name = waypoint_text(self.task.waypoints[last].name or default_waypoint_name(last))
        for i in range(first, last):
            if self[i].joints != self[last].joints:
                raise self.locations.error(
                    ("waypoints", i),
                    f"does not move with {name}, a later one of the path",
                    "a path with all waypoints in one frame, including its start",
                )
        return self[last]

    def check_smooth(self, i: int, start: float, end: float) -> None:
        """Raise an error if the speed of a frame jumps while the tool keeps its pose in it.

        It jumps if the file of its motion gives positions without velocities.

        Args:
            i: The waypoint at the end of the path.
            start: Start of the path [s].
            end: Its end [s].

        Raises:
            DocumentError: The speed jumps.
        """
        for joints in self[i].joints:
            curve = joints.curve.between(start, end)
            jumps = np.abs(curve.jumps(1))
            if jumps.max(initial=0.0) > MAX_SPEED_JUMP:
                k, axis = np.unravel_index(int(jumps.argmax()), jumps.shape)
                unit = "rad/s" if joints.is_revolute[axis] else "m/s"
                jump = self.units.text(float(jumps[k, axis]), unit, ".3g")
                raise self.locations.error(
                    ("waypoints", i),
                    f"the tool is on the path to it from {start:.4g} s to {end:.4g} s, and at "
                    f"{curve.x[k + 1]:.4g} s the speed of frame {joints.name!r} jumps by {jump}, "
                    "which no arm can follow",
                    "a motion with velocities, such as a column y.velocity for y, that "
                    "covers the whole path; or a path before or after that time",
                )

    def refuse_unsupported_keys(self, i: int, waypoint: PoseWaypoint | PathWaypoint) -> None:
        """Refuse requests that moving frames do not support.

        Args:
            i: The waypoint.
            waypoint: Its definition.

        Raises:
            DocumentError: A chosen speed, or an orientation relative to another motion.
        """
        location: Location = ("waypoints", i)
        name = self.names[i]
        frame = self[i]
        requested = waypoint.orientation_in
        of_others = _link_text(self.link)
        if self.in_world_frame(i) and frame.is_moving:
            raise self.locations.error(
                location,
                f"is in frame {name!r}, which moves, and other poses are {of_others}",
                "a fixed frame, or a task without the other poses",
            )
        is_path = isinstance(waypoint, PathWaypoint)
        if is_path and any(self.in_world_frame(k) for k in (i - 1, i)):
            raise self.locations.error(
                location,
                f"ends a path with poses in the base, and other poses are {of_others}",
                f"a path with all waypoints {of_others}, or poses without along",
            )
        velocity = None if isinstance(waypoint, PathWaypoint) else waypoint.velocity
        axes = None if velocity is None or isinstance(velocity, str) else velocity.axes
        for axes_name, *key in ((requested, "orientation_in"), (axes, "velocity", "in")):
            axes_frame = self.named.get(axes_name or "")
            if axes_frame is not None and axes_frame.link != frame.link:
                raise self.locations.error(
                    (*location, *key),
                    f"frame {axes_name!r} is {_link_text(axes_frame.link)}, and the pose "
                    f"{_link_text(frame.link)}",
                    "a frame that is fixed relative to the pose",
                )
        if requested is not None:
            joints = self.named[
                self.named.checked_name(requested, (*location, "orientation_in"))
            ].joints
            is_turning = any(any(part.is_revolute) for part in (*frame.joints, *joints))
            if joints != frame.joints and is_turning:
                raise self.locations.error(
                    (*location, "orientation_in"),
                    "rotates relative to the frame of the pose",
                    "a frame with the same rotation",
                )
        if frame.is_moving and isinstance(waypoint.speed, str | AtMost):
            raise self.locations.error(
                (*location, "speed"),
                f"is chosen, but the motion of frame {name!r} depends on the time",
                "a speed" if is_path else "a speed, or velocity: free",
            )

    def with_time_dependent(
        self, unknowns: ScenarioUnknowns, task_index: Sequence[int]
    ) -> ScenarioUnknowns:
        """The unknowns, including the waypoints whose pose depends on their time.

        Args:
            unknowns: The unknowns so far.
            task_index: Index in the task of each waypoint of the scenario.

        Raises:
            DocumentError: The total duration is given as well.
        """
        in_moving_frames = [
            i
            for i in range(unknowns.first_unknown_time, len(task_index))
            if self[task_index[i]].is_moving
        ]
        if in_moving_frames and unknowns.total_duration is not None:
            name = self.names[task_index[in_moving_frames[0]]]
            raise self.locations.error(
                ("duration",),
                f"is given, and the time in moving frame {name!r} is chosen",
                "no duration, or time or after [s] at the waypoints in that frame and before",
            )
        time_dependent = tuple(sorted({*in_moving_frames, *unknowns.time_dependent}))
        return replace(unknowns, time_dependent=time_dependent)


def _link_text(link: str) -> str:
    """Name the link that carries a frame, for messages."""
    return f"on link {link!r}" if link else "in the base"
