"""Names of segments, and events: as text in tables, or in a separate file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.trajectory import Event, JointTrajectory
from knotwork.curves.trajectory.motion_events import TIME_TOLERANCE
from knotwork.errors import ExportError
from knotwork.errors.plain_text import waypoint_text
from knotwork.files.storage import json_text

EVENTS_FORMAT = "knotwork.events"


def labels_at(trajectory: JointTrajectory, time: FloatArray) -> dict[str, list[str]]:
    """List the segment of each row of a table, and the signals switched since the previous row.

    >>> plan = kw.plan("paper_case")
    >>> labels_at(plan.trajectory, np.array([0.0, 6.0]))["segment"]
    ['A to B', 'B to C']

    Args:
        trajectory: The motion.
        time: Times of the rows [s], shape (s,); the last one is the end of the motion.
    """
    starts = np.array([segment.start for segment in trajectory.segments])
    names = ["", *(segment.name for segment in trajectory.segments)]
    switched: list[list[str]] = [[] for _ in time]
    for event in trajectory.events:
        row = int(np.searchsorted(time, event.time - TIME_TOLERANCE))
        switched[min(row, len(time) - 1)].append(event.text)
    segment = [names[i] for i in np.searchsorted(starts, time, "right")]
    return {"segment": segment, "event": ["; ".join(row) for row in switched]}


def events_text(trajectory: JointTrajectory) -> str:
    """Write events and segments as JSON, with times since the start of the motion [s]."""
    start = trajectory.start_time
    events = [
        {
            "time_from_start": item.time - start,
            **{key: value for key, value in item.to_dict().items() if key != "time"},
        }
        for item in trajectory.events
    ]
    segments = [
        {**item.to_dict(), "start": item.start - start, "end": item.end - start}
        for item in trajectory.segments
    ]
    return json_text(
        {"format": EVENTS_FORMAT, "version": 1, "events": events, "segments": segments}
    )


def events_path(path: Path) -> Path:
    """Path of the separate file of events.

    >>> events_path(Path("motion.yaml")).name
    'motion.events.json'
    """
    return path.with_name(f"{path.stem}.events.json")


def one_ascii_line(name: str) -> str:
    """Write a name in one line of ASCII, so that no part of it can become code of a program."""
    return ascii(name)[1:-1].replace(";", ",")  # a semicolon ends a remark of FANUC


def unsupported_event(event: Event, maker: str, accepted: str) -> ExportError:
    """Make the error for an event that a maker's controller can't switch."""
    return ExportError(
        f"{event.text} at {event.time:.3f} s, {waypoint_text(event.waypoint)}: a program for "
        f"{maker} can't switch it; accepted: on and off, with {accepted}; or no events "
        "(--without-events)",
        time=event.time,
    )
