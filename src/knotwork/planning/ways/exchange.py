"""Minimum-time motion near a collision-free one: exchange method of semi-infinite programming.

Linearised distances at a few points of each piece are constraints. The proof over all time is the
oracle: where it finds a contact, constraints are added, and the program is solved again. Only
motions proved clear count. The best one is kept, so the iteration may end at any time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.planning.timing.initial_guess import Guess
from knotwork.planning.timing.nonlinear_program import Block, Kernel, solve_program
from knotwork.planning.timing.robot_limits import inner_state
from knotwork.planning.timing.section import Section
from knotwork.planning.timing.spline import Scale
from knotwork.planning.timing.tightening import Tightening, tighten
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.planning.ways.clearance_proof import contacts_of
from knotwork.planning.ways.configurations import Configurations
from knotwork.verification.bounds.clearance import Clearance
from knotwork.waypoints import FloatArray

PLANE_PLACES = (0.0, 1 / 3, 2 / 3)
"""Positions in each piece of the points with distance constraints, as fractions."""

MAX_PAIR_GAP = 0.08
"""Maximum gap of the pairs in constraints [m]."""

MAX_PAIRS = 5
MAX_CUTS = 3
"""Maximum numbers of pairs at a point of the reference, and at a contact."""

FIRST_TRUST_RADIUS = 0.6
LAST_TRUST_RADIUS = 0.01
"""First and last trust radius: distance of breaks from the reference [rad or m]."""

MIN_ROUND_GAIN = 0.003
"""Fraction of the duration. The iteration ends when a round shortens the motion by less."""

CLEARANCE_RESERVE = 1e-3
MAX_CLEARANCE_LOSS = 2e-4
"""Extra clearance in the constraints [m], as a reserve between their points, and the fraction of a
smaller clearance that one round may use.
"""

MAX_EXCHANGES = 25
MAX_CONTACT_TIMES = 30
"""Maximum numbers of rounds, and of contact times per round that become constraints."""

DISTANCE_UNIT = 0.1
"""Unit of distance in the constraints [m]."""

MAX_NORMAL_DEPTH = 5e-3
"""Penetration depth above which Coal's normals are not used [m]."""

PULLBACK_STEPS = 7

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
MIN_SPAN_SHARE = 0.05
"""Minimum duration in the scaling of a piece's equations, relative to the mean duration."""


class Exchange:
    """Search for the minimum-time motion near a collision-free one.

    Args:
        space: Distances at single configurations.
        problem: The states at both ends, positions between them, and the limits.
        first: A motion within the limits that is proved clear.
        times: Times at which it passes the waypoints of the problem [s].
        pieces: Number of pieces of the new motions between consecutive waypoints.
        resolution: Distance to the margin within which a clearance may be undecided [m].

    Attributes:
        best: The shortest motion so far.
    """

    def __init__(
        self,
        space: Configurations,
        problem: TimingProblem,
        first: PiecewisePolynomial,
        times: FloatArray,
        pieces: int,
        resolution: float,
    ) -> None:
        self.space, self.resolution = space, resolution
        velocity, acceleration = np.array(problem.velocity), np.array(problem.acceleration)
        velocity[1:-1] = acceleration[1:-1] = np.nan
        self.problem = replace(problem, velocity=velocity, acceleration=acceleration)
        self.tightening = Tightening(margin=PROGRAM_MARGIN)
        self.best = first
        self._reference = _sample_states(first, times, pieces, problem.limits.acceleration)
        self._improved = False

    def run(self, late: Callable[[], bool], beat: float = np.inf) -> PiecewisePolynomial:
        """Iterate until convergence, and give the best motion.

        Args:
            late: Function that is true when the iteration must end.
            beat: Duration that the motion must be below [s].
        """
        radius, failed, tried = FIRST_TRUST_RADIUS, 0, 0
        guess, options = self._reference, FIRST_OPTIONS
        rows, cuts = self._rows_along(guess), list[Plane]()
        for _ in range(MAX_EXCHANGES):
            if late() or radius < LAST_TRUST_RADIUS:
                break
            solution = self._solve(guess, rows + cuts, radius, options)
            if solution is None:
                failed += 1
                if failed > 2 and self._improved:
                    break
                radius, cuts, tried, guess = 0.4 * radius, [], 0, self._reference
                options = NEAR_OPTIONS if self._improved else FIRST_OPTIONS
                continue
            if solution.duration > beat:
                break  # further rows only make it longer
            options = NEAR_OPTIONS
            tighter = tighten(self.problem, self.tightening, solution.curve)
            if tighter is not None:
                self.tightening = tighter
            hits = contacts_of(self.space.model, solution.curve, self.resolution)
            if hits or tighter is not None:
                cuts_found, tried = self._rows_at_contacts(solution, hits), tried + bool(hits)
                cuts, guess = cuts + cuts_found, solution
                if tried == 3:
                    radius, cuts, tried, guess = 0.5 * radius, cuts_found, 0, self._reference
                continue
            if solution.duration < self.best.x[-1]:
                self.best = solution.curve
            if solution.duration > (1.0 - MIN_ROUND_GAIN) * self._reference.duration:
                break
            beat = min(beat, (1.0 - MIN_ROUND_GAIN) * solution.duration)
            self._reference, self._improved, guess = solution, True, solution
            rows, cuts, failed, tried = self._rows_along(solution), [], 0, 0
            radius = min(1.5 * radius, FIRST_TRUST_RADIUS)
        return self.best

    def _solve(
        self, guess: States, rows: Sequence[Plane], radius: float, options: dict[str, Any]
    ) -> States | None:
        """The minimum-time motion near the reference and beyond planes, or `None`.

        Args:
            guess: Initial guess of the solver.
            rows: Planes.
            radius: Trust radius of the breaks [rad or m].
            options: IPOPT options.
        """
        near = self._reference
        scale = _scale(self.problem, near)
        # the durations of pieces differ more than in other sections, so each has its own scale
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
            options,
            reusable=False,
        )
        return states_of(section.rebuild(solution.x)[1]) if solution.solved else None

    def _units(self, near: States) -> Guess:
        """The motion as a guess, which sets the scale of a section."""
        span = near.span.reshape(len(self.problem.position) - 1, -1)
        duration = span.sum(axis=1)
        velocity = near.v[:: span.shape[1]]
        return Guess(duration, span / duration[:, None], near.curve, velocity)

    def _rows_along(self, states: States) -> list[Plane]:
        """Rows at the constraint points of all pieces."""
        return [
            row
            for piece in range(len(states.span))
            for place in PLANE_PLACES
            if piece or place
            for row in self._rows_at(piece, place, states.position_at(piece, place), MAX_PAIRS)
        ]

    def _rows_at(self, piece: int, place: float, q: FloatArray, max_pairs: int) -> list[Plane]:
        """Rows at one point, from the distances at a configuration near it."""
        return [
            Plane(
                piece,
                place,
                pair.gradient / DISTANCE_UNIT,
                (float(pair.gradient @ q) + self._required_clearance(pair.gap) - pair.gap)
                / DISTANCE_UNIT,
            )
            for pair in self.space.near_pairs(q, MAX_PAIR_GAP, max_pairs)
        ]

    def _required_clearance(self, gap: float) -> float:
        """`CLEARANCE_RESERVE`, or for a nearer pair most of its clearance."""
        if gap <= 0.0:
            return CLEARANCE_RESERVE
        return min(CLEARANCE_RESERVE, max(0.5 * gap, gap - MAX_CLEARANCE_LOSS))

    def _rows_at_contacts(self, states: States, hits: Sequence[Clearance]) -> list[Plane]:
        """Rows where the proof finds contacts: at the worst time, and across each contact."""
        times = {hit.time for hit in hits}
        for hit in hits:
            for low, high in hit.contacts or ([hit.interval] if hit.interval else []):
                count = 3 if high - low > 1e-3 else 1
                times.update(np.linspace(low, high, count + 2)[1:-1].tolist())
        chosen = sorted(times)
        if len(chosen) > MAX_CONTACT_TIMES:
            indices = np.linspace(0, len(chosen) - 1, MAX_CONTACT_TIMES).astype(int)
            chosen = [chosen[k] for k in indices]
        rows = []
        for time in chosen:
            piece, place = states.place_of(time)
            q, clear = states.curve(time), self._reference.position_at(piece, place)
            rows += self._rows_at(piece, place, self._at_surface(q, clear), MAX_CUTS)
        return rows

    def _at_surface(self, q: FloatArray, clear: FloatArray) -> FloatArray:
        """A configuration pulled back from deep inside a body, towards one that is clear."""
        if self.space.worst(q)[0] > -MAX_NORMAL_DEPTH:
            return q
        low, high = 0.0, 1.0
        for _ in range(PULLBACK_STEPS):
            middle = 0.5 * (low + high)
            gap = self.space.worst(clear + middle * (q - clear))[0]
            if -MAX_NORMAL_DEPTH < gap < 0.0:
                return np.asarray(clear + middle * (q - clear))
            low, high = (middle, high) if gap >= 0.0 else (low, middle)
        return np.asarray(clear + low * (q - clear))


def _sample_states(
    curve: PiecewisePolynomial, times: FloatArray, pieces: int, max_acceleration: FloatArray
) -> States:
    """A few pieces that roughly follow a motion.

    This is a first guess, and not a continuous motion.
    """
    places = np.arange((len(times) - 1) * pieces + 1) / pieces
    t = np.interp(places, np.arange(len(times)), times)
    q = curve(t)
    v = np.gradient(q, t, axis=0)
    a = np.clip(np.gradient(v, t, axis=0), -0.5 * max_acceleration, 0.5 * max_acceleration)
    v[[0, -1]], a[[0, -1]] = curve(t[[0, -1]], 1), curve(t[[0, -1]], 2)
    return States(np.diff(t), q, v, a, curve)


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


def _scale(problem: TimingProblem, near: States) -> Scale:
    """Units in which all numbers of the program are of order one."""
    limits, time = problem.limits, 5.0 * float(np.median(near.span))
    moves = limits.velocity * time, limits.acceleration * time**2, limits.jerk * time**3
    return Scale(time, np.min(moves, axis=0))


def _row_parameters(rows: Sequence[Plane], scale: Scale, d: int) -> FloatArray:
    """Positions in the pieces, normals and offsets of the rows."""
    parameters = np.empty((d + 2, len(rows)))
    for k, row in enumerate(rows):
        parameters[:, k] = np.concatenate(([row.place], row.normal * scale.unit(0), [row.offset]))
    return parameters


class Plane(NamedTuple):
    """A linear constraint at one point of the motion: normal · q >= offset.

    Attributes:
        piece: Index of the piece.
        place: Position in the piece, 0 to 1.
        normal: Normal in joint space [1/rad or 1/m], shape (d,).
        offset: Dimensionless offset, of order one.
    """

    piece: int
    place: float
    normal: FloatArray
    offset: float


@dataclass(frozen=True, eq=False)
class States:
    """A motion by its pieces.

    Attributes:
        span: Durations of the pieces [s], shape (n,).
        q, v, a: Positions, velocities, accelerations at the breaks, shape (n + 1, d) each.
        curve: The motion of these states; for a first guess only approximately.
    """

    span: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    curve: PiecewisePolynomial

    @property
    def duration(self) -> float:
        """[s]."""
        return float(self.span.sum())

    def position_at(self, piece: int, place: float) -> FloatArray:
        """Joint positions at a position in a piece, 0 to 1."""
        time = float(self.span[:piece].sum()) + place * float(self.span[piece])
        return np.asarray(self.curve(min(time, float(self.curve.x[-1]))))

    def place_of(self, time: float) -> tuple[int, float]:
        """Piece that contains a time, and the position in it, 0 to 1."""
        x = self.curve.x
        piece = min(max(int(np.searchsorted(x, time, side="right")) - 1, 0), len(x) - 2)
        return piece, float((time - x[piece]) / self.span[piece])


def states_of(curve: PiecewisePolynomial) -> States:
    """The states at the breaks of a cubic motion that begins at time 0."""
    last = np.minimum(curve.x, curve.x[-1])
    return States(np.diff(curve.x), curve(last), curve(last, 1), curve(last, 2), curve)
