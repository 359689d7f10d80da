"""The waypoints of a scenario file: names, times, poses and velocities in SI in the base frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from knotwork.errors.plain_text import default_waypoint_name
from knotwork.files.documents import Location, Places
from knotwork.task import (
    JointWaypoint,
    PathWaypoint,
    Placement,
    PlainTask,
    PoseWaypoint,
    Torch,
    Velocity,
)
from knotwork.task.poses import ORIENTATIONS
from knotwork.task.scenario.freedoms_reader import Freedoms, freedom_of, read_freedoms
from knotwork.task.scenario.scenario import JointTarget, ScenarioPath, ScenarioWaypoint
from knotwork.task.scenario.unknowns import check_places, max_speed, min_time
from knotwork.waypoints import CartesianWaypoint, FloatArray

if TYPE_CHECKING:
    import pinocchio as pin

    from knotwork.curves.tool_paths import TimedPath
    from knotwork.task.scenario.carriers import Carriers
    from knotwork.task.scenario.geometry import Frames
    from knotwork.task.scenario.path_reader import PathReader

START, WAITED = "start", "{}, after the wait"

EXPECTED_DURATION = 1.0
"""Expected time to a waypoint whose time is chosen later [s]."""


class WaypointReader:
    """Reads the waypoints of a scenario file, and their frames.

    Args:
        file: Content of the file, in SI but for joint values.
        places: Locations of its parts in the file, for errors.
        length: The file's unit of length [m].
        angle: The file's unit of angle [rad].
        expected: Expected times of waypoints with a chosen time [s], by index.
    """

    def __init__(
        self,
        file: PlainTask,
        places: Places,
        length: float,
        angle: float,
        expected: Mapping[int, float],
    ) -> None:
        self.file, self.places, self.length, self.angle = file, places, length, angle
        self.expected = expected
        self.indices: tuple[int, ...] = ()
        self.poses: dict[int, pin.SE3] = {}
        self.times: list[float] = []
        self.freedoms: Freedoms = []
        self._normals: set[int] = set()

    def waypoints(self) -> tuple[tuple[ScenarioWaypoint, ...], tuple[ScenarioPath, ...]]:
        """All waypoints in order, the start first if there is one, and the paths between them.

        A waypoint with `wait` appears twice: at the start and the end of the wait. Free times are
        expected ones. `indices` has the index in the file of each.

        Raises:
            DocumentError: A time, frame, pose or velocity is missing or wrong.
        """
        steps = self.file.waypoints
        names = self._names()
        if len(steps) + (self.file.start is not None) < 2:
            raise self.places.error(
                ("waypoints",),
                "a motion needs at least two waypoints, and there is one",
                "two or more, or one with start: the start of the motion",
            )
        check_places(self.file, self.places)
        self._read_poses()
        paths = self._read_times()
        self.freedoms = read_freedoms(self.file, self.places, self._normals)
        paths = [
            replace(path, freedom=freedom_of(path, self.freedoms, self.places)) for path in paths
        ]
        motions = {i: path.motion for path in paths for i in range(path.first, path.last + 1)}
        waits: list[ScenarioPath] = []
        last: dict[int, int] = {}
        indices: list[int] = []
        waypoints: list[ScenarioWaypoint] = []
        if self.file.start is not None:
            where = self.places.where(("start",))
            waypoints.append(JointTarget(START, 0.0, self.file.start, {}, ("start",), where))
            indices.append(-1)
        for i, step in enumerate(steps):
            waypoint = self._waypoint(i, names[i], motions.get(i))
            waypoints.append(waypoint)
            indices.append(i)
            if step.wait is not None:
                end = self.times[i] + step.wait
                departure = replace(waypoint, name=WAITED.format(names[i]), time=end)
                carrier = self.carriers.frame_of(i)
                if carrier is not None and isinstance(waypoint, CartesianWaypoint):
                    from knotwork.task.scenario.path_reader import wait_on

                    self.carriers.check_smooth(i, carrier, (waypoint.time, end))
                    wait = wait_on(carrier, self.poses[i], len(waypoints) - 1, waypoint, end)
                    waits.append(wait)
                    pose, twist = wait.motion.pose(end), wait.motion.twist(end)
                    departure = replace(departure, pose=pose, twist=twist)
                waypoints.append(departure)
                indices.append(i)
            last[i] = len(waypoints) - 1
        self.indices = tuple(indices)
        waits += [replace(path, first=last[path.first]) for path in paths]
        return tuple(waypoints), tuple(sorted(waits, key=lambda path: path.first))

    def _waypoint(self, i: int, name: str, motion: TimedPath | None) -> ScenarioWaypoint:
        """A waypoint at the arrival of the tool, possibly along a path."""
        step, where = self.file.waypoints[i], self.places.where(("waypoints", i))
        time, freedom = self.times[i], self.freedoms[i]
        if isinstance(step, JointWaypoint):
            if step.velocity is None:
                self._check_stop(i, "velocity: by joint name")
            velocity = step.velocity if isinstance(step.velocity, dict) else {}
            location = ("waypoints", i, "joints")
            return JointTarget(name, time, step.joints, velocity, location, where)
        pose, twist = self._state(i, step, motion)
        rides = step.wait is not None and self.carriers.frame_of(i) is not None
        if freedom is not None and freedom.position_is_free and (rides or twist.vector.any()):
            raise self.places.error(
                ("waypoints", i, "free"),
                "leaves the position open where the tool moves",
                "position where it stops: stop: true",
            )
        is_fixed = bool(self.file.frames) and self.carriers.is_fixed(i)
        return CartesianWaypoint(name, time, pose, twist, where, freedom, is_fixed)

    def _state(
        self, i: int, step: PoseWaypoint | PathWaypoint, motion: TimedPath | None
    ) -> tuple[pin.SE3, pin.Motion]:
        """Pose and velocity of a waypoint in the base, including the motion of its frame."""
        import pinocchio as pin

        frame, pose, time = self.carriers.frame_of(i), self.poses[i], self.times[i]
        if motion is not None and not self._stops(i):
            twist = motion.twist(time)
            if motion.carrier is not None:
                return motion.pose(time), twist
        else:
            twist = self._twist(i, step) if isinstance(step, PoseWaypoint) else pin.Motion.Zero()
            if frame is not None:
                twist = frame.carried_twist(pose, twist, time)
        return (pose if frame is None else frame.pose_at(pose, time)), twist

    @cached_property
    def carriers(self) -> Carriers:
        """Moving frames of the waypoints' poses."""
        from knotwork.task.scenario.carriers import Carriers

        return Carriers(self.file, self.places, self.frames, self.frame)

    def _names(self) -> list[str]:
        steps = self.file.waypoints
        names = [waypoint.name or default_waypoint_name(i) for i, waypoint in enumerate(steps)]
        used_names = {START} if self.file.start is not None else set()
        used_names |= {
            WAITED.format(names[i]) for i, waypoint in enumerate(steps) if waypoint.wait is not None
        }
        for i, name in enumerate(names):
            if name in used_names:
                raise self.places.error(
                    ("waypoints", i, "name"),
                    f"{name!r} is the name of another waypoint",
                    "a unique name",
                )
            used_names.add(name)
        return names

    def _read_times(self) -> list[ScenarioPath]:
        """Read times, and the paths between waypoints, which correct the poses on them."""
        paths: list[ScenarioPath] = []
        reader = self._path_reader()
        before: float | None = 0.0 if self.file.start is not None else None
        is_chosen = False
        for i, waypoint in enumerate(self.file.waypoints):
            location: Location = ("waypoints", i)
            at_least = min_time(self.file, i)
            is_chosen |= at_least is not None
            if reader is not None and isinstance(waypoint, PathWaypoint):
                if not paths or paths[-1].last < i:
                    paths.append(reader.read(i - 1, before or 0.0))
                is_chosen |= max_speed(waypoint.speed) is not None
                self.times.append(paths[-1].stretches[i - 1 - paths[-1].first].end)
                before = self.times[-1] + (waypoint.wait or 0.0)
                continue
            if waypoint.time is not None:
                time = waypoint.time
                location = (*location, "time")
                if is_chosen and time <= (before or 0.0):  # only the expected time before is late
                    time = (before or 0.0) + EXPECTED_DURATION
            elif at_least is not None:
                duration = max(at_least, EXPECTED_DURATION)
                time = self.expected.get(i, (before or 0.0) + duration)
            elif isinstance(waypoint.after, float):
                time = (before or 0.0) + waypoint.after
                location = (*location, "after")
            elif before is None:
                time = 0.0
            else:
                raise self.places.error(
                    location,
                    "has no time",
                    "time (since 0), after (since the previous one) [s], or after: fastest",
                )
            if before is not None and time <= before:
                earlier = "start" if i == 0 else "the previous waypoint"
                raise self.places.error(
                    location,
                    f"time {time:g} s is not later than {before:g} s, the time of {earlier}",
                    f"a time greater than {before:g} s",
                )
            self.times.append(time)
            before = time + (waypoint.wait or 0.0)
        return paths

    def _path_reader(self) -> PathReader | None:
        frames = {
            i: self.frames[self.frame(i, waypoint)]
            for i, waypoint in enumerate(self.file.waypoints)
            if isinstance(waypoint, PathWaypoint)
        }
        if not frames:
            return None
        from knotwork.task.scenario.path_curves import PathCurves
        from knotwork.task.scenario.path_reader import PathReader

        axes = {i: self._axes(i, frame) for i, frame in frames.items()}
        arguments = self.file, self.places, self.length, frames, axes, self.poses
        return PathReader(PathCurves(*arguments, normals=self._normals), self._stops, self.carriers)

    def _read_poses(self) -> None:
        """Read the poses in the base frame of the waypoints that have one."""
        for i, waypoint in enumerate(self.file.waypoints):
            if isinstance(waypoint, PoseWaypoint | PathWaypoint):
                self.carriers.check(i, waypoint)
                if isinstance(waypoint, PoseWaypoint):
                    self._check_turned(i, waypoint)
                placed = self.placement(waypoint.pose, ("waypoints", i, "pose"))
                frame = self.frame(i, waypoint)
                self.poses[i] = self.frames[frame] * placed
                self.poses[i].rotation = self._axes(i, self.frames[frame]) @ placed.rotation

    def _check_turned(self, i: int, waypoint: PoseWaypoint) -> None:
        """Refuse a pose without orientation unless a path with an orientation begins there."""
        onward = self.file.waypoints[i + 1 : i + 2]
        if not waypoint.pose.turned and not any(
            isinstance(following, PathWaypoint) and isinstance(following.orientation, Torch)
            for following in onward
        ):
            raise self.places.error(
                ("waypoints", i, "pose"),
                f"has no orientation; give one of {', '.join(ORIENTATIONS)}",
            )

    def _axes(self, i: int, frame: pin.SE3) -> FloatArray:
        """Axes of the orientation of a waypoint, whose pose is in a frame."""
        requested = getattr(self.file.waypoints[i], "orientation_in", None)
        if requested is None:
            return np.array(frame.rotation)
        where: Location = ("waypoints", i, "orientation_in")
        return np.array(self.frames[self.frames.find(requested, where)].rotation)

    def placement(self, placement: Placement, location: Location) -> pin.SE3:
        """A placement of the file, in its parent frame, in SI."""
        from knotwork.task.scenario.geometry import read_placement

        return read_placement(placement, self.places, location)

    @cached_property
    def frames(self) -> Frames:
        """The named frames, placed in the base."""
        from knotwork.task.scenario.geometry import Frames

        return Frames(self.file.frames, self.places)

    def frame(self, i: int, waypoint: PoseWaypoint | PathWaypoint) -> str:
        """Name of the frame of a waypoint's pose."""
        if waypoint.frame is not None:
            return self.frames.find(waypoint.frame, ("waypoints", i, "frame"))
        if self.file.frame is not None:
            return self.frames.find(self.file.frame, ("frame",))
        return "base"

    def _stops(self, i: int) -> bool:
        """Whether the tool stops at a waypoint where a path begins or ends."""
        waypoint = self.file.waypoints[i]
        at_start = i == 0 and self.file.start is None
        return bool(waypoint.stop or waypoint.wait) or at_start or i == len(self.file.waypoints) - 1

    def _twist(self, i: int, waypoint: PoseWaypoint) -> pin.Motion:
        """Velocity of a waypoint relative to its frame."""
        import pinocchio as pin

        poses = self.carriers.neighbours_in_frame(i, self.poses, self.times)
        velocity, speed = waypoint.velocity, waypoint.speed
        if isinstance(velocity, Velocity):
            axes = velocity.axes or self.frame(i, waypoint)
            self.frames.find(axes, ("waypoints", i, "velocity", "in"), "tool")
            turn = (
                poses[i].rotation
                if axes == "tool"
                else self.carriers.frame_axes(i, axes, self.times[i])
            )
            linear, angular = np.array(velocity.linear), np.array(velocity.angular)
            return pin.Motion(turn @ linear, turn @ angular)
        if velocity is None and speed is not None:
            from knotwork.task.scenario.speed import neighbours_twist

            # of a chosen speed the direction alone is known
            given = speed if isinstance(speed, float) else 1.0
            return neighbours_twist(self.places, i, given, poses)
        if velocity is None:
            self._check_stop(i, "velocity: {linear, angular}, speed: along the path")
        return pin.Motion.Zero()

    def _check_stop(self, i: int, accepted: str) -> None:
        if not self._stops(i):
            raise self.places.error(
                ("waypoints", i),
                "is passed without a stop and gives no speed",
                f"{accepted}, or stop: true",
            )
