"""Moving frames that carry the poses of a scenario's waypoints."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.files.documents import Location, Places
from knotwork.task import AtMost, JointWaypoint, PathWaypoint, PlainTask, PoseWaypoint
from knotwork.task.scenario.unknowns import Unknowns
from knotwork.units import Units
from knotwork.waypoints import FloatArray

MAX_SPEED_JUMP = 1e-3
"""The largest speed jump of a frame that an arm can follow [m/s, rad/s]."""

if TYPE_CHECKING:
    import pinocchio as pin

    from knotwork.curves.tool_paths.moving_frame import MovingFrame
    from knotwork.task.scenario.geometry import Frames


class Carriers:
    """Moving frames that carry the poses of one file.

    Poses are given in them, and the robot follows them: so they decide which poses depend on the
    time, and which requests a moving frame excludes.

    Args:
        file: Content of the file, in SI.
        places: Locations of its parts in the file, for errors.
        frames: Its frames.
        frame: Function of a waypoint's index that gives the name of its pose's frame.
    """

    def __init__(
        self, file: PlainTask, places: Places, frames: Frames, frame: Callable[[int, Any], str]
    ) -> None:
        self.file, self.places, self.frames = file, places, frames
        self.names = {
            i: frame(i, waypoint)
            for i, waypoint in enumerate(file.waypoints)
            if not isinstance(waypoint, JointWaypoint)
        }

    @cached_property
    def link(self) -> str:
        """Link of the robot that carries poses, else the file's frame; empty for the base.

        Raises:
            DocumentError: Several links carry poses.
        """
        if not self.names:
            return self.frames.moving[self.file.frame or "base"].link
        posed = [*self.names.items()]
        first, *further = [item for item in posed if self.frames.moving[item[1]].link] or posed
        carrying_link = self.frames.moving[first[1]].link
        for i, name in further:
            link = self.frames.moving[name].link
            if link != carrying_link:
                raise self.places.error(
                    ("waypoints", i),
                    f"is in frame {name!r}, {_link_text(link)}, and earlier poses are in frame "
                    f"{first[1]!r}, {_link_text(carrying_link)}",
                    "poses in frames on one link or in the base",
                )
        return carrying_link

    def is_fixed(self, i: int) -> bool:
        """Whether the pose of a waypoint is fixed in the base while joints move other poses."""
        return bool(i in self.names and self.link and not self.frames.moving[self.names[i]].link)

    def frame_of(self, i: int) -> MovingFrame | None:
        """The moving frame of a waypoint's pose; `None` for a fixed pose or joint values."""
        frame = self.frames.moving[self.names[i]] if i in self.names else None
        return replace(frame, link="") if frame is not None and frame.is_moving else None

    def frame_of_path(self, first: int, last: int) -> MovingFrame | None:
        """The moving frame of a path.

        Raises:
            DocumentError: The waypoints do not move together.
        """
        carrier = self.frame_of(last)
        for i in range(first, last):
            if _joints_of(self.frame_of(i)) != _joints_of(carrier):
                raise self.places.error(
                    ("waypoints", i),
                    f"does not move with waypoint {last + 1}, the next one of the path",
                    "a path with all waypoints in one frame, including its start",
                )
        return carrier

    def check_smooth(self, i: int, carrier: MovingFrame | None, span: tuple[float, float]) -> None:
        """Raise an error if the frame's speed jumps during a path.

        It jumps if the file of its motion gives positions without velocities.

        Args:
            i: The waypoint at the end of the path.
            carrier: The moving frame of the path.
            span: Time interval of the path [s].

        Raises:
            DocumentError: The speed jumps.
        """
        for name, frame in self.file.frames.items() if carrier is not None else ():
            joints = self.frames.moving[name].joints[-1:]
            if frame.moves is None or not set(joints) & set(_joints_of(carrier)):
                continue
            curve = joints[0].curve.between(*span)
            jumps = np.abs(curve.jumps(1))
            if jumps.max(initial=0.0) > MAX_SPEED_JUMP:
                k, axis = np.unravel_index(int(jumps.argmax()), jumps.shape)
                unit = "rad/s" if joints[0].turns[axis] else "m/s"
                shown = Units(self.file.units.length, self.file.units.angle)
                jump = shown.text(float(jumps[k, axis]), unit, ".3g")
                raise self.places.error(
                    ("waypoints", i),
                    f"the tool is on the path to it from {span[0]:.4g} s to {span[1]:.4g} s, and "
                    f"at {curve.x[k + 1]:.4g} s the speed of frame {name!r} jumps by {jump}, which "
                    "no arm can follow",
                    "a motion with velocities, such as a column y.velocity for y, that "
                    "covers the whole path; or a path before or after that time",
                )

    def neighbours_in_frame(
        self, i: int, poses: Mapping[int, pin.SE3], times: Sequence[float]
    ) -> Mapping[int, pin.SE3]:
        """Poses near a waypoint, each at its time, relative to its moving frame.

        Args:
            i: The waypoint.
            poses: Poses of all waypoints, with all frames at rest.
            times: Times of all waypoints [s].
        """
        carrier, seen = self.frame_of(i), {}
        for k in (i - 1, i, i + 1):
            if k not in poses:
                continue
            other_carrier, seen[k] = self.frame_of(k), poses[k]
            if _joints_of(other_carrier) != _joints_of(carrier):
                seen[k] = (
                    seen[k] if other_carrier is None else other_carrier.pose_at(seen[k], times[k])
                )
                seen[k] = seen[k] if carrier is None else carrier.pose_at_rest(seen[k], times[k])
        return seen

    def frame_axes(self, i: int, name: str, time: float) -> FloatArray:
        """Axes of a frame at a time [s], relative to the moving frame of a waypoint."""
        carrier, axes_frame = self.frame_of(i), self.frames.moving[name]
        if _joints_of(carrier) == axes_frame.joints:
            return np.array(self.frames[name].rotation)
        turn = np.array(axes_frame.placement_at(time).rotation)
        return turn if carrier is None else carrier.since_rest([time]).matrix[0, :3, :3].T @ turn

    def check(self, i: int, waypoint: PoseWaypoint | PathWaypoint) -> None:
        """Refuse requests that moving frames do not support.

        Raises:
            DocumentError: A chosen speed, or an orientation relative to another motion.
        """
        place: Location = ("waypoints", i)
        carrier, requested = self.frame_of(i), waypoint.orientation_in
        link = self.frames.moving[self.names[i]].link
        if self.is_fixed(i) and carrier is not None:
            raise self.places.error(
                place,
                f"is in frame {self.names[i]!r}, which moves, and other poses are "
                f"{_link_text(self.link)}",
                "a fixed frame, or a task without the other poses",
            )
        if isinstance(waypoint, PathWaypoint) and (self.is_fixed(i) or self.is_fixed(i - 1)):
            raise self.places.error(
                place,
                f"ends a path with poses in the base, and other poses are {_link_text(self.link)}",
                f"a path with all waypoints {_link_text(self.link)}, or poses without along",
            )
        axes = getattr(getattr(waypoint, "velocity", None), "axes", None)
        for name, *key in ((requested, "orientation_in"), (axes, "velocity", "in")):
            known = self.frames.moving.get(name or "")
            if known is not None and known.link != link:
                raise self.places.error(
                    (*place, *key),
                    f"frame {name!r} is {_link_text(known.link)}, and the pose {_link_text(link)}",
                    "a frame that is fixed relative to the pose",
                )
        if requested is not None:
            axes_frame = self.frames.moving[self.frames.find(requested, (*place, "orientation_in"))]
            turning = any(
                any(joints.turns) for joints in (*_joints_of(carrier), *axes_frame.joints)
            )
            if axes_frame.joints != _joints_of(carrier) and turning:
                raise self.places.error(
                    (*place, "orientation_in"),
                    "rotates relative to the frame of the pose",
                    "a frame with the same rotation",
                )
        if carrier is None:
            return
        name = self.names[i]
        if isinstance(getattr(waypoint, "speed", None), str | AtMost):
            raise self.places.error(
                (*place, "speed"),
                f"is chosen, but the motion of frame {name!r} depends on the time",
                "a speed" if isinstance(waypoint, PathWaypoint) else "a speed, or velocity: free",
            )

    def mark_arrivals(self, unknowns: Unknowns | None, index: Sequence[int]) -> Unknowns | None:
        """The unknowns, including the waypoints whose pose depends on their time.

        Args:
            unknowns: The unknowns so far.
            index: Index in the file of each waypoint of the scenario.

        Raises:
            DocumentError: The total duration is given as well.
        """
        if unknowns is None:
            return unknowns
        in_moving_frames = [
            i
            for i in range(unknowns.first_unknown_time, len(index))
            if self.frame_of(index[i]) is not None
        ]
        time_dependent = tuple(sorted({*in_moving_frames, *unknowns.time_dependent}))
        if in_moving_frames and unknowns.total is not None:
            i = index[in_moving_frames[0]]
            raise self.places.error(
                ("duration",),
                f"is given, and the time in moving frame {self.names[i]!r} is chosen",
                "no duration, or time or after [s] at the waypoints in that frame and before",
            )
        return replace(unknowns, time_dependent=time_dependent)


def _link_text(link: str) -> str:
    return f"on link {link!r}" if link else "in the base"


def _joints_of(frame: MovingFrame | None) -> tuple[Any, ...]:
    return frame.joints if frame is not None else ()
