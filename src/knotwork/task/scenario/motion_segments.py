"""Segments of a motion: free motions, tool paths, waits and motions found by `way: clear`."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from knotwork.curves.trajectory.motion_events import TIME_TOLERANCE, Segment, SegmentKind
from knotwork.task import ChosenSectionFields
from knotwork.task.scenario.scenario import Scenario
from knotwork.task.scenario.unknowns_reader import ends_wait


class StoredClearMotion(NamedTuple):
    """A collision-free motion that a task has as numbers.

    Attributes:
        indices: Indices of its waypoints in the scenario.
        section: The motion.
    """

    indices: list[int]
    section: ChosenSectionFields


def stored_clear_motions(scenario: Scenario) -> Iterator[StoredClearMotion]:
    """The collision-free motions in the task of a scenario."""
    times = scenario.expected_times
    for motion in scenario.task.chosen or ():
        if motion.tries:
            low, high = motion.times[0] - TIME_TOLERANCE, motion.times[-1] + TIME_TOLERANCE
            inside = np.flatnonzero((low <= times) & (times <= high)).tolist()
            yield StoredClearMotion(inside, motion)


def motion_segments(scenario: Scenario, motion_starts: Collection[int] = ()) -> tuple[Segment, ...]:
    """Segments of a motion, from waypoint to waypoint.

    Args:
        scenario: The scenario, with all times known.
        motion_starts: Indices of the waypoints at the start of a motion found by `way: clear`.

    >>> [one.name for one in motion_segments(kw.load_scenario("ur5_deburring"))][:2]
    ['start to approach', 'approach to edge start']
    """
    along = {i for path in scenario.paths for i in range(path.first, path.last)}
    ends = [ends_wait(scenario.task_index, i) for i in range(len(scenario.waypoints))]
    parts = []
    for i, (first, second) in enumerate(pairwise(scenario.waypoints)):
        begin = scenario.waypoints[i - ends[i]].name
        kind: SegmentKind = "free motion"
        if ends[i + 1]:
            kind = "wait"
        elif i in along:
            kind = "tool path"
        elif i in motion_starts:
            kind = "way"
        name = f"wait at {begin}" if kind == "wait" else f"{begin} to {second.name}"
        parts.append(Segment(name, first.time, second.time, kind))
    return tuple(parts)
