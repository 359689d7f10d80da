"""Collisions of a plan that `way: clear` could avoid."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from knotwork.curves.interpolation import PLANNER_SPECS, planner_and_rule
from knotwork.planning.planned_motion import Plan
from knotwork.task.scenario import Scenario, ScenarioUnknowns
from knotwork.verification.collisions import failed_pairs
from knotwork.verification.motion import AT_WAYPOINT


def find_avoidable_ends(plan: Plan, scenario_with_unknowns: Scenario) -> list[int]:
    """Ends of the motions that may avoid their collisions with `way: clear`, by index of waypoint.

    A motion can avoid a collision between its waypoints, but none at a waypoint.

    Args:
        plan: The plan that collides.
        scenario_with_unknowns: Its scenario before unknowns were chosen.
    """
    planner, _ = planner_and_rule(plan.scenario.planner)
    if "chosen" not in PLANNER_SPECS[planner].supports or scenario_with_unknowns.task.chosen:
        return []
    unknowns = scenario_with_unknowns.unknowns
    beginning, at_waypoints = set[int](), set[int]()
    for start, end in (s for pair in failed_pairs(plan.report.findings) for s in pair.intervals):
        span = start - AT_WAYPOINT, end + AT_WAYPOINT
        first, after = np.searchsorted(plan.scenario.times, span).tolist()
        beginning.add(first)  # the collision begins in the motion to this waypoint
        if first < after:  # and lasts until the motion from the last colliding waypoint
            at_waypoints.update(range(first, after + 1))
    avoidable = beginning - _given_motions(plan, unknowns)
    return [
        i
        for ends in _ends_of_motions(plan, unknowns)
        if avoidable.intersection(ends) and not at_waypoints.intersection(ends)
        for i in ends
    ]


def _given_motions(plan: Plan, unknowns: ScenarioUnknowns | None) -> set[int]:
    """Ends of tool paths, waits and motions with a way of their own, by index of waypoint."""
    ends = {i for path in plan.scenario.paths for i in range(path.first + 1, path.last + 1)}
    ways = {i for i, at in enumerate(unknowns.at_waypoints) if at.way} if unknowns else set()
    return ends | {i + 1 for i in plan.joints.rest_intervals} | ways


def _ends_of_motions(plan: Plan, unknowns: ScenarioUnknowns | None) -> Iterator[range]:
    """For each motion between stops, the waypoints passed at unknown velocity, and its end."""
    last, first = len(plan.scenario.waypoints) - 1, 1
    for i in range(1, last + 1):
        if unknowns is None or unknowns.at_waypoints[i].velocity_kind != "unknown" or i == last:
            yield range(first, i + 1)
            first = i + 1
