"""Curves of the tool over time, sampled, and the rows of a picture that show them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from knotwork.deviation import (
    deviation_from_line,
    deviation_from_path,
    speed_along_path,
    straight_legs,
)
from knotwork.errors import InputError
from knotwork.joint_quantities import rate_unit
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.jumps import measured_jumps
from knotwork.robot import Robot
from knotwork.scenario import Scenario, ScenarioPath, Stretch, ToleranceSet
from knotwork.view.curves import piecewise_values
from knotwork.view.drawn_motions import Motion
from knotwork.view.limit_share import frame_values, singular_values
from knotwork.waypoints import FloatArray

# Times sampled in all, at least and at most in a piece; between two poses; in a stretch of a path,
# in each of its pieces, and at most in all.
POINTS, LEAST_POINTS, MOST_POINTS, BETWEEN = 1500, 4, 200, 80
ALONG, PIECE_ALONG, MOST_ALONG = 240, 16, 12_000

Curve = tuple[FloatArray, FloatArray]
"""Times [s], shape (n,), and values, shape (n, 2), parted by NaN where nothing is to be seen."""


def robot_of(motion: Motion) -> Robot:
    """Give a motion's robot.

    Raises:
        InputError: It has none, or that has no tool.
    """
    if motion.space is None or motion.space.robot is None:
        raise InputError(
            "the tool can't be drawn without a robot; give a plan or a scenario that names one"
        )
    robot = motion.space.robot
    if robot.tool_frame is None:
        raise InputError(f"robot {robot.name!r} has no tool frame; name one in the scenario")
    return robot


def stretches(
    scenario: Scenario | None, curve: PiecewisePolynomial
) -> Iterator[tuple[ScenarioPath, Stretch, float, float]]:
    """Stretches of tool paths, and from when to when a motion is on each [s]."""
    start, end = curve.x[[0, -1]]
    for path in scenario.paths if scenario is not None else ():
        for stretch in path.stretches:
            low, high = max(stretch.start, start), min(stretch.end, end)
            if low < high:
                yield path, stretch, float(low), float(high)


def full_speeds(motion: Motion) -> Iterator[tuple[ScenarioPath, Stretch, float, float]]:
    """Stretches that ask for a constant speed, and from when to when that is shown [s]."""
    for path, stretch, start, end in stretches(motion.scenario, motion.curve):
        low, high = max(stretch.full_speed[0], start), min(stretch.full_speed[1], end)
        if low < high:
            yield path, stretch, low, high


def speeds(motion: Motion) -> Curve:
    """Linear [m/s] and angular [rad/s] speed of the tool."""
    robot = robot_of(motion)

    def measured(q: FloatArray, v: FloatArray, _: FloatArray) -> FloatArray:
        twists = [robot.twist(*state) for state in zip(q, v, strict=True)]
        return np.array([[np.linalg.norm(t.linear), np.linalg.norm(t.angular)] for t in twists])

    return _over_time(motion, measured, (0, 1))


def place_rates(motion: Motion, frame: str, order: int) -> Curve:
    """Speed [m/s] or acceleration [m/s²] of a link's origin, or of the tool; the second is NaN."""
    robot = robot_of(motion)

    def measured(*states: FloatArray) -> FloatArray:
        return _alone(frame_values(robot, frame, order, *states))

    return _over_time(motion, measured, range(order + 1))


def least_singular_values(motion: Motion) -> Curve:
    """The smallest singular value of the tool Jacobian; the second is NaN."""
    robot = robot_of(motion)

    def measured(q: FloatArray, *_: FloatArray) -> FloatArray:
        return _alone(singular_values(robot, q))

    return _over_time(motion, measured, (0,))


def _over_time(motion: Motion, measured: Callable[..., FloatArray], orders: Iterable[int]) -> Curve:
    """Sample a quantity, at the times at which limits are judged, too.

    Args:
        motion: Whose.
        measured: Its values, shape (n, 2), from position, velocity and acceleration of the joints.
        orders: At jumps of these derivatives the curve is parted.
    """
    curve = motion.curve
    count = min(max(POINTS // (len(curve.x) - 1), LEAST_POINTS), MOST_POINTS)
    (time, q), (_, v), (_, a) = (piecewise_values(curve, order, count) for order in range(3))
    jumps = [measured_jumps(curve, order) for order in orders]
    places = np.flatnonzero(sum((sizes > allowed).any(axis=1) for sizes, allowed in jumps)) + 1
    values = np.insert(measured(q, v, a), places * count, np.nan, axis=0)
    time = np.insert(time, places * count, curve.x[places])
    at = [one.time for one in motion.judged if one.time is not None and motion.shows(one.time)]
    if not at:
        return time, values
    also = np.sort(at)
    index = np.searchsorted(time, also, side="right")
    found = measured(*(curve(also, order) for order in range(3)))
    return np.insert(time, index, also), np.insert(values, index, found, axis=0)


def _alone(values: FloatArray) -> FloatArray:
    """Values as the first of two."""
    return np.stack((values, np.full(values.shape, np.nan)), axis=1)


def speed_errors(motion: Motion) -> Curve:
    """Velocity along the path beyond the speed asked for, as a part of it; the second is NaN."""
    robot, parts = robot_of(motion), []
    for path, stretch, start, end in full_speeds(motion):
        time = times_along(motion.curve, start, end)
        q, v = motion.curve(time), motion.curve(time, 1)
        speed = speed_along_path(robot, q, v, path, stretch, time)
        parts.append((time, _alone(speed / stretch.speed - 1.0)))
    return _joined(parts)


def path_deviations(motion: Motion) -> Curve:
    """Distance [m] and angle [rad] of the tool from its path."""
    robot, parts = robot_of(motion), []
    for path, stretch, start, end in stretches(motion.scenario, motion.curve):
        time = times_along(motion.curve, start, end)
        off = deviation_from_path(robot, motion.curve(time), path, stretch, time)
        parts.append((time, np.stack(off, axis=1)))
    return _joined(parts)


def straight_deviations(motion: Motion) -> Curve:
    """Distance [m] and angle [rad] from the straight way between poses, where there is no path."""
    robot, parts = robot_of(motion), []
    task = motion.scenario
    legs = straight_legs(task.waypoints, task.paths) if task is not None else ()
    for before, after in legs:
        start, end = max(before.time, motion.curve.x[0]), min(after.time, motion.curve.x[-1])
        if start < end:
            time = np.linspace(start, end, BETWEEN + 1)
            poses = map(robot.forward, motion.curve(time))
            off = [deviation_from_line(pose, before.pose, after.pose) for pose in poses]
            parts.append((time, np.array(off)))
    return _joined(parts)


def times_along(curve: PiecewisePolynomial, start: float, end: float) -> FloatArray:
    """Times from one to another, some in each piece of a motion, with its breaks [s]."""
    x = curve.x
    edges = np.concatenate(([start], x[(x > start) & (x < end)], [end]))
    pieces = len(edges) - 1
    count = max(min(max(ALONG // pieces, PIECE_ALONG), MOST_ALONG // pieces), LEAST_POINTS)
    part = np.arange(count) / count
    return np.append((edges[:-1, None] + np.diff(edges)[:, None] * part).ravel(), end)


def _joined(parts: list[Curve]) -> Curve:
    """Join curves, parted by NaN where one does not begin as the other ends."""
    times, values = [np.empty(0)], [np.empty((0, 2))]
    for time, value in parts:
        if len(times[-1]) and times[-1][-1] < time[0]:
            times.append(time[:1])
            values.append(np.full((1, 2), np.nan))
        times.append(time)
        values.append(value)
    return np.concatenate(times), np.concatenate(values)


PERCENT = 1e2


@dataclass(frozen=True)
class Row:
    """A row of panels.

    Attributes:
        title: Of the quantity.
        unit: Unit that it is shown in.
        factor: From SI to that unit.
        curve: Function that measures a motion.
        component: Which of its values is shown.
        asked: Part of a waypoint's velocity that is marked, `"linear"` or `"angular"`, or none.
        limit: In SI, or `None`.
        tolerance: Whether that is allowed along tool paths and to either side, else all the time.
        judged: Quantity and name of the findings on that limit.
        least: Whether the limit is one from below.
    """

    title: str
    unit: str
    factor: float
    curve: Callable[[Motion], Curve]
    component: int
    asked: str = ""
    limit: float | None = None
    tolerance: bool = False
    judged: tuple[str, str] = ("", "")
    least: bool = False


def tool_rows(motions: list[Motion], degrees: bool | None) -> list[Row]:
    """The rows that may be drawn; the caller leaves out those without values."""
    for motion in motions:
        robot_of(motion)  # an error, before anything is drawn
    scenario = motions[0].scenario
    allowed = scenario.tolerances if scenario is not None else ToleranceSet()
    units = motions[0].units(degrees)
    factor, angle = units.shown(1.0, "rad")
    metres, length = units.shown(1.0, "m")
    return [
        Row(
            *("tool speed", f"{length}/s", metres, speeds, 0, "linear"),
            limit=scenario.motion_limits.tool_speed if scenario is not None else None,
            judged=("tool_speed", ""),
        ),
        Row("turning speed", f"{angle}/s", factor, speeds, 1, "angular"),
        Row("speed error", "%", PERCENT, speed_errors, 0, limit=allowed.path_speed, tolerance=True),
        Row(
            "off tool path", length, metres, path_deviations, 0, limit=allowed.path, tolerance=True
        ),
        Row(
            *("turned from it", angle, factor, path_deviations, 1),
            limit=allowed.path_orientation,
            tolerance=True,
        ),
        Row("off straight path", length, metres, straight_deviations, 0),
        Row("turned from it", angle, factor, straight_deviations, 1),
        *(_limit_rows(scenario, metres, length) if scenario is not None else ()),
    ]


def _limit_rows(scenario: Scenario, factor: float, unit: str) -> Iterator[Row]:
    """Rows of limits that no other row has."""
    limits = scenario.motion_limits

    def of_place(name: str, order: int, limit: float, frame: str, quantity: str) -> Row:
        curve = partial(place_rates, frame=frame, order=order)
        shown = rate_unit(unit, order)
        return Row(name, shown, factor, curve, 0, limit=limit, judged=(quantity, frame))

    if limits.tool_acceleration is not None:
        yield of_place("tool acceleration", 2, limits.tool_acceleration, "", "tool_acceleration")
    for one in limits.frame_speeds:
        yield of_place(f"speed of {one.frame}", 1, one.speed, one.frame, "frame_speed")
    if limits.singular_value is not None:
        yield Row(
            *("smallest singular value", "", 1.0, least_singular_values, 0),
            limit=limits.singular_value,
            judged=("smallest_singular_value", ""),
            least=True,
        )
