"""The tool paths of a scenario file: curves, orientation and timing, in SI in the base frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
import pinocchio as pin

from knotwork.curves.tool_paths import Curve, Line, OrientationCurve, TimedPath, Timing, ToolPath
from knotwork.curves.tool_paths.moving_frame import MovingFrame
from knotwork.curves.tool_paths.timing_profile import make_dwell
from knotwork.errors import CornerError, PathError, RampError, StretchTimeError
from knotwork.task import AlongArc, AlongPoints, PathOptions, PathWaypoint
from knotwork.task.scenario.carriers import Carriers
from knotwork.task.scenario.path_curves import PathCurves, rescale_orientation
from knotwork.task.scenario.requested_timing import RequestedTiming
from knotwork.task.scenario.scenario import ScenarioPath, Stretch
from knotwork.task.scenario.unknowns import max_speed
from knotwork.waypoints import CartesianWaypoint, FloatArray

TIMING_TOLERANCE = 1e-6
"""Relative tolerance of speeds and times, and tolerance of orientations [rad]."""

HAIRPIN_ANGLE = 1e-3
"""Minimum difference from half a turn of a corner that can be rounded [rad]."""

WAITING_SPEED, WAITING_LINE = 0.05, 1e-3
"""Speed and length that scale the tolerances of a wait in a moving frame [m/s, m]."""


@dataclass(frozen=True, eq=False)
class PathReader:
    """Reads the tool paths of a file.

    Attributes:
        curves: Makes their curves, and has the content of the file.
        stops: Whether the tool stops at a waypoint, by index.
        carriers: Moving frames of the waypoints.
    """

    curves: PathCurves
    stops: Callable[[int], bool]
    carriers: Carriers

    def read(self, first: int, start: float) -> ScenarioPath:
        """The path that begins at a waypoint and ends at the next stop or free motion.

        Its first waypoint is that of the file. The poses of `curves` are corrected.

        Args:
            first: Index of the waypoint in the file.
            start: Start time [s].

        Raises:
            DocumentError: The path is infeasible as given.
        """
        steps = self.curves.file.waypoints
        if first not in self.curves.poses:
            fault = (
                f"the path begins at waypoint {first + 1}, which is given by joint values"
                if first >= 0
                else "the path has no waypoint at its start"
            )
            raise self.curves.places.error(
                ("waypoints", first + 1, "along"),
                fault,
                "a waypoint with a pose before this one, as the start of the path",
            )
        self._check_start(first)
        last = first + 1
        # the tool stops at the last waypoint of all
        while not self.stops(last) and isinstance(steps[last + 1], PathWaypoint):
            last += 1
        return self._path(first, last, start)

    def _check_start(self, first: int) -> None:
        waypoint = self.curves.file.waypoints[first]
        for key in ("velocity", "speed"):
            if not isinstance(waypoint, PathWaypoint) and getattr(waypoint, key, None) is not None:
                raise self.curves.places.error(
                    ("waypoints", first, key),
                    "is given at the start of a path, which defines it",
                    f"no {key} here, as the path gives it; or stop: true",
                )

    def _path(self, first: int, last: int, start: float) -> ScenarioPath:
        carrier = self.carriers.frame_of_path(first, last)
        steps = [self.curves.waypoint(i) for i in range(first + 1, last + 1)]
        curves = [self.curves.curve(i) for i in range(first + 1, last + 1)]
        turns = [
            self.curves.orientation(first + 1 + k, curve, step)
            for k, (curve, step) in enumerate(zip(curves, steps, strict=True))
        ]
        pieces, ends = self.curves.round_corners(first + 1, curves, steps)
        lengths = np.diff(ends, prepend=0.0)
        with self.curves.errors(last):
            turned = [
                rescale_orientation(turn, length)
                for turn, length in zip(turns, lengths, strict=True)
            ]
            orientation = OrientationCurve.joined(turned)
        path = self._tool_path(first, steps, pieces, ends, orientation)
        requested = self._requested_timing(first, lengths, steps, start)
        timing, speeds = self._solve_timing(first, requested, steps)
        # The waypoint at a rounded corner is passed at its middle.
        self.curves.poses.update({first + 1 + k: path.pose(float(s)) for k, s in enumerate(ends)})
        times, full = start + timing.times, start + timing.full_speed
        stretches = tuple(
            Stretch(
                kind=("woven " if step.weave else "") + kind_of(step),
                start=float(begin),
                end=float(end),
                speed=speed,
                full_speed=(float(low), float(high)),
            )
            for step, speed, (begin, end), (low, high) in zip(
                steps, speeds, pairwise(times), full, strict=True
            )
        )
        motion = TimedPath(path, timing, start, carrier)
        self.carriers.check_smooth(last, carrier, (motion.start_time, motion.end_time))
        if any(step.weave is not None for step in steps):
            from knotwork.task.scenario.weave_reader import WeaveReader

            weaves, added, anew = WeaveReader(self.curves, first, steps).read(path, timing, start)
            motion = TimedPath(path, timing, start, carrier, added, anew)
            stretches = tuple(
                replace(stretch, weave=weave)
                for stretch, weave in zip(stretches, weaves, strict=True)
            )
        return ScenarioPath(first, motion, stretches, requested)

    def _tool_path(
        self,
        first: int,
        steps: Sequence[PathWaypoint],
        pieces: list[Curve],
        ends: FloatArray,
        orientation: OrientationCurve,
    ) -> ToolPath:
        """Join the pieces of a path, which end at the given arc lengths [m]."""
        try:
            return ToolPath(pieces, orientation)
        except CornerError as error:
            where = sum(piece.length for piece in pieces[: error.junction + 1])
            k = int(np.abs(ends - where).argmin())
            lines = all(kind_of(step) == "line" for step in steps[k : k + 2])
            is_hairpin = error.angle > np.pi - HAIRPIN_ANGLE
            name = steps[k].name or str(first + 2 + k)
            raise self.curves.places.error(
                ("waypoints", first + 1 + k),
                f"the path turns sharply by {np.degrees(error.angle):.6g} deg at {name!r}",
                "blend: a length, or stop: true" if lines and not is_hairpin else "stop: true",
            ) from error
        except PathError:
            with self.curves.errors(first + len(steps)):
                raise

    def _durations(self, first: int, steps: list[PathWaypoint], start: float) -> list[float | None]:
        """Given durations of the stretches [s]."""
        durations: list[float | None] = []
        before: float | None = start
        for k, step in enumerate(steps):
            duration = step.after if isinstance(step.after, float) else None
            if step.time is not None and before is not None:
                duration = step.time - before
            elif step.time is not None and step.speed is None:
                raise self.curves.places.error(
                    ("waypoints", first + 1 + k, "time"),
                    "does not give a duration of the path, as the time of the previous waypoint "
                    "follows from a speed",
                    "after: its duration [s], or speed",
                )
            if duration is not None and duration <= 0.0:
                raise self.curves.places.error(
                    ("waypoints", first + 1 + k, "time"),
                    f"is not later than {before:g} s, the time of the previous waypoint",
                    f"a time greater than {before:g} s",
                )
            if duration is None and step.speed is None:
                raise self.curves.places.error(
                    ("waypoints", first + 1 + k),
                    "has neither speed nor after, so the speed of the tool is undefined",
                    "speed: along the path, or after: its duration [s]",
                )
            durations.append(duration)
            known = before is not None and duration is not None
            before = before + duration if known else step.time  # type: ignore[operator]
        return durations

    def _requested_timing(
        self, first: int, lengths: FloatArray, steps: list[PathWaypoint], start: float
    ) -> RequestedTiming:
        last = first + len(steps)
        upper_bounds = [max_speed(step.speed) for step in steps]
        return RequestedTiming(
            lengths=tuple(lengths.tolist()),
            speeds=tuple(step.speed if isinstance(step.speed, float) else None for step in steps),
            durations=tuple(self._durations(first, steps, start)),
            ends=(0.0 if self.stops(first) else None, 0.0 if self.stops(last) else None),
            acceleration=self.curves.file.path.acceleration,
            at_most={k: bound for k, bound in enumerate(upper_bounds) if bound is not None},
        )

    def _solve_timing(
        self, first: int, requested: RequestedTiming, steps: list[PathWaypoint]
    ) -> tuple[Timing, tuple[float, ...]]:
        unit, limit, durations = self.curves.length, requested.acceleration, requested.durations
        text = partial(self.curves.text, digits=6)
        if requested.at_most:
            return requested.at_nominal_speed()
        try:
            timing, speeds = requested.timed()
        except RampError as error:
            k, fits = error.stretch, error.highest_speed
            key = "speed" if requested.speeds[k] is not None else _time_key(steps[k])
            raise self.curves.places.error(
                ("waypoints", first + 1 + k, key),
                f"the path is {text(error.length)} long here, but its changes of speed "
                f"take {text(error.needed)} at {text(limit, '/s²')}",
                (f"at most {text(fits, '/s')}, or " if fits else "")
                + f"path: {{acceleration: {error.lowest_acceleration / unit:.6g}}} or more",
            ) from error
        except StretchTimeError as error:
            k, upper = error.stretch, f" and at most {error.longest:.6g} s"
            raise self.curves.places.error(
                ("waypoints", first + 1 + k, _time_key(steps[k])),
                f"leaves {durations[k]:.6g} s, but the path is {text(requested.lengths[k])} long "
                f"here, and with its changes of speed takes at least {error.shortest:.6g} s"
                f"{'' if error.longest == np.inf else upper} at {text(limit, '/s²')}",
                "a feasible time, or another path: {acceleration: …}",
            ) from error
        except PathError as error:
            raise self.curves.places.error(("waypoints", first + len(steps)), str(error)) from error
        for k, (step, duration) in enumerate(zip(steps, np.diff(timing.times), strict=True)):
            wanted = durations[k]
            if wanted is not None and abs(duration - wanted) > TIMING_TOLERANCE * duration:
                raise self.curves.places.error(
                    ("waypoints", first + 1 + k, _time_key(step)),
                    f"leaves {wanted:.6g} s, but at this speed the path takes {duration:.6g} s",
                    "speed or time, not both",
                )
        return timing, speeds


def wait_on(
    carrier: MovingFrame, pose: pin.SE3, first: int, begin: CartesianWaypoint, end: float
) -> ScenarioPath:
    """A wait in a moving frame: a path on which the tool keeps its pose.

    Args:
        carrier: The moving frame.
        pose: Pose of the tool with that frame at rest.
        first: Index of the waypoint at the start of the wait.
        begin: Waypoint at the start.
        end: End of the wait [s].
    """
    R, start = np.array(pose.rotation), begin.time
    line = Line(pose.translation, pose.translation + WAITING_LINE * R[:, 0])
    path = ToolPath([line], OrientationCurve.constant(R, line.length))
    motion = TimedPath(path, make_dwell(end - start, WAITING_SPEED), start, carrier)
    stretch = Stretch("place", start, end, WAITING_SPEED, (start, start))
    acceleration = PathOptions.model_construct().acceleration
    requested = RequestedTiming(
        (0.0,), (WAITING_SPEED,), (end - start,), (0.0, 0.0), acceleration, {}
    )
    return ScenarioPath(first, motion, (stretch,), requested, begin.freedom)


def _time_key(waypoint: PathWaypoint) -> str:
    return "after" if waypoint.after else "time"


def kind_of(waypoint: PathWaypoint) -> str:
    """Kind of a path to a waypoint: `"line"`, `"arc"` or `"points"`."""
    if isinstance(waypoint.along, AlongArc):
        return "arc"
    return "points" if isinstance(waypoint.along, AlongPoints) else "line"
