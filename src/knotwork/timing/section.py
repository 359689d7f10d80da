"""One section of a motion: from the problem to a program, and from its solution to a curve."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.timing.efforts import EFFORT_PARTS, TOOL_PARTS
from knotwork.timing.motion import TimedMotion
from knotwork.timing.problem import PEAKS, BoolArray, TimingProblem
from knotwork.timing.program import Program, Solution
from knotwork.timing.rebuild import Knots, rebuilt
from knotwork.timing.spline import Form, Scale, blocks, layout, pieces_each, unpacked
from knotwork.timing.start import first_durations, first_velocities, plain_cubic, short_durations
from knotwork.timing.watch import OnStep
from knotwork.waypoints import FloatArray

MARGIN = 1e-6
"""Part of each limit that the solver leaves, so that its tolerance never shows as a violation."""

SLACK = 1e-10
"""A limit counts as kept if it is exceeded by no more than this part of it: rounding."""

EVEN = 3e-4
"""Weight of the unevenness of the pieces of an interval, where nothing else decides it."""

CALM = 1e-4
"""Weight of accelerations, so that joints that are not in a hurry move no more than they must.

No motion is longer by more than this part for it.
"""

SHORTEST = 1e-4
"""No piece is shorter than this part of its first guess."""

LONG = {"ipopt.mu_strategy": "adaptive"}
"""Options of IPOPT for motions of `MANY` intervals and more: a third fewer steps."""

MANY = 12

StartKind = Literal["far", "near", "again"]

NEAR = {"ipopt.mu_init": 1e-4}
"""Options of IPOPT for a start that is near to the solution."""

AGAIN = {
    "ipopt.mu_init": 1e-9,
    "ipopt.warm_start_init_point": "yes",
    "ipopt.warm_start_bound_push": 1e-8,
    "ipopt.warm_start_bound_frac": 1e-8,
    "ipopt.warm_start_slack_bound_push": 1e-8,
    "ipopt.warm_start_slack_bound_frac": 1e-8,
    "ipopt.warm_start_mult_bound_push": 1e-8,
}
"""Options of IPOPT for a start from the solution of a problem whose limits differ a little."""


@dataclass(frozen=True, eq=False)
class Guess:
    """Where the solver starts.

    Attributes:
        duration: Of the intervals [s], shape (n-1,).
        share: Part of each interval that each piece takes, shape (n-1, pieces).
        curve: Joint positions over time from 0 to the sum of the durations.
        velocity: At the waypoints, shape (n, d).
        near: Whether it is likely to be near to the solution.
    """

    duration: FloatArray
    share: FloatArray
    curve: PiecewisePolynomial
    velocity: FloatArray
    near: bool = False


@dataclass(frozen=True, eq=False)
class Found:
    """A curve from the solver's variables, rebuilt.

    Attributes:
        knots: What the curve is made from.
        curve: The curve.
    """

    knots: Knots
    curve: PiecewisePolynomial


def _new_program(form: Form, kind: StartKind, steps: OnStep | None = None) -> Program:
    far = LONG if form.intervals >= MANY else {}
    options: dict[StartKind, dict[str, Any]] = {"far": far, "near": NEAR, "again": AGAIN}
    return Program(layout(form).size, blocks(form), steps=steps, options=options[kind])


@lru_cache(maxsize=16)
def _program(form: Form, kind: StartKind) -> Program:
    return _new_program(form, kind)


def form_of(
    problem: TimingProblem,
    *,
    position: bool = False,
    effort: bool = False,
    tool: bool = False,
) -> Form:
    """Find which equations a problem has."""
    timed = ~problem.free | (problem.at_least > 0.0)
    return Form(
        len(problem.position) - 1,
        len(problem.joint_names),
        along=tuple(np.flatnonzero(problem.along).tolist()),
        timed=tuple(np.flatnonzero(timed).tolist()),
        total=problem.total is not None,
        jerk=bool(np.isfinite(problem.limits.jerk).any()),
        position=position,
        smooth=bool(problem.objective.jerk or problem.objective.peak_jerk),
        peaks=problem.objective.peaks,
        dynamics=problem.dynamics if effort or tool or problem.objective.effort else None,
        effort=effort,
        tool=tool,
        work=problem.objective.effort > 0.0,
    )


def plain_guess(problem: TimingProblem, stretch: float = 1.0, *, hurried: bool = False) -> Guess:
    """Start from plain cubics.

    Args:
        problem: The problem.
        stretch: What the free durations are multiplied by.
        hurried: Whether joints that may not stop are taken not to.
    """
    velocity = first_velocities(problem)
    duration = first_durations(problem, velocity)
    duration = np.where(problem.free, np.maximum(stretch * duration, problem.at_least), duration)
    if hurried:
        short = short_durations(problem)
        duration = np.where(np.isnan(short), duration, np.minimum(short, duration))
    if problem.total is not None:
        duration = duration * (problem.total / duration.sum())
    time = np.concatenate(([0.0], np.cumsum(duration)))
    share = _even(duration.size)
    return Guess(duration, share, plain_cubic(time, problem.position, velocity), velocity)


@dataclass(frozen=True, eq=False)
class Care:
    """What the solver is held to beside the limits at the breaks, and with what margin.

    Attributes:
        margin: Part of each limit that is left.
        position: Whether positions between the breaks are limited.
        effort: Part of the effort limits that is allowed at each break and inside each piece, by
            turns, shape (2 pieces + 1, d); `None` where efforts are not looked at.
        tool: Part of the limit of the tool's speed, shape (2 pieces + 1, 1), or `None`.
    """

    margin: float = MARGIN
    position: bool = False
    effort: FloatArray | None = None
    tool: FloatArray | None = None


def _even(intervals: int) -> FloatArray:
    each = pieces_each(intervals)
    return np.full((intervals, each), 1.0 / each)


def near_guess(found: Found) -> Guess:
    """Start from the solution of a problem that differs little."""
    knots = found.knots
    return Guess(np.diff(knots.time), knots.share, found.curve, knots.velocity, near=True)


def stretched_guess(guess: Guess, problem: TimingProblem) -> Guess:
    """Start from a motion whose intervals, or all together, take as long as is given."""
    before = guess.duration
    duration = np.where(problem.free, before, problem.duration)
    if problem.total is not None:
        free = problem.free
        duration[free] *= (problem.total - duration[~free].sum()) / duration[free].sum()
    curve, each = guess.curve, np.repeat(duration / before, guess.share.shape[1])
    slowed = curve.c / each[:, None] ** np.arange(3.0, -1.0, -1.0)[:, None, None]
    breaks = np.concatenate(([0.0], np.cumsum(each * np.diff(curve.x))))
    return replace(guess, duration=duration, curve=PiecewisePolynomial(slowed, breaks))


def guess_from(motion: TimedMotion, first: int, last: int) -> Guess:
    """Start from a part of a motion that was found before."""
    curve, each = motion.trajectory.polynomial, pieces_each(last - first)
    time = motion.time[first : last + 1]
    here = (curve.x >= time[0]) & (curve.x <= time[-1])
    spans = np.diff(curve.x[here])
    duration = np.diff(time)
    if spans.size == each * duration.size:
        share = spans.reshape(-1, each) / duration[:, None]
    else:
        share = _even(duration.size)
    part = PiecewisePolynomial(curve.c[:, here[:-1] & here[1:]], curve.x[here] - time[0])
    return Guess(duration, share, part, motion.velocity[first : last + 1], near=True)


class Section:
    """A problem made ready for the solver.

    Args:
        problem: The problem.
        guess: Where to start; it also sets the units.
        care: What is limited how far.
    """

    def __init__(
        self,
        problem: TimingProblem,
        guess: Guess,
        care: Care,
    ) -> None:
        self.problem, self.guess, self.care = problem, guess, care
        self.margin = care.margin
        self.form = form_of(
            problem,
            position=care.position,
            effort=care.effort is not None,
            tool=care.tool is not None,
        )
        self.scale = _scale(problem, guess)

    def solve(self, start: Solution | None = None, steps: OnStep | None = None) -> Solution:
        """Run the solver, from a solution found before or from the guess."""
        kind: StartKind = "again" if start is not None else "near" if self.guess.near else "far"
        if steps is None:
            program = _program(self.form, kind)
        else:
            program = _new_program(self.form, kind, steps)
        return program.solve(
            self.start() if start is None else start,
            self.bounds(),
            self.parameters(),
            self.limits(),
        )

    def start(self) -> FloatArray:
        """Variables of the guess."""
        at, guess, scale = layout(self.form), self.guess, self.scale
        x = np.zeros(at.size)
        span = guess.share * guess.duration[:, None]
        x[at.tau] = span.ravel() / scale.time
        time = np.minimum(np.append(0.0, np.cumsum(span.ravel())), guess.curve.x[-1])
        most = self.problem.limits.acceleration
        x[at.q] = guess.curve(time) / scale.unit(0)
        x[at.v] = guess.curve(time, 1) / scale.unit(1)
        x[at.a] = np.clip(guess.curve(time, 2), -most, most) / scale.unit(2)
        for place, i in zip(at.factor, self.form.along, strict=True):
            direction = self.problem.velocity[i]
            length = float(direction @ direction)
            x[place] = float(guess.velocity[i] @ direction) / length if length else 0.0
        for place, name in zip(at.peak, self.form.peaks, strict=True):
            order = PEAKS[name]
            x[place] = guess.curve.extrema(order).peak.max() / scale.unit(order).max()
        return x

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest values of the variables; equal where they are known."""
        at, problem, scale = layout(self.form), self.problem, self.scale
        each = self.form.each
        low, high = np.full(at.size, -np.inf), np.full(at.size, np.inf)
        shortest = SHORTEST * self.guess.duration / each / scale.time
        low[at.tau] = np.repeat(shortest, each)
        inner = 1.0 - self.margin
        V, A = (inner * getattr(problem.limits, name) for name in ("velocity", "acceleration"))
        low[at.v], high[at.v] = -V / scale.unit(1), V / scale.unit(1)
        low[at.a], high[at.a] = -A / scale.unit(2), A / scale.unit(2)
        lower, upper = self._room()
        parts = (slice(each * i, each * (i + 1)) for i in range(self.form.intervals))
        for part, least, most in zip(parts, lower, upper, strict=True):
            low[at.q[part]], high[at.q[part]] = least / scale.unit(0), most / scale.unit(0)
        waypoints = slice(None, None, each)
        low[at.q[waypoints]] = high[at.q[waypoints]] = problem.position / scale.unit(0)
        for places, values, known, order in (
            (at.v, problem.velocity, problem.velocity_known, 1),
            (at.a, problem.acceleration, problem.acceleration_known, 2),
        ):
            fixed = places[waypoints][known]
            low[fixed] = high[fixed] = values[known] / scale.unit(order)
        steady = at.a[waypoints][self._steady()]
        low[steady] = high[steady] = 0.0
        low[at.factor] = 0.0
        high[at.factor] = problem.most[list(self.form.along)]
        low[at.peak] = 0.0
        return low, high

    def _room(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest positions in each interval, shape (n-1, d); its ends are inside."""
        problem = self.problem
        width = problem.limits.upper - problem.limits.lower
        gap = self.margin * np.where(np.isfinite(width), width, 1.0)
        ends = np.stack((problem.position[:-1], problem.position[1:]))
        return (
            np.minimum(problem.limits.lower + gap, ends.min(axis=0)),
            np.maximum(problem.limits.upper - gap, ends.max(axis=0)),
        )

    def parameters(self) -> list[FloatArray]:
        """Parameters of each block."""
        problem, scale, form = self.problem, self.scale, self.form
        h = np.repeat(self.guess.duration, form.each) / scale.time
        rows = [1.0 / h, 1.0 / (h * h)]
        if form.jerk:
            jerk = (1.0 - self.margin) * problem.limits.jerk / scale.unit(3)
            rows.append(np.repeat((1.0 / jerk)[:, None], form.pieces, axis=1))
        weights = np.repeat(self._weights()[:, None], form.pieces, axis=1)
        weights[1] = EVEN * form.each / h / (self.guess.duration.sum() / scale.time)
        rows.append(weights)
        directions = problem.velocity[list(form.along)].T / scale.unit(1)[:, None]
        empty = np.zeros((0, 1))
        found = [np.vstack(rows), empty, directions, *([empty] if form.total else [])]
        units = np.concatenate([scale.unit(order) for order in range(3)])[:, None]
        for allowed, limit in self._held():
            inverse = 1.0 / (allowed * limit).T
            for part in (inverse[:, ::2], inverse[:, 1::2]):
                found.append(np.vstack((np.repeat(units, part.shape[1], axis=1), part)))
        if form.work:
            weight = problem.objective.effort * scale.time / self.typical_cost()
            found.append(np.repeat(np.vstack((units, [[weight]])), form.pieces, axis=1))
        for name in form.peaks:
            unit = scale.unit(PEAKS[name])
            times = form.pieces + (name == "peak_acceleration")
            found.append(np.repeat((unit / unit.max())[:, None], times, axis=1))
            weight = getattr(problem.objective, name) * unit.max() / self.typical_cost()
            found.append(np.array([[weight]]))
        return found

    def _weights(self) -> FloatArray:
        objective, scale = self.problem.objective, self.scale
        cost = self.typical_cost()
        most = np.minimum(self.problem.limits.acceleration, scale.unit(2))
        calm = CALM * cost / (most**2 * self.guess.duration.sum() * len(most))
        weights = [np.array([objective.time * scale.time, 0.0])]
        weights.append((objective.acceleration + calm) * scale.unit(2) ** 2 * scale.time)
        if self.form.smooth:
            unit = scale.unit(3)
            even = CALM * cost / (unit.max() ** 2 * self.guess.duration.sum() * len(unit))
            even *= bool(objective.peak_jerk)
            weights.append((objective.jerk + even) * unit**2 * scale.time)
        return np.asarray(np.concatenate(weights) / cost)

    def typical_cost(self) -> float:
        """What the objective is divided by, so that it is near one."""
        objective, scale = self.problem.objective, self.scale
        h = self.guess.duration
        cost = objective.time * float(h.sum())
        for weight, order in ((objective.jerk, 3), (objective.acceleration, 2)):
            cost += weight * float(np.sum((scale.unit(order)) ** 2) * h.sum())
        for name in self.form.peaks:
            cost += getattr(objective, name) * float(scale.unit(PEAKS[name]).max())
        if self.form.work:
            q = self.problem.position
            still = np.zeros_like(q)
            squares = self.problem.arm.effort(q, still, still) ** 2
            cost += objective.effort * float(squares.sum(axis=1).mean() * h.sum())
        return cost or 1.0

    def limits(self) -> list[tuple[FloatArray, FloatArray]]:
        """Least and greatest values of each block's constraints."""
        problem, scale, form = self.problem, self.scale, self.form
        d, count = form.joints, form.pieces
        fastest = self._fastest()
        high = [np.zeros((2 * d, count)), *fastest]
        low = [np.zeros((2 * d, count)), *(-one for one in fastest)]
        if form.jerk:
            high.append(np.zeros((2 * d, count)))
            low.append(np.full((2 * d, count), -np.inf))
        if form.position:
            lower, upper = (
                np.repeat((room / scale.unit(0)).T, form.each, axis=1) for room in self._room()
            )
            high += [upper] * 4
            low += [lower] * 4
        timed = list(form.timed)
        free = problem.free[timed]
        least = np.where(free, problem.at_least[timed], problem.duration[timed]) / scale.time
        most = np.where(free, np.inf, least)
        zero = np.zeros((d, len(form.along)))
        found = [(np.vstack(low), np.vstack(high)), (least[None], most[None]), (zero, zero)]
        if problem.total is not None:
            total = np.array([[problem.total / scale.time]])
            found.append((total, total))
        for allowed, limit in self._held():
            parts = TOOL_PARTS if np.ndim(limit) == 0 else EFFORT_PARTS
            inside = len(parts) * allowed.shape[1]
            for rows, part in ((allowed.shape[1], allowed[::2]), (inside, allowed[1::2])):
                most = np.full((rows, len(part)), 1.0 - self.margin)
                found.append((-most, most))
        if form.work:
            found.append((np.zeros((0, count)), np.zeros((0, count))))
        for name in form.peaks:
            most = np.zeros((2 * d, count + (name == "peak_acceleration")))
            found += [(np.full(most.shape, -np.inf), most), (np.zeros((0, 1)), np.zeros((0, 1)))]
        return found

    def _held(self) -> list[tuple[FloatArray, Any]]:
        """Parts that are allowed of the limits of effort and tool speed, and the limits."""
        care, limits = self.care, self.problem.limits
        pairs = ((care.effort, limits.effort), (care.tool, limits.tool_speed))
        return [(allowed, limit) for allowed, limit in pairs if allowed is not None]

    def _fastest(self) -> list[FloatArray]:
        """Greatest velocities at two points of each piece, scaled, shape (d, pieces) each."""
        most = (1.0 - self.margin) * self.problem.limits.velocity
        shape = (self.form.intervals, self.form.each, self.form.joints)
        start, end = (np.broadcast_to(most, shape).copy() for _ in range(2))
        # with no acceleration there, the point next to the waypoint has its velocity
        given = np.where(self._cruising(), 1.001 * self.problem.limits.velocity, 0.0)
        start[:, 0] = np.maximum(start[:, 0], given[:-1])
        end[:, -1] = np.maximum(end[:, -1], given[1:])
        unit = self.scale.unit(1)
        return [(v.reshape(self.form.pieces, -1) / unit).T for v in (start, end)]

    def _cruising(self) -> BoolArray:
        """Which joints pass which waypoints at their velocity limit, so without acceleration."""
        problem = self.problem
        most = (1.0 - 2.0 * self.margin) * problem.limits.velocity
        return problem.velocity_known[:, None] & (np.abs(problem.velocity) >= most)

    def _steady(self) -> BoolArray:
        """Which joints have no acceleration at which waypoints, beside those where it is known."""
        problem = self.problem
        stands = problem.velocity_known[:, None] & (problem.velocity == 0.0)
        idle = stands[:-1] & stands[1:] & (np.diff(problem.position, axis=0) == 0.0)
        steady = self._cruising()
        steady[:-1] |= idle  # or it would swing out between them
        steady[1:] |= idle
        return steady & ~problem.acceleration_known[:, None]

    def rebuild(self, x: FloatArray) -> Found:
        """Make the exact curve of the variables; it starts at time 0."""
        problem, form = self.problem, self.form
        tau, _, v, a = unpacked(form, x, self.scale)
        parts = tau.reshape(form.intervals, form.each)
        duration = np.where(problem.free, parts.sum(axis=1), problem.duration)
        if problem.total is not None:
            free = problem.free
            left = problem.total - duration[~free].sum()
            duration[free] *= left / duration[free].sum()
        duration = np.where(problem.free, np.maximum(duration, problem.at_least), duration)
        velocity = np.where(problem.velocity_known[:, None], problem.velocity, v[:: form.each])
        for place, i in zip(layout(form).factor, form.along, strict=True):
            velocity[i] = max(float(x[place]), 0.0) * problem.velocity[i]
        known = problem.acceleration_known
        a[:: form.each][known] = problem.acceleration[known]
        a[:: form.each][self._steady()] = 0.0
        ends = np.arange(form.intervals)[:, None] * form.each + np.arange(form.each + 1)
        knots = Knots(
            np.concatenate(([0.0], np.cumsum(duration))),
            parts / parts.sum(axis=1)[:, None],
            problem.position,
            velocity,
            a[ends],
        )
        return Found(knots, rebuilt(knots))


def _scale(problem: TimingProblem, guess: Guess) -> Scale:
    time = float(np.median(guess.duration))
    limits = problem.limits
    with np.errstate(invalid="ignore"):
        room = np.minimum(limits.velocity * time, limits.acceleration * time**2)
        room = np.minimum(room, limits.jerk * time**3)
    span = np.ptp(problem.position, axis=0)
    largest = float(span.max()) or 1.0
    typical = np.maximum(span, 1e-3 * largest)
    smooth = problem.objective.jerk or problem.objective.peaks
    if smooth and not problem.free.any():
        # given times set the size of the motion, however loose the limits are
        peak = np.abs(guess.curve(guess.curve.x[:-1], 2)).max(axis=0)
        room = np.minimum(room, np.maximum(typical, peak * time**2))
    return Scale(time, np.where(np.isfinite(room), room, typical))


def excess(problem: TimingProblem, curve: PiecewisePolynomial) -> dict[str, float]:
    """By how much a curve exceeds the limits of its joints' motion, relative to each limit.

    By its exact extrema; only the limits that are exceeded.
    """
    found = {}
    for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk")):
        over = float((curve.extrema(order).peak / getattr(problem.limits, name)).max()) - 1.0
        if over > SLACK:
            found[name] = over
    positions = curve.extrema(0)
    lower, upper = problem.limits.lower, problem.limits.upper
    size = np.maximum(1.0, np.maximum(np.abs(problem.position).max(axis=0), 0.0))
    over = float((np.maximum(lower - positions.minimum, positions.maximum - upper) / size).max())
    if over > SLACK:
        found["position"] = over
    return found
