"""The tool over time: its speed, and how far it is from straight paths between its poses."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from knotwork.errors import InputError
from knotwork.polynomial.jumps import measured_jumps
from knotwork.robot import Robot
from knotwork.scenario import Scenario
from knotwork.tool_path import deviation_from_line
from knotwork.view.curves import piecewise_values
from knotwork.view.heads import curve_legend, explain_marks, frame_times, picture_title, settle
from knotwork.view.motions import Drawable, Motion, motions_of
from knotwork.view.style import (
    DASHES,
    LOOKS,
    colour,
    dashes,
    dress,
    mark_waypoints,
    new_figure,
    settings,
    shown_unit,
)
from knotwork.waypoints import CartesianWaypoint, FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Times sampled in all, at least and at most in a piece, and between two poses.
POINTS, LEAST_POINTS, MOST_POINTS, BETWEEN = 1500, 4, 200, 80
MILLIMETRES = 1e3
# Room above and below the curves, in parts of their range.
ROOM = 0.07


def plot_tool(
    motions: Drawable | Sequence[Drawable],
    *,
    degrees: bool = False,
    scenario: Scenario | None = None,
    labels: Sequence[str] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the tool over time: speed, turning speed, and deviation from the straight path.

    What waypoints ask for is marked. The straight path leads from one pose to the next, turning
    evenly; it is shown where two poses follow each other. Everything is sampled.

    Args:
        motions: A `Plan`, a `JointTrajectory`, or several of them, of a robot with a tool.
        degrees: Show angles in degrees instead of radians.
        scenario: For trajectories: what was asked for, with its robot.
        labels: A name for each motion; by default its planner.
        title: Title of the picture; by default the scenario and the planner.

    Returns:
        A figure, not known to `pyplot`.

    >>> figure = plot_tool(kw.plan("planar2_closed_form"))
    >>> [axis.get_ylabel() for axis in figure.axes]
    ['tool speed [mm/s]', 'turning speed [rad/s]', ...]

    Raises:
        InputError: There is no robot with a tool, there are too many motions for one picture, or
            they are not of the scenario's joints.
    """
    found = motions_of(motions, scenario=scenario, labels=labels)
    if len(found) > len(DASHES):
        raise InputError(
            f"{len(found)} motions are too many to tell apart in one picture; choose at most "
            f"{len(DASHES)}"
        )
    for motion in found:
        _robot(motion)  # that there is one is said before anything is drawn
    angle, factor = shown_unit("rad", degrees)
    rows = [("tool speed [mm/s]", MILLIMETRES), (f"turning speed [{angle}/s]", factor)]
    if any(_straight_legs(motion) for motion in found):
        rows += [("off straight path [mm]", MILLIMETRES), (f"turned from it [{angle}]", factor)]
    with settings():
        figure = new_figure(len(rows), 1)
        axes: list[Axes] = list(figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0])
        for index, motion in enumerate(found):
            _draw_curves(axes, rows, motion, index)
        _dress(axes, rows, found[0])
        figure.align_ylabels()
        heading = title if title is not None else f"{picture_title(found, 'motion')} · tool"
        several = enumerate(found) if len(found) > 1 else ()
        curve_legend(figure, {motion.label: (i, i) for i, motion in several}, heading)
        explain_marks(figure)
        frame_times([axes[0]], axes[-1:], found)
        settle(figure, len(rows))
    return figure


def _draw_curves(
    axes: list[Axes], rows: list[tuple[str, float]], motion: Motion, index: int
) -> None:
    speeds, deviations = (made(motion, _robot(motion)) for made in (_speeds, _deviations))
    for i, (axis, (label, factor)) in enumerate(zip(axes, rows, strict=True)):
        time, values = speeds if i < 2 else deviations
        axis.plot(
            time,
            factor * values[:, i % 2],
            color=colour(index),
            linestyle=dashes(index),
            linewidth=2.0,
            gid=f"tool:{motion.label}:{label.partition(' [')[0]}",
        )


def _robot(motion: Motion) -> Robot:
    if motion.space is None or motion.space.robot is None:
        raise InputError(
            "the tool can't be drawn without a robot; give a plan or a scenario that names one"
        )
    robot = motion.space.robot
    if robot.tool_frame is None:
        raise InputError(f"robot {robot.name!r} has no tool frame; name one in the scenario")
    return robot


def _speeds(motion: Motion, robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Times, and linear [m/s] and angular [rad/s] speed of the tool, shape (n, 2)."""
    curve = motion.curve
    count = min(max(POINTS // (len(curve.x) - 1), LEAST_POINTS), MOST_POINTS)
    time, q = piecewise_values(curve, 0, count)
    _, v = piecewise_values(curve, 1, count)
    twists = [robot.twist(*state) for state in zip(q, v, strict=True)]
    speeds = np.array([[np.linalg.norm(t.linear), np.linalg.norm(t.angular)] for t in twists])
    jumps = [measured_jumps(curve, order) for order in (0, 1)]
    places = np.flatnonzero(sum((sizes > allowed).any(axis=1) for sizes, allowed in jumps)) + 1
    time = np.insert(time, places * count, curve.x[places])
    return time, np.insert(speeds, places * count, np.nan, axis=0)


def _straight_legs(motion: Motion) -> list[tuple[CartesianWaypoint, CartesianWaypoint]]:
    """Poses that follow each other."""
    waypoints = motion.scenario.waypoints if motion.scenario is not None else ()
    return [
        (before, after)
        for before, after in pairwise(waypoints)
        if isinstance(before, CartesianWaypoint) and isinstance(after, CartesianWaypoint)
    ]


def _deviations(motion: Motion, robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Times, and distance [m] and angle [rad] from the straight path, shape (n, 2), with NaN."""
    curve = motion.curve
    times, values = [np.empty(0)], [np.empty((0, 2))]
    for before, after in _straight_legs(motion):
        if curve.x[0] <= before.time and after.time <= curve.x[-1]:
            time = np.linspace(before.time, after.time, BETWEEN + 1)
            poses = map(robot.forward, curve(time))
            off = [deviation_from_line(pose, before.pose, after.pose) for pose in poses]
            if len(times[-1]) and times[-1][-1] < before.time:  # no straight path in between
                times.append(np.array([before.time]))
                values.append(np.full((1, 2), np.nan))
            times.append(time)
            values.append(np.array(off))
    return np.concatenate(times), np.concatenate(values)


def _dress(axes: list[Axes], rows: list[tuple[str, float]], first: Motion) -> None:
    """Labels, scales from zero, and the waypoints with what they ask for."""
    waypoints = first.scenario.waypoints if first.scenario is not None else ()
    poses = [one for one in waypoints if isinstance(one, CartesianWaypoint)]
    for axis, (label, factor), kind in zip(axes, rows, ("linear", "angular", "", ""), strict=False):
        dress(axis)
        axis.set_ylabel(label)
        mark_waypoints(axis, np.array([one.time for one in waypoints]))
        if kind and poses:
            asked = [factor * float(np.linalg.norm(getattr(one, kind))) for one in poses]
            times = [one.time for one in poses]
            axis.plot(times, asked, gid=f"asked:{kind}", zorder=4, **LOOKS["asked"])
        drawn = np.concatenate(
            [
                np.asarray(line.get_ydata(), float)
                for line in axis.lines
                if line.get_gid() != "waypoint"
            ]
        )
        high = float(np.nanmax(drawn)) if np.isfinite(drawn).any() else 0.0
        high = high if high > 1e-9 else 1.0
        axis.set_ylim(-ROOM * high, (1 + ROOM) * high)
