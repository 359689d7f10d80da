"""Changes to a running plan: speed override, stop, another goal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.documents import Document, edited
from knotwork.errors import InputError
from knotwork.pipeline.remaining_scene import by_joint, on_moving_frames, scene_from
from knotwork.pipeline.speed_override import NEAR, TOLERANCE, passed_times, retimed
from knotwork.polynomial import PiecewisePolynomial
from knotwork.retiming import first_rest, inverse_time, joint_stop, stop_on_path
from knotwork.scenario import Scenario, resolved
from knotwork.scenario.event_reader import action_of, segments
from knotwork.scenario.joint_space import JointSpace, joint_space
from knotwork.scenario.waypoint_reader import START
from knotwork.task import Task
from knotwork.task.places import moved_paths
from knotwork.task.si_units import si_factors
from knotwork.trajectory import JointTrajectory, Segment
from knotwork.trajectory.events import on_at
from knotwork.verification import Finding, check
from knotwork.waypoints import FloatArray, JointWaypoints

if TYPE_CHECKING:
    from typing_extensions import Self

    from knotwork.verification import Report

CHOICES = (
    *("start", "near", "branch", "times", "ways", "duration", "objective", "chosen", "knots"),
    *("planner", "planner_options", "path"),
)
"""Planning options of a task, of no use for a given motion."""


class ExecutionMixin:
    """Changes to a running plan."""

    if TYPE_CHECKING:
        scenario: Scenario
        space: JointSpace
        joint_waypoints: JointWaypoints
        trajectory: JointTrajectory
        report: Report

    def scaled(self, profile: Mapping[float, float]) -> Self:
        """Execute the same path at another speed.

        Joints deviate from the path by at most 1e-6 rad or m. The check of the new plan covers
        limits, collisions and the waypoints at their new times; tool paths are not checked again.
        Moving frames and other robots keep their own speed.

        Args:
            profile: Speed override by time since the start [s]: 1 is the planned speed. It changes
                smoothly from each value to the next, and keeps the last one. If it changes too fast
                for limits of acceleration and jerk, and is at most 1, the nearest feasible override
                found is executed instead; a warning of the report gives it.

        Raises:
            InputError: A time or an override is negative, nothing would move, or a waypoint is in a
                moving frame, which the tool would miss.

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
        motion, clock, known = retimed(profile, self.trajectory, self.scenario.times, limits)
        span = self.trajectory.start_time, float(clock(clock.x[-1]))
        return self._with_motion(motion, clock, span, (START, "end"), known)

    def stop(self, at: float, *, on_path: bool = True) -> Self:
        """Stop as soon as the limits of acceleration and jerk allow.

        Args:
            at: Start of the stop [s].
            on_path: Stay on the path of the motion, within 1e-6 rad or m, and stop at its next rest
                if no stop is sooner. Otherwise each joint stops independently, as fast as it can.

        Returns:
            A plan from the time `at` on, which is its time 0. It starts with the position,
            velocity and acceleration at that time.

        Raises:
            InputError: The time is outside the motion, a joint has no acceleration limit (or,
                off the path, no jerk limit), the motion ends before it can stop on its path, or is
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
        found = stop_on_path(self.trajectory.polynomial, at, *limits, TOLERANCE)
        if found is None:
            raise InputError(
                f"{self.scenario.name}: no stop on the path from {at:g} s keeps the limits "
                "before the motion ends; accepted: an earlier time, or on_path=False"
            )
        clock, motion = found
        return self._with_motion(motion, clock, (at, float(clock(clock.x[-1]))), ends)

    def _with_motion(
        self,
        motion: PiecewisePolynomial,
        clock: PiecewisePolynomial | None,
        span: tuple[float, float],
        ends: tuple[str, str],
        known: Sequence[Finding] = (),
    ) -> Self:
        """The plan of another motion, through the waypoints that it reaches.

        Args:
            motion: Motion of the joints.
            clock: Time of the planned motion over its own, or `None` if it leaves the path.
            span: Time interval of the planned motion that is executed [s].
            ends: Names of the waypoints at the ends, where the task has none.
            known: Findings to report.
        """
        scenario, space = self.scenario, self.space
        own = {one.name: one.time for one in scenario.waypoints}
        begin, end = (next((k for k in own if abs(own[k] - time) < NEAR), None) for time in span)
        ends = begin or ends[0], (None if clock is None else end) or ends[1]
        task = scene_from(scenario, space.robot, self.trajectory, span, ends)
        names = self._names(motion, clock, ends)
        times = np.array(sorted(names))
        units = si_factors(scenario.task.units)
        waits = self._waits(names, clock)
        place = {name: time for time, name in names.items() if time not in waits.values()}
        actions = self._actions(place, clock, span[0])
        waypoints = []
        for name, time in sorted(place.items(), key=lambda one: one[1]):
            one: dict[str, Any] = {"time": time, "name": name}
            one["joints"] = by_joint(space, motion(time), *units)
            if time in waits:
                one["wait"] = waits[time] - time
            else:
                one["velocity"] = by_joint(space, motion(time, 1), *units)
            if actions[name]:
                one["do"] = actions[name]
            waypoints.append(one)
        ends_given = {
            end: by_joint(space, motion(motion.x[i], 2), *units)
            for end, i in (("start", 0), ("end", -1))
        }
        task = _without_file(task, scenario).replace(
            **dict.fromkeys(CHOICES), waypoints=waypoints, end_acceleration=ends_given
        )
        asked = resolved(task)
        parts = self._segments(clock) or segments(asked)
        return self._checked(asked, motion, times, parts, known)

    def _checked(
        self,
        asked: Scenario,
        motion: PiecewisePolynomial,
        times: FloatArray,
        parts: tuple[Segment, ...],
        known: Sequence[Finding],
    ) -> Self:
        """The plan of a motion for a task, with given times of its waypoints [s]."""
        space, moved = self.space, joint_space(asked)
        trajectory = replace(
            self.trajectory,
            polynomial=motion,
            waypoint_times=times,
            events=tuple(one.event for one in asked.events),
            loads=moved.carrying.loads(float(motion.x[0])) if moved.carrying else (),
            segments=parts,
        )
        passed_through = JointWaypoints(
            space.joint_names, times, motion(times), motion(times, 1), joint_units=space.joint_units
        )
        return replace(  # type: ignore[type-var]  # the one class that inherits it is a dataclass
            self,
            scenario=asked,
            space=moved,
            joint_waypoints=passed_through,
            trajectory=trajectory,
            report=check(trajectory, asked, space=moved, known=known),
            left_out=(),
            solution=None,
            chosen=None,
            sequences=1,
        )

    def _names(
        self,
        motion: PiecewisePolynomial,
        clock: PiecewisePolynomial | None,
        ends: tuple[str, str],
    ) -> dict[float, str]:
        """Names of a motion's waypoints by time: its ends, and the ones that it passes."""
        names = dict(zip(motion.x[[0, -1]].tolist(), ends, strict=True))
        if clock is None:
            return names
        passed = passed_times(self.scenario.times, clock)
        for time, when in zip(passed, inverse_time(clock, passed), strict=True):
            near = next((one for one in names if abs(one - when) < NEAR), float(when))
            i = int(np.flatnonzero(self.scenario.times == time)[0])
            names[near] = self.scenario.waypoints[i].name
        return names

    def _actions(
        self, place: Mapping[str, float], clock: PiecewisePolynomial | None, start: float
    ) -> dict[str, list[dict[str, Any]]]:
        """Actions at waypoints, for given times; at the first one all signals already on."""
        outputs, events = self.scenario.task.outputs, self.trajectory.events
        found: dict[str, list[dict[str, Any]]] = {name: [] for name in place}
        begun = start + NEAR if clock is None else start - NEAR
        found[min(place, key=place.__getitem__)] += [
            action_of(one, outputs) for one in on_at(events, begun)
        ]
        if clock is None:
            return found
        last = float(clock(clock.x[-1])) + NEAR
        for event in events:
            if not begun < event.time <= last:
                continue
            when = float(inverse_time(clock, np.array([event.time]))[0])
            name = event.waypoint
            if name not in place:
                name = max(place, key=lambda one: (place[one] <= when + NEAR, place[one]))
            later = when - place[name]
            moment = {"after" if later > 0.0 else "before": abs(later)}
            found[name].append(action_of(event, outputs) | (moment if abs(later) > NEAR else {}))
        return found

    def _waits(
        self, names: Mapping[float, str], clock: PiecewisePolynomial | None
    ) -> dict[float, float]:
        """Ends of the waits at waypoints, by the times of arrival."""
        if clock is None:
            return {}
        place = {name: time for time, name in names.items()}
        points, index = self.scenario.waypoints, self.scenario.index
        pairs = ((points[i].name, points[i + 1].name, i) for i in range(len(points) - 1))
        return {
            place[one]: place[other]
            for one, other, i in pairs
            if index[i] == index[i + 1] and one in place and other in place
        }

    def _segments(self, clock: PiecewisePolynomial | None) -> tuple[Segment, ...]:
        """Segments of a motion with another clock; empty if unknown."""
        if clock is None:
            return ()
        first, last = clock(clock.x[[0, -1]])
        found = []
        for one in self.trajectory.segments:
            ends = np.array([max(one.start, first), min(one.end, last)])
            if ends[1] - ends[0] > NEAR:
                start, end = inverse_time(clock, ends).tolist()
                found.append(replace(one, start=start, end=end))
        return tuple(found)


def _without_file(task: Task, scenario: Scenario) -> Task:
    """A task independent of its file: named, with absolute paths."""
    folder = Path.cwd() if scenario.source is None else scenario.source.parent
    data = task.to_dict() | {"name": scenario.name}
    return Task(**edited(Document(data), moved_paths(data, folder.resolve(), None)).data)
