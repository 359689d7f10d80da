"""Plans of a motion that is executed at another speed, or stopped."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.polynomial.monotone import first_times
from knotwork.curves.retiming import find_first_rest, stop_joints, stop_on_path
from knotwork.curves.trajectory import Segment
from knotwork.curves.trajectory.motion_events import signals_on_at
from knotwork.errors import InputError
from knotwork.planning.replanning import SCENE_KEYS, on_moving_frames, task_with_scene_from
from knotwork.planning.speed_override import PATH_TOLERANCE, TIME_TOLERANCE, change_speed
from knotwork.task import Task
from knotwork.task.scenario import JointTarget, Scenario, ScenarioWaypoint, resolve_task
from knotwork.task.scenario.event_reader import action_of
from knotwork.task.scenario.joint_space import by_joint, joint_space
from knotwork.task.scenario.motion_segments import motion_segments
from knotwork.task.scenario.waypoint_reader import START
from knotwork.task.task_source import with_moved_paths
from knotwork.verification import Finding, Motion, check
from knotwork.verification.finding import Group
from knotwork.verification.path_checks import check_tool_paths
from knotwork.verification.report import CheckedMotion
from knotwork.verification.waypoint_checks import check_tool_at_waypoints
from knotwork.waypoints import CartesianWaypoint, JointWaypoints

EXECUTED_KEYS = {*SCENE_KEYS, "name", "joint_units", "frame", "outputs", "rate", "description"}
"""Keys of a task that apply to an executed motion; the others are for planning."""

MotionT = TypeVar("MotionT", bound=CheckedMotion)


class Arrival(NamedTuple):
    """A waypoint that an executed motion reaches, or an end of that motion.

    Attributes:
        time: Time in the executed motion [s].
        name: Name of the waypoint or the end.
        waypoint: Index of the waypoint in the scenario; -1 for an end between waypoints.
    """

    time: float
    name: str
    waypoint: int = -1


@dataclass(frozen=True, eq=False)
class Execution:
    """A planned motion executed with another clock, or left early by a stop.

    Attributes:
        motion: The executed motion of the joints.
        clock: Time in the planned motion as a function of time in the executed one; constant if the
            executed motion leaves the planned path.
        arrivals: Ends of the executed motion and the waypoints that it passes, in order of time.
    """

    motion: PiecewisePolynomial
    clock: PiecewisePolynomial
    arrivals: Sequence[Arrival]

    @property
    def ends(self) -> tuple[str, str]:
        """Names of the two ends of the executed motion."""
        return self.arrivals[0].name, self.arrivals[-1].name

    @property
    def span(self) -> tuple[float, float]:
        """The interval of the planned motion that is executed [s]."""
        start, end = self.clock(self.clock.x[[0, -1]]).tolist()
        return start, end

    @property
    def is_on_path(self) -> bool:
        """Whether the executed motion follows the planned path."""
        return self.span[0] < self.span[1]


def scaled_motion(plan: MotionT, profile: Mapping[float, float]) -> MotionT:
    """Execute a planned motion at another speed: see `Plan.scaled`."""
    scenario, limits = plan.scenario, plan.space.limits
    moving = on_moving_frames(scenario.given)
    if moving:
        raise scenario.locations.error(
            ("waypoints", moving[0]), "is in a moving frame, which keeps its own speed"
        )
    motion, clock, warnings = change_speed(
        profile, plan.trajectory, scenario.times, (limits["acceleration"], limits["jerk"])
    )
    return _checked(plan, _execute(plan, motion, clock, (START, "end")), warnings)


def stopped_motion(plan: MotionT, at: float, *, on_path: bool) -> MotionT:
    """Stop a planned motion: see `Plan.stop`."""
    name, space, planned = plan.scenario.name, plan.space, plan.trajectory
    q, v, a = (planned(at, nu) for nu in range(3))
    at_rest = InputError(f"{name}: the motion is at rest at {at:g} s; it can't be stopped")
    if find_first_rest(planned.polynomial, at) == at:
        raise at_rest
    for kind in ("acceleration",) if on_path else ("acceleration", "jerk"):
        unlimited = np.flatnonzero(~np.isfinite(space.limits[kind]))
        if unlimited.size:
            raise InputError(
                f"{name}: joint {space.joint_names[unlimited[0]]!r} has no {kind} "
                f"limit, so the fastest stop is undefined; accepted: `limits: {{{kind}: …}}`"
            )
    limits = space.limits["acceleration"], space.limits["jerk"]
    if on_path:
        stop = stop_on_path(planned.polynomial, at, *limits, PATH_TOLERANCE)
        if stop is None:
            raise InputError(
                f"{name}: no stop on the path from {at:g} s keeps the limits "
                "before the motion ends; accepted: an earlier time, or on_path=False"
            )
        clock, motion = stop
    else:
        off_path = stop_joints(q, v, a, *limits)
        if off_path is None:
            raise at_rest
        motion, clock = off_path, PiecewisePolynomial([[at]], off_path.x[[0, -1]])
    return _checked(plan, _execute(plan, motion, clock, (f"stop from {at:g} s", "stopped")))


def _checked(plan: MotionT, executed: Execution, warnings: Sequence[Finding] = ()) -> MotionT:
    """Check an executed motion against a task of the waypoints that it reaches.

    Args:
        plan: The planned motion.
        executed: The executed motion.
        warnings: Findings to report as well.
    """
    motion, scenario = executed.motion, resolve_task(_task_of(plan, executed))
    space, times = joint_space(scenario), np.array([arrival.time for arrival in executed.arrivals])
    trajectory = replace(
        plan.trajectory,
        polynomial=motion,
        waypoint_times=times,
        events=tuple(event.event for event in scenario.events),
        loads=space.loaded_robots.loads(float(motion.x[0])) if space.loaded_robots else (),
        segments=_segments(plan.trajectory.segments, executed.clock) or motion_segments(scenario),
    )
    known = [
        *warnings,
        *_misplaced_objects(plan.scenario, executed),
        *_tool_findings(plan, executed, Motion(trajectory, plan.space)),
    ]
    waypoints = JointWaypoints(
        space.joint_names, times, motion(times), motion(times, 1), joint_units=space.joint_units
    )
    report = check(trajectory, scenario, space=space, known=known)
    return type(plan)(scenario, space, waypoints, trajectory, report)


def _tool_findings(plan: CheckedMotion, executed: Execution, motion: Motion) -> list[Finding]:
    """Findings on the plan's tool paths and poses, where the executed motion passes them."""
    if executed.is_on_path:
        passed = _passed_scenario(plan.scenario, executed)
        checks = check_tool_at_waypoints, check_tool_paths
        return [finding for judge in checks for finding in judge(motion, passed, plan.space)]
    fact = "the motion leaves the tool paths of the task, which are not checked"
    warning = Finding.of_motion(Group.WARNINGS, "path", fact, "warning")
    return [warning] if plan.scenario.paths else []


def _passed_scenario(scenario: Scenario, executed: Execution) -> Scenario:
    """The poses and tool paths that an executed motion passes, at its times and speeds.

    Its waypoints are the arrivals. Those in moving frames, which keep their own clock, and ends
    between waypoints have no pose.
    """
    arrivals, moving = executed.arrivals, on_moving_frames(scenario.given)
    waypoints: list[ScenarioWaypoint] = []
    for time, name, i in arrivals:
        planned = JointTarget(name, time) if i < 0 else scenario.waypoints[i]
        if isinstance(planned, CartesianWaypoint) and scenario.task_index[i] not in moving:
            twist = planned.twist * float(executed.clock(time, 1))
            waypoints.append(replace(planned, time=time, twist=twist))
        else:
            waypoints.append(JointTarget(name, time))
    first = bisect_right(scenario.times.tolist(), executed.span[0]) - 1
    intervals = [first if arrival.waypoint < 0 else arrival.waypoint for arrival in arrivals[:-1]]
    paths = []
    for path in scenario.paths:
        passed = [k for k, i in enumerate(intervals) if path.first <= i < path.last]
        stretches = tuple(
            replace(
                path.stretches[intervals[k] - path.first],
                start=arrivals[k].time,
                end=arrivals[k + 1].time,
            )
            for k in passed
        )
        if passed:
            paths.append(replace(path, first=passed[0], stretches=stretches, clock=executed.clock))
    return replace(scenario, waypoints=tuple(waypoints), paths=tuple(paths))


def _misplaced_objects(scenario: Scenario, executed: Execution) -> Iterator[Finding]:
    """Warnings of objects whose frame is unknown, because the executed task has joint values."""
    inner = {arrival.waypoint for arrival in executed.arrivals[1:-1]}
    for held in scenario.scene.held:
        ends = ("before", held.take), ("after", held.leave)
        for (when, waypoint), frame in zip(ends, held.frames, strict=True):
            if not frame.rests_on(scenario.pose_frame_link) and waypoint in inner:
                fact = (
                    f"{when} {scenario.waypoints[waypoint].name!r}, {held.name!r} moves relative "
                    "to the frame of the poses, but is checked as fixed in it"
                )
                yield Finding.of_motion(Group.WARNINGS, "held_object", fact, "warning")


def _execute(
    plan: CheckedMotion,
    motion: PiecewisePolynomial,
    clock: PiecewisePolynomial,
    ends: tuple[str, str],
) -> Execution:
    """An executed motion with the waypoints that it passes.

    Args:
        plan: The planned motion.
        motion: The executed motion of the joints.
        clock: Time of the planned motion over that of the executed one.
        ends: Names of its ends, where the task has no waypoint.
    """
    start, end = motion.x[[0, -1]].tolist()
    low, high = clock(clock.x[[0, -1]])
    known = plan.scenario.times
    passed = np.flatnonzero((low - TIME_TOLERANCE <= known) & (known <= high + TIME_TOLERANCE))
    times = first_times(clock, np.clip(known[passed], low, high))
    arrivals = []
    for waypoint, time in zip(passed.tolist(), times.tolist(), strict=True):
        at = next((t for t in (start, end) if abs(t - time) < TIME_TOLERANCE), time)
        arrivals.append(Arrival(at, plan.scenario.waypoints[waypoint].name, waypoint))
    if not arrivals or arrivals[0].time != start:
        arrivals.insert(0, _end(start, ends[0], arrivals))
    if arrivals[-1].time != end:
        arrivals.append(_end(end, ends[1], arrivals))
    return Execution(motion, clock, arrivals)


def _end(time: float, name: str, arrivals: Sequence[Arrival]) -> Arrival:
    """An end of an executed motion, with a name that no waypoint has."""
    while any(arrival.name == name for arrival in arrivals):
        name = f"{name} 2"
    return Arrival(time, name)


def _task_of(plan: CheckedMotion, executed: Execution) -> Task:
    """A task of which the executed motion is a solution: its states at the reached waypoints.

    It does not depend on a file: it has a name and absolute paths.
    """
    scenario, space, motion = plan.scenario, plan.space, executed.motion
    task = task_with_scene_from(plan, executed.span, executed.ends)
    units = task.units
    waypoints: dict[int | str, dict[str, Any]] = {}
    for time, name, waypoint in executed.arrivals:
        key = name if waypoint < 0 else scenario.task_index[waypoint]
        if key in waypoints:  # the end of a wait, which is not a waypoint of the task
            del waypoints[key]["velocity"]
            waypoints[key]["wait"] = time - waypoints[key]["time"]
        else:
            q, v = (by_joint(space, motion(time, nu), units) for nu in range(2))
            waypoints[key] = {"time": time, "name": name, "joints": q, "velocity": v}
    _add_actions([*waypoints.values()], plan, executed)
    first, last = (by_joint(space, motion(t, 2), units) for t in motion.x[[0, -1]].tolist())
    data = {key: value for key, value in task.to_dict().items() if key in EXECUTED_KEYS} | {
        "name": scenario.name,
        "waypoints": [*waypoints.values()],
        "end_acceleration": {"start": first, "end": last},
    }
    folder = Path.cwd() if scenario.source is None else scenario.source.parent
    return Task(**with_moved_paths(data, folder, None))


def _add_actions(
    waypoints: Sequence[dict[str, Any]], plan: CheckedMotion, executed: Execution
) -> None:
    """Add the actions of an executed motion to its waypoints.

    Signals that are already on are switched on at the first one.
    """
    outputs, events = plan.scenario.given.outputs, plan.trajectory.events
    start, end = executed.span
    begin = start + (-TIME_TOLERANCE if executed.is_on_path else TIME_TOLERANCE)
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


def _segments(planned: Sequence[Segment], clock: PiecewisePolynomial) -> tuple[Segment, ...]:
    """Segments of a motion with another clock."""
    first, last = clock(clock.x[[0, -1]])
    executed = []
    for segment in planned:
        ends = np.array([max(segment.start, first), min(segment.end, last)])
        if ends[1] - ends[0] > TIME_TOLERANCE:
            start, end = first_times(clock, ends).tolist()
            executed.append(replace(segment, start=start, end=end))
    return tuple(executed)
