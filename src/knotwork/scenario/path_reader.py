"""The tool paths of a scenario file: curves, orientation and timing in SI in the base frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from knotwork import tool_paths
from knotwork.errors import CornerError, PathError, RampError, StretchTimeError
from knotwork.scenario.free_reader import given_speed
from knotwork.scenario.free_times import PROVISIONAL_SPEED
from knotwork.scenario.model import ScenarioPath, Stretch
from knotwork.scenario.path_curves import PathCurves, stretched
from knotwork.scenario.waypoint_schema import AlongArc, AlongPoints, PathWaypoint
from knotwork.tool_paths import Curve, OrientationCurve, TimedPath, Timing, ToolPath
from knotwork.waypoints import FloatArray

ACCELERATION = 1.0
"""Largest acceleration along a path where its speed changes, if the file gives none [m/s²]."""

AGREE = 1e-6
"""Speeds and times, and orientations [rad], may differ by this much, relative to them."""

HAIRPIN = 1e-3
"""Corners so near to half a turn [rad] can't be rounded."""

# Rounds in which speeds that follow from times, and those at junctions, come to agree.
ROUNDS = 100


@dataclass(frozen=True, eq=False)
class PathReader:
    """Reads the tool paths of one file.

    Attributes:
        curves: Makes their curves, and has what the file says.
        stops: Whether the tool stands still at a waypoint, by index.
    """

    curves: PathCurves
    stops: Callable[[int], bool]

    def begins(self, i: int) -> bool:
        """Whether a path begins at a waypoint, rather than going on through it."""
        given = self.curves.file.waypoints
        if i + 1 >= len(given) or not isinstance(given[i + 1], PathWaypoint):
            return False
        return not isinstance(given[i], PathWaypoint) or self.stops(i)

    def read(self, first: int, start: float) -> ScenarioPath:
        """The path that begins at a waypoint and ends where the next one stops, or is none.

        Its first waypoint is that of the file. The poses of `curves` are then right.

        Args:
            first: Index of the waypoint in the file.
            start: When it begins [s].

        Raises:
            DocumentError: The path can't be made as asked.
        """
        given = self.curves.file.waypoints
        if first not in self.curves.poses:
            found = (
                f"the path begins at waypoint {first + 1}, which is given by joint values"
                if first >= 0
                else "the path has no waypoint that it begins at"
            )
            raise self.curves.document.error(
                ("waypoints", first + 1, "along"),
                found,
                "a waypoint with a pose before this one: where the path begins",
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
                raise self.curves.document.error(
                    ("waypoints", first, key),
                    "is given where a path begins, which has its own",
                    f"no {key} here: the waypoint takes that of the path; or stop: true",
                )

    def _path(self, first: int, last: int, start: float) -> ScenarioPath:
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
            raise self.curves.document.error(
                ("waypoints", first + 1 + k),
                f"the path turns sharply by {np.degrees(error.angle):.6g} deg at {name!r}",
                "blend: a length, or stop: true" if lines and not back else "stop: true",
            ) from error
        except PathError:
            with self.curves.errors(last):
                raise
        timing, speeds = self._timing(first, lengths, given, start)
        # a rounded corner is passed in its middle
        self.curves.poses.update({first + 1 + k: path.pose(float(s)) for k, s in enumerate(ends)})
        times, full = start + timing.times, start + timing.full_speed
        stretches = tuple(
            Stretch(kind_of(one), float(begin), float(end), speed, (float(low), float(high)))
            for one, speed, (begin, end), (low, high) in zip(
                given, speeds, pairwise(times), full, strict=True
            )
        )
        return ScenarioPath(first, TimedPath(path, timing, start), stretches)

    def _durations(self, first: int, given: list[PathWaypoint], start: float) -> list[float | None]:
        """What the file says of how long each stretch takes [s]."""
        durations: list[float | None] = []
        before: float | None = start
        for k, one in enumerate(given):
            taken = one.after if isinstance(one.after, float) else None
            if one.time is not None and before is not None:
                taken = one.time - before
            elif one.time is not None and one.speed is None:
                raise self.curves.document.error(
                    ("waypoints", first + 1 + k, "time"),
                    "does not say how long the path takes, as the time of the waypoint before it "
                    "follows from a speed",
                    "after: the time that it takes [s], or speed",
                )
            if taken is not None and taken <= 0.0:
                raise self.curves.document.error(
                    ("waypoints", first + 1 + k, "time"),
                    f"is not later than {before:g} s, the time of the waypoint before it",
                    f"a time greater than {before:g} s",
                )
            if taken is None and one.speed is None:
                raise self.curves.document.error(
                    ("waypoints", first + 1 + k),
                    "has neither speed nor after, so that nothing says how fast the tool moves",
                    "speed: along the path, or after: the time that it takes [s]",
                )
            durations.append(taken)
            known = before is not None and taken is not None
            before = before + taken if known else one.time  # type: ignore[operator]
        return durations

    def _speed(self, waypoint: PathWaypoint) -> float | None:
        """The speed that the file gives [m/s]; a provisional one where it is chosen."""
        speed = given_speed(waypoint.speed, PROVISIONAL_SPEED / self.curves.length)
        return None if speed is None else self.curves.length * speed

    def _timing(
        self, first: int, lengths: FloatArray, given: list[PathWaypoint], start: float
    ) -> tuple[Timing, tuple[float, ...]]:
        unit, acceleration = self.curves.length, self.curves.file.path.acceleration
        limit = ACCELERATION if acceleration is None else unit * acceleration
        said = partial(self.curves.said, digits=6)
        last = first + len(given)
        ends: list[float | None] = [None, None]
        if self.stops(first):
            ends[0] = 0.0
        if self.stops(last):
            ends[1] = 0.0
        speeds = [self._speed(one) for one in given]
        durations = self._durations(first, given, start)
        try:
            timing, found = timed(lengths, speeds, durations, ends, limit)
        except RampError as error:
            fits = error.highest_speed
            raise self.curves.document.error(
                ("waypoints", first + 1 + error.stretch, "speed"),
                f"the path is {said(error.length)} long here, but its changes of speed "
                f"take {said(error.needed)} at {said(limit, '/s²')}",
                (f"at most {said(fits, '/s')}, or " if fits else "")
                + f"path: {{acceleration: {error.lowest_acceleration / unit:.6g}}} or more",
            ) from error
        except StretchTimeError as error:
            k, upper = error.stretch, f" and at most {error.most:.6g} s"
            raise self.curves.document.error(
                ("waypoints", first + 1 + k, "after" if given[k].after else "time"),
                f"leaves {durations[k]:.6g} s, but the path is {said(float(lengths[k]))} long "
                f"here, and with its changes of speed it takes at least {error.least:.6g} s"
                f"{'' if error.most == np.inf else upper} at {said(limit, '/s²')}",
                "a time that it can take, or another path: {acceleration: …}",
            ) from error
        except PathError as error:
            raise self.curves.document.error(("waypoints", last), str(error)) from error
        for k, (one, taken) in enumerate(zip(given, np.diff(timing.times), strict=True)):
            asked = durations[k]
            if asked is not None and abs(taken - asked) > AGREE * taken:
                raise self.curves.document.error(
                    ("waypoints", first + 1 + k, "after" if one.after else "time"),
                    f"leaves {asked:.6g} s, but at the speed given the path takes {taken:.6g} s",
                    "speed or time, not both",
                )
        return timing, found


def kind_of(waypoint: PathWaypoint) -> str:
    """What a path to a waypoint is: `"line"`, `"arc"` or `"points"`."""
    if isinstance(waypoint.along, AlongArc):
        return "arc"
    return "points" if isinstance(waypoint.along, AlongPoints) else "line"


def path_start(curves: list[Curve], index: int) -> float:
    """Arc length where a curve begins [m]."""
    return float(sum(curve.length for curve in curves[:index]))


def timed(
    lengths: FloatArray,
    speeds: list[float | None],
    durations: list[float | None],
    ends: list[float | None],
    acceleration: float,
) -> tuple[Timing, tuple[float, ...]]:
    """Time stretches of which each has a speed [m/s] or a duration [s].

    The speed at a junction is the lower one of its two stretches. So speeds that follow from
    durations depend on one another, and are found in rounds.

    Raises:
        PathError: A stretch is too short for its changes of speed, or a duration can't be had.
    """
    count = len(lengths)
    found = [
        float(lengths[k] / duration)
        if speed is None and duration is not None
        else float(speed or 0)
        for k, (speed, duration) in enumerate(zip(speeds, durations, strict=True))
    ]
    for _ in range(ROUNDS):
        before = list(found)
        for k in range(count):
            if speeds[k] is not None:
                continue
            left = ends[0] if k == 0 else found[k - 1]
            right = ends[1] if k == count - 1 else found[k + 1]
            try:
                found[k] = tool_paths.speed_for_duration(
                    float(lengths[k]),
                    float(durations[k] or 0.0),
                    acceleration=acceleration,
                    start_speed=None if left is None or (k and left >= found[k]) else left,
                    end_speed=None
                    if right is None or (k < count - 1 and right >= found[k])
                    else right,
                )
            except StretchTimeError as error:
                error.stretch = k
                raise
        if np.allclose(found, before, rtol=1e-12, atol=0.0):
            break
    timing = tool_paths.speed_profile(
        lengths, found, start_speed=ends[0], end_speed=ends[1], acceleration=acceleration
    )
    return timing, tuple(found)
