"""Plans of a motion that is executed at another speed, or stopped."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.monotone import first_times
from knotwork.curves.retiming import find_first_rest, stop_joints, stop_on_path
from knotwork.curves.trajectory import JointTrajectory, Segment
from knotwork.curves.trajectory.motion_events import signals_on_at
from knotwork.errors import InputError
from knotwork.planning.replanning import on_moving_frames, scene_from
from knotwork.planning.speed_override import PATH_TOLERANCE, SAME_WAYPOINT_TIME, change_speed
from knotwork.task import EndAcceleration, JointWaypoint, Task
from knotwork.task.scenario import Scenario, resolve_task
from knotwork.task.scenario.event_reader import action_of, segments
from knotwork.task.scenario.joint_space import JointSpace, by_joint, joint_space
from knotwork.task.scenario.waypoint_reader import START
from knotwork.task.task_source import with_moved_paths
from knotwork.verification import Finding, Motion, check
from knotwork.verification.motion import Execution
from knotwork.verification.path_checks import check_path_geometry
from knotwork.verification.report import CheckedMotion
from knotwork.verification.waypoint_checks import check_tool_at_arrivals
from knotwork.waypoints import JointWaypoints

PLANNING_KEYS = (
    *("start", "near", "branch", "times", "ways", "duration", "objective", "chosen", "knots"),
    *("planner", "planner_options", "path"),
)
"""Keys of a task that only planning needs; an executed motion is given."""


class _ExecutedMotion(NamedTuple):
    """A planned motion executed with another clock, or left early by a stop.

    Attributes:
        scenario: The task of the plan.
        space: Its joints.
        planned: The planned motion.
        motion: The executed motion of the joints.
        clock: Time of the planned motion over that of the executed one; constant if it leaves the
            path.
        ends: Names of the ends of the executed motion, where the task has no waypoint.
    """

    scenario: Scenario
    space: JointSpace
    planned: JointTrajectory
    motion: PiecewisePolynomial
    clock: PiecewisePolynomial
    ends: tuple[str, str]

    @property
    def span(self) -> tuple[float, float]:
        """Time interval of the planned motion that is executed [s]."""
        start, end = self.clock(self.clock.x[[0, -1]]).tolist()
        return start, end

    @property
    def is_on_path(self) -> bool:
        """Whether it follows the planned motion."""
        start, end = self.span
        return start < end


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


def scaled_motion(plan: CheckedMotion, profile: Mapping[float, float]) -> CheckedMotion:
    """Execute a planned motion at another speed: see `Plan.scaled`."""
    scenario, space, planned = plan.scenario, plan.space, plan.trajectory
    moving = on_moving_frames(scenario.given)
    if moving:
        raise scenario.locations.error(
            ("waypoints", moving[0]), "is in a moving frame, which keeps its own speed"
        )
    limits = space.limits["acceleration"], space.limits["jerk"]
    motion, clock, warnings = change_speed(profile, planned, scenario.times, limits)
    return _checked(
        _ExecutedMotion(scenario, space, planned, motion, clock, (START, "end")), warnings
    )


def stopped_motion(plan: CheckedMotion, at: float, *, on_path: bool) -> CheckedMotion:
    """Stop a planned motion: see `Plan.stop`."""
    scenario, space, planned = plan.scenario, plan.space, plan.trajectory
    q, v, a = (planned(at, nu) for nu in range(3))
    at_rest = InputError(f"{scenario.name}: the motion is at rest at {at:g} s; it can't be stopped")
    if find_first_rest(planned.polynomial, at) == at:
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
        clock = PiecewisePolynomial([[at]], motion.x[[0, -1]])
        return _checked(_ExecutedMotion(scenario, space, planned, motion, clock, ends))
    stop = stop_on_path(planned.polynomial, at, *limits, PATH_TOLERANCE)
    if stop is None:
        raise InputError(
            f"{scenario.name}: no stop on the path from {at:g} s keeps the limits "
            "before the motion ends; accepted: an earlier time, or on_path=False"
        )
    clock, motion = stop
    return _checked(_ExecutedMotion(scenario, space, planned, motion, clock, ends))


def _checked(executed: _ExecutedMotion, warnings: Sequence[Finding] = ()) -> CheckedMotion:
    """An executed motion with a task of the waypoints that it reaches, checked.

    Args:
        executed: The motion.
        warnings: Findings to report as well.
    """
    planned, motion, clock = executed.planned, executed.motion, executed.clock
    arrivals = _arrivals(executed)
    scenario = resolve_task(_task_of(executed, arrivals))
    space, times = joint_space(scenario), np.array([arrival.time for arrival in arrivals])
    trajectory = replace(
        planned,
        polynomial=motion,
        waypoint_times=times,
        events=tuple(event.event for event in scenario.events),
        loads=space.carrying.loads(float(motion.x[0])) if space.carrying else (),
        segments=_segments(planned.segments, clock) or segments(scenario),
    )
    geometry = _geometry(executed, arrivals, Motion(trajectory, executed.space))
    waypoints = JointWaypoints(
        space.joint_names, times, motion(times), motion(times, 1), joint_units=space.joint_units
    )
    report = check(trajectory, scenario, space=space, known=[*warnings, *geometry])
    return CheckedMotion(scenario, space, waypoints, trajectory, report)


def _geometry(
    executed: _ExecutedMotion, arrivals: Sequence[_ReachedWaypoint], motion: Motion
) -> list[Finding]:
    """Findings on the plan's tool paths and poses, where the executed motion passes them."""
    planned = executed.scenario
    if not executed.is_on_path:
        fact = "the motion leaves the tool paths of the task, which are not checked"
        warning = Finding.of_motion("Warnings", "path", fact, "warning")
        return [warning] if planned.paths else []
    times = {arrival.waypoint: arrival.time for arrival in arrivals if arrival.waypoint >= 0}
    execution = Execution(executed.clock, times, executed.ends)
    moving = on_moving_frames(planned.given)
    fixed = {
        waypoint: time
        for waypoint, time in times.items()
        if planned.task_index[waypoint] not in moving
    }
    in_fixed_frames = replace(execution, arrivals=fixed)
    return [
        *check_tool_at_arrivals(motion, planned, executed.space, in_fixed_frames),
        *check_path_geometry(motion, planned, executed.space, execution),
    ]


def _arrivals(executed: _ExecutedMotion) -> list[_ReachedWaypoint]:
    """The ends of an executed motion and the waypoints that it passes, in order of time."""
    scenario = executed.scenario
    start, end = executed.motion.x[[0, -1]].tolist()
    low, high = executed.span
    is_passed = (low - SAME_WAYPOINT_TIME <= scenario.times) & (
        scenario.times <= high + SAME_WAYPOINT_TIME
    )
    passed = np.flatnonzero(is_passed)
    times = np.full(len(passed), start)
    if executed.is_on_path:
        times = first_times(executed.clock, scenario.times[passed])
    arrivals = []
    for waypoint, time in zip(passed.tolist(), times.tolist(), strict=True):
        at = next((t for t in (start, end) if abs(t - time) < SAME_WAYPOINT_TIME), time)
        arrivals.append(_ReachedWaypoint(at, scenario.waypoints[waypoint].name, waypoint))
    if not arrivals or arrivals[0].time != start:
        arrivals.insert(0, _ReachedWaypoint(start, executed.ends[0]))
    if arrivals[-1].time != end:
        arrivals.append(_ReachedWaypoint(end, executed.ends[1]))
    return arrivals


def _task_of(executed: _ExecutedMotion, arrivals: Sequence[_ReachedWaypoint]) -> Task:
    """A task of which the executed motion is a solution: its states at the reached waypoints."""
    scenario, space, motion = executed.scenario, executed.space, executed.motion
    names = arrivals[0].name, arrivals[-1].name
    task = scene_from(scenario, space.robot, executed.planned, executed.span, names)
    units = scenario.given.units.in_si
    stays = [list(stay) for _, stay in groupby(arrivals, partial(_task_waypoint, scenario))]
    waypoints = []
    for stay, switched in zip(stays, _actions(executed, [stay[0] for stay in stays]), strict=True):
        arrival, leave = stay[0], stay[-1]
        values: dict[str, Any] = {"velocity": by_joint(space, motion(arrival.time, 1), *units)}
        if leave is not arrival:
            values = {"wait": leave.time - arrival.time}
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


def _task_waypoint(scenario: Scenario, reached: _ReachedWaypoint) -> int | str:
    """Index in the task, which is equal at both ends of a wait; between waypoints the name."""
    return scenario.task_index[reached.waypoint] if reached.waypoint >= 0 else reached.name


def _actions(
    executed: _ExecutedMotion, arrivals: Sequence[_ReachedWaypoint]
) -> list[list[dict[str, Any]]]:
    """Actions at each waypoint. Signals that are already on are at the first one."""
    outputs, events = executed.scenario.task.outputs, executed.planned.events
    start, end = executed.span
    begin = start + (-SAME_WAYPOINT_TIME if executed.is_on_path else SAME_WAYPOINT_TIME)
    actions: list[list[dict[str, Any]]] = [[] for _ in arrivals]
    actions[0] += [action_of(event, outputs) for event in signals_on_at(events, begin)]
    names = [arrival.name for arrival in arrivals]
    for event in (e for e in events if begin < e.time <= end + SAME_WAYPOINT_TIME):
        time = float(first_times(executed.clock, np.array([event.time]))[0])
        if event.waypoint in names:
            k = names.index(event.waypoint)
        else:
            k = sum(arrival.time <= time + SAME_WAYPOINT_TIME for arrival in arrivals) - 1
        action = action_of(event, outputs)
        delay = time - arrivals[k].time
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
            start, end = first_times(clock, ends).tolist()
            executed.append(replace(segment, start=start, end=end))
    return tuple(executed)


def _without_file(task: Task, scenario: Scenario) -> Task:
    """A task that does not depend on its file: it has a name and absolute paths."""
    folder = Path.cwd() if scenario.source is None else scenario.source.parent
    return Task(**with_moved_paths(task.to_dict() | {"name": scenario.name}, folder, None))
