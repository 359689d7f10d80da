"""Waypoints at rest where the arm's weight alone takes more effort than a limit leaves."""

from __future__ import annotations

import numpy as np

from knotwork.errors import TimingError
from knotwork.joint_quantities import JOINT_QUANTITIES
from knotwork.timing.problem import TimingProblem
from knotwork.timing.safe_numbers import rounded_up


def too_heavy(problem: TimingProblem) -> TimingError | None:
    """Say which joints can't hold still where the motion rests, and what each would need.

    An arm may pass such a place while it falls, so this explains why no motion was found; it does
    not prove that there is none.
    """
    limit = problem.limits.effort
    rests = np.flatnonzero((problem.velocity == 0.0).all(axis=1))
    if not np.isfinite(limit).any() or not rests.size:
        return None
    q = problem.position[rests]
    effort = np.abs(problem.arm.effort(q, np.zeros_like(q), np.zeros_like(q)))
    place, over = effort.argmax(axis=0), np.flatnonzero(effort.max(axis=0) > limit)
    if not over.size:
        return None
    margin, said = problem.limits.margin, []
    for k in over.tolist():
        unit = JOINT_QUANTITIES["effort"].units[problem.joint_units[k]]
        needed = rounded_up(float(effort[place[k], k]) / margin, 4)
        said.append(
            f"at {problem.names[rests[place[k]]]!r} joint {problem.joint_names[k]!r} needs a limit "
            f"of effort above {problem.units.text(needed, unit)} to hold still; it is "
            f"{problem.units.text(float(limit[k]) / margin, unit)}"
        )
    k = int(over[0])
    return TimingError(
        f"no motion was found that keeps all limits: {'; and '.join(said)}"
        f"{problem.limits.said_of_margin}",
        waypoint=int(rests[place[k]]),
        joint=problem.joint_names[k],
        limit="effort",
        value=float(limit[k]),
        bound=float(effort[place[k], k]),
    )
