"""`solve_sections`: motions of all timing sections, which share a budget and a total duration."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.errors import TimingError, merge_errors
from knotwork.planning.choosing.clear_sections import plan_clear_section
from knotwork.planning.choosing.solved_scenario import SolvedScenario
from knotwork.planning.choosing.timing_sections import TimingSection
from knotwork.planning.timing import Objective, TimedMotion
from knotwork.planning.timing.budget import Budget
from knotwork.planning.timing.minimum_durations import sufficient_duration
from knotwork.planning.timing.solving import solve_with_budget
from knotwork.units import rounded_up

SMOOTHEST = Objective(time=0.0, jerk=1.0)
"""Objective of a single interval with a given time."""

CALMEST = Objective(time=0.0, acceleration=1.0)
"""Objective of several intervals with given times.

With minimum jerk the accelerations of a short interval would continue in a long one.
"""


class SectionsUnsolvedError(Exception):
    """Limits leave no motion for some sections.

    Attributes:
        sections: These sections.
        error: The reasons, merged into one error.
    """

    def __init__(self, sections: Collection[TimingSection], error: TimingError) -> None:
        super().__init__()
        self.sections, self.error = sections, error


def solve_sections(
    solved: SolvedScenario, sections: list[TimingSection], budget: Budget
) -> dict[TimingSection, TimedMotion]:
    """Solve all sections, with the given total duration if there is one.

    Args:
        solved: The scenario and its IK solutions.
        sections: Its timing sections.
        budget: Budget and progress of all of them.

    Raises:
        SectionsUnsolvedError: Limits leave no motion for some sections.
        NoWayFoundError: A section has no collision-free motion. It is raised at once, because
            another sequence of solutions may have one.
        InputError: A section with `way: clear` can't be solved, or the total is too short.
    """
    unknowns = solved.unknowns
    objective = Objective(**dict(unknowns.objective))
    with_unknown_times = [section for section in sections if section.has_unknown_durations]
    solved_twice = with_unknown_times if unknowns.total_duration is not None else []
    budget.set_intervals(sum(len(section.indices) - 1 for section in sections + solved_twice))
    if unknowns.total_duration is None:
        return _solve_each(sections, objective, budget)
    fastest = _solve_each(with_unknown_times, Objective(), budget)
    chosen = [i for section in with_unknown_times for i in section.indices[:-1]]
    outside = float(np.delete(solved.scenario.durations, chosen).sum())
    shortest = outside + sum(motion.duration for motion in fastest.values())
    if unknowns.total_duration < shortest:
        raise _total_too_short(solved, shortest, fastest.values())
    factor = (unknowns.total_duration - outside) / (shortest - outside)
    totals = {section: factor * motion.duration for section, motion in fastest.items()}
    try:
        return _solve_each(sections, objective, budget, totals)
    except SectionsUnsolvedError as failure:
        failure.error.hint = f"the shortest motion found lasts {rounded_up(shortest):.6g} s"
        raise failure.error from None


def _solve_each(
    sections: list[TimingSection],
    objective: Objective,
    budget: Budget,
    totals: Mapping[TimingSection, float] = MappingProxyType({}),
) -> dict[TimingSection, TimedMotion]:
    """Solve sections one by one, some of them with a total duration [s]."""
    motions: dict[TimingSection, TimedMotion] = {}
    unsolved: list[TimingSection] = []
    errors: list[TimingError] = []
    ends: dict[int, FloatArray] = {}  # of collision-free motions, which choose their solutions
    for section in sections:
        problem = section.timing_problem(objective, totals.get(section))
        if objective.only_time and section not in totals and not problem.duration_is_unknown.any():
            single = len(section.indices) == 2
            problem = replace(problem, objective=SMOOTHEST if single else CALMEST)
        try:
            if section.way is None:
                motions[section] = solve_with_budget(problem, budget)
            else:
                first, *_, last = section.indices
                motion = plan_clear_section(section, problem, budget, ends.get(first))
                motions[section], ends[last] = motion, motion.trajectory.position(motion.duration)
        except TimingError as error:
            unsolved.append(section)
            errors += section.located([error, *error.others])
    if errors:
        raise SectionsUnsolvedError(unsolved, merge_errors(errors))
    return motions


def _total_too_short(
    solved: SolvedScenario, shortest: float, fastest: Collection[TimedMotion]
) -> TimingError:
    """The error for a duration below that of the shortest motion found.

    Args:
        solved: The scenario and its IK solutions.
        shortest: Duration of that motion [s].
        fastest: Its sections.
    """
    limits = [limit for motion in fastest for limit in motion.active_limits]
    longest = max(limits, key=lambda limit: limit.share or 0.0, default=None)
    limited = ""
    if longest is not None:
        of_subject = f" of {longest.subject!r}" if longest.subject else ""
        limited = f", which {longest.quantity.replace('_', ' ')}{of_subject} limits most"
    budget_ended = any(motion.status == "budget" for motion in fastest)
    return TimingError(
        f"{solved.unknowns.total_duration:g} s is shorter than the minimum time found within "
        f"the limits, {rounded_up(shortest):.6g} s{limited}; accepted: "
        f"{sufficient_duration(shortest):.6g} s or more"
        f"{', or a larger budget' if budget_ended else ''}",
        cause="budget" if budget_ended else "duration",
        where=solved.scenario.where("duration"),
    )
