"""Curves of the tool over time, sampled, and the rows of a picture that show them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from knotwork.errors import InputError
from knotwork.joint_quantities import rate_unit
from knotwork.metrics.deviation import (
    deviation_from_line,
    deviation_from_path,
    speed_along_path,
    straight_legs,
)
from knotwork.polynomial import PiecewisePolynomial
from knotwork.polynomial.jumps import measured_jumps
from knotwork.polynomial.refined import split_at
from knotwork.robot import Robot
from knotwork.scenario import Scenario, ScenarioPath, Stretch
from knotwork.view.clearance_curve import clearance_curve
from knotwork.view.curves import piecewise_values
from knotwork.view.drawn_motions import Motion
from knotwork.view.limit_share import frame_values, singular_values
from knotwork.waypoints import FloatArray

# Largest number of samples; smallest and largest number in a piece; number between two poses; in a
# stretch of a path, smallest number in each piece, and largest number.
POINTS, LEAST_POINTS, MOST_POINTS, BETWEEN = 1500, 4, 200, 80
ALONG, PIECE_ALONG, MOST_ALONG = 240, 16, 12_000

Curve = tuple[FloatArray, FloatArray]
"""Times [s], shape (n,), and values, shape (n, k), with NaN at gaps."""


def robot_of(motion: Motion) -> Robot:
    """Give a motion's robot.

    Raises:
        InputError: The motion has no robot, or a robot without a tool.
    """
    if motion.space.robot is None:
        raise InputError(
            "the tool can't be drawn without a robot; give a plan or a scenario that names one"
        )
    robot = motion.space.robot
    if robot.tool_frame is None:
        raise InputError(f"robot {robot.name!r} has no tool frame; name one in the scenario")
    return robot


def stretches(
    scenario: Scenario, curve: PiecewisePolynomial
) -> Iterator[tuple[ScenarioPath, Stretch, float, float]]:
    """Stretches of tool paths, with their time intervals in a motion [s]."""
    start, end = curve.x[[0, -1]]
    for path in scenario.paths:
        for stretch in path.stretches:
            low, high = max(stretch.start, start), min(stretch.end, end)
            if low < high:
                yield path, stretch, float(low), float(high)


def full_speeds(motion: Motion) -> Iterator[tuple[ScenarioPath, Stretch, float, float]]:
    """Stretches with a given constant speed, with their time intervals [s]."""
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
    """Speed [m/s] or acceleration [m/s²] of a link's origin, or of the tool."""
    robot = robot_of(motion)

    def measured(*states: FloatArray) -> FloatArray:
        return frame_values(robot, frame, order, *states)[:, np.newaxis]

    return _over_time(motion, measured, range(order + 1))


def least_singular_values(motion: Motion) -> Curve:
    """The smallest singular value of the tool Jacobian."""
    robot = robot_of(motion)

    def measured(q: FloatArray, *_: FloatArray) -> FloatArray:
        return singular_values(robot, q)[:, np.newaxis]

    return _over_time(motion, measured, (0,))


def clearances(motion: Motion) -> Curve:
    """Minimum clearance from the surroundings [m]."""
    x = motion.curve.x
    at = [one.time for one in motion.judged if one.quantity == "clearance"]
    also = [time for time in at if time is not None]
    span = float(x[0]), float(x[-1])
    found = clearance_curve(motion.trajectory, motion.scenario, motion.space, span, also)
    if found is None:
        return np.empty(0), np.empty((0, 1))
    return found.time, found.distance[:, np.newaxis]


def _over_time(motion: Motion, measured: Callable[..., FloatArray], orders: Iterable[int]) -> Curve:
    """Sample a quantity, including the times of findings on limits.

    Args:
        motion: The motion.
        measured: Values, shape (n, k), from position, velocity and acceleration of the joints.
        orders: The curve has gaps at jumps of these derivatives.
    """
    curve = motion.curve
    count = min(max(POINTS // (len(curve.x) - 1), LEAST_POINTS), MOST_POINTS)
    curve = _cut(curve, count * float(curve.x[-1] - curve.x[0]) / POINTS)
    (time, q), (_, v), (_, a) = (piecewise_values(curve, order, count) for order in range(3))
    jumps = [measured_jumps(curve, order) for order in orders]
    places = np.flatnonzero(sum((sizes > allowed).any(axis=1) for sizes, allowed in jumps)) + 1
    values = np.insert(measured(q, v, a), places * count, np.nan, axis=0)
    time = np.insert(time, places * count, curve.x[places])
    at = [one.time for one in motion.judged if one.time is not None]
    if not at:
        return time, values
    also = np.sort(at)
    index = np.searchsorted(time, also, side="right")
    found = measured(*(curve(also, order) for order in range(3)))
    return np.insert(time, index, also), np.insert(values, index, found, axis=0)


def _cut(curve: PiecewisePolynomial, span: float) -> PiecewisePolynomial:
    """The same curve with long pieces cut into ones of about a span [s]."""
    ends = zip(curve.x[:-1], curve.x[1:], strict=True)
    times = [np.linspace(a, b, int((b - a) / span) + 1)[1:-1] for a, b in ends]
    return split_at(curve, np.concatenate(times))


def speed_errors(motion: Motion) -> Curve:
    """Relative error of the speed along the path."""
    robot, parts = robot_of(motion), []
    for path, stretch, start, end in full_speeds(motion):
        time = times_along(motion.curve, start, end)
        q, v = motion.curve(time), motion.curve(time, 1)
        speed = speed_along_path(robot, q, v, path, stretch, time)
        parts.append((time, (speed / stretch.speed - 1.0)[:, np.newaxis]))
    return _joined(parts, 1)


def path_deviations(motion: Motion) -> Curve:
    """Distance [m] and angle [rad] of the tool from its path."""
    robot, parts = robot_of(motion), []
    for path, stretch, start, end in stretches(motion.scenario, motion.curve):
        time = times_along(motion.curve, start, end)
        off = deviation_from_path(robot, motion.curve(time), path, stretch, time)
        parts.append((time, np.stack(off, axis=1)))
    return _joined(parts, 2)


def straight_deviations(motion: Motion) -> Curve:
    """Distance [m] and angle [rad] from the straight line between poses, off tool paths."""
    robot, parts = robot_of(motion), []
    task = motion.scenario
    for before, after in straight_legs(task.waypoints, task.paths):
        start, end = max(before.time, motion.curve.x[0]), min(after.time, motion.curve.x[-1])
        if start < end:
            time = np.linspace(start, end, BETWEEN + 1)
            poses = map(robot.forward, motion.curve(time))
            off = [deviation_from_line(pose, before.pose, after.pose) for pose in poses]
            parts.append((time, np.array(off)))
    return _joined(parts, 2)


def times_along(curve: PiecewisePolynomial, start: float, end: float) -> FloatArray:
    """Times in an interval, some in each piece of a motion, with its breaks [s]."""
    x = curve.x
    edges = np.concatenate(([start], x[(x > start) & (x < end)], [end]))
    pieces = len(edges) - 1
    count = max(min(max(ALONG // pieces, PIECE_ALONG), MOST_ALONG // pieces), LEAST_POINTS)
    part = np.arange(count) / count
    return np.append((edges[:-1, None] + np.diff(edges)[:, None] * part).ravel(), end)


def _joined(parts: list[Curve], columns: int) -> Curve:
    """Join curves, with NaN where one does not begin at the end of the other."""
    times, values = [np.empty(0)], [np.empty((0, columns))]
    for time, value in parts:
        if len(times[-1]) and times[-1][-1] < time[0]:
            times.append(time[:1])
            values.append(np.full((1, columns), np.nan))
        times.append(time)
        values.append(value)
    return np.concatenate(times), np.concatenate(values)


@dataclass(frozen=True)
class Row:
    """A row of panels.

    Attributes:
        title: Title of the quantity.
        unit: Its SI unit, or `"%"`.
        curve: Function that measures a motion.
        component: Index of the displayed value.
        asked: Part of a waypoint's velocity to mark, `"linear"` or `"angular"`, or none.
        limit: Limit in SI, or `None`.
        tolerance: Whether it is a tolerance along tool paths, to both sides.
        judged: Quantity and name of the findings on that limit.
        least: Whether it is a lower limit.
    """

    title: str
    unit: str
    curve: Callable[[Motion], Curve]
    component: int = 0
    asked: str = ""
    limit: float | None = None
    tolerance: bool = False
    judged: tuple[str, str] = ("", "")
    least: bool = False


def tool_rows(motions: list[Motion]) -> list[Row]:
    """Candidate rows; the caller leaves out those without values."""
    for motion in motions:
        robot_of(motion)  # raises before anything is drawn
    scenario = motions[0].scenario
    allowed, limits = scenario.tolerances, scenario.motion_limits
    off, straight = path_deviations, straight_deviations
    speed, speed_error = limits.tool_speed, allowed.path_speed
    rows = [
        Row("tool speed", "m/s", speeds, 0, "linear", speed, judged=("tool_speed", "")),
        Row("turning speed", "rad/s", speeds, 1, "angular"),
        Row("speed error", "%", speed_errors, limit=speed_error, tolerance=True),
        Row("off tool path", "m", off, limit=allowed.path, tolerance=True),
        Row("turned off path", "rad", off, 1, limit=allowed.path_orientation, tolerance=True),
        Row("off straight path", "m", straight),
        Row("turned off line", "rad", straight, 1),
    ]
    places = [("tool acceleration", "", limits.tool_acceleration, 2, "tool_acceleration")]
    places += [
        (f"speed of {one.frame}", one.frame, one.speed, 1, "frame_speed")
        for one in limits.frame_speeds
    ]
    for title, frame, limit, order, quantity in places:
        if limit is not None:
            curve = partial(place_rates, frame=frame, order=order)
            unit = rate_unit("m", order)
            rows.append(Row(title, unit, curve, limit=limit, judged=(quantity, frame)))
    if scenario.scene.objects:
        least = scenario.scene.rules.margin
        rows.append(Row("clearance", "m", clearances, limit=least, least=True))
    if limits.singular_value is not None:
        title, judged = "smallest singular value", ("smallest_singular_value", "")
        least = limits.singular_value
        rows.append(Row(title, "", least_singular_values, limit=least, judged=judged, least=True))
    return rows
