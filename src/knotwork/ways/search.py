"""`find_way`: a motion between two states that keeps every margin, proved, and as fast as found."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.retiming.stops import joint_stop
from knotwork.timing.attempts import resting
from knotwork.timing.problem import TimingProblem
from knotwork.timing.stop_to_stop import braking_move
from knotwork.timing.tightening import keeps_limits
from knotwork.waypoints import FloatArray, IndexArray
from knotwork.ways.configurations import Configurations
from knotwork.ways.exchange import Exchange
from knotwork.ways.problem import NoWayError, Way, WayProblem
from knotwork.ways.proof import not_clear, too_near
from knotwork.ways.rrt import connect, shortened
from knotwork.ways.states import backwards, followed, slowed


class Care(NamedTuple):
    """How carefully a polyline is looked for.

    Attributes:
        step: Edges are sampled at this [rad or m].
        extra: Clearance that samples keep beyond the margins [m].
        checks: Number of configurations looked at before it gives up.
    """

    step: float
    extra: float
    checks: int


CARES = (
    Care(0.05, 5e-3, 20_000),
    Care(0.025, 5e-3, 20_000),
    Care(0.025, 1e-3, 20_000),
    Care(0.0125, 0.0, 40_000),
)
"""Tried in turn until a polyline is proved clear."""

PAIRS = 220
"""With more pairs of solids, fewer configurations are looked at, in the same time."""

ROOMS = (1.0, 0.5, 0.25)
"""Parts of the room that is asked for, tried in turn."""

SEEDS = 3
"""Number of polylines tried with each before the next."""

PIECES_AN_EDGE = 4
FEWEST, MOST = 12, 20
"""Pieces of the motion for each edge of the polyline, and of the whole."""


def find_way(
    problem: WayProblem,
    *,
    tries: int = 1,
    room: float = 0.0,
    late: Callable[[], bool] = lambda: False,
    report: Callable[[int, Way | None], None] = lambda number, best: None,
) -> Way:
    """Find a fast motion between two states that keeps every margin and limit, proved.

    The same problem gives the same motion. More tries can only make it faster.

    Args:
        problem: The states, the limits and the bodies.
        tries: Number of ways that are looked for; the fastest motion is taken.
        room: Clearance that pairs keep beyond their margins [m], or a half, a quarter or nothing of
            it if no way is found with more. A pair keeps no more than half of what it has at the
            waypoints.
        late: Whether the time is over; then the best so far is taken, once there is one.
        report: Called with the number of the try, from 1 on, and the best motion so far, as each
            try begins and when there is a better motion.

    Raises:
        NoWayError: None was found.
    """
    for part in ROOMS if room else ():
        try:
            roomy = _with_room(problem, part * room)
            way = _Search(roomy, CARES[:1], late, report).best_of(tries)
            return replace(way, room=part * room)
        except NoWayError:
            continue
    return _Search(problem, CARES, late, report).best_of(tries)


def lasting(problem: WayProblem, way: Way, duration: float) -> PiecewisePolynomial | None:
    """A way that lasts longer than it has to, or `None` where the arm can't go so slowly.

    Args:
        problem: As for `find_way`.
        way: The fastest.
        duration: How long it is to last [s], no less than the fastest.
    """
    timing = problem.timing
    if not timing.velocity[[0, -1]].any() and not timing.acceleration[[0, -1]].any():
        return slowed(way.curve, duration / way.duration)
    if way.through is None:
        return None
    rests = resting(replace(way.through, total=duration), "resting")
    if rests is None or not_clear(problem.model, rests.found.curve, problem.resolution):
        return None
    return rests.found.curve


def _with_room(problem: WayProblem, room: float) -> WayProblem:
    """The problem with margins that are greater by some room [m]."""
    model, limits = problem.model, problem.timing.limits
    space = Configurations(problem.robot, model, limits)
    least = dict.fromkeys(space.bodies, room)
    for q in (problem.starts[0], *problem.timing.position[1:-1], problem.goals[0]):
        for names, gap in zip(space.bodies, space.gaps(q).tolist(), strict=True):
            least[names] = min(least[names], 0.5 * max(gap, 0.0))
    pairs = []
    for one in model.pairs:
        both = model.bodies[one.first].name, model.bodies[one.second].name
        pairs.append(one._replace(margin=one.margin + least.get(both, 0.0)))
    return replace(problem, model=replace(model, pairs=tuple(pairs)))


def stretches(
    starts: FloatArray, inner: FloatArray, goals: FloatArray
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Where each polyline may begin and end, shape (m, d) each: from waypoint to waypoint."""
    return pairwise([starts, *inner[:, None], goals])


def affordable(checks: int, space: Configurations) -> int:
    """How many configurations are looked at, of a number that few pairs allow."""
    return checks * PAIRS // max(PAIRS, len(space.bodies))


class _Search:
    def __init__(
        self,
        problem: WayProblem,
        cares: Sequence[Care],
        late: Callable[[], bool],
        report: Callable[[int, Way | None], None],
    ) -> None:
        self.problem, self.cares, self.late, self.report = problem, cares, late, report
        timing = problem.timing
        limits = timing.limits
        self.space = Configurations(problem.robot, problem.model, limits, problem.loaded)
        self.inner = timing.position[1:-1]
        starts = self._free("start", problem.starts)
        for k, q in enumerate(self.inner, 1):
            self._free(f"{k}", q[None])
        self.ends = [starts, self._free("goal", problem.goals)]
        # to rest after the start, and from rest to the goal, where they are not straight
        self.runs: list[PiecewisePolynomial | None] = [None, None]
        self.moves = [self._move_to_rest(k, self.ends[k][0]) for k in (0, -1)]
        self.care = 0

    @property
    def rests(self) -> list[FloatArray]:
        """Where the arm is at rest next to each of the starts and goals that are left."""
        return [q + move for q, move in zip(self.ends, self.moves, strict=True)]

    def _free(self, end: str, ends: FloatArray) -> FloatArray:
        """Those of the solutions of an end where the arm is clear."""
        free = self.space.those_free(ends)
        if not len(free):
            gap, bodies = self.space.worst(ends[0])
            raise NoWayError(end, bodies, -gap, solutions=len(ends))
        return free

    def _move_to_rest(self, k: int, q: FloatArray) -> FloatArray:
        """How far from the start, 0, or the goal, -1, the arm is at rest next to it, clear.

        It brakes straight, on a path that is given, or each joint by itself; what leads to the goal
        does so backwards in time.
        """
        timing, problem = self.problem.timing, self.problem
        limits = timing.limits
        v, a = timing.velocity[k] * (-1.0 if k else 1.0), timing.acceleration[k]
        if not v.any() and not a.any():
            return np.zeros_like(q)
        move = braking_move(v, a, limits)
        blame = self._against(k, q, move)
        if blame is None:
            return move
        run = problem.stop() if k == 0 else None
        if run is None or not self._is_possible(run):
            run = joint_stop(q, v, a, limits.acceleration, limits.jerk)
            if not self._is_possible(run):
                raise blame
        self.runs[k] = backwards(run) if k else run
        return np.asarray(run(run.x[-1]) - q)

    def _against(self, k: int, q: FloatArray, move: FloatArray) -> NoWayError | None:
        """What is in the way of a straight move from an end."""
        end, rest = ("goal" if k else "start"), q + move
        if not self.space.within_limits(rest):
            beyond = np.maximum(self.space.lower - rest, rest - self.space.upper)
            return NoWayError(end, depth=float(beyond.max()), joint=int(beyond.argmax()))
        if self._is_clear(np.stack((q, rest))):
            return None
        gap, bodies = min(self.space.worst(q + part * move) for part in np.linspace(0.0, 1.0, 33))
        return NoWayError(end, bodies, max(-gap, 0.0), moving=True)

    def _is_possible(self, run: PiecewisePolynomial) -> bool:
        """Whether a motion is clear and keeps limits."""
        return keeps_limits(self.problem.timing, run) and not not_clear(
            self.problem.model, run, self.problem.resolution
        )

    def _is_clear(self, line: FloatArray) -> bool:
        return not too_near(self.problem.model, line, self.problem.resolution)

    def best_of(self, tries: int) -> Way:
        best: Way | None = None
        for seed in range(tries):
            if best is not None:
                self._leave_out_far_ends(best.duration)
            if best is not None and (self.late() or not len(self.ends[0])):
                break
            self.report(seed + 1, best)
            lines = self._lines(seed)
            if lines is None:
                break
            way = self._fast(lines, best, seed + 1)
            if way is not None and (best is None or way.duration < best.duration):
                best = way
                self.report(seed + 1, best)
        if best is None:
            raise NoWayError(checks=self.space.checks)
        return best

    def _leave_out_far_ends(self, duration: float) -> None:
        """Leave out ends between which no motion takes less than a time, however it goes."""
        first, last = self.ends
        fastest = np.abs(first[:, None] - last) / self.problem.timing.limits.velocity
        near = fastest.max(axis=2) < duration
        self.ends = [first[near.any(axis=1)], last[near.any(axis=0)]]

    def _lines(self, seed: int) -> list[FloatArray] | None:
        """Polylines from each waypoint to the next that are proved clear."""
        found = []
        starts, goals = self.rests
        for k, ends in enumerate(stretches(starts, self.inner, goals)):
            line = self._line([seed, k] if k else [seed], *ends)
            if line is None:
                return None
            found.append(line)
        return found

    def _line(self, seed: list[int], starts: FloatArray, goals: FloatArray) -> FloatArray | None:
        """A polyline that is proved clear."""
        weights = 1.0 / self.problem.timing.limits.velocity
        weights = weights / weights.mean()
        while self.care < len(self.cares):
            step, extra, checks = self.cares[self.care]
            # between all solutions, far ones are joined too soon, so those chosen come first
            few = slice(None if self.care or seed[0] else 1)
            self.space.keep_away(extra, (*starts[few], *goals[few]))
            for k in range(SEEDS):
                rng = np.random.default_rng([*seed, k])
                most = affordable(checks, self.space)
                line = connect(self.space, starts[few], goals[few], rng, step, most)
                if line is None:
                    break
                for one in (shortened(self.space, line, rng, step, weights), line):
                    if len(one) == 1 or self._is_clear(one):
                        return one
            self.care += 1
        return None

    def _fast(self, lines: list[FloatArray], best: Way | None, number: int) -> Way | None:
        """The fastest motion near polylines that follow one another."""
        line = np.concatenate((lines[0][:1], *(one[1:] for one in lines)))
        edges = [len(one) - 1 for one in lines]
        passed, problem = np.cumsum([0, *edges]), self.problem
        inner = self._through(line[passed])
        made = self._first(line, passed)
        if made is None:
            return None
        first, times, through = made
        if not_clear(problem.model, first, problem.resolution) or not keeps_limits(inner, first):
            return None
        way = Way(first, times, line, through, rests=len(line) > len(passed))
        if best is None:
            self.report(number, way)
        pieces = min(max(PIECES_AN_EDGE * max(edges), FEWEST), MOST)
        beat = np.inf if best is None else best.duration
        exchange = Exchange(self.space, inner, first, times, pieces, problem.resolution)
        curve = exchange.run(self.late, beat)
        return way if curve is first else Way(curve, curve.x[::pieces], line, through, rests=False)

    def _first(
        self, line: FloatArray, passed: IndexArray
    ) -> tuple[PiecewisePolynomial, FloatArray, TimingProblem | None] | None:
        """A motion that rests at the corners of a line, its times there, and its problem."""
        before, after = self.runs
        if len(line) == 1:  # one rest for both ends
            if before is None and after is None:
                return None
            curve = followed(before, after)
            return curve, curve.x[[0, -1]], None
        through = self._through(line)
        position, velocity, acceleration = map(
            np.array, (through.position, through.velocity, through.acceleration)
        )
        for k, run in zip((0, -1), self.runs, strict=True):
            if run is not None:
                position[k], velocity[k], acceleration[k] = line[k], 0.0, 0.0
        through = replace(through, position=position, velocity=velocity, acceleration=acceleration)
        rests = resting(through, "resting")
        if rests is None:
            return None
        middle, times = rests.found.curve, rests.found.knots.time[passed]
        if before is None and after is None:
            return middle, times, through
        curve = followed(before, middle, after)
        times = times + (0.0 if before is None else before.x[-1])
        times[[0, -1]] = curve.x[[0, -1]]
        return curve, times, None

    def _through(self, line: FloatArray) -> TimingProblem:
        """The problem with the corners of a polyline as waypoints, at rest at the inner ones."""
        timing = self.problem.timing
        n, d = line.shape
        position, (velocity, acceleration) = np.array(line), np.zeros((2, n, d))
        for k, ends, rests in zip((0, -1), self.ends, self.rests, strict=True):
            position[k] = ends[np.abs(rests - line[k]).max(axis=1).argmin()]
        velocity[[0, -1]] = timing.velocity[[0, -1]]
        acceleration[[0, -1]] = timing.acceleration[[0, -1]]
        return TimingProblem(
            timing.joint_names,
            position,
            velocity,
            timing.limits,
            acceleration=acceleration,
            dynamics=timing.dynamics,
        )
