"""What makes a plan pass that fails: found by planning it with one change."""

from __future__ import annotations

import time
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from knotwork.errors import InputError
from knotwork.verification import Finding
from knotwork.verification.collisions import GROUP as COLLISIONS
from knotwork.verification.limits import LIMITS
from knotwork.verification.report import TRIED

if TYPE_CHECKING:
    from knotwork.pipeline import Plan
    from knotwork.scenario import Scenario

GROUP = "Tried"
MOST_SECONDS = 0.5
"""After so much time of the processor [s] only the first change of a kind is tried."""
SHORT = 1.0 / 3.0
"""A move is short if it has at most this part of the time of the longest beside it."""
LONGER = (1.5, 2.0, 3.0, 4.0)
"""So many times its time is tried for a short move."""
TURNS = (90, -90, 180)
"""So far the tool is turned about its own z axis where it collides [deg]."""


def with_remedies(plan: Plan) -> Plan:
    """Add to the report of a plan that fails with which change it passes, if one is found.

    Other knots are tried, other solutions than those asked for, the tool turned about its axis, and
    more time for a short move.

    Args:
        plan: The plan; of one whose times were chosen nothing is tried.
    """
    if plan.report.ok or plan.chosen is not None:
        return plan
    said = _found(plan)
    if not said:
        return plan
    finding = Finding(GROUP, "motion", "", TRIED, "information", said)
    return replace(plan, report=replace(plan.report, findings=(*plan.report.findings, finding)))


def _found(plan: Plan) -> str:
    """What was found by trying; else that a move is short; empty if it is neither."""
    own_knots = _takes_knots(plan)
    end = time.process_time() + MOST_SECONDS
    given: dict[str, Any] = {
        "planner": plan.scenario.planner,
        "knots": plan.scenario.knots if own_knots else None,
    }
    found: list[str] = []
    if own_knots and plan.scenario.knots == "paper" and _passes(plan.scenario, knots="balanced"):
        found.append("with `knots: balanced`")
    short = _short_move(plan)
    longer = _with_longer(plan, short[0]) if short is not None else ()
    for changes in (_turned(plan), longer):
        for n, (said, changed) in enumerate(changes):
            if n and time.process_time() > end:
                break
            if _passes(changed, **given):
                found.append(said)
                break
    if plan.scenario.branch != "free" and (not found or time.process_time() < end):
        free = replace(plan.scenario, branch="free")
        if _failing_moves(plan, *LIMITS, COLLISIONS) and _passes(
            free, every_sequence=True, **given
        ):
            found.insert(0, "without `branch`")
    if found:
        return f"tried: it passes {', or '.join(found)}"
    if short is None:
        return ""
    first, duration = _move(plan, short[0])
    return (
        f"the move from {first!r} to {plan.scenario.waypoints[short[0]].name!r} has {duration:g} "
        f"s, beside one of {short[1]:.4g} s: so short a move can make those beside it swing out"
    )


def _takes_knots(plan: Plan) -> bool:
    """Whether the planner takes the scenario's knots."""
    from knotwork.interpolation import PLANNER_SPECS, planner_and_rule

    name, rule = planner_and_rule(plan.scenario.planner)
    return "knots" in PLANNER_SPECS[name].supports and "knots" not in rule


def _passes(scenario: Scenario, *, every_sequence: bool = False, **options: Any) -> bool:
    """Whether a scenario passes; by default where its best sequence of solutions does."""
    from knotwork import pipeline

    planned = pipeline.plan if every_sequence else pipeline.plan_once
    try:
        return planned(scenario, **options).report.ok
    except InputError:
        return False


def _move(plan: Plan, k: int) -> tuple[str, float]:
    """Where the move to a waypoint begins, and how long it takes [s]."""
    first, last = plan.scenario.waypoints[k - 1 : k + 1]
    return first.name, round(last.time - first.time, 9)


def _failing_moves(plan: Plan, *groups: str) -> list[int]:
    """The waypoints at the ends of the moves in which findings of these groups fail."""
    times = plan.scenario.times
    failed = (one.at for one in plan.report.failures if one.group in groups)
    ends = (bisect_right(times, at) for at in failed if at is not None)
    return sorted({min(max(i, 1), len(times) - 1) for i in ends})


def _short_move(plan: Plan) -> tuple[int, float] | None:
    """Waypoint at the end of the shortest move among those that fail and those beside them.

    A short move can make those beside it swing out, beyond limits and into objects.

    Returns:
        Its index with the time of the longest beside it [s]; `None` if no move is short.
    """
    found = []
    for i in _failing_moves(plan, *LIMITS, COLLISIONS):
        near = [k for k in (i - 1, i, i + 1) if 0 < k < len(plan.scenario.times)]
        durations = {k: _move(plan, k)[1] for k in near}
        shortest = min(near, key=durations.__getitem__)
        if durations[shortest] <= SHORT * max(durations.values()):
            found.append((durations[shortest], shortest, max(durations.values())))
    return min(found)[1:] if found else None


def _turned(plan: Plan) -> Iterator[tuple[str, Scenario]]:
    """The scenario with the tool turned about its axis on both sides of what collides.

    Along tool paths, and where joint values are given, it stays as it is.
    """
    import numpy as np
    import pinocchio as pin

    from knotwork.waypoints import CartesianWaypoint

    scenario = plan.scenario
    fixed = {k for path in scenario.paths for k in range(path.first, path.last + 1)}
    sides = {k for i in _failing_moves(plan, COLLISIONS) for k in (i - 1, i)}
    poses = {
        k: one
        for k in sorted(sides - fixed)
        if isinstance(one := scenario.waypoints[k], CartesianWaypoint)
    }
    if not poses:
        return
    names = " and ".join(repr(one.name) for one in poses.values())
    for turn in TURNS:
        rotation = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, np.radians(turn)), np.zeros(3))
        waypoints = list(scenario.waypoints)
        for k, one in poses.items():
            waypoints[k] = replace(one, pose=one.pose * rotation)
        yield (
            f"with the tool turned by {turn}° about its z axis at {names}",
            replace(scenario, waypoints=tuple(waypoints)),
        )


def _with_longer(plan: Plan, k: int) -> Iterator[tuple[str, Scenario]]:
    """The scenario with more time for the move to a waypoint, if its file says it in `after`."""
    from knotwork.documents import edited
    from knotwork.scenario import scenario_of

    document = plan.scenario.document
    if document is None:
        return
    name, duration = plan.scenario.waypoints[k].name, _move(plan, k)[1]
    for i, row in enumerate(document.data["waypoints"]):
        after = row.get("after")
        if row.get("name") != name or not isinstance(after, int | float):
            continue
        for factor in LONGER:
            longer = float(f"{factor * after:.2g}")
            said = f"with `after: {longer:g}` for {name!r} in place of {duration:g}"
            yield said, scenario_of(edited(document, {("waypoints", i, "after"): longer}))
