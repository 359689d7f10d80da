"""One section solved: from several starts, until a motion keeps every limit exactly."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from knotwork.timing.care import first_care, form_of_care, more_care
from knotwork.timing.costs import terms, weighted
from knotwork.timing.problem import TimingProblem
from knotwork.timing.program import joined_limits
from knotwork.timing.section import (
    Found,
    Guess,
    Section,
    plain_guess,
)
from knotwork.timing.spline import PIECES
from knotwork.timing.start import short_durations
from knotwork.timing.watch import Steps, Watch
from knotwork.waypoints import FloatArray

STARTS = (0.85, 0.5, 1.0, 2.0, 4.0, 1.4)
"""Factors of the first durations that are tried until one leads to a solution."""

SMALL = 100
"""Pieces times joints up to which a second start is tried for a better optimum: it costs little."""

MOST_TIMES = 12
"""How often a start is solved again, with more care, before it has failed."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """A motion that keeps every limit.

    Attributes:
        found: The motion.
        cost: What it costs.
        optimal: Whether the solver converged; otherwise the budget ended first.
    """

    found: Found
    cost: float
    optimal: bool


def solved_section(
    problem: TimingProblem,
    watch: Watch,
    guess: Guess | None = None,
    starts: int = len(STARTS),
) -> Attempt | None:
    """Solve a section.

    Args:
        problem: The section.
        watch: What the steps are told to.
        guess: Where to start first.
        starts: How many other starts are tried at most.

    Returns:
        The best motion found, or `None` if there is none.
    """
    large = PIECES * len(problem.position) * len(problem.joint_names) > SMALL
    wanted = 1 if guess is not None or large else 2
    runs: list[_Run] = []
    for start in _starts(problem, guess, starts):
        runs.append(_run(start, problem, watch))
        found = [run.best for run in runs if run.best is not None]
        hopeless = not found and len(runs) > 1 and any(run.infeasible for run in runs)
        if watch.late(found=bool(found)) or len(found) >= wanted or hopeless:
            break
    return min((r.best for r in runs if r.best is not None), key=lambda b: b.cost, default=None)


def _starts(problem: TimingProblem, guess: Guess | None, count: int) -> Iterator[Guess]:
    if guess is not None:
        yield guess
    if not np.isnan(short_durations(problem)).all():
        yield plain_guess(problem, STARTS[0], hurried=True)
    for stretch in STARTS[:count]:
        yield plain_guess(problem, stretch)


@dataclass(frozen=True, eq=False)
class _Run:
    """What one start led to: the best motion, and whether the solver saw that there is none."""

    best: Attempt | None
    infeasible: bool = False


def _run(guess: Guess, problem: TimingProblem, watch: Watch) -> _Run:
    """Solve from one start, with more care each time that the exact check finds an excess."""
    care, x = first_care(problem), None
    best: Attempt | None = None
    for _ in range(MOST_TIMES):
        section = Section(problem, guess, care)
        steps = _steps(section, watch, best)
        solution = section.solve(x, steps if watch.needed else None)
        if not watch.needed:
            watch.iterations += solution.iterations
        if steps.best is not None:
            best = Attempt(steps.best[1], steps.best[0], optimal=False)
        if solution.solved:
            found = section.rebuild(solution.x)
            more = more_care(problem, care, found.curve)
            if more is None:
                return _Run(Attempt(found, weighted(problem, terms(problem, found.curve)), True))
            # with further equations the solution is no good start
            same = form_of_care(more) == form_of_care(care)
            care, x = more, solution.x if same else None
        elif x is None or watch.late(found=best is not None):
            return _Run(best, solution.status == "Infeasible_Problem_Detected")
        else:  # what was near to a solution is none any more: start again
            x = None
    return _Run(best)


def _steps(section: Section, watch: Watch, best: Attempt | None) -> Steps:
    problem = section.problem

    def attempt(x: FloatArray) -> tuple[float, Found] | None:
        found = section.rebuild(x)
        if more_care(problem, section.care, found.curve) is not None:
            return None
        return weighted(problem, terms(problem, found.curve)), found

    known = None if best is None else (best.cost, best.found)
    return Steps(watch, *joined_limits(section.limits()), attempt, known)
