"""Plans of a motion that is executed at another speed, or stopped."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.monotone import first_times
from knotwork.curves.retiming import find_first_rest, stop_joints, stop_on_path
from knotwork.curves.trajectory import JointTrajectory, Segment
from knotwork.curves.trajectory.motion_events import TIME_TOLERANCE, signals_on_at
from knotwork.errors import InputError
from knotwork.errors.arguments import require_flag, require_number
from knotwork.files.documents.values import marked
from knotwork.planning.replanning import (
    in_moving_frames,
    task_with_scene_from,
    waypoint_at_state,
)
from knotwork.planning.speed_override import change_speed
from knotwork.task import Task
from knotwork.task.scenario import JointTarget, Scenario, resolve_task
from knotwork.task.scenario.event_reader import action_of
from knotwork.task.scenario.motion_segments import motion_segments
from knotwork.task.scenario.scenario import ScenarioPath, ScenarioWaypoint
from knotwork.task.scenario.scenario_joints import read_scenario_joints, to_file_units
from knotwork.task.scenario.unknowns_reader import ends_wait
from knotwork.task.scenario.waypoint_reader import START
from knotwork.task.task_source import with_moved_paths
from knotwork.verification import Finding, Motion, check
from knotwork.verification.finding import Group, Topic
from knotwork.verification.path_checks import check_tool_paths
from knotwork.verification.report import CheckedMotion
from knotwork.verification.waypoint_checks import check_tool_at_waypoints
from knotwork.waypoints import CartesianWaypoint, JointWaypoints

MotionT = TypeVar("MotionT", bound=CheckedMotion)


@dataclass(frozen=True, eq=False)
class Execution:
    """A planned motion executed with another clock, or left early by a stop.

    Attributes:
        trajectory: The executed motion.
        clock: Time in the planned motion as a function of time in the executed one; constant if the
            executed motion leaves the planned path.
        kept_scenario: The planned scenario as far as the executed motion keeps it, at the times
            and speeds of that motion. Its waypoints are the ends of the motion and those that it
            passes.
    """

    trajectory: JointTrajectory
    clock: PiecewisePolynomial
    kept_scenario: Scenario

    @property
    def span(self) -> tuple[float, float]:
        """The interval of the planned motion that is executed [s]; empty off the planned path."""
        first, last = self.clock(self.clock.x[[0, -1]]).tolist()
        return first, last


def scaled_motion(plan: MotionT, profile: Mapping[float, float]) -> MotionT:
    """A plan at another speed: see `Plan.scaled`."""
    scenario, limits = plan.scenario, plan.joints.limits
    moving = in_moving_frames(scenario.task)
    if moving:
        raise scenario.locations.error(
            ("waypoints", moving[0]),
            "is in a moving frame, which keeps its own speed",
            "tasks without such poses, or plan.stop",
        )
    curve, clock, warnings = change_speed(profile, plan.trajectory, scenario.times, limits)
    return _checked_plan(plan, _execution_of(plan, curve, clock, (START, "end")), warnings)


def stopped_motion(plan: MotionT, at: float, *, on_path: bool) -> MotionT:
    """A plan that stops: see `Plan.stop`."""
    at = require_number(at, "at", "s")
    require_flag(on_path, "on_path")
    name, joints, planned = plan.scenario.name, plan.joints, plan.trajectory
    at_rest = f"{name}: the motion is at rest at {at:g} s; it can't be stopped"
    if find_first_rest(planned.polynomial, at) == at:
        raise InputError(at_rest)
    for kind in ("acceleration",) if on_path else ("acceleration", "jerk"):
        unlimited = np.flatnonzero(~np.isfinite(joints.limits[kind]))
        if unlimited.size:
            raise InputError(
                f"{name}: joint {joints.joint_names[unlimited[0]]!r} has no {kind} "
                f"limit, so the fastest stop is undefined; accepted: `limits: {{{kind}: …}}`"
            )
    warnings: list[Finding] = []
    if on_path:
        stop = stop_on_path(planned.polynomial, at, joints.limits)
        if stop is None:
            raise InputError(
                f"{name}: no stop on the path from {at:g} s keeps the limits "
                "before the motion ends; accepted: an earlier time, or on_path=False"
            )
        clock, curve = stop
    else:
        off_path = stop_joints(planned(at), planned(at, 1), planned(at, 2), joints.limits)
        if off_path is None:
            raise InputError(at_rest)
        curve, clock = off_path, PiecewisePolynomial([[at]], off_path.x[[0, -1]])
        if plan.scenario.paths:
            fact = "the motion leaves the tool paths of the task, which are not checked"
            warnings = [Topic(Group.WARNINGS).finding("path", fact, "warning")]
    ends = f"stop from {at:g} s", "stopped"
    return _checked_plan(plan, _execution_of(plan, curve, clock, ends), warnings)


def _execution_of(
    plan: CheckedMotion,
    curve: PiecewisePolynomial,
    clock: PiecewisePolynomial,
    ends: tuple[str, str],
) -> Execution:
    """An executed motion, with the part of the planned scenario that it keeps.

    Waypoints have no pose off the planned path, and none in moving frames, which keep their clock.

    Args:
        plan: The planned motion.
        curve: The executed motion of the joints.
        clock: Time of the planned motion over that of the executed one.
        ends: Names of its ends, where the task has no waypoint.
    """
    planned = plan.scenario
    start, end = curve.x[[0, -1]].tolist()
    first, last = clock(clock.x[[0, -1]])
    within = np.clip(planned.times, first, last)
    passes = np.abs(planned.times - within) <= TIME_TOLERANCE
    times = first_times(clock, within[passes])
    for limit in (start, end):
        times[np.abs(times - limit) < TIME_TOLERANCE] = limit
    on_path = first < last
    unposed = in_moving_frames(planned.task) if on_path else planned.task_index
    passed_indices = np.flatnonzero(passes).tolist()
    task_index = [planned.task_index[i] for i in passed_indices]
    waypoints: list[ScenarioWaypoint] = []
    for i, time in zip(passed_indices, times.tolist(), strict=True):
        waypoint = planned.waypoints[i]
        if isinstance(waypoint, CartesianWaypoint) and planned.task_index[i] not in unposed:
            twist = waypoint.twist * float(clock(time, 1))
            waypoints.append(replace(waypoint, time=time, twist=twist))
        else:
            waypoints.append(JointTarget(waypoint.name, time))
    intervals = passed_indices
    if not waypoints or waypoints[0].time > start:
        waypoints.insert(0, _end(start, ends[0], waypoints))
        intervals = [bisect_right(planned.times.tolist(), first) - 1, *passed_indices]
        task_index.insert(0, -1)
    if waypoints[-1].time < end:
        waypoints.append(_end(end, ends[1], waypoints))
        task_index.append(len(planned.task.waypoints))
    kept_scenario = replace(
        planned,
        waypoints=tuple(waypoints),
        task_index=tuple(task_index),
        paths=tuple(_passed_paths(planned, waypoints, intervals, clock)) if on_path else (),
    )
    trajectory = replace(plan.trajectory, polynomial=curve, waypoint_times=kept_scenario.times)
    return Execution(trajectory, clock, kept_scenario)


def _end(time: float, name: str, waypoints: Sequence[ScenarioWaypoint]) -> JointTarget:
    """An end of an executed motion, with a name that no waypoint has."""
    while any(waypoint.name == name for waypoint in waypoints):
        name = f"{name} 2"
    return JointTarget(name, time)


def _passed_paths(
    planned: Scenario,
    waypoints: Sequence[ScenarioWaypoint],
    intervals: Sequence[int],
    clock: PiecewisePolynomial,
) -> Iterator[ScenarioPath]:
    """The executed parts of tool paths.

    Args:
        planned: The planned scenario.
        waypoints: Waypoints of the executed motion.
        intervals: Intervals of the planned scenario that are executed from each of them.
        clock: Time of the planned motion over that of the executed one.
    """
    for path in planned.paths:
        parts = [
            (k, replace(path.stretches[i - path.first], start=begin.time, end=end.time))
            for k, (i, (begin, end)) in enumerate(zip(intervals, pairwise(waypoints), strict=False))
            if path.first <= i < path.last
        ]
        if parts:
            stretches = tuple(stretch for _, stretch in parts)
            yield replace(path, first=parts[0][0], stretches=stretches, clock=clock)


def _checked_plan(plan: MotionT, executed: Execution, warnings: Sequence[Finding] = ()) -> MotionT:
    """Check an executed motion against a task of the waypoints that it reaches.

    Args:
        plan: The planned motion.
        executed: The executed motion.
        warnings: Findings to report as well.
    """
    kept = executed.kept_scenario
    scenario = resolve_task(_task_of(plan, executed))
    joints = read_scenario_joints(scenario)
    segments = _segments(plan.trajectory.segments, executed)
    trajectory = replace(
        executed.trajectory,
        events=tuple(event.event for event in scenario.events),
        loads=joints.loaded_robots.loads(executed.trajectory.start_time)
        if joints.loaded_robots
        else (),
        segments=segments or motion_segments(scenario),
    )
    motion = Motion(trajectory, plan.joints)
    known = [
        *warnings,
        *_misplaced_objects(plan.scenario, executed),
        *check_tool_at_waypoints(motion, kept, plan.joints),
        *check_tool_paths(motion, kept, plan.joints),
    ]
    q, v = (trajectory(kept.times, nu) for nu in range(2))
    waypoints = JointWaypoints(joints.joint_names, kept.times, q, v, joint_units=joints.joint_units)
    report = check(trajectory, scenario, joints=joints, known=known)
    return type(plan)(
        scenario=scenario,
        joints=joints,
        joint_waypoints=waypoints,
        trajectory=trajectory,
        report=report,
    )


def _misplaced_objects(scenario: Scenario, executed: Execution) -> Iterator[Finding]:
    """Warnings of objects whose frame is unknown, because the executed task has joint values."""
    inner = {waypoint.name for waypoint in executed.kept_scenario.waypoints[1:-1]}
    for held in scenario.scene.held:
        ends = ("before", held.taken_at), ("after", held.released_at)
        for (when, i), frame in zip(ends, held.end_frames, strict=True):
            name = scenario.waypoints[i].name
            if not frame.rests_on(scenario.pose_frame_link) and name in inner:
                fact = (
                    f"{when} {name!r}, {held.name!r} moves relative to the frame of the poses, but "
                    "is checked as fixed in it"
                )
                yield Topic(Group.WARNINGS).finding("held_object", fact, "warning")


def _task_of(plan: CheckedMotion, executed: Execution) -> Task:
    """A task of which the executed motion is a solution: its states at the reached waypoints.

    It does not depend on a file: it has a name and absolute paths.
    """
    scenario = plan.scenario
    trajectory = executed.trajectory
    kept = executed.kept_scenario
    ends = kept.waypoints[0].name, kept.waypoints[-1].name
    task = task_with_scene_from(plan, executed.span, ends)
    planned, waypoints = scenario.task.waypoints, list[dict[str, Any]]()
    for k, (reached, task_i) in enumerate(zip(kept.waypoints, kept.task_index, strict=True)):
        if ends_wait(kept.task_index, k):  # it is not a waypoint of the task
            del waypoints[-1]["velocity"]
            waypoints[-1]["wait"] = reached.time - waypoints[-1]["time"]
        else:
            old = planned[task_i] if 0 <= task_i < len(planned) else None
            waypoints.append(waypoint_at_state(trajectory, reached.time, task, reached.name, old))
    _add_actions(waypoints, plan, executed)
    start, end = (
        to_file_units(trajectory, trajectory(t, 2), task.units)
        for t in kept.times[[0, -1]].tolist()
    )
    replaced = marked(Task, "defines_motion")
    data = {key: value for key, value in task.to_dict().items() if key not in replaced} | {
        "name": scenario.name,
        "waypoints": waypoints,
        "end_acceleration": {"start": start, "end": end},
    }
    folder = Path.cwd() if scenario.source is None else scenario.source.parent
    return Task(**with_moved_paths(Task, data, folder, None))


def _add_actions(
    waypoints: Sequence[dict[str, Any]], plan: CheckedMotion, executed: Execution
) -> None:
    """Add the actions of an executed motion to its waypoints.

    Signals that are already on are switched on at the first one.
    """
    outputs, events = plan.scenario.task.outputs, plan.trajectory.events
    start, end = executed.span
    begin = start + (-TIME_TOLERANCE if start < end else TIME_TOLERANCE)
    if on := signals_on_at(events, begin):
        waypoints[0]["do"] = [action_of(event, outputs) for event in on]
    names, times = ([waypoint[key] for waypoint in waypoints] for key in ("name", "time"))
    for event in (e for e in events if begin < e.time <= end + TIME_TOLERANCE):
        time = float(first_times(executed.clock, np.array([event.time]))[0])
        if event.waypoint in names:
            k = names.index(event.waypoint)
        else:
            k = bisect_right(times, time + TIME_TOLERANCE) - 1
        action = action_of(event, outputs)
        delay = time - times[k]
        if abs(delay) > TIME_TOLERANCE:
            action["after" if delay > 0.0 else "before"] = abs(delay)
        waypoints[k].setdefault("do", []).append(action)


def _segments(planned: Sequence[Segment], executed: Execution) -> tuple[Segment, ...]:
    """The executed parts of planned segments."""
    parts = []
    for segment in planned:
        within = np.clip([segment.start, segment.end], *executed.span)
        start, end = first_times(executed.clock, within).tolist()
        if end - start > TIME_TOLERANCE:
            parts.append(replace(segment, start=start, end=end))
    return tuple(parts)
