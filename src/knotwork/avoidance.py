"""The next best sequences of solutions, tried where a motion collides between its waypoints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from knotwork.errors import InputError
from knotwork.scenario import Scenario
from knotwork.task_to_joint import TaskSolution
from knotwork.verification import Finding
from knotwork.verification.collisions import GROUP, failed_pairs

PlanT = TypeVar("PlanT", bound=Any)
"""A plan, of which scenario, report and solution are looked at."""

MOST_SEQUENCES = 12
"""So many sequences of solutions are tried at most, the best one included."""


MOST_TIMED = 4
"""So many where the times are chosen anew for each."""


def without_collisions(
    first: PlanT, made: Callable[[TaskSolution], PlanT], most: int = MOST_SEQUENCES
) -> PlanT:
    """Take the best sequence of solutions whose motion collides nowhere.

    Where the motion of a sequence collides between two waypoints, the solutions that it has at both
    are not taken together again, and the next best sequence is planned. If all of them collide, the
    one with the fewest colliding pairs is given, and its report says how many were tried.

    Args:
        first: The plan of the best sequence.
        made: Plans another one.
        most: So many are tried, the first one included.
    """
    best, current, tried = first, first, 1
    while (failed := failed_pairs(current.report.findings)) and tried < most:
        solution = current.solution
        other = solution.avoiding(_intervals(failed, current.scenario)) if solution else None
        if other is None:
            break
        tried += 1
        try:
            current = made(other)
        except InputError:  # there is no such motion, however slow
            break
        if _worth(current) < _worth(best):
            best = current
    if tried == 1:
        return first
    return _with_finding(best, tried)


def _worth(plan: Any) -> tuple[int, int]:
    """What a plan is judged by, smaller is better: pairs that collide, and all else that fails."""
    return len(failed_pairs(plan.report.findings)), len(plan.report.failures)


def _intervals(failed: list[Finding], scenario: Scenario) -> list[int]:
    """The intervals between waypoints in which pairs collide, by the waypoint they begin at."""
    times = scenario.times
    when = [found.at for found in failed if found.at is not None]
    index = np.searchsorted(times, when, side="right") - 1
    return sorted(set(np.clip(index, 0, len(times) - 2).tolist()))


def _with_finding(plan: PlanT, tried: int) -> PlanT:
    """The plan with a finding on how many sequences of solutions were tried."""
    ok = not failed_pairs(plan.report.findings)
    message = (
        f"the motion of the best sequence of solutions collides; of {tried} sequences tried this "
        f"is {'the first that does not' if ok else 'the one with the fewest colliding pairs'}"
    )
    finding = Finding(
        group=GROUP,
        subject="motion",
        name="",
        quantity="sequences_tried",
        verdict="information",
        message=message,
    )
    report = replace(plan.report, findings=(*plan.report.findings, finding))
    return replace(plan, report=report)
