"""Checks of events and of the tool's position at them; reports on segments and cycles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from knotwork.curves.trajectory.motion_events import Event
from knotwork.task.scenario import Scenario
from knotwork.task.scenario.motion_segments import motion_segments
from knotwork.task.scenario.repetitions import repetition_starts
from knotwork.task.scenario.scenario import RequestedEvent
from knotwork.task.scenario.scenario_joints import ScenarioJoints
from knotwork.verification.finding import Finding, Findings, Group, Topic, Verdict
from knotwork.verification.motion import Motion, time_slack

MAX_NAMED_EVENTS = 4
"""Maximum number of events named in a short report."""


def check_events(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Report the time of each event, and compare the tool's position along a path with the task."""
    requested = [request.event for request in scenario.events]
    shown = [f"{event.text} {event.time:.3f} s" for event in requested[:MAX_NAMED_EVENTS]]
    remaining = len(requested) - len(shown)
    highlight = ", ".join(shown) + (f" and {remaining} more" if remaining else "")
    for request in scenario.events:
        event = request.event
        slack = time_slack(event.time)
        inside = motion.start_time - slack <= event.time <= motion.end_time + slack
        fact = f"{event.text} at {event.time:.3f} s: {_location_text(request, scenario)}"
        if not inside:
            fact += f", but the motion runs from {motion.start_time:.3f} to {motion.end_time:.3f} s"
        yield _event_finding(
            event, "information" if inside else "failed", fact, highlight=highlight
        )
        highlight = ""
        if inside and request.path is not None:
            yield _compare_on_path(request, motion, scenario, joints)
    stored = motion.trajectory
    if stored.events or stored.segments:
        unexpected = "the motion has it, but the scenario does not request it"
        yield from _missing_from(requested, stored.events, unexpected)
        missing = "the scenario requests it, but the motion does not have it"
        yield from _missing_from(stored.events, requested, missing)
    elif requested:
        fact = "the motion has no events, so the switching of signals is not checked"
        yield Topic(Group.EVENTS, "event", "events").finding("switching_time", fact, "warning")
    yield from _repeated_or_left_on(requested)


def _event_finding(
    event: Event, verdict: Verdict, fact: str, *, group: str = Group.EVENTS, highlight: str = ""
) -> Finding:
    topic = Topic(group, "event", event.name)
    return topic.finding("switching_time", fact, verdict, time=event.time, highlight=highlight)


def _repeated_or_left_on(requested: Sequence[Event]) -> Findings:
    """Warn of signals switched to the value that they have, and of signals left on at the end."""
    last: dict[str | int, Event] = {}
    faults = []
    for event in requested:
        before = last.get(event.signal)
        if isinstance(event.value, bool) and before is not None and before.value is event.value:
            faults.append((event, f"it has had this value since {before.time:.3f} s"))
        last[event.signal] = event
    faults += [
        (event, "the motion ends with it on") for event in last.values() if event.value is True
    ]
    for event, fault in faults:
        fact = f"{event.text} at {event.time:.3f} s: {fault}"
        yield _event_finding(event, "warning", fact, group=Group.WARNINGS)


def _missing_from(events: Sequence[Event], candidates: Sequence[Event], fault: str) -> Findings:
    """Report a failure for each candidate that is not among the events."""
    for event in candidates:
        slack = time_slack(event.time)
        near = (other for other in events if abs(other.time - event.time) <= slack)
        if not any(replace(other, time=event.time) == event for other in near):
            yield _event_finding(event, "failed", f"{event.text} at {event.time:.3f} s: {fault}")


def _location_text(request: RequestedEvent, scenario: Scenario) -> str:
    """Text of an event's position or time relative to its waypoint."""
    offset, unit = (request.delay, "s") if request.path is None else (request.distance, "m")
    if not offset and request.path is None:
        return f"at {request.event.waypoint!r}"
    size = scenario.units.text(abs(offset), unit, ".6g")
    return f"{size} {'after' if offset > 0.0 else 'before'} {request.event.waypoint!r}"


def _compare_on_path(
    request: RequestedEvent, motion: Motion, scenario: Scenario, joints: ScenarioJoints
) -> Finding:
    event, path = request.event, request.path
    if path is None or joints.robot is None:
        raise TypeError("an event on a path needs a robot")
    time = np.clip([event.time], motion.start_time, motion.end_time)
    pose = joints.robot.forward(motion.curve(time[0]))
    reached, _, _ = path.timed_path.woven_frame.relative_motion(
        time, pose.translation[None], pose.rotation[None], np.zeros((1, 3))
    )
    requested = path.timed_path.tool_path.position(np.array([request.arc_length]))
    miss = float(np.linalg.norm(reached - requested))
    tolerance = scenario.tolerances.path
    shown, allowed = (scenario.units.text(length, "m", ".3g") for length in (miss, tolerance))
    located = f"{event.text} at {event.time:.3f} s, {_location_text(request, scenario)}"
    fact = f"{located}: the tool is {shown} from that position, tolerance {allowed}"
    points = (tuple(pose.translation.tolist()),)
    return Topic(Group.EVENTS, "event", event.name).at_most(
        "event_position", fact, miss, tolerance, "m", time=event.time, points=points
    )


def report_segments(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Report the interval of each segment of the motion."""
    for segment in motion.trajectory.segments or motion_segments(scenario):
        topic = Topic(Group.SEGMENTS, "segment", segment.name)
        interval = (segment.start, segment.end)
        yield topic.finding("segment", segment.text, interval=interval)


def report_cycles(motion: Motion, scenario: Scenario, joints: ScenarioJoints) -> Findings:
    """Report the time from the first waypoint of a repetition to that of the next."""
    for rows in repetition_starts(scenario):
        starts = scenario.times[rows]
        if len(rows) < 2:
            continue
        durations = np.diff(starts)
        first, last = (scenario.waypoints[i].name for i in (rows[0], rows[-1]))
        text = f"{len(rows)} repetitions, {durations.mean():.4g} s each"
        if np.ptp(durations) > 1e-3:
            text += f" on average, {durations.min():.4g} to {durations.max():.4g} s"
        fact = f"{text}, from {first!r} to {last!r}"
        interval = (float(starts[0]), float(starts[-1]))
        topic = Topic(Group.CYCLES, "cycle", first)
        yield topic.finding("cycle", fact, highlight=text, interval=interval)
