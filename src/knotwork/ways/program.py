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
from typing import Any

import numpy as np

from knotwork.timing.efforts import inner_state
from knotwork.timing.exact_curve import Knots, rebuilt
from knotwork.timing.held_limits import held_blocks, held_bounds, held_parameters
from knotwork.timing.problem import TimingProblem
from knotwork.timing.program import Block, Kernel, Program
from knotwork.timing.spline import Layout, Scale, piece_kernel, placed
from knotwork.timing.tightening import Tightening
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
        "ipopt.mu_init": 1e-4,
        "ipopt.max_iter": 70,
        "ipopt.tol": 1e-4,
    },
}
"""Of IPOPT."""


@lru_cache(maxsize=8)
def _row_kernel(d: int) -> Kernel:
    """Normal · q(s) - offset in one piece. Parameters: s, normal, offset."""
    import casadi as ca

    span, state, last = ca.SX.sym("span"), ca.SX.sym("state", 3 * d), ca.SX.sym("last", d)
    s, normal, offset = ca.SX.sym("s"), ca.SX.sym("normal", d), ca.SX.sym("offset")
    position, _, _ = inner_state(span, (*ca.vertsplit(state, d), None, None, last), s)
    return Kernel(
        ca.vertcat(span, state, last),
        ca.vertcat(s, normal, offset),
        ca.dot(normal, position) - offset,
    )


class MotionProgram:
    """The shortest motion between the states of a problem, beyond planes.

    Args:
        problem: Waypoints, the first and the last of whose velocities and accelerations are known,
            and the limits; the jerk of every joint is limited.

    Attributes:
        tightening: Which limits of positions, efforts and tool speed it has, and margins of all.
    """

    def __init__(self, problem: TimingProblem) -> None:
        self.problem = problem
        self.tightening = Tightening(margin=MARGIN)

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
        scale, at = _scale(self.problem, near), placed(n, d)
        low, high = self._bounds(at, near, radius, scale)
        x = np.zeros(at.size)
        x[at.tau] = guess.span / scale.time
        for places, values, order in ((at.q, guess.q, 0), (at.v, guess.v, 1), (at.a, guess.a, 2)):
            x[places] = values / scale.unit(order)
        piece = np.vstack((at.piece[: 1 + 3 * d], at.a[1:].T))
        blocks = [
            Block(piece_kernel(d, True, self.tightening.position, False), at.piece),
            Block(_row_kernel(d), piece[:, [row.piece for row in rows]]),
        ]
        if self.tightening.held:
            blocks += held_blocks(at, self.problem.arm, self.tightening)
        program = Program(
            at.size,
            blocks,
            options={"ipopt.constr_viol_tol": 1e-8} | OPTIONS[start],
        )
        found = program.solve(
            np.clip(x, low, high),
            (low, high),
            [
                self._piece_parameters(near, scale),
                _row_parameters(rows, scale, d),
                *held_parameters(self.tightening, self.problem.limits, scale),
            ],
            [
                self._piece_limits(n, scale),
                (np.zeros((1, len(rows))), np.full((1, len(rows)), np.inf)),
                *held_bounds(self.tightening),
            ],
        )
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
            high[places] = (1.0 - self.tightening.margin) * limit / scale.unit(order)
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
        jerk = (1.0 - self.tightening.margin) * limits.jerk / scale.unit(3)
        most = np.minimum(limits.acceleration, scale.unit(2))
        even = EVEN * scale.time / (float(h.mean()) * total)
        calm = CALM * scale.unit(2) ** 2 * scale.time / (most**2 * total * d)
        weights = np.concatenate(([scale.time / total, even], calm))
        fixed = np.repeat(np.concatenate((1.0 / jerk, weights))[:, None], n, axis=1)
        return np.vstack((1.0 / h, 1.0 / (h * h), fixed))

    def _piece_limits(self, n: int, scale: Scale) -> tuple[FloatArray, FloatArray]:
        """Least and greatest values of the constraints of the pieces."""
        problem, d = self.problem, len(scale.unit(0))
        zero = np.zeros((2 * d, n))
        fastest = np.repeat(
            ((1.0 - self.tightening.margin) * problem.limits.velocity / scale.unit(1))[:, None],
            n,
            axis=1,
        )
        low = [zero, -fastest, -fastest, np.full((2 * d, n), -np.inf)]
        high = [zero, fastest, fastest, zero]
        if self.tightening.position:
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


def _row_parameters(rows: Sequence[Row], scale: Scale, d: int) -> FloatArray:
    """Places, normals and offsets of the rows."""
    found = np.empty((d + 2, len(rows)))
    for k, row in enumerate(rows):
        found[:, k] = np.concatenate(([row.place], row.normal * scale.unit(0), [row.offset]))
    return found
