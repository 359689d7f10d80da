"""Times of a task's actions."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from knotwork.curves.trajectory.motion_events import TIME_TOLERANCE, Event
from knotwork.errors.plain_text import quoted_waypoint
from knotwork.files.documents import Location
from knotwork.task import Action
from knotwork.task.actions import parse_switched
from knotwork.task.scenario.scenario import RequestedEvent, ScenarioPath, ScenarioWaypoint
from knotwork.task.scenario.task_reading import TaskReading

LENGTH_ROUNDING = 1e-9
"""Rounding tolerance of positions on a path, relative to its length."""


@dataclass(frozen=True, eq=False)
class EventReader:
    """Reads the events of a file.

    Attributes:
        reading: The task in SI, with its frames.
        waypoints, paths: Waypoints and paths of the scenario.
        task_index: Index in the task of each waypoint, increasing.
    """

    reading: TaskReading
    waypoints: Sequence[ScenarioWaypoint]
    paths: Sequence[ScenarioPath]
    task_index: Sequence[int]

    def events(self, *, timed: bool) -> tuple[RequestedEvent, ...]:
        """All events in order of time.

        Args:
            timed: Whether times are known; if not, only positions are checked.

        Raises:
            DocumentError: An event is outside the motion or its path, or before another event of
                its signal that precedes it in the file.
        """
        events = list(self._requested_events())
        if not timed:
            return ()
        last: dict[str | int, Event] = {}
        for location, requested in events:
            event = requested.event
            self._check_inside(location, event)
            before = last.get(event.signal)
            if before is not None and event.time <= before.time:
                raise self.reading.locations.error(
                    location,
                    f"{event.text} ({event.waypoint}) comes at {event.time:.6g} s, not after "
                    f"{before.text} at {before.time:.6g} s, the previous one in the file",
                    "a later time, or the other order",
                )
            last[event.signal] = event
        in_file = (requested for _, requested in events)
        return tuple(sorted(in_file, key=lambda requested: requested.event.time))

    def _requested_events(self) -> Iterator[tuple[Location, RequestedEvent]]:
        for i, waypoint in enumerate(self.reading.task.waypoints):
            waited = 0.0
            for j, action in enumerate(waypoint.actions):
                item = () if isinstance(waypoint.do, Action) else (j,)
                location: Location = ("waypoints", i, "do", *item)
                if action.wait is not None:
                    waited += action.wait
                else:
                    yield location, self._requested_event(i, action, waited, location)

    def _requested_event(
        self, i: int, action: Action, waited: float, location: Location
    ) -> RequestedEvent:
        """The event of an action at waypoint i of the task, after waits of a duration [s]."""
        waypoint = self.waypoints[arrival := bisect_left(self.task_index, i)]
        outputs = self.reading.task.outputs
        if action.output is None:
            name, value = next(iter(action.signals.items()))
        else:
            name = _output_name(action.output, outputs) or f"output {action.output}"
            value = bool(action.value)
        value = parse_switched(value)
        output = outputs.get(name, action.output)
        if output is not None and not isinstance(value, bool):
            raise self.reading.locations.error(
                location, f"{name} is a digital output, and {value!r} is not a state", "on or off"
            )
        moment = action.after or -(action.before or 0.0) or waited
        event = Event(waypoint.time + moment, name, value, waypoint.name, output)
        if not action.at:
            return RequestedEvent(event, moment)
        departure = bisect_right(self.task_index, i) - 1
        reference = departure if action.at > 0.0 else arrival
        path, s = self._locate_on_path(reference, action.at, location)
        time = path.timed_path.start_time + float(path.timed_path.timing.time_of(np.array([s]))[0])
        return RequestedEvent(replace(event, time=time), time - waypoint.time, action.at, path, s)

    def _locate_on_path(self, i: int, at: float, location: Location) -> tuple[ScenarioPath, float]:
        """The path through waypoint i of the scenario, and an arc length along it [m]."""
        location = (*location, "at")
        onward = at > 0.0
        candidates = (
            path for path in self.paths if path.first + (not onward) <= i <= path.last - onward
        )
        path = next(candidates, None)
        name = quoted_waypoint(self.waypoints[i].name)
        if path is None:
            raise self.reading.locations.error(
                location,
                f"no tool path {'begins' if onward else 'ends'} at {name}",
                "after or before: seconds; or at on a path with along",
            )
        lengths = path.requested.lengths
        before, length = sum(lengths[: i - path.first]), sum(lengths)
        s = before + at
        if not -LENGTH_ROUNDING * length <= s <= (1.0 + LENGTH_ROUNDING) * length:
            text = self.reading.units.text
            raise self.reading.locations.error(
                location,
                f"{text(at, 'm')} from {name} is outside the tool path",
                f"from {text(-before, 'm')} to {text(length - before, 'm')}",
            )
        return path, min(max(s, 0.0), length)

    def _check_inside(self, location: Location, event: Event) -> None:
        start, end = self.waypoints[0].time, self.waypoints[-1].time
        if not start - TIME_TOLERANCE <= event.time <= end + TIME_TOLERANCE:
            raise self.reading.locations.error(
                location,
                f"{event.text} ({event.waypoint}) comes at {event.time:.6g} s, outside the motion",
                f"a time from {start:.6g} s to {end:.6g} s",
            )


def action_of(event: Event, outputs: Mapping[str, int]) -> dict[str, Any]:
    """An event as an action of a task with given outputs, without delay."""
    if event.output is None:
        return {event.name: event.value}
    name = _output_name(event.output, outputs)
    if name is None:
        return {"output": event.output, "value": event.value}
    return {name: event.value}


def _output_name(output: int, outputs: Mapping[str, int]) -> str | None:
    """Name of a digital output, or `None`."""
    return next((name for name, number in outputs.items() if number == output), None)
