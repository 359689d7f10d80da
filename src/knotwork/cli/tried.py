"""What makes a plan pass that fails: found by planning it with other knots or one longer move."""

from __future__ import annotations

import time
from bisect import bisect_right
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from knotwork.errors import InputError

if TYPE_CHECKING:
    from knotwork.pipeline import Plan

MOST_SECONDS = 0.3
"""No other is tried after so much time of the processor [s]."""
SHORT = 1.0 / 3.0
"""A move is short if it has at most this part of the time of the longest beside it."""
LONGER = (1.5, 2.0, 3.0, 4.0)
"""So many times its time is tried for a short move."""


def remedies(plan: Plan) -> str:
    """Say with which change a plan passes that fails; empty where none was found.

    Args:
        plan: The plan; of one whose times were chosen nothing is tried.
    """
    from knotwork.interpolation import PLANNER_SPECS, planner_and_rule

    if plan.report.ok or plan.chosen is not None:
        return ""
    name, rule = planner_and_rule(plan.scenario.planner)
    own_knots = "knots" in PLANNER_SPECS[name].supports and "knots" not in rule
    end = time.process_time() + MOST_SECONDS
    found = []
    if own_knots and plan.scenario.knots == "paper" and _passes(plan.scenario, knots="balanced"):
        found.append("with `knots: balanced`")
    short = _short_move(plan)
    if short is None:
        return _tried(found)
    k, beside = short
    last, (first, duration) = plan.scenario.waypoints[k].name, _move(plan, k)
    options = {
        "planner": plan.scenario.planner,
        "knots": plan.scenario.knots if own_knots else None,
    }
    for longer, changed in _with_longer(plan, k):
        if time.process_time() > end:
            break
        if _passes(changed, **options):
            found.append(f"with `after: {longer:g}` for {last!r} in place of {duration:g}")
            break
    return _tried(found) or (
        f"the move from {first!r} to {last!r} has {duration:g} s, beside one of {beside:.4g} s: so "
        "short a move can make those beside it swing out"
    )


def _tried(found: list[str]) -> str:
    return f"tried: it passes {', or '.join(found)}" if found else ""


def _passes(scenario: Any, **options: Any) -> bool:
    from knotwork import pipeline

    try:
        return pipeline.plan(scenario, **options).report.ok
    except InputError:
        return False


def _move(plan: Plan, k: int) -> tuple[str, float]:
    """Where the move to a waypoint begins, and how long it takes [s]."""
    first, last = plan.scenario.waypoints[k - 1 : k + 1]
    return first.name, round(last.time - first.time, 9)


def _short_move(plan: Plan) -> tuple[int, float] | None:
    """Waypoint at the end of the shortest move among those that fail and those beside them.

    A short move can make those beside it swing out, beyond limits and into objects.

    Returns:
        Its index with the time of the longest beside it [s]; `None` if no move is short.
    """
    from knotwork.verification.collisions import GROUP as COLLISIONS
    from knotwork.verification.limits import LIMITS

    times = plan.scenario.times
    found = []
    for failure in plan.report.failures:
        if failure.at is None or failure.group not in (*LIMITS, COLLISIONS):
            continue
        i = min(max(bisect_right(times, failure.at), 1), len(times) - 1)
        near = [k for k in (i - 1, i, i + 1) if 0 < k < len(times)]
        durations = {k: _move(plan, k)[1] for k in near}
        shortest = min(near, key=durations.__getitem__)
        if durations[shortest] <= SHORT * max(durations.values()):
            found.append((durations[shortest], shortest, max(durations.values())))
    return min(found)[1:] if found else None


def _with_longer(plan: Plan, k: int) -> Iterator[tuple[float, Any]]:
    """The scenario with more time for the move to a waypoint, if its file says it in `after`."""
    from knotwork.documents import edited
    from knotwork.scenario import scenario_of

    document = plan.scenario.document
    if document is None:
        return
    for i, row in enumerate(document.data["waypoints"]):
        if row.get("name") != plan.scenario.waypoints[k].name:
            continue
        after = row.get("after")
        if isinstance(after, int | float):
            for factor in LONGER:
                longer = float(f"{factor * after:.2g}")
                yield longer, scenario_of(edited(document, {("waypoints", i, "after"): longer}))
