"""Minimum-time motion near a collision-free one: exchange method of semi-infinite programming.

Linearised distances at a few points of each piece are constraints. The proof over all time is the
oracle: where it finds a contact, constraints are added, and the program is solved again. Only
motions proved clear count. The best one is kept, so the iteration may end at any time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.planning.clear_motions.configuration_space import ConfigurationSpace
from knotwork.planning.timing.budget import Budget
from knotwork.planning.timing.motion_states import States, states_of
from knotwork.planning.timing.nonlinear_program import Block, Kernel, solve_program, symbols
from knotwork.planning.timing.robot_limits import state_inside
from knotwork.planning.timing.tightening import Tightening, tighten
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.planning.timing.timing_program import TimingProgram
from knotwork.verification.bounds.clearance import Clearance

PLANE_FRACTIONS = (0.0, 1 / 3, 2 / 3)
"""Points with distance constraints in each piece, as fractions of its duration."""

MAX_PAIR_GAP = 0.08
"""Maximum gap of the pairs in constraints [m]. Those of farther pairs would not be active in a step
within the trust radius; if one is, the proof finds it.
"""

MAX_PAIRS = 5
"""Maximum number of pairs at a point of the reference, the nearest ones. More slow the solver."""

MAX_PAIRS_AT_CONTACT = 3
"""Maximum number of pairs at a contact, fewer because each contact has several times."""

FIRST_TRUST_RADIUS = 0.6
LAST_TRUST_RADIUS = 0.01
"""First and last distance of breaks from the reference that is allowed [rad or m].

Linearised distances hold only near the reference. Steps below the last one gain hardly any time.
"""

MIN_ROUND_GAIN = 0.003
"""Minimum gain of a round as a fraction of the duration; after a smaller one the iteration ends."""

CLEARANCE_RESERVE = 1e-3
"""Additional clearance that is required at the constraint points [m], because the distance
may be smaller between them.
"""

MAX_ROUNDS = 25
"""Maximum number of rounds, so that the time of the search is bounded."""
MAX_CONTACT_TIMES = 30
"""Maximum number of contact times per round that become constraints, for the same reason."""

MAX_REJECTED = 3
"""Number of solutions in contact after which the trust radius is halved."""

DISTANCE_UNIT = 0.1
"""Unit of distance in the constraints [m], with which their values are of order one."""

FIRST_OPTIONS: dict[str, Any] = {
    "ipopt.constr_viol_tol": 1e-8,
    "ipopt.mu_strategy": "adaptive",
    "ipopt.max_iter": 100,
    "ipopt.tol": 1e-6,
    "ipopt.acceptable_tol": 1e-4,
    "ipopt.acceptable_iter": 4,
}
NEAR_OPTIONS: dict[str, Any] = {
    "ipopt.constr_viol_tol": 1e-8,
    "ipopt.mu_init": 1e-4,
    "ipopt.max_iter": 70,
    "ipopt.tol": 1e-4,
}
"""IPOPT options for the start from a first guess, and from a motion close to the solution."""

PROGRAM_MARGIN = 3e-5
"""Relative margin to each limit, larger than the solver's tolerance."""


class ExchangeSearch:
    """Search for the minimum-time motion near a collision-free one.

    Args:
        space: Distances at single configurations.
        problem: The states at both ends, positions between them, and the limits.
        first: A motion within the limits that is proved clear.
        times: Times at which it passes the waypoints of the problem [s].
        pieces: Number of pieces of the new motions between consecutive waypoints.
        unproved_pairs: Finds the pairs that a motion is not proved to keep apart.

    Attributes:
        best: The shortest motion so far.
    """

    def __init__(
        self,
        space: ConfigurationSpace,
        problem: TimingProblem,
        first: PiecewisePolynomial,
        times: FloatArray,
        pieces: int,
        unproved_pairs: Callable[[PiecewisePolynomial], list[Clearance]],
    ) -> None:
        self.space, self.unproved_pairs = space, unproved_pairs
        velocity, acceleration = np.array(problem.velocity), np.array(problem.acceleration)
        velocity[1:-1] = acceleration[1:-1] = np.nan
        self.problem = replace(problem, velocity=velocity, acceleration=acceleration)
        self.tightening = Tightening(margin=PROGRAM_MARGIN)
        self.best = first
        self._reference = states_of(first, np.repeat(np.diff(times) / pieces, pieces))
        self._improved = False

    def run(self, budget: Budget, max_duration: float = np.inf) -> PiecewisePolynomial:
        """Iterate until convergence, and give the best motion.

        Args:
            budget: Computing time, at whose end the iteration ends.
            max_duration: Duration above which a motion is of no use [s].
        """
        radius, rejected = FIRST_TRUST_RADIUS, 0
        guess, options = self._reference, FIRST_OPTIONS
        planes, contact_planes = self._planes_along(guess), list[Plane]()
        for _ in range(MAX_ROUNDS):
            if budget.has_ended or radius < LAST_TRUST_RADIUS:
                break
            solution = self._solve(guess, planes + contact_planes, radius, options)
            if solution is None:
                radius, contact_planes, rejected, guess = 0.4 * radius, [], 0, self._reference
                options = NEAR_OPTIONS if self._improved else FIRST_OPTIONS
                continue
            if solution.duration > max_duration:
                break  # further planes only make it longer
            options = NEAR_OPTIONS
            tighter = tighten(self.problem, self.tightening, solution.curve)
            if tighter is not None:
                self.tightening = tighter
            unproved = self.unproved_pairs(solution.curve)
            if unproved or tighter is not None:
                planes_found = self._planes_at_contacts(solution, unproved)
                rejected += bool(unproved)
                contact_planes, guess = contact_planes + planes_found, solution
                if rejected == MAX_REJECTED:
                    radius, contact_planes, rejected = 0.5 * radius, planes_found, 0
                    guess = self._reference
                continue
            if solution.duration < self.best.x[-1]:
                self.best = solution.curve
            if solution.duration > (1.0 - MIN_ROUND_GAIN) * self._reference.duration:
                break
            max_duration = min(max_duration, (1.0 - MIN_ROUND_GAIN) * solution.duration)
            self._reference, self._improved, guess = solution, True, solution
            planes, contact_planes, rejected = self._planes_along(solution), [], 0
            radius = min(1.5 * radius, FIRST_TRUST_RADIUS)
        return self.best

    def _solve(
        self, guess: States, planes: Sequence[Plane], radius: float, options: dict[str, Any]
    ) -> States | None:
        """The minimum-time motion near the reference that keeps the planes, or `None`.

        Args:
            guess: Initial guess of the solver.
            planes: Constraints of the distances.
            radius: Trust radius of the breaks [rad or m].
            options: IPOPT options.
        """
        near = self._reference
        program = TimingProgram(self.problem, near, self.tightening)
        scale, layout, d = program.scale, program.layout, program.layout.joint_count
        low, high = program.bounds()
        nearest = (near.q - radius) / scale.unit(0), (near.q + radius) / scale.unit(0)
        low[layout.q], high[layout.q] = (
            np.clip(bound, low[layout.q], high[layout.q]) for bound in nearest
        )
        # duration of each piece, the state at its start and the acceleration at its end
        pieces = np.vstack((layout.piece_columns[: 1 + 3 * d], layout.a[1:].T))
        plane_block = Block(
            _plane_kernel(d),
            pieces[:, [plane.piece for plane in planes]],
            parameters={
                "fraction": np.array([plane.fraction for plane in planes]),
                "normal": scale.position[:, None]
                * np.reshape([plane.normal for plane in planes], (-1, d)).T,
                "offset": np.array([plane.offset for plane in planes]),
            },
            bounds={"distance": (0.0, np.inf)},
        )
        blocks = [*program.blocks(), plane_block]
        start = np.clip(program.variables_of(guess), low, high)
        solution = solve_program(blocks, start, (low, high), options, reusable=False)
        return states_of(program.motion_of(solution.x)[1]) if solution.solved else None

    def _planes_along(self, states: States) -> list[Plane]:
        """Planes at the constraint points of all pieces."""
        return [
            plane
            for piece in range(len(states.span))
            for fraction in PLANE_FRACTIONS
            if piece or fraction
            for plane in self._planes_at(
                piece, fraction, states.position_at(piece, fraction), MAX_PAIRS
            )
        ]

    def _planes_at(self, piece: int, fraction: float, q: FloatArray, max_pairs: int) -> list[Plane]:
        """Planes at one point, from the distances at a configuration near it."""
        return [
            Plane(
                piece,
                fraction,
                pair.gradient / DISTANCE_UNIT,
                (float(pair.gradient @ q) + self._required_clearance(pair.gap) - pair.gap)
                / DISTANCE_UNIT,
            )
            for pair in self.space.near_pairs(q, MAX_PAIR_GAP, max_pairs)
        ]

    def _required_clearance(self, gap: float) -> float:
        """`CLEARANCE_RESERVE`, or for a nearer pair half of its clearance."""
        return min(CLEARANCE_RESERVE, 0.5 * gap) if gap > 0.0 else CLEARANCE_RESERVE

    def _planes_at_contacts(self, states: States, unproved: Sequence[Clearance]) -> list[Plane]:
        """Planes where the proof fails: at the worst time of each pair, and across its contacts."""
        times = {pair.time for pair in unproved}
        for pair in unproved:
            for low, high in pair.contacts or ([pair.interval] if pair.interval else []):
                count = 3 if high - low > 1e-3 else 1
                times.update(np.linspace(low, high, count + 2)[1:-1].tolist())
        chosen = sorted(times)
        if len(chosen) > MAX_CONTACT_TIMES:
            indices = np.linspace(0, len(chosen) - 1, MAX_CONTACT_TIMES).astype(int)
            chosen = [chosen[k] for k in indices]
        planes = []
        for time in chosen:
            piece, fraction = states.piece_at(time)
            planes += self._planes_at(piece, fraction, states.curve(time), MAX_PAIRS_AT_CONTACT)
        return planes


@lru_cache(maxsize=8)
def _plane_kernel(d: int) -> Kernel:
    """Kernel of the `distance` from a `Plane`, normal · q - offset, at a point of a piece."""
    import casadi as ca

    tau, start, end_acceleration = ca.SX.sym("tau"), ca.SX.sym("start", 3 * d), ca.SX.sym("a1", d)
    parameters = symbols(fraction=1, normal=d, offset=1)
    q, _, _ = state_inside(tau, ca.vertsplit(start, d), end_acceleration, parameters["fraction"])
    distance = ca.dot(parameters["normal"], q) - parameters["offset"]
    return Kernel(ca.vertcat(tau, start, end_acceleration), parameters, {"distance": distance})


class Plane(NamedTuple):
    """A linear constraint at one point of the motion: normal · q >= offset.

    Attributes:
        piece: Index of the piece.
        fraction: Time in the piece as a fraction of its duration, 0 to 1.
        normal: Normal in joint space [1/rad or 1/m], shape (d,).
        offset: Dimensionless offset, of order one.
    """

    piece: int
    fraction: float
    normal: FloatArray
    offset: float
