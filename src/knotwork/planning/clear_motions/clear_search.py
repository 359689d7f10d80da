"""Fast motions between two states, proved to keep every required clearance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from knotwork.arrays import FloatArray, IndexArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.retiming import stop_on_path
from knotwork.curves.retiming.stops import stop_joints
from knotwork.planning.clear_motions.clear_motion_problem import (
    ClearMotion,
    ClearMotionProblem,
    ClearSearchError,
)
from knotwork.planning.clear_motions.configuration_space import ConfigurationSpace
from knotwork.planning.clear_motions.exchange import ExchangeSearch
from knotwork.planning.clear_motions.rrt import connect, polyline_curve, shorten_polyline
from knotwork.planning.timing.budget import Budget
from knotwork.planning.timing.motion_curves import concatenate, reverse, slow_down
from knotwork.planning.timing.stop_to_stop import resting_motion
from knotwork.planning.timing.tightening import exceeded_limit, keeps_limits
from knotwork.planning.timing.timing_problem import TimingProblem


class Stage(NamedTuple):
    """Settings of the samples in one stage of the search.

    Attributes:
        step: Step of samples on edges [rad or m].
        extra_clearance: Clearance of samples beyond the required one [m].
        checks: Maximum number of configurations checked.
    """

    step: float
    extra_clearance: float
    checks: int


STAGES = (
    Stage(0.05, 5e-3, 20_000),
    Stage(0.025, 5e-3, 20_000),
    Stage(0.025, 1e-3, 20_000),
    Stage(0.0125, 0.0, 40_000),
)
"""Stages, in order, until a polyline is proved clear."""

FULL_PAIRS = 220
"""Number of pairs of solids above which fewer configurations are checked, to take the same time."""

CLEARANCE_SHARES = (1.0, 0.5, 0.25)
"""Candidate fractions of the requested clearance, in order."""

BRAKING_SHARES = (1.0, 0.5, 0.25)
"""Candidate fractions of the limits of acceleration and jerk for stops, in order."""

POLYLINE_SEEDS = 3
"""Number of polylines in each stage."""

PIECES_AN_EDGE, MIN_PIECES, MAX_PIECES = 4, 12, 20
"""Pieces of the motion for each edge of the polyline, and their minimum and maximum number."""


def find_clear_motion(
    problem: ClearMotionProblem, budget: Budget, *, tries: int = 1, extra_clearance: float = 0.0
) -> ClearMotion:
    """Find a fast motion between two states, proved to keep every clearance and limit.

    The same problem gives the same motion. It can only be faster with more searches.

    Args:
        problem: The states, the limits and the bodies.
        budget: Computing time, at whose end the best motion so far is returned, if there is one;
            and progress.
        tries: Number of searches; the fastest motion is returned.
        extra_clearance: Clearance beyond that which pairs require [m]. If no motion is found, it
            is reduced to a half, a quarter or zero. That of a pair need not exceed half of its
            clearance at the waypoints.

    Raises:
        ClearSearchError: No motion was found.
    """
    for part in CLEARANCE_SHARES if extra_clearance else ():
        try:
            wider = _with_extra_clearance(problem, part * extra_clearance)
            motion = _ClearSearch(wider, STAGES[:1], budget, tries).run()
            return replace(motion, extra_clearance=part * extra_clearance)
        except ClearSearchError:
            continue
    return _ClearSearch(problem, STAGES, budget, tries).run()


def slow_to_duration(motion: ClearMotion, duration: float) -> PiecewisePolynomial | None:
    """Slow a motion down to a duration; `None` if the arm can't move at this speed.

    Args:
        motion: The fastest motion.
        duration: The new duration [s], not below that of the motion.
    """
    before, middle, after = motion.parts
    if before is None and after is None:
        return slow_down(motion.curve, duration / motion.duration)
    if middle is None:
        return None
    remaining = duration - sum(float(stop.x[-1]) for stop in (before, after) if stop is not None)
    factor = remaining / float(middle.x[-1])
    return concatenate(before, slow_down(middle, factor), after) if factor >= 1.0 else None


def _with_extra_clearance(
    problem: ClearMotionProblem, extra_clearance: float
) -> ClearMotionProblem:
    """The problem with a higher required clearance [m]."""
    model, limits = problem.collision_model, problem.timing.limits
    space = ConfigurationSpace(problem.arm_model, model, limits)
    clearance = dict.fromkeys(space.pair_names, extra_clearance)
    passed = (problem.starts[0], *problem.timing.position[1:-1], problem.goals[0])
    possible = space.possible_clearance(extra_clearance, passed)
    for names, kept in zip(space.pair_names, possible, strict=True):
        clearance[names] = min(clearance[names], float(kept))
    pairs = []
    for pair in model.pairs:
        names = model.bodies[pair.first].name, model.bodies[pair.second].name
        required = pair.required_clearance + clearance.get(names, 0.0)
        pairs.append(pair._replace(required_clearance=required))
    return replace(problem, collision_model=replace(model, pairs=tuple(pairs)))


class _ClearSearch:
    """Searches for a motion between two states; each begins with other random numbers.

    Attributes:
        space: Collision tests, which count the checked configurations.
        inner: Positions of the waypoints between the ends, shape (n-2, d).
        ends: Collision-free solutions of the start and of the goal, shape (m, d) each.
        stops: The motion to rest after the start and the one from rest to the goal; `None` for an
            end at rest.
        resting_ends: Configurations at rest next to the ends, shape (m, d) each.
        stage: Index of the current stage, which later searches keep.
    """

    def __init__(
        self, problem: ClearMotionProblem, stages: Sequence[Stage], budget: Budget, tries: int
    ) -> None:
        self.problem, self.stages, self.budget, self.tries = problem, stages, budget, tries
        model, limits = problem.collision_model, problem.timing.limits
        self.space = ConfigurationSpace(problem.arm_model, model, limits, problem.loaded_arm_model)
        self.inner = problem.timing.position[1:-1]
        starts = self._clear_ends(0, problem.starts)
        for i, q in enumerate(self.inner, 1):
            self._clear_ends(i, q[None])
        goals = self._clear_ends(-1, problem.goals)
        self.ends = [starts, goals]
        before, after = self.stops = [self._stop(end, self.ends[end][0]) for end in (0, -1)]
        self.resting_ends = [
            starts if before is None else before(before.x[-1:]),
            goals if after is None else after(after.x[:1]),
        ]
        self.stage = 0

    def _clear_ends(self, i: int, ends: FloatArray) -> FloatArray:
        """Select the collision-free solutions of waypoint i."""
        clear = ends[[self.space.is_clear(q) for q in ends]]
        if not len(clear):
            gap, bodies = self.space.worst(ends[0])
            raise ClearSearchError(i, bodies, -gap, solutions=len(ends))
        return clear

    def _stop(self, end: int, q: FloatArray) -> PiecewisePolynomial | None:
        """Motion to rest after the start (0) or from rest to the goal (-1), if it moves.

        Each joint brakes independently, or the arm brakes on a given path. Next to the goal the
        motion is reversed in time.
        """
        timing, problem = self.problem.timing, self.problem
        v, a = timing.velocity[end] * (-1.0 if end else 1.0), timing.acceleration[end]
        if not v.any() and not a.any():
            return None
        limits, errors = timing.limits, []

        def candidates() -> Iterator[PiecewisePolynomial | None]:
            for share in BRAKING_SHARES:
                yield stop_joints(q, v, a, limits.scaled(share))
            if end == 0 and problem.continued is not None:
                stop = stop_on_path(*problem.continued, limits)
                if stop is not None:
                    yield stop[1]

        for motion in candidates():
            if motion is None:
                return None  # the arm rests there, within rounding
            error = self._obstruction(end, motion)
            if error is None:
                return reverse(motion) if end else motion
            errors.append(error)
        raise errors[0]

    def _obstruction(self, end: int, motion: PiecewisePolynomial) -> ClearSearchError | None:
        """Obstruction of a motion from the start (0) or the goal (-1) to rest."""
        reached = motion.extrema(0)
        beyond = np.maximum(self.space.lower - reached.minimum, reached.maximum - self.space.upper)
        if beyond.max() > 0.0:
            k = int(beyond.argmax())
            return ClearSearchError(end, shortfall=float(beyond[k]), limit="position", joint=k)
        if unproved := self.problem.unproved_pairs(motion):
            worst = min(unproved, key=lambda pair: pair.gap)
            names = worst.first.name, worst.second.name
            shortfall = max(-worst.gap, 0.0)
            return ClearSearchError(end, names, shortfall, moving=True)
        if (excess := exceeded_limit(self.problem.timing, motion)) is None:
            return None
        limit, utilisation = excess
        return ClearSearchError(end, limit=limit, joint=int(utilisation.max(axis=0).argmax()))

    def run(self) -> ClearMotion:
        """The fastest motion of all searches."""
        best: ClearMotion | None = None
        number = 0
        while number < self.tries and (best is None or not self.budget.has_ended):
            number += 1
            self._report(number, best)
            lines = self._polylines(number - 1)
            if lines is None:
                break
            motion = self._optimised_motion(lines, best, number)
            if motion is not None and (best is None or motion.duration < best.duration):
                best = motion
                self._report(number, best)
        if best is None:
            raise ClearSearchError(checks=self.space.checks)
        return replace(best, tries=number)

    def _report(self, number: int, best: ClearMotion | None) -> None:
        """Report the progress of a search, and the best motion so far."""
        duration = None if best is None else best.duration
        self.budget.report(0, duration, f"way {number} of {self.tries}", (number - 1) / self.tries)

    def _polylines(self, seed: int) -> list[FloatArray] | None:
        """Polylines between consecutive waypoints, proved clear, or `None`."""
        lines = []
        starts, goals = self.resting_ends
        for k, ends in enumerate(pairwise([starts, *self.inner[:, None], goals])):
            line = self._polyline([seed, k] if k else [seed], *ends)
            if line is None:
                return None
            lines.append(line)
        return lines

    def _polyline(
        self, seed: list[int], starts: FloatArray, goals: FloatArray
    ) -> FloatArray | None:
        """A polyline from a start to a goal, proved clear, or `None`.

        A stage without one is left for good. The space keeps the clearance of the last stage.

        Args:
            seed: Index of the search; after its first polyline also that of the polyline.
            starts: Possible first configurations, shape (m, d).
            goals: Possible last configurations, shape (m, d).
        """
        weights = 1.0 / self.problem.timing.limits.velocity
        weights = weights / weights.mean()
        while self.stage < len(self.stages):
            step, extra_clearance, checks = self.stages[self.stage]
            # first the chosen solutions alone, because the trees connect distant ones too early
            is_first = self.stage == 0 and seed[0] == 0
            tried = slice(1 if is_first else None)
            self.space.keep_away(extra_clearance, (*starts[tried], *goals[tried]))
            for k in range(POLYLINE_SEEDS):
                rng = np.random.default_rng([*seed, k])
                max_checks = checks * FULL_PAIRS // max(FULL_PAIRS, len(self.space.pair_names))
                line = connect(self.space, starts[tried], goals[tried], rng, step, max_checks)
                if line is None:
                    break
                for candidate in (shorten_polyline(self.space, line, rng, step, weights), line):
                    curve = polyline_curve(candidate)
                    if len(candidate) == 1 or not self.problem.unproved_pairs(curve):
                        return candidate
            self.stage += 1
        return None

    def _optimised_motion(
        self, lines: list[FloatArray], best: ClearMotion | None, number: int
    ) -> ClearMotion | None:
        """The fastest motion near consecutive polylines."""
        line = np.concatenate((lines[0][:1], *(part[1:] for part in lines)))
        edges = [len(part) - 1 for part in lines]
        passed = np.cumsum([0, *edges])
        motion = self._first_motion(line, passed)
        if motion is None:
            return None
        ends = self._timing_problem(line[passed], moving=True)
        unproved_pairs = self.problem.unproved_pairs
        if unproved_pairs(motion.curve) or not keeps_limits(ends, motion.curve):
            return None
        if best is None:
            self._report(number, motion)
        pieces = min(max(PIECES_AN_EDGE * max(edges), MIN_PIECES), MAX_PIECES)
        exchange = ExchangeSearch(
            self.space, ends, motion.curve, motion.time, pieces, unproved_pairs
        )
        faster = exchange.run(self.budget, np.inf if best is None else best.duration)
        if faster is motion.curve:
            return motion
        return replace(motion, curve=faster, time=faster.x[::pieces], rests=False)

    def _first_motion(self, line: FloatArray, passed: IndexArray) -> ClearMotion | None:
        """A motion that rests at the corners of a line, of which some are waypoints, or `None`."""
        before, after = self.stops
        middle = None
        times = np.zeros(len(passed))
        if len(line) > 1:  # otherwise both ends have the same configuration at rest
            rests = resting_motion(self._timing_problem(line, moving=False), "resting")
            if rests is None:
                return None
            middle = rests.curve
            times = rests.time[passed]
        parts = before, middle, after
        if parts == (None, None, None):
            return None
        curve = concatenate(*parts)
        times = times + (0.0 if before is None else before.x[-1])
        times[[0, -1]] = curve.x[[0, -1]]
        return ClearMotion(curve, times, line, parts, rests=len(line) > len(passed))

    def _timing_problem(self, line: FloatArray, *, moving: bool) -> TimingProblem:
        """The problem with rests at the corners of a polyline.

        Args:
            line: The polyline, shape (n, d).
            moving: Whether its ends are the start and the goal, not the configurations at rest next
                to them.
        """
        timing, position = self.problem.timing, np.array(line)
        velocity, acceleration = np.zeros((2, *line.shape))
        for end in (0, -1) if moving else ():
            distance = np.abs(self.resting_ends[end] - line[end]).max(axis=1)
            position[end] = self.ends[end][distance.argmin()]
            velocity[end], acceleration[end] = timing.velocity[end], timing.acceleration[end]
        return TimingProblem(
            timing.joint_names,
            position,
            velocity,
            timing.limits,
            acceleration=acceleration,
            tool_speed=timing.tool_speed,
            dynamics=timing.dynamics,
        )
