"""The program of one motion between two states: pieces, limits, and planes to stay beyond.

The pieces, their equations and the limits are those of `timing.spline`; all breaks are free, but
for the positions of waypoints between the states, each with as many pieces before it. A
distance d that falls at the rate -g per joint position becomes a row for one place s of one piece,

    d + g · (q(s) - q₀) >= margin,

which holds near q₀, the place where d and g were measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum, auto
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from knotwork.polynomial import PiecewisePolynomial
from knotwork.timing.efforts import EFFORT_PARTS, TOOL_PARTS, inner_state
from knotwork.timing.exact_curve import Knots, rebuilt
from knotwork.timing.problem import TimingProblem
from knotwork.timing.program import Block, Kernel, Program
from knotwork.timing.spline import Layout, Scale, limit_blocks, piece_kernel, placed
from knotwork.timing.tightening import BETWEEN, exceeded
from knotwork.waypoints import FloatArray
from knotwork.ways.states import Row, States, states_of

MARGIN = 3e-5
"""Part of each limit that the solver leaves, so that its tolerance never shows as a violation."""

INSIDE = 1e-6
"""Breaks stay this far from position limits [rad or m]."""

EVEN = 1.5e-4
CALM = 1e-4
"""Weights of uneven pieces and of accelerations, where the duration does not decide them."""

SHORTEST = 2e-3
"""No piece is shorter than this part of the mean."""

BATCH = 6
"""Rows of a piece are padded to a multiple of this, so that few programs are set up."""

LENGTH = 0.1
"""Unit of distances in the program [m]."""


class Start(Enum):
    """What a program starts from: a first guess, or a motion that is nearly the solution."""

    FAR = auto()
    NEAR = auto()


OPTIONS: dict[Start, dict[str, Any]] = {
    Start.FAR: {
        "ipopt.mu_strategy": "adaptive",
        "ipopt.max_iter": 100,
        "ipopt.tol": 1e-6,
        "ipopt.acceptable_tol": 1e-4,
        "ipopt.acceptable_iter": 4,
    },
    Start.NEAR: {
        "ipopt.mu_init": 1e-3,
        "ipopt.max_iter": 70,
        "ipopt.tol": 1e-5,
        "ipopt.acceptable_tol": 1e-3,
        "ipopt.acceptable_iter": 3,
        "ipopt.acceptable_constr_viol_tol": 1e-8,
    },
}
"""Of IPOPT."""


class Shape(NamedTuple):
    """What programs have in common that differ in numbers only.

    Attributes:
        pieces, joints: Number of pieces, and of joints.
        rows: Number of rows of each piece.
        position: Whether positions between the breaks are limited.
        dynamics: Inertias of the arm where efforts or the tool's speed are limited.
        effort, tool: Whether these are.
    """

    pieces: int
    joints: int
    rows: int
    position: bool
    dynamics: Any = None
    effort: bool = False
    tool: bool = False


@lru_cache(maxsize=8)
def _row_kernel(d: int) -> Kernel:
    """Normal · q(s) - offset in one piece. Parameters: s, normal, offset."""
    import casadi as ca

    span, state, last = ca.SX.sym("span"), ca.SX.sym("state", 3 * d), ca.SX.sym("last", d)
    s, normal, offset = ca.SX.sym("s"), ca.SX.sym("normal", d), ca.SX.sym("offset")
    q, _, _ = inner_state(span, (*ca.vertsplit(state, d), None, None, last), s)
    return Kernel(
        ca.vertcat(span, state, last),
        ca.vertcat(s, normal, offset),
        ca.dot(normal, q) - offset,
    )


@lru_cache(maxsize=64)
def _program(shape: Shape, start: Start) -> Program:
    at, d = placed(shape.pieces, shape.joints), shape.joints
    row = np.vstack((at.piece[: 1 + 3 * d], at.a[1:].T))
    blocks = [
        Block(piece_kernel(d, True, shape.position, False), at.piece),
        Block(_row_kernel(d), np.repeat(row, shape.rows, axis=1)),
        *limit_blocks(at, shape.dynamics, effort=shape.effort, tool=shape.tool),
    ]
    return Program(at.size, blocks, options={"ipopt.constr_viol_tol": 1e-8} | OPTIONS[start])


class MotionProgram:
    """The shortest motion between the states of a problem, beyond planes.

    Args:
        problem: Waypoints, the first and the last of whose velocities and accelerations are known,
            and the limits; the jerk of every joint is limited.

    Attributes:
        position: Whether positions between the breaks are limited as well.
        allowed: Part of the limits of `"effort"` and `"tool_speed"` that is allowed, by name;
            those that are not in it are left out.
    """

    def __init__(self, problem: TimingProblem) -> None:
        self.problem = problem
        self.position = False
        self.allowed: dict[str, float] = {}

    @property
    def held(self) -> tuple[bool, dict[str, float]]:
        """Which limits it has besides those of velocity, acceleration and jerk."""
        return self.position, dict(self.allowed)

    def keeps_efforts(self, curve: PiecewisePolynomial) -> bool:
        """Whether a motion is proved to keep the limits of effort and tool speed.

        Where it does not, the program has them from now on, or allows less of them.
        """
        over = exceeded(self.problem, curve)
        if over is None:
            return True
        name, shares = over
        part = self.allowed.get(name, float(shares.max()))  # at first nearly all is allowed
        self.allowed[name] = part * (1.0 - BETWEEN) / max(float(shares.max()), 1.0)
        return False

    def solve(
        self, guess: States, near: States, rows: Sequence[Row], radius: float, start: Start
    ) -> States | None:
        """Solve it.

        Args:
            guess: Where the solver starts.
            near: The breaks stay near to those of this motion.
            rows: The planes.
            radius: How far each joint may be from `near` [rad or m].
            start: What the guess is.

        Returns:
            The motion, or `None` where the solver found none.
        """
        n, d = len(near.span), near.q.shape[1]
        most = int(np.bincount([row.piece for row in rows], minlength=n).max()) if rows else 0
        shape = Shape(
            n,
            d,
            max(1, -(-most // BATCH)) * BATCH,
            self.position,
            self.problem.dynamics if self.allowed else None,
            "effort" in self.allowed,
            "tool_speed" in self.allowed,
        )
        scale, at = _scale(self.problem, near), placed(n, d)
        low, high = self._bounds(at, near, radius, scale)
        x = np.zeros(at.size)
        x[at.tau] = guess.span / scale.time
        for places, values, order in ((at.q, guess.q, 0), (at.v, guess.v, 1), (at.a, guess.a, 2)):
            x[places] = values / scale.unit(order)
        parameters = [self._piece_parameters(near, scale), _row_parameters(shape, rows, scale)]
        limits = [
            self._piece_limits(shape, scale),
            (np.zeros((1, n * shape.rows)), np.full((1, n * shape.rows), np.inf)),
        ]
        for name, parts in (("effort", EFFORT_PARTS), ("tool_speed", TOOL_PARTS)):
            if name not in self.allowed:
                continue
            limit = np.atleast_1d(self.allowed[name] * getattr(self.problem.limits, name))
            scales = np.concatenate([scale.unit(0), scale.unit(1), scale.unit(2), 1.0 / limit])
            for count, width in ((n + 1, 1), (n, len(parts))):
                parameters.append(np.repeat(scales[:, None], count, axis=1))
                ones = np.ones((width * len(limit), count))
                limits.append((-ones, ones))
        found = _program(shape, start).solve(np.clip(x, low, high), (low, high), parameters, limits)
        if not found.solved:
            return None
        v, a = (found.x[places] * scale.unit(order) for places, order in ((at.v, 1), (at.a, 2)))
        return self._rebuilt(found.x[at.tau] * scale.time, v, a)

    def _rebuilt(self, span: FloatArray, v: FloatArray, a: FloatArray) -> States:
        """The exact curve of durations and accelerations; it meets all waypoints to rounding."""
        problem = self.problem
        stretches = len(problem.position) - 1
        each = len(span) // stretches
        spans = span.reshape(stretches, each)
        duration = spans.sum(axis=1)
        a[[0, -1]] = problem.acceleration[[0, -1]]
        velocity = v[::each].copy()
        velocity[[0, -1]] = problem.velocity[[0, -1]]
        knots = Knots(
            np.concatenate(([0.0], np.cumsum(duration))),
            spans / duration[:, None],
            problem.position,
            velocity,
            a[each * np.arange(stretches)[:, None] + np.arange(each + 1)],
        )
        return states_of(rebuilt(knots))

    def _bounds(
        self, at: Layout, near: States, radius: float, scale: Scale
    ) -> tuple[FloatArray, FloatArray]:
        """Least and greatest values of the variables."""
        problem, limits = self.problem, self.problem.limits
        low, high = np.full(at.size, -np.inf), np.full(at.size, np.inf)
        low[at.tau] = SHORTEST * near.duration / len(near.span) / scale.time
        for places, limit, order in ((at.v, limits.velocity, 1), (at.a, limits.acceleration, 2)):
            high[places] = (1.0 - MARGIN) * limit / scale.unit(order)
            low[places] = -high[places]
        inside = limits.lower + INSIDE, limits.upper - INSIDE
        low[at.q] = np.clip(near.q - radius, *inside) / scale.unit(0)
        high[at.q] = np.clip(near.q + radius, *inside) / scale.unit(0)
        through = at.q[:: len(near.span) // (len(problem.position) - 1)]
        low[through] = high[through] = problem.position / scale.unit(0)
        for places, values, order in ((at.v, problem.velocity, 1), (at.a, problem.acceleration, 2)):
            low[places[[0, -1]]] = high[places[[0, -1]]] = values[[0, -1]] / scale.unit(order)
        return low, high

    def _piece_parameters(self, near: States, scale: Scale) -> FloatArray:
        """Scales of the equations, inverse limits of jerk, weights of the cost."""
        limits, n, d = self.problem.limits, len(near.span), near.q.shape[1]
        total = near.duration
        h = np.maximum(near.span, 0.05 * total / n) / scale.time
        jerk = (1.0 - MARGIN) * limits.jerk / scale.unit(3)
        most = np.minimum(limits.acceleration, scale.unit(2))
        even = EVEN * scale.time / (float(h.mean()) * total)
        calm = CALM * scale.unit(2) ** 2 * scale.time / (most**2 * total * d)
        weights = np.concatenate(([scale.time / total, even], calm))
        fixed = np.repeat(np.concatenate((1.0 / jerk, weights))[:, None], n, axis=1)
        return np.vstack((1.0 / h, 1.0 / (h * h), fixed))

    def _piece_limits(self, shape: Shape, scale: Scale) -> tuple[FloatArray, FloatArray]:
        """Least and greatest values of the constraints of the pieces."""
        problem, n, d = self.problem, shape.pieces, shape.joints
        zero = np.zeros((2 * d, n))
        fastest = np.repeat(
            ((1.0 - MARGIN) * problem.limits.velocity / scale.unit(1))[:, None], n, axis=1
        )
        low = [zero, -fastest, -fastest, np.full((2 * d, n), -np.inf)]
        high = [zero, fastest, fastest, zero]
        if shape.position:
            each = n // (len(problem.position) - 1)
            least, most = problem.limits.lower + INSIDE, problem.limits.upper - INSIDE
            lower, upper = (np.repeat(one[:, None], n, axis=1) for one in (least, most))
            # a waypoint may lie on a limit: then only pieces next to it may come up to it
            for next_to, q in (
                (slice(None, None, each), problem.position[:-1]),
                (slice(each - 1, None, each), problem.position[1:]),
            ):
                lower[:, next_to] = np.minimum(lower[:, next_to], q.T)
                upper[:, next_to] = np.maximum(upper[:, next_to], q.T)
            low += [lower / scale.unit(0)[:, None]] * 4
            high += [upper / scale.unit(0)[:, None]] * 4
        return np.vstack(low), np.vstack(high)


def _scale(problem: TimingProblem, near: States) -> Scale:
    """Units in which all numbers of the program are near one."""
    limits, time = problem.limits, 5.0 * float(np.median(near.span))
    moves = limits.velocity * time, limits.acceleration * time**2, limits.jerk * time**3
    return Scale(time, np.min(moves, axis=0))


def _row_parameters(shape: Shape, rows: Sequence[Row], scale: Scale) -> FloatArray:
    """Places, normals and offsets of the rows; those that pad a piece are always kept."""
    found = np.zeros((shape.joints + 2, shape.pieces * shape.rows))
    found[-1] = -1.0
    used = np.zeros(shape.pieces, dtype=int)
    for row in rows:
        k = row.piece * shape.rows + used[row.piece]
        used[row.piece] += 1
        normal = row.normal * scale.unit(0) / LENGTH
        found[:, k] = np.concatenate(([row.place], normal, [row.offset / LENGTH]))
    return found
