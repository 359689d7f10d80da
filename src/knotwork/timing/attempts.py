"""One section solved: from several starts, until a motion keeps every limit exactly."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from knotwork.timing.care import (
    first_care,
    first_efforts,
    form_of_care,
    keeps_limits,
    more_care,
    without_efforts,
)
from knotwork.timing.costs import terms, weighted
from knotwork.timing.efforts import effort_shares
from knotwork.timing.motion import Status
from knotwork.timing.problem import Objective, TimingProblem
from knotwork.timing.program import Solution, joined_limits
from knotwork.timing.rebuild import Knots, rebuilt, slower_knots
from knotwork.timing.rests import with_rests
from knotwork.timing.section import (
    Care,
    Found,
    Guess,
    Section,
    near_guess,
    plain_guess,
    slower_guess,
    stretched_guess,
)
from knotwork.timing.spline import PIECES, pieces_each
from knotwork.timing.start import between_stops, short_durations
from knotwork.timing.watch import Steps, Watch
from knotwork.waypoints import FloatArray

STARTS = (0.85, 0.5, 1.0, 2.0, 4.0, 1.4)
"""Factors of the first durations that are tried until one leads to a solution."""

MOST_SLOWED = 2.5
"""Where efforts bind, the motion without their limits is a start, so many times slower at most."""

SLOWED = 1.5
"""Another start is so many times slower than it."""

ROOM = 1.05
"""The first is slower by this factor than it would be if efforts fell with the square of time."""

HEAVY_STARTS = 4
"""So many of these others are tried where efforts bind."""

SMALL = 100
"""Pieces times joints up to which a second start is tried for a better optimum: it costs little."""

SWINGS = 1e-6
"""A joint with nowhere to go swings out if its acceleration at a waypoint is above this part of its
greatest one."""

COSTLESS = 1e-6
"""Joints are kept still if the objective grows by no more than this part of it."""

SLOWER = (1.01, 1.1, 1.3, 1.6, 2.0, 3.0, 4.0, 6.0, 9.0)
"""So many times slower are motions that were not searched for, tried where the budget has ended."""

HALVINGS = 3
"""So often the step between what is too fast and what is not is halved then."""

HARDLY = 1.001
"""So much longer than the fastest motion a motion can only be much like it."""

MOST_TIMES = 12
"""How often a start is solved again, with more care, before it has failed."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """A motion that keeps every limit.

    Attributes:
        found: The motion.
        cost: What it costs.
        status: As of a `TimedMotion`.
        care: What the solver was held to.
    """

    found: Found
    cost: float
    status: Status
    care: Care

    @property
    def optimal(self) -> bool:
        """Whether the solver converged."""
        return self.status == "optimal"


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
        starts: How many other starts are tried at most; with one, the first motion is taken.

    Returns:
        The best motion found, or `None` if there is none.
    """
    large = PIECES * problem.position.size > SMALL
    wanted = 1 if guess is not None or large or starts == 1 else 2
    runs: list[_Run] = []
    for start, care in _starts(problem, watch, guess, starts, runs):
        if watch.late(found=False):
            break
        begun = watch.now()
        runs.append(_run(start, problem, watch, care))
        found = [run.best for run in runs if run.best is not None and run.best.optimal]
        hopeless = not found and len(runs) > 1 and any(run.infeasible for run in runs)
        # where efforts bind, further starts cost much and fail more often
        heavy = any(one.care.effort is not None for one in found) and runs[-1].best is not found[0]
        enough = len(found) >= wanted or hopeless or heavy
        kept = any(run.best is not None for run in runs)
        if enough or watch.late(found=kept, ahead=watch.now() - begun if kept else 0.0):
            break
    best = min((r.best for r in runs if r.best is not None), key=lambda b: b.cost, default=None)
    if best is None and not watch.late(found=False):
        best = _from_fastest(problem, watch, starts)
    stopped = watch.late(found=False) if best is None else best.status == "stopped"
    if stopped:
        quick = [
            best,
            stopping(problem),
            *(_slowed(problem, one) for run in runs for one in run.near),
        ]
        return min((one for one in quick if one is not None), key=lambda b: b.cost, default=None)
    if best is None or watch.late(found=True):
        return best
    return _with_idle_joints_still(problem, watch, best)


def with_longer(problem: TimingProblem, part: float = 1.0) -> TimingProblem:
    """The problem of the least time, with durations no shorter than parts of those given."""
    return replace(
        problem,
        duration=np.full(problem.duration.shape, np.nan),
        at_least=np.where(problem.free, problem.at_least, part * problem.duration),
        total=None,
        objective=Objective(),
    )


def _from_fastest(problem: TimingProblem, watch: Watch, starts: int) -> Attempt | None:
    """A motion in given time, from the fastest one, stretched, or from one that lasts no less."""
    if problem.total is not None:
        fastest = [replace(problem, total=None, objective=Objective())]
    elif not problem.free.all():
        fastest = [with_longer(problem, part) for part in (0.0, 1.0)]
    else:
        return None
    for one in fastest:
        found = solved_section(one, watch, starts=starts)
        if found is None:
            continue
        guess, care = stretched_guess(found.found, problem), first_care(problem)
        if found.care.effort is not None:
            # held to efforts from the first step on, or it would leave the only place with room
            guess, care = replace(guess, near=False), replace(found.care, still=None)
        best = _run(guess, problem, watch, care).best or _hardly_slower(problem, found.found)
        if best is not None:
            return best
    return None


def _hardly_slower(problem: TimingProblem, fastest: Found) -> Attempt | None:
    """The fastest motion, slowed to the total given, where next to no other is left room for."""
    knots = fastest.knots
    if problem.total is None or not _scales(problem):
        return None
    times = problem.total / float(np.ptp(knots.time))
    return _kept(problem, slower_knots(knots, times), "stretched") if times <= HARDLY else None


def stopping(problem: TimingProblem) -> Attempt | None:
    """A motion that comes to rest in every interval, if that is allowed: it needs no search."""
    return _no_slower_than_need_be(
        problem, lambda slower: with_rests(problem, pieces_each(1), slower)
    )


def _slowed(problem: TimingProblem, found: Found) -> Attempt | None:
    """What the solver had come to, so slow that it keeps every limit, if it may be slower."""
    if problem.total is not None or not _scales(problem):
        return None
    return _no_slower_than_need_be(problem, lambda slower: slower_knots(found.knots, slower))


def _scales(problem: TimingProblem) -> bool:
    """Whether all of a motion may be slower: no time, velocity or acceleration fixes its scale."""
    moving = problem.velocity_known[:, None] & (problem.velocity != 0.0)
    moving |= problem.acceleration_known[:, None] & (problem.acceleration != 0.0)
    return bool(problem.free.all() and not moving.any())


def _kept(problem: TimingProblem, knots: Knots, status: Status) -> Attempt | None:
    """A motion that was not searched for, if it keeps every limit."""
    found = Found(knots, rebuilt(knots))
    if not keeps_limits(problem, found.curve):
        return None
    cost = weighted(problem, terms(problem, found.curve))
    return Attempt(found, cost, status, first_care(problem))


def _no_slower_than_need_be(
    problem: TimingProblem, made: Callable[[float], Knots | None]
) -> Attempt | None:
    """The first of ever slower motions that keeps every limit; they were not searched for."""

    def kept(slower: float) -> Attempt | None:
        knots = made(slower)
        return None if knots is None else _kept(problem, knots, "stopped")

    low = 1.0
    for high in SLOWER:
        best = kept(high)
        if best is None:
            low = high
            continue
        for _ in range(HALVINGS):
            middle = float(np.sqrt(low * high))
            tried = kept(middle)
            low, high, best = (middle, high, best) if tried is None else (low, middle, tried)
        return best
    return None


def _with_idle_joints_still(problem: TimingProblem, watch: Watch, best: Attempt) -> Attempt:
    """Keep joints still that have nowhere to go, if it costs nothing.

    A joint that stands still at two waypoints, at the same place, may have an acceleration there
    that suits the intervals beside, and then it swings out between them.
    """
    stands = problem.velocity_known[:, None] & (problem.velocity == 0.0)
    idle = stands[:-1] & stands[1:] & (np.diff(problem.position, axis=0) == 0.0)
    ends = np.abs(best.found.knots.acceleration[:, [0, -1]]).max(axis=1)
    swings = idle & (ends > SWINGS * best.found.curve.extrema(2).peak)
    if not swings.any():
        return best
    still = np.zeros(problem.position.shape, dtype=bool)
    still[:-1] |= swings
    still[1:] |= swings
    found = _run(near_guess(best.found), problem, watch, replace(best.care, still=still)).best
    return best if found is None or found.cost > (1.0 + COSTLESS) * best.cost else found


def _starts(
    problem: TimingProblem, watch: Watch, guess: Guess | None, count: int, runs: list[_Run]
) -> Iterator[tuple[Guess, Care]]:
    """Where to start, and with what care; what earlier runs found decides about later ones."""
    care = first_care(problem)
    if guess is not None:
        yield guess, care
    known = between_stops(problem, pieces_each(1))
    if known is not None:
        yield near_guess(Found(known, rebuilt(known))), care
    if not np.isnan(short_durations(problem)).all():
        yield plain_guess(problem, STARTS[0], hurried=True), care
    fast = None
    if care.effort is not None:
        loose = without_efforts(problem)
        light = _run(plain_guess(loose, STARTS[0]), loose, watch, first_care(loose)).best
        fast = None if light is None else light.found
        if fast is not None:
            yield _lighter_guess(problem, fast), care
    varied = problem.free.any() and problem.total is None
    for k, stretch in enumerate(STARTS[:count]):
        if k == 1 and fast is None:
            fast = next((run.light for run in runs if run.light is not None), None)
        if k == 1 and fast is not None:
            care = first_efforts(problem)
            yield slower_guess(fast, SLOWED), care
        if k == 0 or (varied and (fast is None or k < HEAVY_STARTS)):
            yield plain_guess(problem, stretch), care


@dataclass(frozen=True, eq=False)
class _Run:
    """What one start led to.

    Attributes:
        best: The best motion, if one was found.
        infeasible: Whether the solver saw that there is none.
        light: A motion that keeps all limits but those of effort, if it was found on the way.
        near: What the solver came to without a solution, where there is a budget.
    """

    best: Attempt | None
    infeasible: bool = False
    light: Found | None = None
    near: tuple[Found, ...] = ()


def _run(guess: Guess, problem: TimingProblem, watch: Watch, care: Care) -> _Run:
    """Solve from one start, with more care each time that the exact check finds an excess."""
    last: Solution | None = None
    best: Attempt | None = None
    light: Found | None = None
    near: Found | None = None
    again = False
    for _ in range(MOST_TIMES):
        section = Section(problem, guess, care)
        steps = _steps(section, watch, best)
        solution = section.solve(last, steps if watch.needed else None)
        if not watch.needed:
            watch.iterations += solution.iterations
        if steps.best is not None:
            best = Attempt(steps.best[1], steps.best[0], "stopped", care)
        if solution.solved:
            near = section.rebuild(solution.x)
            more = more_care(problem, care, near.curve)
            if more is None:
                cost = weighted(problem, terms(problem, near.curve))
                return _Run(Attempt(near, cost, "optimal", care), light=light)
            if care.effort is None and more.effort is not None and not guess.near:
                light, guess = near, _lighter_guess(problem, near)
            # with further equations the solution is no good start
            same = form_of_care(more) == form_of_care(care)
            care, last = more, solution if same else None
        elif last is None or again or watch.late(found=best is not None):
            infeasible = solution.status == "Infeasible_Problem_Detected" and last is None
            came = [] if watch.budget is None else [section.rebuild(solution.x)]
            came += [] if near is None else [near]
            return _Run(best, infeasible, light, tuple(came))
        else:  # what was near to a solution is none any more: start again, once
            last, again = None, True
    return _Run(best, light=light, near=() if near is None else (near,))


def _lighter_guess(problem: TimingProblem, fast: Found) -> Guess:
    """A motion found without limits of effort, slowed by as much as it exceeds them."""
    share = float(effort_shares(problem, fast.curve).max())
    return slower_guess(fast, float(np.clip(ROOM * np.sqrt(share), 1.0, MOST_SLOWED)))


def _steps(section: Section, watch: Watch, best: Attempt | None) -> Steps:
    problem = section.problem

    def attempt(x: FloatArray) -> tuple[float, Found] | None:
        found = section.rebuild(x)
        if more_care(problem, section.care, found.curve) is not None:
            return None
        return weighted(problem, terms(problem, found.curve)), found

    known = None if best is None else (best.cost, best.found)
    return Steps(watch, *joined_limits(section.limits()), attempt, known)
