"""Terms of the objective of a finished curve."""

from __future__ import annotations

import numpy as np

from knotwork.planning.timing.robot_limits import effort_integral
from knotwork.planning.timing.timing_problem import TimingProblem
from knotwork.spline.polynomial import PiecewisePolynomial


def terms(problem: TimingProblem, curve: PiecewisePolynomial) -> dict[str, float]:
    """Unweighted values by name: the time, and the other terms with a weight.

    The integrals run over the motion and are summed over the joints.
    """
    objective, span = problem.objective, np.diff(curve.x)[:, None]
    values = {"time": float(curve.x[-1] - curve.x[0])}
    if objective.jerk:
        values["jerk"] = float(np.sum((6.0 * curve.c[0]) ** 2 * span))
    if objective.acceleration:
        start = 2.0 * curve.c[1]
        end = start + 6.0 * curve.c[0] * span
        values["acceleration"] = float(
            np.sum((start * start + start * end + end * end) * span) / 3.0
        )
    if objective.effort:
        values["effort"] = effort_integral(problem, curve)
    return values


def objective_value(problem: TimingProblem, curve: PiecewisePolynomial) -> float:
    """The objective that is minimised."""
    values = terms(problem, curve)
    return float(sum(getattr(problem.objective, name) * value for name, value in values.items()))
