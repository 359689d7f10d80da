"""Plans of a motion that is executed at another speed, or stopped."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.retiming import (
    find_first_rest,
    invert_clock,
    stop_joints,
    stop_on_path,
)
from knotwork.curves.trajectory import Segment
from knotwork.curves.trajectory.motion_events import signals_on_at
from knotwork.errors import InputError
from knotwork.files.documents import Document, apply_edits
from knotwork.planning.replanning import on_moving_frames, scene_from
from knotwork.planning.speed_override import PATH_TOLERANCE, SAME_WAYPOINT_TIME, change_speed
from knotwork.task import EndAcceleration, JointWaypoint, Task
from knotwork.task.scenario import Scenario, resolve_task
from knotwork.task.scenario.event_reader import action_of, segments
from knotwork.task.scenario.joint_space import by_joint, joint_space
from knotwork.task.scenario.waypoint_reader import START
from knotwork.task.si_units import si_factors
from knotwork.task.task_source import moved_paths
from knotwork.verification import Finding, Motion, check
from knotwork.verification.checked_motion import Execution
from knotwork.verification.path_checks import check_path_geometry
from knotwork.verification.waypoint_checks import check_tool_at_arrivals
from knotwork.waypoints import JointWaypoints

if TYPE_CHECKING:
    from knotwork.planning import Plan

PLANNING_KEYS = (
    *("start", "near", "branch", "times", "ways", "duration", "objective", "chosen", "knots"),
    *("planner", "planner_options", "path"),
)
"""Keys of a task that only planning needs; an executed motion is given."""


class _ExecutedMotion(NamedTuple):
    """A planned motion executed with another clock, or left early by a stop.

    Attributes:
        planned: The plan.
        motion: The executed motion of the joints.
        clock: Time of the planned motion over that of the executed one; `None` if it leaves the
            path.
        span: Time interval of the planned motion that is executed [s].
        ends: Names of the ends of the executed motion, where the task has no waypoint.
    """

    planned: Plan
    motion: PiecewisePolynomial
    clock: PiecewisePolynomial | None
    span: tuple[float, float]
    ends: tuple[str, str]


class _ReachedWaypoint(NamedTuple):
    """A waypoint that an executed motion reaches, or one of its ends.

    Attributes:
        time: Time in this motion [s].
        name: Its name.
        waypoint: Index in the scenario; -1 for an end of the motion between waypoints.
    """

    time: float
    name: str
    waypoint: int = -1


def scaled_plan(planned: Plan, profile: Mapping[float, float]) -> Plan:
    """Execute a plan at another speed: see `Plan.scaled`."""
    scenario, space, trajectory = planned.scenario, planned.space, planned.trajectory
    moving = on_moving_frames(scenario.given)
    if moving:
        raise scenario.places.error(
            ("waypoints", moving[0]), "is in a moving frame, which keeps its own speed"
        )
    limits = space.limits["acceleration"], space.limits["jerk"]
    motion, clock, known = change_speed(profile, trajectory, scenario.times, limits)
    span = trajectory.start_time, float(clock(clock.x[-1]))
    return _checked(_ExecutedMotion(planned, motion, clock, span, (START, "end")), known)


def stopped_plan(planned: Plan, at: float, *, on_path: bool) -> Plan:
    """Stop a plan: see `Plan.stop`."""
    scenario, space, trajectory = planned.scenario, planned.space, planned.trajectory
    q, v, a = (trajectory(at, nu) for nu in range(3))
    at_rest = InputError(f"{scenario.name}: the motion is at rest at {at:g} s; it can't be stopped")
    if find_first_rest(trajectory.polynomial, at) == at:
        raise at_rest
    for kind in ("acceleration",) if on_path else ("acceleration", "jerk"):
        unlimited = np.flatnonzero(~np.isfinite(space.limits[kind]))
        if unlimited.size:
            raise InputError(
                f"{scenario.name}: joint {space.joint_names[unlimited[0]]!r} has no {kind} "
                f"limit, so the fastest stop is undefined; accepted: `limits: {{{kind}: …}}`"
            )
    limits = space.limits["acceleration"], space.limits["jerk"]
    ends = f"stop from {at:g} s", "stopped"
    if not on_path:
        motion = stop_joints(q, v, a, *limits)
        if motion is None:
            raise at_rest
        return _checked(_ExecutedMotion(planned, motion, None, (at, at), ends))
    stop = stop_on_path(trajectory.polynomial, at, *limits, PATH_TOLERANCE)
    if stop is None:
        raise InputError(
            f"{scenario.name}: no stop on the path from {at:g} s keeps the limits "
            "before the motion ends; accepted: an earlier time, or on_path=False"
        )
    clock, motion = stop
    span = at, float(clock(clock.x[-1]))
    return _checked(_ExecutedMotion(planned, motion, clock, span, ends))


def _checked(executed: _ExecutedMotion, known: Sequence[Finding] = ()) -> Plan:
    """The plan of an executed motion through the waypoints that it reaches, checked.

    Args:
        executed: The motion.
        known: Findings to report as well.
    """
    planned, motion, clock = executed.planned, executed.motion, executed.clock
    arrivals = _arrivals(executed)
    scenario = resolve_task(_task_of(executed, arrivals))
    space, times = joint_space(scenario), np.array([arrival.time for arrival in arrivals])
    trajectory = replace(
        planned.trajectory,
        polynomial=motion,
        waypoint_times=times,
        events=tuple(event.event for event in scenario.events),
        loads=space.carrying.loads(float(motion.x[0])) if space.carrying else (),
        segments=segments(scenario)
        if clock is None
        else _segments(planned.trajectory.segments, clock),
    )
    geometry = _geometry(executed, arrivals, Motion(trajectory, planned.space))
    waypoints = JointWaypoints(
        space.joint_names, times, motion(times), motion(times, 1), joint_units=space.joint_units
    )
    report = check(trajectory, scenario, space=space, known=[*known, *geometry])
    return replace(
        planned,
        scenario=scenario,
        space=space,
        joint_waypoints=waypoints,
        trajectory=trajectory,
        report=report,
        unsupported_options=(),
        solution=None,
        chosen=None,
        tried_sequences=1,
    )


def _geometry(
    executed: _ExecutedMotion, arrivals: Sequence[_ReachedWaypoint], motion: Motion
) -> list[Finding]:
    """Findings on the plan's tool paths and poses, where the executed motion passes them."""
    planned, clock = executed.planned, executed.clock
    if clock is None:
        if not planned.scenario.paths:
            return []
        fact = "the motion leaves the tool paths of the task, which are not checked"
        return [
            Finding(
                group="Warnings",
                subject="motion",
                name="",
                quantity="path",
                verdict="warning",
                fact=fact,
            )
        ]
    times = {arrival.waypoint: arrival.time for arrival in arrivals if arrival.waypoint >= 0}
    execution = Execution(clock, times, executed.ends)
    moving = on_moving_frames(planned.scenario.given)
    fixed = {i: t for i, t in times.items() if planned.scenario.task_index[i] not in moving}
    at_rest = replace(execution, arrivals=fixed)
    return [
        *check_tool_at_arrivals(motion, planned.scenario, planned.space, at_rest),
        *check_path_geometry(motion, planned.scenario, planned.space, execution),
    ]


def _arrivals(executed: _ExecutedMotion) -> list[_ReachedWaypoint]:
    """The ends of an executed motion and the waypoints that it passes, in order of time."""
    start, end = executed.motion.x[[0, -1]].tolist()
    low, high = executed.span
    passed = [
        i
        for i, waypoint in enumerate(executed.planned.scenario.waypoints)
        if low - SAME_WAYPOINT_TIME <= waypoint.time <= high + SAME_WAYPOINT_TIME
    ]
    planned = executed.planned.scenario.times[passed]
    actual = np.full(len(planned), start)
    if executed.clock is not None:
        actual = invert_clock(executed.clock, planned)
    arrivals = []
    for i, time in zip(passed, actual.tolist(), strict=True):
        at = next((t for t in (start, end) if abs(t - time) < SAME_WAYPOINT_TIME), time)
        arrivals.append(_ReachedWaypoint(at, executed.planned.scenario.waypoints[i].name, i))
    if not arrivals or arrivals[0].time != start:
        arrivals.insert(0, _ReachedWaypoint(start, executed.ends[0]))
    if arrivals[-1].time != end:
        arrivals.append(_ReachedWaypoint(end, executed.ends[1]))
    return arrivals


def _task_of(executed: _ExecutedMotion, arrivals: Sequence[_ReachedWaypoint]) -> Task:
    """A task of which the executed motion is a solution: its states at the reached waypoints."""
    scenario, space = executed.planned.scenario, executed.planned.space
    motion = executed.motion
    names = arrivals[0].name, arrivals[-1].name
    task = scene_from(scenario, space.robot, executed.planned.trajectory, executed.span, names)
    units = si_factors(scenario.given.units)
    waits = {
        k: second.time - first.time
        for k, (first, second) in enumerate(pairwise(arrivals))
        if min(first.waypoint, second.waypoint) >= 0
        and scenario.task_index[first.waypoint] == scenario.task_index[second.waypoint]
    }
    placed = {k: arrival for k, arrival in enumerate(arrivals) if k - 1 not in waits}
    actions = _actions(executed, list(placed.values()))
    waypoints = []
    for (k, arrival), switched in zip(placed.items(), actions, strict=True):
        values: dict[str, Any] = {"velocity": by_joint(space, motion(arrival.time, 1), *units)}
        if k in waits:
            values = {"wait": waits[k]}
        if switched:
            values["do"] = switched
        joints = by_joint(space, motion(arrival.time), *units)
        waypoints.append(
            JointWaypoint(time=arrival.time, name=arrival.name, joints=joints, **values)
        )
    first, last = (by_joint(space, motion(t, 2), *units) for t in motion.x[[0, -1]].tolist())
    return _without_file(task, scenario).replace(
        **dict.fromkeys(PLANNING_KEYS),
        waypoints=waypoints,
        end_acceleration=EndAcceleration(start=first, end=last),
    )


def _actions(
    executed: _ExecutedMotion, placed: Sequence[_ReachedWaypoint]
) -> list[list[dict[str, Any]]]:
    """Actions at each waypoint. Signals that are already on are at the first one."""
    outputs, events = executed.planned.scenario.task.outputs, executed.planned.trajectory.events
    clock, start = executed.clock, executed.span[0]
    begin = start + SAME_WAYPOINT_TIME if clock is None else start - SAME_WAYPOINT_TIME
    actions: list[list[dict[str, Any]]] = [[] for _ in placed]
    actions[0] += [action_of(event, outputs) for event in signals_on_at(events, begin)]
    if clock is None:
        return actions
    names = [arrival.name for arrival in placed]
    end = float(clock(clock.x[-1])) + SAME_WAYPOINT_TIME
    for event in (event for event in events if begin < event.time <= end):
        time = float(invert_clock(clock, np.array([event.time]))[0])
        if event.waypoint in names:
            k = names.index(event.waypoint)
        else:
            k = sum(arrival.time <= time + SAME_WAYPOINT_TIME for arrival in placed) - 1
        action = action_of(event, outputs)
        delay = time - placed[k].time
        if abs(delay) > SAME_WAYPOINT_TIME:
            action["after" if delay > 0.0 else "before"] = abs(delay)
        actions[k].append(action)
    return actions


def _segments(planned: Sequence[Segment], clock: PiecewisePolynomial) -> tuple[Segment, ...]:
    """Segments of a motion with another clock."""
    first, last = clock(clock.x[[0, -1]])
    executed = []
    for segment in planned:
        ends = np.array([max(segment.start, first), min(segment.end, last)])
        if ends[1] - ends[0] > SAME_WAYPOINT_TIME:
            start, end = invert_clock(clock, ends).tolist()
            executed.append(replace(segment, start=start, end=end))
    return tuple(executed)


def _without_file(task: Task, scenario: Scenario) -> Task:
    """A task that does not depend on its file: it has a name and absolute paths."""
    folder = Path.cwd() if scenario.source is None else scenario.source.parent
    data = task.to_dict() | {"name": scenario.name}
    return Task(**apply_edits(Document(data), moved_paths(data, folder.resolve(), None)).data)
