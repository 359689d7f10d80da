"""The waypoints of a task: names, times, poses and velocities in SI in the base frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from knotwork.errors.plain_text import default_waypoint_name
from knotwork.files.documents import Location
from knotwork.task import JointWaypoint, PathWaypoint, PoseWaypoint, Torch, Velocity
from knotwork.task.poses import ORIENTATIONS
from knotwork.task.scenario.freedoms_reader import Freedoms, freedom_of, read_freedoms
from knotwork.task.scenario.scenario import JointTarget, ScenarioPath, ScenarioWaypoint
from knotwork.task.scenario.task_reading import TaskReading
from knotwork.task.scenario.unknowns_reader import check_unknowns
from knotwork.waypoints import CartesianWaypoint

if TYPE_CHECKING:
    import pinocchio as pin

    from knotwork.curves.tool_paths import TimedPath

START = "start"
"""Name of the waypoint at the start of the motion."""
NAME_AFTER_WAIT = "{}, after the wait"
"""Name of the waypoint at the end of a wait."""

EXPECTED_DURATION = 1.0
"""Expected time to a waypoint whose time is chosen later [s]."""


class WaypointsResult(NamedTuple):
    """The waypoints of a scenario.

    Attributes:
        waypoints: All waypoints in order, the start first if there is one. One with `wait` appears
            twice: at the start and the end of the wait. Unknown times are expected ones.
        paths: The paths between them.
        task_index: Index in the task of each; -1 for the start.
    """

    waypoints: tuple[ScenarioWaypoint, ...]
    paths: tuple[ScenarioPath, ...]
    task_index: tuple[int, ...]


def read_waypoints(reading: TaskReading, expected: Mapping[int, float]) -> WaypointsResult:
    """Read the waypoints of a task, and the paths between them.

    Args:
        reading: The task in SI, with its frames.
        expected: Expected times of waypoints with a chosen time [s], by index in the task.

    Raises:
        DocumentError: A time, frame, pose or velocity is missing or wrong.
    """
    task, locations = reading.task, reading.locations
    names = _names(reading)
    if len(names) + (task.start is not None) < 2:
        raise locations.error(
            ("waypoints",),
            "a motion needs at least two waypoints, and there is one",
            "two or more, or one with start: the start of the motion",
        )
    check_unknowns(task, reading.waypoint_unknowns, locations)
    arrivals = _read_arrivals(reading, expected, _rest_poses(reading))
    freedoms = read_freedoms(reading, arrivals.free_turns)
    paths = [
        replace(path, freedom=freedom_of(path, freedoms, locations)) for path in arrivals.paths
    ]
    timed_paths = {i: path.timed_path for path in paths for i in range(path.first, path.last + 1)}
    reader = _WaypointReader(reading, arrivals, timed_paths, freedoms)
    waits: list[ScenarioPath] = []
    waypoints: list[ScenarioWaypoint] = []
    task_index: list[int] = []
    if task.start is not None:
        where = locations.where(("start",))
        waypoints.append(JointTarget(START, 0.0, where))
        task_index.append(-1)
    for i, name in enumerate(names):
        waypoint = reader.waypoint(i, name)
        wait = task.waypoints[i].wait_time
        waypoints.append(waypoint)
        task_index.append(i)
        if wait is None:
            continue
        end = waypoint.time + wait
        departure = replace(waypoint, name=NAME_AFTER_WAIT.format(name), time=end)
        if isinstance(waypoint, CartesianWaypoint) and reading.pose_frames[i].is_moving:
            from knotwork.task.scenario.path_reader import wait_in_moving_frame

            reading.pose_frames.check_smooth(i, waypoint.time, end)
            path = wait_in_moving_frame(
                reading.pose_frames[i], arrivals.poses[i], len(waypoints) - 1, waypoint, end
            )
            waits.append(path)
            tool = path.timed_path
            departure = replace(departure, pose=tool.pose(end), twist=tool.twist(end))
        waypoints.append(departure)
        task_index.append(i)
    departures = {task_i: i for i, task_i in enumerate(task_index)}
    paths = [*waits, *(replace(path, first=departures[path.first]) for path in paths)]
    paths.sort(key=lambda path: path.first)
    return WaypointsResult(tuple(waypoints), tuple(paths), tuple(task_index))


def _names(reading: TaskReading) -> list[str]:
    """Names of the task's waypoints, each once."""
    task = reading.task
    names = [waypoint.name or default_waypoint_name(i) for i, waypoint in enumerate(task.waypoints)]
    owners = {START: "the start of the motion"} if task.start is not None else {}
    owners |= {
        NAME_AFTER_WAIT.format(name): "another waypoint"
        for name, waypoint in zip(names, task.waypoints, strict=True)
        if waypoint.wait_time is not None
    }
    for i, name in enumerate(names):
        if name in owners:
            location: Location = ("waypoints", i, "name")
            fault = f"{name!r} is the name of {owners[name]}"
            if task.waypoints[i].name is None:
                location, fault = ("waypoints", i), f"its default name {fault}"
            raise reading.locations.error(location, fault, "a unique name")
        owners[name] = "another waypoint"
    return names


def _rest_poses(reading: TaskReading) -> dict[int, pin.SE3]:
    """Poses in the base frame by index in the task, with all frames at rest."""
    poses = {}
    for i, waypoint in enumerate(reading.task.waypoints):
        if isinstance(waypoint, JointWaypoint):
            continue
        reading.pose_frames.refuse_unsupported_keys(i, waypoint)
        if isinstance(waypoint, PoseWaypoint):
            _require_orientation(reading, i, waypoint)
        placed = reading.placement(waypoint.pose, "waypoints", i, "pose")
        poses[i] = reading.pose_frames[i].rest_placement * placed
        poses[i].rotation = reading.pose_frames.axes(i) @ placed.rotation
    return poses


def _require_orientation(reading: TaskReading, i: int, waypoint: PoseWaypoint) -> None:
    """Refuse a pose without orientation unless a path with an orientation begins there."""
    following = reading.task.waypoints[i + 1 : i + 2]
    begins_torch = any(
        isinstance(end, PathWaypoint) and isinstance(end.orientation, Torch) for end in following
    )
    if not waypoint.pose.has_orientation and not begins_torch:
        raise reading.locations.error(
            ("waypoints", i, "pose"),
            f"has no orientation; give one of {', '.join(ORIENTATIONS)}",
        )


@dataclass(eq=False)
class _Arrivals:
    """Times of all waypoints of a task, and the paths between them.

    Attributes:
        times: Time of arrival at each [s].
        poses: Poses by index in the task, with all frames at rest.
        paths: The paths; their first waypoints are those of the task.
        free_turns: Waypoints at the end of stretches with normals, by index in the task.
    """

    times: list[float]
    poses: dict[int, pin.SE3]
    paths: list[ScenarioPath]
    free_turns: set[int]


def _read_arrivals(
    reading: TaskReading, expected: Mapping[int, float], rest_poses: Mapping[int, pin.SE3]
) -> _Arrivals:
    """Read times, and the paths between waypoints, which correct the poses on them."""
    arrivals = _Arrivals([], dict(rest_poses), [], set())
    before = 0.0 if reading.task.start is not None else None
    is_chosen = False
    for i, waypoint in enumerate(reading.task.waypoints):
        is_chosen |= not reading.waypoint_unknowns[i].duration_is_given
        if isinstance(waypoint, PathWaypoint):
            if not arrivals.paths or arrivals.paths[-1].last < i:
                from knotwork.task.scenario.path_reader import read_path

                path, poses, free_turns = read_path(reading, i - 1, before or 0.0, arrivals.poses)
                arrivals.paths.append(path)
                arrivals.poses.update(poses)
                arrivals.free_turns.update(free_turns)
            path = arrivals.paths[-1]
            time = path.stretches[i - 1 - path.first].end
        else:
            time = _arrival(reading, i, before, expected.get(i), is_chosen=is_chosen)
        arrivals.times.append(time)
        before = time + (waypoint.wait_time or 0.0)
    return arrivals


def _arrival(
    reading: TaskReading, i: int, before: float | None, expected: float | None, *, is_chosen: bool
) -> float:
    """Time of a waypoint at which no path ends [s].

    Args:
        reading: The task in SI, with its frames.
        i: Index in the task.
        before: Time at which the previous waypoint is left [s], or `None`.
        expected: Its expected time if it is chosen [s], or `None`.
        is_chosen: Whether this or an earlier time is chosen.
    """
    waypoint = reading.task.waypoints[i]
    unknowns = reading.waypoint_unknowns[i]
    location: Location = ("waypoints", i)
    if waypoint.time is not None:
        time = waypoint.time
        location = (*location, "time")
        if is_chosen and time <= (before or 0.0):  # only the expected time before is late
            time = (before or 0.0) + EXPECTED_DURATION
    elif unknowns.duration_is_unknown:
        duration = max(unknowns.min_duration, EXPECTED_DURATION)
        time = (before or 0.0) + duration if expected is None else expected
    elif isinstance(waypoint.after, float):
        time = (before or 0.0) + waypoint.after
        location = (*location, "after")
    elif before is None:
        time = 0.0
    else:
        raise reading.locations.error(
            location,
            "has no time",
            "time: seconds since 0, after: seconds since the previous one, or after: fastest",
        )
    if before is not None and time <= before:
        earlier = "the start" if i == 0 else "the previous waypoint"
        raise reading.locations.error(
            location,
            f"time {time:g} s is not later than {before:g} s, when the arm leaves {earlier}",
            f"a time greater than {before:g} s",
        )
    return time


@dataclass(frozen=True, eq=False)
class _WaypointReader:
    """Reads the waypoints one by one, by their index in the task.

    Attributes:
        reading: The task in SI, with its frames.
        arrivals: Their times and poses.
        timed_paths: Timed paths, by index of the waypoints on them.
        freedoms: Freedoms of their poses.
    """

    reading: TaskReading
    arrivals: _Arrivals
    timed_paths: Mapping[int, TimedPath]
    freedoms: Freedoms

    def waypoint(self, i: int, name: str) -> ScenarioWaypoint:
        """A waypoint at the arrival of the tool, possibly along a path."""
        waypoint = self.reading.task.waypoints[i]
        where = self.reading.locations.where(("waypoints", i))
        time = self.arrivals.times[i]
        freedom = self.freedoms[i]
        if isinstance(waypoint, JointWaypoint):
            if waypoint.velocity is None:
                self._check_stop(i, "velocity: by joint name")
            return JointTarget(name, time, where)
        pose, twist = self._state(i, waypoint)
        moves = waypoint.wait_time is not None and self.reading.pose_frames[i].is_moving
        if freedom is not None and freedom.position_is_free and (moves or twist.vector.any()):
            raise self.reading.locations.error(
                ("waypoints", i, "free"),
                "leaves the position open where the tool moves",
                "position where it stops: stop: true",
            )
        in_world_frame = self.reading.pose_frames.in_world_frame(i)
        return CartesianWaypoint(name, time, pose, twist, where, freedom, in_world_frame)

    def _state(self, i: int, waypoint: PoseWaypoint | PathWaypoint) -> tuple[pin.SE3, pin.Motion]:
        """Pose and velocity of a waypoint in the base, including the motion of its frame."""
        import pinocchio as pin

        frame, time = self.reading.pose_frames[i], self.arrivals.times[i]
        timed_path = self.timed_paths.get(i)
        if timed_path is not None and not self.reading.stops(i):
            return timed_path.pose(time), timed_path.twist(time)
        pose = self.arrivals.poses[i]
        twist = pin.Motion.Zero()
        if isinstance(waypoint, PoseWaypoint):
            twist = self._twist(i, waypoint)
        return frame.pose_at(pose, time), frame.twist_at(pose, twist, time)

    def _twist(self, i: int, waypoint: PoseWaypoint) -> pin.Motion:
        """Velocity of a waypoint relative to its frame."""
        import pinocchio as pin

        reading = self.reading
        frames = reading.pose_frames
        times = self.arrivals.times
        poses = frames.neighbours(i, self.arrivals.poses, times)
        velocity, speed = waypoint.velocity, waypoint.speed
        if isinstance(velocity, Velocity):
            name = velocity.axes or frames.names[i]
            frames.named.checked_name(name, ("waypoints", i, "velocity", "in"), "tool")
            is_tool = name == "tool"
            axes = poses[i].rotation if is_tool else frames.axes_at(i, name, times[i])
            return pin.Motion(axes @ np.array(velocity.linear), axes @ np.array(velocity.angular))
        if velocity is None and speed is not None:
            from knotwork.task.scenario.neighbour_direction import neighbours_twist

            # of a chosen speed the direction alone is known
            known = speed if isinstance(speed, float) else 1.0
            return neighbours_twist(reading.locations, i, known, poses)
        if velocity is None:
            self._check_stop(i, "velocity: {linear, angular}, speed: along the path")
        return pin.Motion.Zero()

    def _check_stop(self, i: int, accepted: str) -> None:
        if not self.reading.stops(i):
            raise self.reading.locations.error(
                ("waypoints", i),
                "is passed without a stop and gives no speed",
                f"{accepted}, or stop: true",
            )
