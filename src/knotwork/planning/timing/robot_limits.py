"""Limits and costs that depend on the robot: kernels and blocks, and values on a curve.

The solver applies limits of effort and tool speed at the breaks and inside the pieces. Between
these points they are sampled and proved afterwards, and tightened where they are exceeded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from knotwork.arrays import FloatArray
from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.planning.timing.nonlinear_program import Block, Kernel, symbols
from knotwork.planning.timing.spline import Layout, Scale
from knotwork.planning.timing.state_limits import problem_state_limits
from knotwork.planning.timing.timing_problem import TimingProblem

if TYPE_CHECKING:
    from knotwork.planning.timing.symbolic_dynamics import Dynamics

SAMPLES_PER_PIECE = 16
"""Samples in each piece, without its end."""

FRACTIONS_IN_PIECE: dict[str, tuple[float, ...]] = {
    "effort": (0.5,),
    "tool_speed": (0.25, 0.5, 0.75),
}
"""Limits, with the fractions of a piece's duration at which the solver applies them.

Tool speed may vary much faster than effort.
"""


def state_inside(tau: Any, start: Sequence[Any], end_acceleration: Any, at: Any) -> Any:
    """Position, velocity and acceleration of the joints in a cubic piece.

    Args:
        tau: Duration of the piece.
        start: Position, velocity and acceleration at its start.
        end_acceleration: Acceleration at its end.
        at: Fraction of its duration at which to give the state.
    """
    q, v, a = start
    t = at * tau
    return (
        q + t * v + t**2 * ((3 - at) * a + at * end_acceleration) / 6,
        v + t * ((2 - at) * a + at * end_acceleration) / 2,
        (1 - at) * a + at * end_acceleration,
    )


def _inside_kernel(
    d: int,
    fractions: Sequence[float],
    parameters: Mapping[str, Any],
    terms: Callable[[Any, list[Any]], tuple[Mapping[str, Any], Any]],
) -> Kernel:
    """Kernel of a piece for terms of the states inside it, with variables `Layout.piece_columns`.

    Args:
        d: Number of joints.
        fractions: Fractions of its duration at which the states are.
        parameters: Parameters in addition to `units` of a state.
        terms: Function from the duration of the piece and the positions, velocities and
            accelerations of the states, in SI units, to the constraints by name and the cost.
    """
    import casadi as ca

    tau, ends, given = ca.SX.sym("tau"), ca.SX.sym("ends", 6 * d), symbols(units=3 * d)
    q0, v0, a0, _, _, a1 = ca.vertsplit(ends, d)
    values = [
        ca.vertcat(*state_inside(tau, (q0, v0, a0), a1, at)) * given["units"] for at in fractions
    ]
    states = [ca.SX.sym(f"state{k}", 3 * d) for k in range(len(fractions))]
    constraints, cost = terms(tau, [ca.vertsplit(state, d) for state in states])
    inner = ca.vertcat(*states), ca.vertcat(*values)
    return Kernel(ca.vertcat(tau, ends), {**given, **parameters}, constraints, cost, inner)


@lru_cache(maxsize=32)
def limit_kernel(dynamics: Dynamics, name: str, *, inside: bool) -> Kernel:
    """Kernel of the `utilisation` of a limit; that of the tool speed is squared.

    Its parameters are the `units` of a state, and the `inverse_limit`.

    Args:
        dynamics: The dynamics of the robot.
        name: Name of the limit in `FRACTIONS_IN_PIECE`.
        inside: Whether the limit applies at its fractions of a piece, whose variables are a column
            of `Layout.piece_columns`; otherwise at a break, of `Layout.state_columns`.
    """
    import casadi as ca

    d = dynamics.robot.dof
    given = symbols(inverse_limit=d if name == "effort" else 1)

    def utilisation(q: Any, v: Any, a: Any) -> Any:
        if name == "effort":
            return dynamics.symbolic_effort(q, v, a) * given["inverse_limit"]
        return ca.sumsqr(dynamics.symbolic_tool_velocity(q, v) * given["inverse_limit"])

    def terms(tau: Any, states: list[Any]) -> tuple[Mapping[str, Any], Any]:
        return {"utilisation": ca.vertcat(*(utilisation(*state) for state in states))}, 0.0

    if inside:
        return _inside_kernel(d, FRACTIONS_IN_PIECE[name], given, terms)
    state, given = ca.SX.sym("state", 3 * d), {**symbols(units=3 * d), **given}
    at_break = utilisation(*ca.vertsplit(state * given["units"], d))
    return Kernel(state, given, {"utilisation": at_break})


def robot_limit_blocks(
    problem: TimingProblem,
    allowed_utilisation: Mapping[str, FloatArray],
    margin: float,
    scale: Scale,
    layout: Layout,
) -> Iterator[Block]:
    """Blocks of limits at the breaks where values are unknown, and inside the pieces.

    Args:
        problem: The problem.
        allowed_utilisation: Allowed utilisation of each limit in `FRACTIONS_IN_PIECE` in the
            program, alternately at each break and inside each piece, shape (2 pieces + 1, d or 1).
        margin: Relative margin to each.
        scale: Units of the program.
        layout: Its variables.
    """
    bound = 1.0 - margin
    for name, allowed in allowed_utilisation.items():
        known = problem.velocity_known
        if name == "effort":
            known = known & problem.acceleration_known
        unknown = np.full(layout.piece_count + 1, True)
        unknown[:: layout.interval_pieces][known] = False
        at_breaks = layout.state_columns[:, unknown], allowed[::2][unknown]
        inside_pieces = layout.piece_columns, allowed[1::2]
        for inside, (columns, utilisation) in ((False, at_breaks), (True, inside_pieces)):
            yield Block(
                limit_kernel(problem.required_dynamics, name, inside=inside),
                columns,
                parameters={
                    "units": scale.state[:, None],
                    "inverse_limit": 1.0 / (utilisation * problem.limit(name)).T,
                },
                bounds={"utilisation": (-bound, bound)},
            )


@lru_cache(maxsize=8)
def work_kernel(dynamics: Dynamics) -> Kernel:
    """Kernel of the integral of effort squared over a piece (Simpson's rule), as a cost.

    Its parameters are the `units` of a state, and the `weight`.
    """
    given = symbols(weight=1)

    def terms(tau: Any, states: list[Any]) -> tuple[Mapping[str, Any], Any]:
        import casadi as ca

        start, middle, end = (ca.sumsqr(dynamics.symbolic_effort(*state)) for state in states)
        return {}, given["weight"] * tau * (start + 4 * middle + end) / 6

    return _inside_kernel(dynamics.robot.dof, (0.0, 0.5, 1.0), given, terms)


def sampled_utilisation(
    problem: TimingProblem, curve: PiecewisePolynomial
) -> Mapping[str, FloatArray]:
    """Largest utilisation at samples of each piece, shape (pieces, d or 1).

    Its keys are the names of those in `FRACTIONS_IN_PIECE` that the problem has.
    """
    names = [name for name in FRACTIONS_IN_PIECE if np.isfinite(problem.limit(name)).any()]
    if not names:
        return {}
    span = np.diff(curve.x)[:, None]
    inside = curve.x[:-1, None] + np.arange(SAMPLES_PER_PIECE) / SAMPLES_PER_PIECE * span
    times = np.minimum(np.hstack((inside, curve.x[1:, None])), curve.x[-1])
    limits = problem_state_limits(problem)
    utilisation = limits.utilisation(curve, times).max(axis=1)
    quantities = np.array([limited.quantity for limited in limits.quantities])
    return {name: utilisation[:, quantities == name] for name in names}


def unproved_utilisation(
    problem: TimingProblem, curve: PiecewisePolynomial, name: str
) -> FloatArray:
    """Utilisation of a limit where it is not proved to be kept, shape (pieces, d or 1).

    It has only the worst value of each joint, in its piece; the others are 0.
    """
    from knotwork.verification.bounds import effort_bound, tool_speed_bound

    robot = problem.required_dynamics.robot
    motion = JointTrajectory(robot.joint_names, curve, joint_units=robot.joint_units)
    if name == "effort":
        bounds = effort_bound(robot, motion, limit=problem.limits.effort)
    else:
        bounds = (tool_speed_bound(robot, motion, limit=problem.tool_speed),)
    utilisations = np.zeros((curve.x.size - 1, len(bounds)))
    for k, (bound, allowed) in enumerate(zip(bounds, problem.limit(name), strict=True)):
        if not (bound.ok and bound.proved):
            piece = int(np.searchsorted(curve.x, bound.time, side="right")) - 1
            worst = max(abs(bound.bound), abs(bound.value))
            utilisations[min(piece, len(utilisations) - 1), k] = worst / allowed
    return utilisations
