"""Waypoints at rest where the arm's weight alone takes more effort than a limit leaves."""

from __future__ import annotations

import numpy as np

from knotwork.errors import TimingError
from knotwork.joint_quantities import JOINT_QUANTITIES
from knotwork.timing.feasible import ROUNDING
from knotwork.timing.problem import TimingProblem
from knotwork.timing.safe_numbers import rounded_up


def too_heavy(problem: TimingProblem, *, certain: bool) -> list[TimingError]:
    """Say which joints can't hold still where the motion rests, and what each would need.

    Args:
        problem: The task.
        certain: Whether only what proves that there is no motion is an error: an arm whose
            acceleration is chosen may pass such a place while it falls.

    Returns:
        One error, or none.
    """
    limit = problem.limits.effort
    rests = (problem.velocity == 0.0).all(axis=1)
    known = rests & (problem.acceleration == 0.0).all(axis=1)
    rows = np.flatnonzero(rests)
    if not np.isfinite(limit).any() or not rows.size:
        return []
    q = problem.position[rows]
    effort = np.abs(problem.arm.effort(q, np.zeros_like(q), np.zeros_like(q)))
    beyond = effort > limit * (1.0 + ROUNDING)
    place, over = effort.argmax(axis=0), np.flatnonzero(beyond.any(axis=0))
    if not over.size or (certain and not beyond[known[rows]].any()):
        return []
    margin, said = problem.limits.margin, []
    for k in over.tolist():
        unit = JOINT_QUANTITIES["effort"].units[problem.joint_units[k]]
        needed = rounded_up(float(effort[place[k], k]) / margin, 4)
        said.append(
            f"at {problem.names[rows[place[k]]]!r} joint {problem.joint_names[k]!r} needs a limit "
            f"of effort above {problem.units.text(needed, unit)} to hold still; it is "
            f"{problem.units.text(float(limit[k]) / margin, unit)}"
        )
    k = int(over[0])
    found = "no motion keeps all limits" if certain else "no motion was found that keeps all limits"
    return [
        TimingError(
            f"{found}: {'; and '.join(said)}{problem.limits.said_of_margin}",
            waypoint=int(rows[place[k]]),
            joint=problem.joint_names[k],
            limit="effort",
            value=float(limit[k]),
            bound=float(effort[place[k], k]),
        )
    ]
