"""The tool paths of a scenario file: curves, orientation and timing, in SI in the base frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pinocchio as pin

from knotwork.arrays import FloatArray
from knotwork.curves.tool_paths import Curve, Line, OrientationCurve, TimedPath, Timing, ToolPath
from knotwork.curves.tool_paths.task_frame import TaskFrame
from knotwork.curves.tool_paths.timing_profile import make_wait
from knotwork.errors import CornerError, PathError, RampError, StretchTimeError
from knotwork.errors.plain_text import default_waypoint_name, waypoint_text
from knotwork.files.documents import Location
from knotwork.task import AlongArc, AlongPoints, PathOptions, PathWaypoint
from knotwork.task.scenario.path_curves import PathCurves, StretchGeometry, rescale_orientation
from knotwork.task.scenario.requested_timing import RequestedTiming
from knotwork.task.scenario.scenario import ScenarioPath, Stretch
from knotwork.task.scenario.task_reading import TaskReading
from knotwork.waypoints import CartesianWaypoint

if TYPE_CHECKING:
    from knotwork.curves.tool_paths.weave import WeavePattern

WAITING_SPEED, WAITING_LINE = 0.05, 1e-3
"""Speed and length that scale the tolerances of a wait in a moving frame [m/s, m]."""


class PathResult(NamedTuple):
    """A path, and its consequences for its waypoints.

    Attributes:
        path: The path; its first waypoint is that of the task.
        poses: Poses of its waypoints, by index in the task: corners are passed at their middle, and
            the path may define orientations.
        free_turns: Waypoints, by index in the task, at the end of stretches with normals, which
            leave the turn open.
    """

    path: ScenarioPath
    poses: dict[int, pin.SE3]
    free_turns: set[int]


def read_path(
    reading: TaskReading, first: int, start: float, poses: Mapping[int, pin.SE3]
) -> PathResult:
    """The path that begins at a waypoint and ends at the next stop or free motion.

    Args:
        reading: The task in SI, with its frames.
        first: Index of the waypoint in the task.
        start: Start time [s].
        poses: Poses of all waypoints, with all frames at rest.

    Raises:
        DocumentError: The path is infeasible as given.
    """
    waypoints = reading.task.waypoints
    if first not in poses:
        raise reading.locations.error(
            ("waypoints", first + 1, "along"),
            "the path has no pose at its start",
            "a waypoint with a pose before this one, not with joints",
        )
    for key in ("velocity", "speed"):
        waypoint = waypoints[first]
        if not isinstance(waypoint, PathWaypoint) and getattr(waypoint, key, None) is not None:
            raise reading.locations.error(
                ("waypoints", first, key),
                "is given at the start of a path, which defines it",
                f"no {key} here, as the path gives it; or stop: true",
            )
    last = first + 1
    # the tool stops at the last waypoint of all
    while not reading.stops(last) and isinstance(waypoints[last + 1], PathWaypoint):
        last += 1
    curves = PathCurves(reading, poses)
    ends = [curves.waypoint(i) for i in range(first + 1, last + 1)]
    return _PathReader(reading, curves, first, ends, start).read()


@dataclass(frozen=True, eq=False)
class _PathReader:
    """Reads one path.

    Attributes:
        reading: The task in SI, with its frames.
        curves: Its curves.
        first: Index in the task of the waypoint at the start.
        waypoints: The other waypoints. `k` counts them, and the stretches that end there.
        start: Start time [s].
    """

    reading: TaskReading
    curves: PathCurves
    first: int
    waypoints: Sequence[PathWaypoint]
    start: float

    @property
    def last(self) -> int:
        """Index in the task of the waypoint at the end."""
        return self.first + len(self.waypoints)

    def _location(self, k: int, *key: str) -> Location:
        return ("waypoints", self.first + 1 + k, *key)

    def read(self) -> PathResult:
        frame = self.reading.pose_frames.of_path(self.first, self.last)
        stretches: list[StretchGeometry] = []
        rotation = np.array(self.curves.poses[self.first].rotation)
        for i in range(self.first + 1, self.last + 1):
            stretches.append(self.curves.stretch(i, rotation))
            rotation = stretches[-1].orientation.rotations[-1]
        pieces, ends = self.curves.round_corners(
            self.first + 1, [stretch.curve for stretch in stretches], self.waypoints
        )
        lengths = np.diff(ends, prepend=0.0)
        with self.curves.errors_at(self.last):
            turns = [
                rescale_orientation(stretch.orientation, length)
                for stretch, length in zip(stretches, lengths, strict=True)
            ]
            orientation = OrientationCurve.joined(turns)
        path = self._tool_path(pieces, ends, orientation)
        requested = self._requested_timing(lengths)
        timing, speeds = self._solve_timing(requested)
        self.reading.pose_frames.check_smooth(self.last, self.start, self.start + timing.duration)
        weaves: list[WeavePattern | None] = [None] * len(self.waypoints)
        weave_offset, weave_breaks = None, np.zeros(0)
        if any(waypoint.weave is not None for waypoint in self.waypoints):
            from knotwork.task.scenario.weave_reader import WeaveReader

            reader = WeaveReader(self.curves, self.first, self.waypoints)
            weaves, weave_offset, weave_breaks = reader.read(path, timing, self.start)
        motion = TimedPath(path, timing, self.start, frame, weave_offset, weave_breaks)
        times, full = self.start + timing.times, self.start + timing.full_speed_intervals
        parts = tuple(
            Stretch(
                kind=("woven " if waypoint.weave else "") + path_kind(waypoint),
                start=float(begin),
                end=float(end),
                speed=speed,
                full_speed_interval=(float(low), float(high)),
                weave=weave,
            )
            for waypoint, speed, (begin, end), (low, high), weave in zip(
                self.waypoints, speeds, pairwise(times), full, weaves, strict=True
            )
        )
        return PathResult(
            ScenarioPath(self.first, motion, parts, requested),
            {self.first + k: path.pose(float(s)) for k, s in enumerate([0.0, *ends])},
            {self.first + 1 + k for k, stretch in enumerate(stretches) if stretch.turn_is_free},
        )

    def _tool_path(
        self, pieces: list[Curve], ends: FloatArray, orientation: OrientationCurve
    ) -> ToolPath:
        """Join the pieces of a path, which end at the given arc lengths [m]."""
        try:
            return ToolPath(pieces, orientation)
        except CornerError as error:
            where = sum(piece.length for piece in pieces[: error.junction + 1])
            k = int(np.abs(ends - where).argmin())
            name = self.waypoints[k].name or default_waypoint_name(self.first + 1 + k)
            angle = self.reading.units.text(error.angle, "rad")
            raise self.reading.locations.error(
                self._location(k),
                f"the path turns sharply by {angle} at {waypoint_text(name)}",
                "stop: true; or blend: a length, between two lines that do not turn back",
            ) from error
        except PathError:
            with self.curves.errors_at(self.last):
                raise

    def _durations(self) -> list[float | None]:
        """Given durations of the stretches [s]."""
        durations: list[float | None] = []
        before: float | None = self.start
        for k, waypoint in enumerate(self.waypoints):
            duration = waypoint.after if isinstance(waypoint.after, float) else None
            if waypoint.time is not None:
                if before is None:
                    raise self.reading.locations.error(
                        self._location(k, "time"),
                        "does not give a duration of the path, because the time of the previous "
                        "waypoint follows from a speed",
                        "after: its duration [s], or speed",
                    )
                duration = waypoint.time - before
                if duration <= 0.0:
                    raise self.reading.locations.error(
                        self._location(k, "time"),
                        f"is not later than {before:g} s, when the previous waypoint is left",
                        f"a time greater than {before:g} s",
                    )
            if duration is None and waypoint.speed is None:
                raise self.reading.locations.error(
                    self._location(k),
                    "has neither speed nor after, so the speed of the tool is undefined",
                    "speed: along the path, or after: its duration [s]",
                )
            durations.append(duration)
            before = None if before is None or duration is None else before + duration
        return durations

    def _requested_timing(self, lengths: FloatArray) -> RequestedTiming:
        unknowns = self.reading.waypoint_unknowns[self.first + 1 : self.last + 1]
        return RequestedTiming(
            lengths=tuple(lengths.tolist()),
            speeds=tuple(
                waypoint.speed if isinstance(waypoint.speed, float) else None
                for waypoint in self.waypoints
            ),
            durations=tuple(self._durations()),
            ends=(
                0.0 if self.reading.stops(self.first) else None,
                0.0 if self.reading.stops(self.last) else None,
            ),
            acceleration=self.reading.task.path.acceleration,
            max_speeds={
                k: end.max_speed for k, end in enumerate(unknowns) if end.path_speed_is_unknown
            },
        )

    def _solve_timing(self, requested: RequestedTiming) -> tuple[Timing, tuple[float, ...]]:
        limit = requested.acceleration
        units = self.reading.units
        if requested.max_speeds:
            return requested.at_nominal_speed()
        try:
            return requested.timed()
        except RampError as error:
            k = error.stretch
            fits = error.highest_speed
            lowest = error.lowest_acceleration
            key = "speed" if requested.speeds[k] is not None else _time_key(self.waypoints[k])
            raise self.reading.locations.error(
                self._location(k, key),
                f"the path is {units.text(error.length, 'm')} long here, but its changes of "
                f"speed take {units.text(error.needed, 'm')} at {units.text(limit, 'm/s²')}",
                (f"at most {units.text(fits, 'm/s')}, or " if fits else "")
                + f"path: {{acceleration: {units.number(lowest, 'm/s²', '.6g')}}} or more",
            ) from error
        except StretchTimeError as error:
            k = error.stretch
            upper = "" if error.longest == np.inf else f" and at most {error.longest:.6g} s"
            length = units.text(requested.lengths[k], "m")
            raise self.reading.locations.error(
                self._location(k, _time_key(self.waypoints[k])),
                f"leaves {requested.durations[k]:.6g} s, but the path is {length} long "
                f"here, and with its changes of speed takes at least {error.shortest:.6g} s"
                f"{upper} at {units.text(limit, 'm/s²')}",
                "a feasible time, or another path: {acceleration: …}",
            ) from error
        except PathError as error:
            raise self.reading.locations.error(("waypoints", self.last), str(error)) from error


def wait_in_moving_frame(
    frame: TaskFrame, pose: pin.SE3, first: int, begin: CartesianWaypoint, end: float
) -> ScenarioPath:
    """A wait in a moving frame: a path on which the tool keeps its pose.

    Args:
        frame: The moving frame.
        pose: Pose of the tool with that frame at rest.
        first: Index of the waypoint at the start of the wait.
        begin: Waypoint at the start.
        end: End of the wait [s].
    """
    R = np.array(pose.rotation)
    start = begin.time
    line = Line(pose.translation, pose.translation + WAITING_LINE * R[:, 0])
    path = ToolPath([line], OrientationCurve.constant(R, line.length))
    motion = TimedPath(path, make_wait(end - start, WAITING_SPEED), start, frame)
    stretch = Stretch("place", start, end, WAITING_SPEED, (start, start))
    acceleration = PathOptions.model_construct().acceleration
    requested = RequestedTiming(
        (0.0,), (WAITING_SPEED,), (end - start,), (0.0, 0.0), acceleration, {}
    )
    return ScenarioPath(first, motion, (stretch,), requested, begin.freedom)


def _time_key(waypoint: PathWaypoint) -> str:
    return "after" if waypoint.after else "time"


def path_kind(waypoint: PathWaypoint) -> str:
    """Kind of a path to a waypoint: `"line"`, `"arc"` or `"points"`."""
    if isinstance(waypoint.along, AlongArc):
        return "arc"
    return "points" if isinstance(waypoint.along, AlongPoints) else "line"
