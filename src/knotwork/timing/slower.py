"""What is given at waypoints beyond a limit, and what part of it would do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from knotwork.errors import TimingError
from knotwork.timing.feasible import Fault, faults
from knotwork.timing.holding import too_heavy
from knotwork.timing.problem import Objective, TimingProblem, part_of
from knotwork.timing.safe_numbers import rounded_down
from knotwork.timing.search import OutOfStepsError, Search

AROUND = 2
"""So many intervals on both sides of a waypoint are solved with a velocity that is proposed."""

LESS = (0.0, 0.003, 0.01, 0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""Parts by which a velocity is lowered, below what the limits rule out, until a motion is found."""

HALVINGS = 3
"""So often the step between what does and what does not is halved."""

DIGITS = 4
"""Digits of a factor that is proposed."""


def given_errors(problem: TimingProblem) -> list[TimingError]:
    """Say what is given at waypoints beyond a limit, and what part of it would do.

    A part that would do is one with which a motion was found, around the waypoint.

    Returns:
        An error for each waypoint and quantity, and one for efforts; empty where nothing is beyond
        a limit.
    """
    found = faults(problem)
    search = Search()
    heavy = too_heavy(problem, certain=True)
    return [*heavy, *(_error(problem, one, found, search) for one in found)]


def _error(
    problem: TimingProblem, fault: Fault, others: Sequence[Fault], search: Search
) -> TimingError:
    bound = fault.bound
    if fault.given == "position":
        advice = ""
    else:
        factor = _possible(problem, fault, others, search)
        if factor is not None:
            bound = factor * fault.value
            advice = f". {factor:g} times the {fault.given} given here would do"
        else:
            most = rounded_down(fault.factor, DIGITS)
            advice = (
                f". At most {most:g} times the {fault.given} given here is possible, and with jerk "
                "and the other waypoints perhaps less"
            )
    return TimingError(
        fault.said + advice,
        waypoint=fault.waypoint,
        joint=problem.joint_names[fault.joint],
        limit=fault.limit,
        value=fault.value,
        bound=bound,
    )


def _possible(
    problem: TimingProblem, fault: Fault, others: Sequence[Fault], search: Search
) -> float | None:
    """The largest part of what is given with which a motion is found around the waypoint."""

    def does(factor: float) -> bool:
        tried = _lowered(problem, fault, factor)
        for one in others:
            if one.waypoint != fault.waypoint and one.given != "position":
                tried = _lowered(tried, one, one.factor)
        first = max(0, fault.waypoint - AROUND)
        last = min(len(problem.position) - 1, fault.waypoint + AROUND)
        part = replace(part_of(tried, first, last), total=None, objective=Objective())
        return search.solved(part) is not None

    def lowered(less: float) -> float:
        return rounded_down(fault.factor * (1.0 - less), DIGITS)

    try:
        least = next((k for k, less in enumerate(LESS) if does(lowered(less))), None)
        if least is None:
            return None
        low, high = LESS[max(least - 1, 0)], LESS[least]
        for _ in range(HALVINGS if least else 0):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if does(lowered(middle)) else (middle, high)
    except OutOfStepsError:
        return None
    return lowered(high)


def _lowered(problem: TimingProblem, fault: Fault, factor: float) -> TimingProblem:
    """The problem with part of what is given at a waypoint."""
    values = np.array(getattr(problem, fault.given))
    values[fault.waypoint] *= factor
    changed: Any = {fault.given: values}
    return replace(problem, **changed)
