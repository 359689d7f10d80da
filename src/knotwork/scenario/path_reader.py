"""The tool paths of a scenario file: curves, orientation and timing, in SI in the base frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
import pinocchio as pin

from knotwork.errors import CornerError, PathError, RampError, StretchTimeError
from knotwork.scenario.asked_timing import ACCELERATION, AskedTiming
from knotwork.scenario.carriers import Carriers
from knotwork.scenario.free_reader import greatest_speed
from knotwork.scenario.path_curves import PathCurves, stretched
from knotwork.scenario.scenario import ScenarioPath, Stretch
from knotwork.task import AlongArc, AlongPoints, PathWaypoint
from knotwork.tool_paths import Curve, Line, OrientationCurve, TimedPath, Timing, ToolPath
from knotwork.tool_paths.moving_frame import MovingFrame
from knotwork.tool_paths.timing_profile import standstill
from knotwork.waypoints import CartesianWaypoint, FloatArray

AGREE = 1e-6
"""Relative tolerance of speeds and times, and tolerance of orientations [rad]."""

HAIRPIN = 1e-3
"""Corners within this of half a turn [rad] can't be rounded."""

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

    def begins(self, i: int) -> bool:
        """Whether a path begins at a waypoint, rather than passing through it."""
        given = self.curves.file.waypoints
        if i + 1 >= len(given) or not isinstance(given[i + 1], PathWaypoint):
            return False
        return not isinstance(given[i], PathWaypoint) or self.stops(i)

    def read(self, first: int, start: float) -> ScenarioPath:
        """The path that begins at a waypoint and ends at the next stop or free motion.

        Its first waypoint is the file's. Afterwards the poses of `curves` are right.

        Args:
            first: Index of the waypoint in the file.
            start: Start time [s].

        Raises:
            DocumentError: The path can't be made as given.
        """
        given = self.curves.file.waypoints
        if first not in self.curves.poses:
            found = (
                f"the path begins at waypoint {first + 1}, which is given by joint values"
                if first >= 0
                else "the path has no waypoint at its start"
            )
            raise self.curves.places.error(
                ("waypoints", first + 1, "along"),
                found,
                "a waypoint with a pose before this one, as the start of the path",
            )
        self._check_start(first)
        last = first + 1
        while (
            not self.stops(last)
            and last + 1 < len(given)
            and isinstance(given[last + 1], PathWaypoint)
        ):
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
        given = [self.curves.waypoint(i) for i in range(first + 1, last + 1)]
        curves = [self.curves.curve(i) for i in range(first + 1, last + 1)]
        turns = [
            self.curves.orientation(first + 1 + k, curve, one)
            for k, (curve, one) in enumerate(zip(curves, given, strict=True))
        ]
        pieces, ends = self.curves.blended(first + 1, curves, given)
        lengths = np.diff(ends, prepend=0.0)
        with self.curves.errors(last):
            turned = [stretched(turn, length) for turn, length in zip(turns, lengths, strict=True)]
            orientation = OrientationCurve.joined(turned)
        try:
            path = ToolPath(pieces, orientation)
        except CornerError as error:
            where = float(path_start(pieces, error.junction + 1))
            k = int(np.abs(ends - where).argmin())
            lines = all(kind_of(one) == "line" for one in given[k : k + 2])
            back = error.angle > np.pi - HAIRPIN
            name = given[k].name or str(first + 2 + k)
            raise self.curves.places.error(
                ("waypoints", first + 1 + k),
                f"the path turns sharply by {np.degrees(error.angle):.6g} deg at {name!r}",
                "blend: a length, or stop: true" if lines and not back else "stop: true",
            ) from error
        except PathError:
            with self.curves.errors(last):
                raise
        asked = self._asked(first, lengths, given, start)
        timing, speeds = self._timed(first, asked, given)
        # The waypoint at a rounded corner is passed at its middle.
        self.curves.poses.update({first + 1 + k: path.pose(float(s)) for k, s in enumerate(ends)})
        times, full = start + timing.times, start + timing.full_speed
        stretches = tuple(
            Stretch(
                ("woven " if one.weave else "") + kind_of(one),
                float(begin),
                float(end),
                speed,
                (float(low), float(high)),
            )
            for one, speed, (begin, end), (low, high) in zip(
                given, speeds, pairwise(times), full, strict=True
            )
        )
        motion = TimedPath(path, timing, start, carrier)
        self.carriers.check_smooth(last, carrier, (motion.start_time, motion.end_time))
        if any(one.weave is not None for one in given):
            from knotwork.scenario.weave_reader import WeaveReader

            weaves, added, anew = WeaveReader(self.curves, first, given).read(path, timing, start)
            motion = TimedPath(path, timing, start, carrier, added, anew)
            stretches = tuple(
                replace(one, weave=weave) for one, weave in zip(stretches, weaves, strict=True)
            )
        return ScenarioPath(first, motion, stretches, asked)

    def _durations(self, first: int, given: list[PathWaypoint], start: float) -> list[float | None]:
        """Given durations of the stretches [s]."""
        durations: list[float | None] = []
        before: float | None = start
        for k, one in enumerate(given):
            taken = one.after if isinstance(one.after, float) else None
            if one.time is not None and before is not None:
                taken = one.time - before
            elif one.time is not None and one.speed is None:
                raise self.curves.places.error(
                    ("waypoints", first + 1 + k, "time"),
                    "does not give a duration of the path, as the time of the previous waypoint "
                    "follows from a speed",
                    "after: its duration [s], or speed",
                )
            if taken is not None and taken <= 0.0:
                raise self.curves.places.error(
                    ("waypoints", first + 1 + k, "time"),
                    f"is not later than {before:g} s, the time of the previous waypoint",
                    f"a time greater than {before:g} s",
                )
            if taken is None and one.speed is None:
                raise self.curves.places.error(
                    ("waypoints", first + 1 + k),
                    "has neither speed nor after, so the speed of the tool is undefined",
                    "speed: along the path, or after: its duration [s]",
                )
            durations.append(taken)
            known = before is not None and taken is not None
            before = before + taken if known else one.time  # type: ignore[operator]
        return durations

    def _asked(
        self, first: int, lengths: FloatArray, given: list[PathWaypoint], start: float
    ) -> AskedTiming:
        acceleration = self.curves.file.path.acceleration
        last = first + len(given)
        most = [greatest_speed(one.speed) for one in given]
        return AskedTiming(
            tuple(lengths.tolist()),
            tuple(one.speed if isinstance(one.speed, float) else None for one in given),
            tuple(self._durations(first, given, start)),
            (0.0 if self.stops(first) else None, 0.0 if self.stops(last) else None),
            ACCELERATION if acceleration is None else acceleration,
            {k: most for k, most in enumerate(most) if most is not None},
        )

    def _timed(
        self, first: int, asked: AskedTiming, given: list[PathWaypoint]
    ) -> tuple[Timing, tuple[float, ...]]:
        unit, limit, durations = self.curves.length, asked.acceleration, asked.durations
        text = partial(self.curves.text, digits=6)
        try:
            timing, found = asked.provisional()
        except RampError as error:
            fits = error.highest_speed
            raise self.curves.places.error(
                ("waypoints", first + 1 + error.stretch, "speed"),
                f"the path is {text(error.length)} long here, but its changes of speed "
                f"take {text(error.needed)} at {text(limit, '/s²')}",
                (f"at most {text(fits, '/s')}, or " if fits else "")
                + f"path: {{acceleration: {error.lowest_acceleration / unit:.6g}}} or more",
            ) from error
        except StretchTimeError as error:
            k, upper = error.stretch, f" and at most {error.most:.6g} s"
            raise self.curves.places.error(
                ("waypoints", first + 1 + k, _time_key(given[k])),
                f"leaves {durations[k]:.6g} s, but the path is {text(asked.lengths[k])} long "
                f"here, and with its changes of speed takes at least {error.least:.6g} s"
                f"{'' if error.most == np.inf else upper} at {text(limit, '/s²')}",
                "a feasible time, or another path: {acceleration: …}",
            ) from error
        except PathError as error:
            raise self.curves.places.error(("waypoints", first + len(given)), str(error)) from error
        for k, (one, taken) in enumerate(zip(given, np.diff(timing.times), strict=True)):
            wanted = durations[k]
            if wanted is not None and abs(taken - wanted) > AGREE * taken:
                raise self.curves.places.error(
                    ("waypoints", first + 1 + k, _time_key(one)),
                    f"leaves {wanted:.6g} s, but at the given speed the path takes {taken:.6g} s",
                    "speed or time, not both",
                )
        return timing, found


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
    motion = TimedPath(path, standstill(end - start, WAITING_SPEED), start, carrier)
    stretch = Stretch("place", start, end, WAITING_SPEED, (start, start))
    asked = AskedTiming((0.0,), (WAITING_SPEED,), (end - start,), (0.0, 0.0), ACCELERATION, {})
    return ScenarioPath(first, motion, (stretch,), asked, begin.freedom)


def _time_key(waypoint: PathWaypoint) -> str:
    return "after" if waypoint.after else "time"


def kind_of(waypoint: PathWaypoint) -> str:
    """Kind of a path to a waypoint: `"line"`, `"arc"` or `"points"`."""
    if isinstance(waypoint.along, AlongArc):
        return "arc"
    return "points" if isinstance(waypoint.along, AlongPoints) else "line"


def path_start(curves: list[Curve], index: int) -> float:
    """Arc length at the start of a curve [m]."""
    return float(sum(curve.length for curve in curves[:index]))
