"""Events and the tool's position at them; segments of the motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from knotwork.scenario import Scenario
from knotwork.scenario.event_reader import segments
from knotwork.scenario.joint_space import JointSpace
from knotwork.scenario.scenario import AskedEvent
from knotwork.trajectory.motion_events import Event
from knotwork.verification.finding import Finding, judged
from knotwork.verification.motion import Motion
from knotwork.verification.waypoints import TIME_ROUNDING as SAME_TIME

GROUP = "Events"
MOST_NAMED = 4
"""Maximum number of events named in a short report."""


def events(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Report the time of each event, and compare the tool's position along a path with the task."""
    asked = scenario.events
    named = [f"{one.event.text} {one.event.time:.3f} s" for one in asked[:MOST_NAMED]]
    more = f" and {len(asked) - MOST_NAMED} more" if len(asked) > MOST_NAMED else ""
    for i, one in enumerate(asked):
        event = one.event
        inside = event.time <= motion.end_time + SAME_TIME * max(1.0, motion.end_time)
        late = "" if inside else f", but the motion ends at {motion.end_time:.3f} s"
        yield Finding(
            GROUP,
            "event",
            event.name,
            "event",
            "information" if inside else "failed",
            f"{event.text} at {event.time:.3f} s: {_place(one, scenario)}{late}",
            time=event.time,
            brief=", ".join(named) + more if i == 0 else "",
        )
        if inside and one.path is not None:
            yield _on_path(one, motion, scenario, space)
    stored = motion.trajectory
    if stored.events or stored.segments:
        yield from _stored(stored.events, [one.event for one in asked])
    elif asked:
        said = "the motion does not say what is switched on its way; that is not checked"
        yield Finding(GROUP, "event", "events", "event", "warning", said)
    yield from _left_on([one.event for one in asked])


def _left_on(asked: Sequence[Event]) -> Iterator[Finding]:
    """Signals switched on or off twice in a row, and signals on at the end of the motion."""
    last: dict[str | int, Event] = {}
    found = []
    for one in asked:
        before = last.get(one.signal)
        if isinstance(one.value, bool) and before is not None and before.value is one.value:
            found.append((one, f"it is so since {before.time:.3f} s"))
        last[one.signal] = one
    found += [(one, "the motion ends with it on") for one in last.values() if one.value is True]
    for one, why in found:
        said = f"{one.text} at {one.time:.3f} s: {why}"
        yield Finding("Warnings", "event", one.name, "event", "warning", said, time=one.time)


def _stored(stored: Sequence[Event], asked: Sequence[Event]) -> Iterator[Finding]:
    """Differences between the events of a stored motion and those of the scenario."""
    for some, others, fault in (
        (stored, asked, "the motion has it, and the scenario does not ask for it"),
        (asked, stored, "the scenario asks for it, and the motion does not have it"),
    ):
        times: dict[Event, list[float]] = {}
        for one in others:
            times.setdefault(replace(one, time=0.0), []).append(one.time)
        for one in some:
            slack = SAME_TIME * max(1.0, one.time)
            known = times.get(replace(one, time=0.0), [])
            if not any(abs(one.time - time) <= slack for time in known):
                said = f"{one.text} at {one.time:.3f} s: {fault}"
                yield Finding(GROUP, "event", one.name, "event", "failed", said, time=one.time)


def _place(asked: AskedEvent, scenario: Scenario) -> str:
    """Text of an event's position or time relative to its waypoint."""
    waypoint = asked.event.waypoint
    if asked.path is not None:
        far = scenario.units.text(abs(asked.distance), "m", ".6g")
        return f"{far} {'after' if asked.distance > 0.0 else 'before'} {waypoint!r}"
    later = asked.delay
    moment = f"{abs(later):.6g} s {'after' if later > 0.0 else 'before'} " if later else "at "
    return f"{moment}{waypoint!r}"


def _on_path(asked: AskedEvent, motion: Motion, scenario: Scenario, space: JointSpace) -> Finding:
    event, path = asked.event, asked.path
    if path is None or space.robot is None:
        raise TypeError("an event has a place on a path, which needs a robot")
    time = np.array([min(event.time, motion.end_time)])
    pose = space.robot.forward(motion.curve(time[0]))
    place, _, _ = path.motion.relative_motion(
        time, pose.translation[None], pose.rotation[None], np.zeros((1, 3))
    )
    wanted = path.motion.path.position(np.array([asked.arc_length]))
    miss, tolerance = float(np.linalg.norm(place - wanted)), scenario.tolerances.path
    off, allowed = (scenario.units.text(one, "m", ".3g") for one in (miss, tolerance))
    return Finding(
        group=GROUP,
        subject="event",
        name=event.name,
        quantity="place",
        verdict=judged(miss <= tolerance),
        message=f"{event.text} at {event.time:.3f} s, {_place(asked, scenario)}: the tool is {off} "
        f"from that place, tolerance {allowed}",
        value=miss,
        limit=tolerance,
        margin=tolerance - miss,
        unit="m",
        time=event.time,
        points=(tuple(pose.translation.tolist()),),
    )


def parts(motion: Motion, scenario: Scenario, space: JointSpace) -> Iterator[Finding]:
    """Report the interval of each segment of the motion."""
    for one in motion.trajectory.segments or segments(scenario):
        yield Finding(
            "Segments",
            "segment",
            one.name,
            "segment",
            "information",
            one.text,
            interval=(one.start, one.end),
        )
