"""Segments: consecutive waypoints with unknowns between them, split where the state is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.errors import InputError
from knotwork.planning.choosing.timing_task import TimingTask
from knotwork.planning.timing import Objective, TimingLimits, TimingProblem
from knotwork.task import ClearWay
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.joint_space import JointSpace
from knotwork.waypoints import FloatArray, IndexArray

MIN_RAMP_TIME = 0.01
"""Minimum time from zero to the maximum acceleration if there is no jerk limit [s]."""

MAX_JERK = 2e4
"""Largest jerk if there are no limits of jerk and acceleration [rad/s³ or m/s³]."""


@dataclass(frozen=True, eq=False)
class TimingSegment:
    """Consecutive waypoints of a scenario, without a tool path or wait between them.

    Attributes:
        waypoints: Their indices in the scenario.
        rows: Their rows in its joint waypoints, shape (n,).
        way: Options of a collision-free motion, or `None`.
    """

    waypoints: range
    rows: IndexArray
    way: ClearWay | None = None

    def continues_into(self, following: TimingSegment) -> bool:
        """Whether it is a collision-free motion that ends where another one begins."""
        return self.way is not None and self.waypoints[-1] == following.waypoints[0]


def find_segments(task: TimingTask) -> list[TimingSegment]:
    """The segments of a task with unknowns, in order of time.

    Raises:
        InputError: The time between two equal stops is to be chosen, or the velocity at one of the
            points with zero acceleration.
    """
    scenario, unknowns = task.scenario, task.unknowns
    closed = set(task.space.waits)
    for i in closed:
        if unknowns.duration[i]:
            names = (scenario.waypoints[k].name for k in (i, i + 1))
            error = InputError(
                f"{' and '.join(map(repr, names))} are the same stop, so the minimum time between "
                "them is zero; accepted: wait: seconds at the first of them, or after: seconds"
            )
            raise task.locate(error, i + 1)
    ends = task.zero_acceleration_points
    for i, why in ends.items():
        if unknowns.speed[i] != "given":
            accepted = "stop, or a velocity"
            if i in unknowns.ways and i + 1 in unknowns.ways:
                accepted += ", or velocity: free between ways of equal options without times"
            message = f"the velocity is chosen, but {why} here; accepted: {accepted}"
            raise task.locate(InputError(message), i)
    closed.update(i for path in scenario.paths for i in range(path.first, path.last))
    last = len(scenario.waypoints) - 1
    segments: list[TimingSegment] = []
    first = 0
    for i in range(last + 1):
        if i < last and i not in closed and i not in ends:
            continue
        if i > first and _has_unknowns(task, first, i):
            rows = task.rows[first : i + 1]
            segments.append(TimingSegment(range(first, i + 1), rows, unknowns.ways.get(i)))
        first = i + 1 if i in closed else i
    return segments


def _has_unknowns(task: TimingTask, first: int, last: int) -> bool:
    """Whether anything is chosen between two waypoints."""
    unknowns = task.unknowns
    return bool(
        task.zero_acceleration_points.keys() & {first, last}
        or unknowns.optimal_knots
        or unknowns.duration[first:last].any()
        or any(kind != "given" for kind in unknowns.speed[first : last + 1])
    )


def timing_problem(
    task: TimingTask, segment: TimingSegment, objective: Objective, total: float | None = None
) -> TimingProblem:
    """Known and unknown values of a segment.

    Args:
        task: The task.
        segment: The segment.
        objective: Objective to minimise.
        total: Duration of the segment [s], or `None`.

    Raises:
        InputError: A moving joint has neither an acceleration nor an effort limit.
    """
    unknowns, space, waypoints = task.unknowns, task.space, task.waypoints
    rows = segment.rows
    inner = slice(segment.waypoints[0], segment.waypoints[-1])
    velocity = waypoints.velocity[rows].copy()
    kinds = [unknowns.speed[i] for i in segment.waypoints]
    velocity[[kind == "free" for kind in kinds]] = np.nan
    limits = TimingLimits(
        space.limits["velocity"],
        space.limits["acceleration"],
        jerk_limits(space),
        space.limits["effort"] if space.robot is not None else None,  # type: ignore[arg-type]
        space.lower_position_limit,
        space.upper_position_limit,
        task.scenario.motion_limits.tool_speed or np.inf,
        task.scenario.task.limits.margin,
    )
    duration = task.scenario.durations[inner]
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
        max_factor=unknowns.at_most[list(segment.waypoints)],
        acceleration=_accelerations(task, segment),
        duration=duration,
        at_least=unknowns.at_least[inner],
        total=total,
        objective=objective,
        dynamics=task.dynamics(segment.waypoints[0]) if moved_by_force else None,
        units=task.scenario.units,
    )


def jerk_limits(space: JointSpace) -> FloatArray:
    """Jerk limits; without one, a bound that avoids jumps of the acceleration."""
    jerk, acceleration = space.limits["jerk"], space.limits["acceleration"]
    ramped = np.where(np.isfinite(acceleration), acceleration / MIN_RAMP_TIME, MAX_JERK)
    return np.where(np.isfinite(jerk), jerk, np.minimum(ramped, MAX_JERK))


def assumed_jerk(space: JointSpace) -> dict[str, float]:
    """Jerk bounds of the joints without a limit [rad/s³ or m/s³]."""
    has_limit = np.isfinite(space.limits["jerk"])
    bounds = zip(space.joint_names, has_limit, jerk_limits(space), strict=True)
    return {name: float(bound) for name, has, bound in bounds if not has}


def _accelerations(task: TimingTask, segment: TimingSegment) -> FloatArray:
    """Accelerations at the ends of a segment.

    At the ends of the motion they are as given. Otherwise they are zero if times are chosen, and
    free if only knots are chosen. They are zero where a collision-free motion begins or ends.
    """
    space, waypoints, rows = task.space, task.waypoints, segment.rows
    known = np.full((len(rows), len(space.joint_names)), np.nan)
    for end, last in ((0, 0), (-1, len(waypoints.time) - 1)):
        row, accelerations = rows[end], waypoints.acceleration
        if accelerations is not None and not np.isnan(accelerations[row]).any():
            known[end] = accelerations[row]
        elif row == last and space.end_acceleration is not None:
            known[end] = space.end_acceleration[end]
        elif segment.waypoints[end] in task.zero_acceleration_points or (
            row == last and task.unknowns.duration.any()
        ):
            known[end] = 0.0
    return known


def _check_limits(scenario: Scenario, space: JointSpace, limits: TimingLimits) -> None:
    """Refuse a joint with unbounded acceleration."""
    bounded = np.isfinite(limits.acceleration)
    if space.robot is not None:
        bounded |= np.isfinite(limits.effort)
    loose = [name for name, fine in zip(space.joint_names, bounded, strict=True) if not fine]
    if not loose:
        return
    reason = (
        "neither a limit of acceleration nor one of torque is known"
        if space.robot is not None
        else "no acceleration limit is given"
    )
    with scenario.error_context("limits"):
        raise InputError(
            f"times are chosen, but no limit bounds the acceleration of {', '.join(loose)}: "
            f"{reason}; accepted: acceleration: {{joint: value, …}}, with values for this robot"
        )
