"""Curves of the tool over time, sampled, and the rows of a picture that show them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.errors import InputError
from knotwork.joint_quantities import FRAME_ORDERS, rate_unit
from knotwork.task.scenario import ScenarioPath, Stretch
from knotwork.verification.bounds.path_samples import PathSamples, PathStretch
from knotwork.verification.limits import SMALLEST_SINGULAR_VALUE
from knotwork.view.clearance_curve import clearance_curve
from knotwork.view.plotted_utilisation import frame_values, smallest_singular_values
from knotwork.view.shown_motion import ShownMotion

SAMPLES = 1500
"""Number of samples of a motion."""
PATH_SAMPLES, PIECE_SAMPLES, MAX_PATH_SAMPLES = 240, 16, 12_000
"""Number of samples of a stretch of a path, minimum in each piece, and maximum of a stretch."""

Curve = tuple[FloatArray, FloatArray]
"""Times [s], shape (n,), and values, shape (n, k), with NaN at gaps."""


def stretches(motion: ShownMotion) -> Iterator[tuple[ScenarioPath, Stretch, float, float]]:
    """Stretches of tool paths, with their time intervals in a motion [s]."""
    start, end = motion.curve.x[[0, -1]]
    for path in motion.scenario.paths:
        for stretch in path.stretches:
            low, high = max(stretch.start, start), min(stretch.end, end)
            if low < high:
                yield path, stretch, float(low), float(high)


def full_speeds(motion: ShownMotion) -> Iterator[tuple[ScenarioPath, Stretch, float, float]]:
    """Stretches with a given constant speed, with their time intervals [s]."""
    for path, stretch, start, end in stretches(motion):
        low, high = stretch.full_speed_interval
        low, high = max(low, start), min(high, end)
        if low < high:
            yield path, stretch, low, high


def speeds(motion: ShownMotion) -> Curve:
    """Linear [m/s] and angular [rad/s] speed of the tool."""
    time = _sample_times(motion)
    states = zip(motion.curve(time), motion.curve(time, 1), strict=True)
    twists = [motion.robot.twist(*state) for state in states]
    return time, np.array([[np.linalg.norm(t.linear), np.linalg.norm(t.angular)] for t in twists])


def frame_rates(motion: ShownMotion, frame: str, order: int) -> Curve:
    """Speed [m/s] or acceleration [m/s²] of a link's origin, or of the tool."""
    time = _sample_times(motion)
    states = (motion.curve(time, k) for k in range(3))
    return time, frame_values(motion.robot, frame, order, *states)[:, np.newaxis]


def least_singular_values(motion: ShownMotion) -> Curve:
    """The smallest singular value of the tool Jacobian."""
    time = _sample_times(motion)
    return time, smallest_singular_values(motion.robot, motion.curve(time))[:, np.newaxis]


def clearances(motion: ShownMotion) -> Curve:
    """Minimum clearance from the surroundings [m]."""
    clearance = clearance_curve(motion)
    if clearance is None:
        return np.empty(0), np.empty((0, 1))
    return clearance.time, clearance.distance[:, np.newaxis]


def _sample_times(motion: ShownMotion) -> FloatArray:
    """Times of a motion, with those of findings on limits [s]."""
    at = [finding.time for finding in motion.tool_findings if finding.time is not None]
    x = motion.curve.x
    breaks = x if len(x) <= SAMPLES else x[[0, -1]]
    return np.unique(np.concatenate([np.linspace(x[0], x[-1], SAMPLES), breaks, at]))


def speed_errors(motion: ShownMotion) -> Curve:
    """Relative error of the speed along the path."""
    parts = [
        (time, (samples.along_speed / stretch.speed - 1.0)[:, np.newaxis])
        for stretch, time, samples in _follow(motion, full_speeds(motion))
    ]
    return _join_curves(parts, 1)


def path_deviations(motion: ShownMotion) -> Curve:
    """Distance [m] and angle [rad] of the tool from its path."""
    parts = [
        (time, np.stack((samples.distance, samples.angle), axis=1))
        for _, time, samples in _follow(motion, stretches(motion))
    ]
    return _join_curves(parts, 2)


def _follow(
    motion: ShownMotion, parts: Iterable[tuple[ScenarioPath, Stretch, float, float]]
) -> Iterator[tuple[Stretch, FloatArray, PathSamples]]:
    """Compare the tool with its path in parts of stretches, at sample times [s]."""
    for path, stretch, start, end in parts:
        time = times_along(motion.curve, start, end)
        ends = stretch.start, stretch.end
        followed = PathStretch(motion.robot, motion.curve, path.timed_path, *ends, path.freedom)
        yield stretch, time, followed.sample(time)


def times_along(curve: PiecewisePolynomial, start: float, end: float) -> FloatArray:
    """Times in an interval, some in each piece of a motion, with its breaks [s]."""
    x = curve.x
    edges = np.concatenate(([start], x[(x > start) & (x < end)], [end]))
    pieces = len(edges) - 1
    count = min(max(PATH_SAMPLES // pieces, PIECE_SAMPLES), max(MAX_PATH_SAMPLES // pieces, 4))
    part = np.arange(count) / count
    return np.append((edges[:-1, None] + np.diff(edges)[:, None] * part).ravel(), end)


def _join_curves(curves: list[Curve], columns: int) -> Curve:
    """Join curves, with NaN where one does not begin at the end of the other."""
    times, values = [np.empty(0)], [np.empty((0, columns))]
    for time, value in curves:
        if len(times[-1]) and times[-1][-1] < time[0]:
            times.append(time[:1])
            values.append(np.full((1, columns), np.nan))
        times.append(time)
        values.append(value)
    return np.concatenate(times), np.concatenate(values)


@dataclass(frozen=True)
class ToolRow:
    """A row of panels.

    Attributes:
        title: Title of the quantity.
        unit: SI unit of the quantity, or `"%"`.
        curve: Function that samples the quantity over a motion.
        component: Index of the displayed value.
        given_part: Part of the waypoints' velocities to mark, `"linear"` or `"angular"`, or none.
        limit: Limit in SI, or `None`.
        tolerance: Whether the limit is a tolerance along tool paths, to both sides.
        judged: Quantity and name of the findings on the limit.
        least: Whether the limit is a lower one.
    """

    title: str
    unit: str
    curve: Callable[[ShownMotion], Curve]
    component: int = 0
    given_part: str = ""
    limit: float | None = None
    tolerance: bool = False
    judged: tuple[str, str] = ("", "")
    least: bool = False


def tool_rows(motions: list[ShownMotion]) -> list[ToolRow]:
    """Make the candidate rows of a picture; the caller leaves out rows without values.

    Raises:
        InputError: A motion has no robot.
        RobotError: A robot has no tool.
    """
    for motion in motions:
        if motion.joints.robot is None:
            raise InputError(
                "the tool can't be drawn without a robot; give a plan or a scenario that names one"
            )
        motion.robot.require_tool()
    scenario = motions[0].scenario
    allowed, limits = scenario.tolerances, scenario.motion_limits
    off, speed, speed_error = path_deviations, limits.tool_speed, allowed.path_speed
    rows = [
        ToolRow("tool speed", "m/s", speeds, 0, "linear", speed, judged=("tool_speed", "")),
        ToolRow("turning speed", "rad/s", speeds, 1, "angular"),
        ToolRow("speed error", "%", speed_errors, limit=speed_error, tolerance=True),
        ToolRow("off tool path", "m", off, limit=allowed.path, tolerance=True),
        ToolRow("turned off path", "rad", off, 1, limit=allowed.path_orientation, tolerance=True),
    ]
    for quantity, frame, limit in limits.frame_limits:
        if quantity != "tool_speed":
            title = f"speed of {frame}" if frame else "tool acceleration"
            order = FRAME_ORDERS[quantity]
            curve = partial(frame_rates, frame=frame, order=order)
            unit = rate_unit("m", order)
            rows.append(ToolRow(title, unit, curve, limit=limit, judged=(quantity, frame)))
    if scenario.scene.objects:
        least = scenario.scene.margin
        rows.append(ToolRow("clearance", "m", clearances, limit=least, least=True))
    if limits.singular_value is not None:
        title, judged = "smallest singular value", (SMALLEST_SINGULAR_VALUE, "")
        least = limits.singular_value
        rows.append(
            ToolRow(title, "", least_singular_values, limit=least, judged=judged, least=True)
        )
    return rows
