"""The program of one motion between two states: pieces, limits, and separating planes.

The pieces, their equations and the limits are those of `timing.section`; all breaks are variables,
except for the positions of waypoints between the states, each after the same number of pieces. A
distance d with gradient g becomes a row for one point s of one piece,

    d + g · (q(s) - q₀) >= margin,

which is valid near q₀, the configuration of d and g.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import Enum, auto
from functools import lru_cache
from typing import Any

import numpy as np

from knotwork.planning.timing.initial_guess import Guess
from knotwork.planning.timing.nonlinear_program import Block, Kernel, solve_program
from knotwork.planning.timing.robot_limits import inner_state
from knotwork.planning.timing.section import Section
from knotwork.planning.timing.spline import Scale
from knotwork.planning.timing.tightening import Tightening
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.planning.ways.states import Plane, States, states_of
from knotwork.waypoints import FloatArray

PROGRAM_MARGIN = 3e-5
"""Relative margin to each limit, larger than the solver's tolerance."""


MIN_SPAN_SHARE = 0.05
"""Minimum duration in the scaling of a piece's equations, relative to the mean duration."""


class Start(Enum):
    """Start of a program: a first guess, or a motion close to the solution."""

    FAR = auto()
    NEAR = auto()


START_OPTIONS: dict[Start, dict[str, Any]] = {
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
"""IPOPT options."""


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
    """The minimum-time motion between the states of a problem, beyond planes.

    Args:
        problem: The states, the positions between them, and the limits.
    """

    def __init__(self, problem: TimingProblem) -> None:
        velocity, acceleration = np.array(problem.velocity), np.array(problem.acceleration)
        velocity[1:-1] = acceleration[1:-1] = np.nan
        self.problem = replace(problem, velocity=velocity, acceleration=acceleration)
        self.tightening = Tightening(margin=PROGRAM_MARGIN)

    def solve(
        self, guess: States, near: States, rows: Sequence[Plane], radius: float, start: Start
    ) -> States | None:
        """Solve the program.

        Args:
            guess: Initial guess of the solver.
            near: Reference motion of trust region and units, with the same number of pieces.
            rows: Planes.
            radius: Trust radius of the breaks [rad or m].
            start: Kind of the guess.

        Returns:
            The motion, or `None` if the solver found none.
        """
        scale = _scale(self.problem, near)
        # durations of pieces differ more than in other sections: each has its own
        spans = np.maximum(near.span, MIN_SPAN_SHARE * near.duration / len(near.span))
        section = Section(self.problem, self._units(near), self.tightening, scale, spans)
        at, d = section.layout, section.layout.joints
        low, high = section.bounds()
        nearest = (near.q - radius) / scale.unit(0), (near.q + radius) / scale.unit(0)
        low[at.q], high[at.q] = (np.clip(bound, low[at.q], high[at.q]) for bound in nearest)
        x = np.zeros(at.size)
        x[at.tau] = guess.span / scale.time
        for places, values, order in ((at.q, guess.q, 0), (at.v, guess.v, 1), (at.a, guess.a, 2)):
            x[places] = values / scale.unit(order)
        piece = np.vstack((at.piece[: 1 + 3 * d], at.a[1:].T))
        planes = Block(
            _row_kernel(d),
            piece[:, [row.piece for row in rows]],
            _row_parameters(rows, scale, d),
            high=np.inf,
        )
        solution = solve_program(
            [*section.blocks(), planes],
            np.clip(x, low, high),
            (low, high),
            {"ipopt.constr_viol_tol": 1e-8} | START_OPTIONS[start],
            reusable=False,
        )
        return states_of(section.rebuild(solution.x).curve) if solution.solved else None

    def _units(self, near: States) -> Guess:
        """The motion as a guess, which sets the scale of a section."""
        span = near.span.reshape(len(self.problem.position) - 1, -1)
        duration = span.sum(axis=1)
        velocity = near.v[:: span.shape[1]]
        return Guess(duration, span / duration[:, None], near.curve, velocity)


def _scale(problem: TimingProblem, near: States) -> Scale:
    """Units in which all numbers of the program are of order one."""
    limits, time = problem.limits, 5.0 * float(np.median(near.span))
    moves = limits.velocity * time, limits.acceleration * time**2, limits.jerk * time**3
    return Scale(time, np.min(moves, axis=0))


def _row_parameters(rows: Sequence[Plane], scale: Scale, d: int) -> FloatArray:
    """Places, normals and offsets of the rows."""
    parameters = np.empty((d + 2, len(rows)))
    for k, row in enumerate(rows):
        parameters[:, k] = np.concatenate(([row.place], row.normal * scale.unit(0), [row.offset]))
    return parameters
