"""Segments: consecutive waypoints between which something is chosen, divided where all is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.choosing.task import FreeTask
from knotwork.errors import InputError
from knotwork.scenario import FreeWay, Scenario
from knotwork.scenario.joint_space import JointSpace
from knotwork.timing import Objective, TimingLimits, TimingProblem
from knotwork.waypoints import FloatArray, IndexArray

SHORTEST_RAMP = 0.01
"""Without a limit of jerk, the acceleration goes from none to its limit in no less time [s]."""

GREATEST_JERK = 2e4
"""Without limits of jerk and acceleration, the greatest jerk [rad/s³ or m/s³]."""


@dataclass(frozen=True, eq=False)
class Segment:
    """Consecutive waypoints of a scenario; between them is neither a tool path nor a wait.

    Attributes:
        waypoints: Their indices in the scenario.
        rows: Their rows in its joint waypoints, shape (n,).
        way: What is asked of it if it finds its way.
    """

    waypoints: range
    rows: IndexArray
    way: FreeWay | None = None

    def meets(self, other: Segment) -> bool:
        """Whether it is a way that ends where another one begins."""
        return self.way is not None and self.waypoints[-1] == other.waypoints[0]


def find_segments(task: FreeTask) -> list[Segment]:
    """The segments of a task in which something is chosen, in order of time.

    Raises:
        InputError: The time between two equal stops is to be chosen, or the velocity at one of the
            still points.
    """
    scenario, free = task.scenario, task.free
    n = len(scenario.waypoints)
    closed = set(task.space.waits)
    for i in closed:
        if free.duration[i]:
            with scenario.error_context("waypoints", scenario.index[i + 1]):
                raise InputError(
                    f"{scenario.waypoints[i].name!r} and {scenario.waypoints[i + 1].name!r} are "
                    "the same stop, so the least time between them is none; accepted: wait: "
                    "seconds at the first of them, or after: seconds"
                )
    for i, why in task.still_points.items():
        if free.speed[i] != "given":
            accepted = "stop, or a velocity"
            if i in free.ways and i + 1 in free.ways:
                accepted += ", or velocity: free if both ways have the same options and no times"
            message = f"the velocity is chosen, but {why} here; accepted: {accepted}"
            raise task.located(InputError(message), i)
    for path in scenario.paths:
        closed.update(range(path.first, path.last))
    ends = task.still_points
    segments: list[Segment] = []
    first = 0
    for i in range(n):
        if i + 1 < n and i not in closed and i not in ends:
            continue
        if i > first and _chosen(task, first, i):
            own = Segment(range(first, i + 1), task.rows[first : i + 1], free.ways.get(i))
            segments.append(own)
        first = i + 1 if i in closed else i
    return segments


def _chosen(task: FreeTask, first: int, last: int) -> bool:
    """Whether something is chosen between two waypoints."""
    free = task.free
    return bool(
        task.still_points.keys() & {first, last}
        or free.optimal_knots
        or free.duration[first:last].any()
        or any(kind != "given" for kind in free.speed[first : last + 1])
    )


def timing_problem(
    task: FreeTask, segment: Segment, objective: Objective, total: float | None = None
) -> TimingProblem:
    """What is known of a segment, and what is to be chosen.

    Args:
        task: The task.
        segment: The segment.
        objective: What is minimised.
        total: How long the segment is to last [s], or `None`.

    Raises:
        InputError: A joint that moves has neither a limit of acceleration nor one of effort.
    """
    free, space, waypoints = task.free, task.space, task.waypoints
    rows = segment.rows
    inner = slice(segment.waypoints[0], segment.waypoints[-1])
    velocity = waypoints.velocity[rows].copy()
    kinds = [free.speed[i] for i in segment.waypoints]
    velocity[[kind == "free" for kind in kinds]] = np.nan
    duration = np.where(free.duration[inner], np.nan, np.diff(waypoints.time[rows]))
    limits = TimingLimits(
        space.limits["velocity"],
        space.limits["acceleration"],
        jerk_limits(space),
        space.limits["effort"] if space.robot is not None else None,  # type: ignore[arg-type]
        space.lower_position_limit,
        space.upper_position_limit,
        task.scenario.motion_limits.tool_speed or np.inf,
        task.scenario.margin,
    )
    if np.isnan(duration).any() and total is None:
        _check_limits(task.scenario, space, limits)
    effort = bool(np.isfinite(limits.effort).any() or objective.effort)
    moved_by_force = effort or np.isfinite(limits.tool_speed)
    return TimingProblem(
        space.joint_names,
        waypoints.position[rows],
        velocity,
        limits,
        names=tuple(waypoints.names[row] for row in rows),
        joint_units=space.joint_units,
        along=np.array([kind == "along" for kind in kinds]),
        most=free.at_most[list(segment.waypoints)],
        acceleration=_accelerations(task, segment),
        duration=duration,
        at_least=free.at_least[inner],
        total=total,
        objective=objective,
        dynamics=task.dynamics(segment.waypoints[0]) if moved_by_force else None,
        units=task.scenario.units,
    )


def jerk_limits(space: JointSpace) -> FloatArray:
    """Limits of jerk; where there is none, what keeps changes of acceleration from being jumps."""
    jerk, acceleration = space.limits["jerk"], space.limits["acceleration"]
    ramped = np.where(np.isfinite(acceleration), acceleration / SHORTEST_RAMP, GREATEST_JERK)
    return np.where(np.isfinite(jerk), jerk, np.minimum(ramped, GREATEST_JERK))


def assumed_jerk(space: JointSpace) -> dict[str, float]:
    """Bounds of jerk of the joints that have no limit of it [rad/s³ or m/s³]."""
    given = np.isfinite(space.limits["jerk"])
    bounds = zip(space.joint_names, given, jerk_limits(space), strict=True)
    return {name: float(bound) for name, has, bound in bounds if not has}


def _accelerations(task: FreeTask, segment: Segment) -> FloatArray:
    """Accelerations at the ends of a segment.

    At the ends of the motion they are as asked for; else none where times are chosen, and chosen
    where only knots are. Where a way begins or ends there is none.
    """
    space, waypoints, rows = task.space, task.waypoints, segment.rows
    still = task.still_points
    known = np.full((len(rows), len(space.joint_names)), np.nan)
    ends = space.end_acceleration
    for place, row, last in ((0, rows[0], 0), (-1, rows[-1], len(waypoints.time) - 1)):
        given = waypoints.acceleration
        if given is not None and not np.isnan(given[row]).any():
            known[place] = given[row]
        elif row == last and ends is not None:
            known[place] = ends[place]
        elif (row == last and task.free.duration.any()) or segment.waypoints[place] in still:
            known[place] = 0.0
    return known


def _check_limits(scenario: Scenario, space: JointSpace, limits: TimingLimits) -> None:
    """Refuse a joint that could move as fast as one likes."""
    bounded = np.isfinite(limits.acceleration)
    if space.robot is not None:
        bounded |= np.isfinite(limits.effort)
    loose = [name for name, fine in zip(space.joint_names, bounded, strict=True) if not fine]
    if not loose:
        return
    example = ", ".join(
        f"{name}: {10.0 if unit == 'rad' else 2.0:g}"
        for name, unit in zip(space.joint_names, space.joint_units, strict=True)
        if name in loose
    )
    shown = (scenario.units.shown(1.0, f"{unit}/s²")[1] for unit in space.joint_units)
    units = " or ".join(dict.fromkeys(shown))
    with scenario.error_context("limits"):
        raise InputError(
            f"times are chosen, but nothing bounds the acceleration of {', '.join(loose)}: "
            + (
                "neither a limit of acceleration nor one of torque is known"
                if space.robot is not None
                else "no limit of acceleration is given"
            )
            + f"; accepted: acceleration: {{{example}}}, with values for this robot "
            f"[{units}]"
        )
