"""Changes of a plan in execution: speed override, stop, another goal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.errors import InputError
from knotwork.files.documents import Document, edited
from knotwork.planning.planned_motion import PlannedMotion
from knotwork.planning.remaining_scene import by_joint, on_moving_frames, scene_from
from knotwork.planning.speed_override import PATH_TOLERANCE, SAME_WAYPOINT_TIME, change_speed
from knotwork.scenario import Scenario, resolved
from knotwork.scenario.event_reader import action_of, segments
from knotwork.scenario.joint_space import joint_space
from knotwork.scenario.waypoint_reader import START
from knotwork.spline.polynomial import PiecewisePolynomial
from knotwork.spline.retiming import first_rest, inverse_time, joint_stop, stop_on_path
from knotwork.spline.trajectory import Segment
from knotwork.spline.trajectory.motion_events import signals_on_at
from knotwork.task import Task
from knotwork.task.places import moved_paths
from knotwork.task.si_units import si_factors
from knotwork.verification import Finding, check
from knotwork.waypoints import JointWaypoints

if TYPE_CHECKING:
    from typing_extensions import Self

PLANNING_KEYS = (
    *("start", "near", "branch", "times", "ways", "duration", "objective", "chosen", "knots"),
    *("planner", "planner_options", "path"),
)
"""Planning options of a task, which a given motion does not need."""


class ExecutedMotion(PlannedMotion):
    """A planned motion, and its changes during execution."""

    def scaled(self, profile: Mapping[float, float]) -> Self:
        """Execute the same path at another speed.

        Joints deviate from the path by at most 1e-6 rad or m. The check of the new plan covers
        limits, collisions and the waypoints at their new times; tool paths are not checked again.
        Moving frames and other robots keep their own speed.

        Args:
            profile: Speed override by time since the start [s]: 1 is the planned speed. The
                override changes smoothly from each value to the next, and keeps the last one. If it
                is at most 1 and changes too fast for the limits of acceleration and jerk, the
                nearest feasible override found replaces it. A warning of the report states it.

        Raises:
            InputError: A time or an override is negative, the arm would not move, or the tool would
                miss a waypoint in a moving frame.

        >>> plan = kw.plan("paper_case")
        >>> slow = plan.scaled({0: 1.0, 4: 1.0, 6: 0.5})
        >>> slow.trajectory.duration > plan.trajectory.duration, slow.report.ok
        (True, True)
        """
        for i in on_moving_frames(self.scenario.task)[:1]:
            raise self.scenario.places.error(
                ("waypoints", i), "is in a moving frame, which keeps its own speed"
            )
        limits = self.space.limits["acceleration"], self.space.limits["jerk"]
        motion, clock, known = change_speed(profile, self.trajectory, self.scenario.times, limits)
        span = self.trajectory.start_time, float(clock(clock.x[-1]))
        return self._with_motion(motion, clock, span, (START, "end"), known)

    def stop(self, at: float, *, on_path: bool = True) -> Self:
        """Stop as soon as the limits of acceleration and jerk allow.

        Args:
            at: Start of the stop [s].
            on_path: Stay on the path of the motion, within 1e-6 rad or m, and stop at its next rest
                if no stop is sooner. Otherwise each joint stops independently, in minimum time.

        Returns:
            A plan that begins at the time `at`, which is its time 0, with the position, velocity
            and acceleration at that time.

        Raises:
            InputError: The time is outside the motion; a joint has no acceleration limit (or, off
                the path, no jerk limit); the motion ends before it can stop on its path; or it is
                at rest at that time.

        >>> joints = [{"joints": {"a": 0}}, {"joints": {"a": 1}, "after": 2}]
        >>> swing = kw.plan({"limits": {"acceleration": 4, "jerk": 40}, "waypoints": joints})
        >>> stop = swing.stop(1.0)
        >>> stop.report.ok, bool(stop.trajectory.duration < 0.5)
        (True, True)
        """
        q, v, a = (self.trajectory(at, nu) for nu in range(3))
        if first_rest(self.trajectory.polynomial, at) == at:
            raise InputError(
                f"{self.scenario.name}: the motion is at rest at {at:g} s; there is nothing to stop"
            )
        limits = self.space.limits["acceleration"], self.space.limits["jerk"]
        for kind, limit in zip(("acceleration", "jerk"), limits, strict=True):
            if kind == "jerk" and on_path:
                continue
            for joint in np.flatnonzero(~np.isfinite(limit))[:1]:
                raise InputError(
                    f"{self.scenario.name}: joint {self.space.joint_names[joint]!r} has no {kind} "
                    f"limit, so the fastest stop is undefined; accepted: `limits: {{{kind}: …}}`"
                )
        ends = f"stop from {at:g} s", "stopped"
        if not on_path:
            return self._with_motion(joint_stop(q, v, a, *limits), None, (at, at), ends)
        stop = stop_on_path(self.trajectory.polynomial, at, *limits, PATH_TOLERANCE)
        if stop is None:
            raise InputError(
                f"{self.scenario.name}: no stop on the path from {at:g} s keeps the limits "
                "before the motion ends; accepted: an earlier time, or on_path=False"
            )
        clock, motion = stop
        return self._with_motion(motion, clock, (at, float(clock(clock.x[-1]))), ends)

    def _with_motion(
        self,
        motion: PiecewisePolynomial,
        clock: PiecewisePolynomial | None,
        span: tuple[float, float],
        ends: tuple[str, str],
        known: Sequence[Finding] = (),
    ) -> Self:
        """The plan of a changed motion, with the waypoints that it reaches.

        Args:
            motion: Motion of the joints.
            clock: Time of the planned motion over its own, or `None` if it leaves the path.
            span: Time interval of the planned motion that is executed [s].
            ends: Names of the waypoints at the ends, where the task has none.
            known: Findings to report.
        """
        space = self.space
        arrivals = self._arrivals(motion, clock, span, ends)
        if self.scenario.paths:
            fact = "the tool is not checked against the tool paths of the task in this motion"
            known = [*known, Finding("Warnings", "motion", "", "path", "warning", fact)]
        changed = self._scenario_of(motion, clock, span, arrivals)
        changed_space, times = joint_space(changed), np.array([*arrivals.values()])
        carrying = changed_space.carrying
        trajectory = replace(
            self.trajectory,
            polynomial=motion,
            waypoint_times=times,
            events=tuple(asked.event for asked in changed.events),
            loads=carrying.loads(float(motion.x[0])) if carrying else (),
            segments=segments(changed) if clock is None else self._segments(clock),
        )
        return replace(
            self,
            scenario=changed,
            space=changed_space,
            joint_waypoints=JointWaypoints(
                space.joint_names,
                times,
                motion(times),
                motion(times, 1),
                joint_units=space.joint_units,
            ),
            trajectory=trajectory,
            report=check(trajectory, changed, space=changed_space, known=known),
            left_out=(),
            solution=None,
            chosen=None,
            sequences=1,
        )

    def _scenario_of(
        self,
        motion: PiecewisePolynomial,
        clock: PiecewisePolynomial | None,
        span: tuple[float, float],
        arrivals: Mapping[str, float],
    ) -> Scenario:
        """The task of a changed motion: its states at the waypoints that it reaches."""
        scenario, space = self.scenario, self.space
        names = list(arrivals)
        task = scene_from(scenario, space.robot, self.trajectory, span, (names[0], names[-1]))
        waits = {
            first.name: second.name
            for (first, second), (i, k) in zip(
                pairwise(scenario.waypoints), pairwise(scenario.index), strict=True
            )
            if i == k and {first.name, second.name} <= arrivals.keys()
        }
        placed = {name: time for name, time in arrivals.items() if name not in waits.values()}
        actions = self._actions(placed, clock, span[0])
        units = si_factors(scenario.task.units)

        def values(time: float, order: int) -> dict[str, float]:
            return by_joint(space, motion(time, order), *units)

        waypoints = [
            {"time": time, "name": name, "joints": values(time, 0)}
            | (
                {"wait": arrivals[waits[name]] - time}
                if name in waits
                else {"velocity": values(time, 1)}
            )
            | ({"do": actions[name]} if actions[name] else {})
            for name, time in placed.items()
        ]
        first, last = motion.x[[0, -1]].tolist()
        return resolved(
            _without_file(task, scenario).replace(
                **dict.fromkeys(PLANNING_KEYS),
                waypoints=waypoints,
                end_acceleration={"start": values(first, 2), "end": values(last, 2)},
            )
        )

    def _arrivals(
        self,
        motion: PiecewisePolynomial,
        clock: PiecewisePolynomial | None,
        span: tuple[float, float],
        ends: tuple[str, str],
    ) -> dict[str, float]:
        """Times of a motion's waypoints by name, in order: its ends, and those that it passes."""
        start, end = motion.x[[0, -1]].tolist()
        low, high = span if clock is not None else (span[0], span[0])
        points = self.scenario.waypoints
        passed = [
            p for p in points if low - SAME_WAYPOINT_TIME <= p.time <= high + SAME_WAYPOINT_TIME
        ]
        old = np.array([waypoint.time for waypoint in passed])
        new = np.full(len(old), start) if clock is None else inverse_time(clock, old)
        for i, time in enumerate(new):
            new[i] = next((t for t in (start, end) if abs(t - time) < SAME_WAYPOINT_TIME), time)
        arrivals = dict(zip((point.name for point in passed), new.tolist(), strict=True))
        if start not in arrivals.values():
            arrivals = {ends[0]: start} | arrivals
        return arrivals if end in arrivals.values() else arrivals | {ends[1]: end}

    def _actions(
        self, placed: Mapping[str, float], clock: PiecewisePolynomial | None, start: float
    ) -> dict[str, list[dict[str, Any]]]:
        """Actions at waypoints, from given times.

        Signals that are already on are at the first waypoint.
        """
        outputs, events = self.scenario.task.outputs, self.trajectory.events
        begin = start + SAME_WAYPOINT_TIME if clock is None else start - SAME_WAYPOINT_TIME
        actions: dict[str, list[dict[str, Any]]] = {name: [] for name in placed}
        actions[next(iter(placed))] += [
            action_of(event, outputs) for event in signals_on_at(events, begin)
        ]
        if clock is None:
            return actions
        end = float(clock(clock.x[-1])) + SAME_WAYPOINT_TIME
        for event in (event for event in events if begin < event.time <= end):
            time = float(inverse_time(clock, np.array([event.time]))[0])
            name = event.waypoint
            if name not in placed:
                name = [name for name, t in placed.items() if t <= time + SAME_WAYPOINT_TIME][-1]
            delay = time - placed[name]
            moment = {"after" if delay > 0.0 else "before": abs(delay)}
            is_later = abs(delay) > SAME_WAYPOINT_TIME
            actions[name].append(action_of(event, outputs) | (moment if is_later else {}))
        return actions

    def _segments(self, clock: PiecewisePolynomial) -> tuple[Segment, ...]:
        """Segments of the motion with another clock."""
        first, last = clock(clock.x[[0, -1]])
        executed = []
        for segment in self.trajectory.segments:
            ends = np.array([max(segment.start, first), min(segment.end, last)])
            if ends[1] - ends[0] > SAME_WAYPOINT_TIME:
                start, end = inverse_time(clock, ends).tolist()
                executed.append(replace(segment, start=start, end=end))
        return tuple(executed)


def _without_file(task: Task, scenario: Scenario) -> Task:
    """A task that does not depend on its file: it has a name and absolute paths."""
    folder = Path.cwd() if scenario.source is None else scenario.source.parent
    data = task.to_dict() | {"name": scenario.name}
    return Task(**edited(Document(data), moved_paths(data, folder.resolve(), None)).data)
