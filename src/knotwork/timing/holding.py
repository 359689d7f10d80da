"""Waypoints where the arm's weight alone takes more effort than a limit leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from knotwork.errors import TimingError
from knotwork.joint_quantities import JOINT_QUANTITIES
from knotwork.timing.feasible import ROUNDING
from knotwork.timing.problem import BoolArray, TimingProblem
from knotwork.timing.safe_numbers import rounded_up


@dataclass(frozen=True)
class Overload:
    """A joint that can't hold still at a waypoint.

    Attributes:
        waypoint: Where that takes it most effort.
        joint: Index of the joint.
        effort: What it takes there [N m or N].
    """

    waypoint: int
    joint: int
    effort: float


def overloads(problem: TimingProblem, waypoints: BoolArray) -> list[Overload]:
    """The joints whose limits of effort are too low to hold still at some of these waypoints."""
    limit, rows = problem.limits.effort, np.flatnonzero(waypoints)
    if not np.isfinite(limit).any() or not rows.size:
        return []
    q = problem.position[rows]
    effort = np.abs(problem.arm.effort(q, np.zeros_like(q), np.zeros_like(q)))
    place = effort.argmax(axis=0)
    over = np.flatnonzero((effort > limit * (1.0 + ROUNDING)).any(axis=0)).tolist()
    return [Overload(int(rows[place[k]]), k, float(effort[place[k], k])) for k in over]


def too_heavy(problem: TimingProblem, *, certain: bool) -> list[TimingError]:
    """Say which joints can't hold still where the motion rests, and what each would need.

    Args:
        problem: The task.
        certain: Whether only what proves that there is no motion is an error: an arm whose
            acceleration is chosen may pass such a place while it falls.

    Returns:
        One error, or none.
    """
    rests = (problem.velocity == 0.0).all(axis=1)
    known = rests & (problem.acceleration == 0.0).all(axis=1)
    found = overloads(problem, rests)
    if not found or (certain and not overloads(problem, known)):
        return []
    limits = problem.limits
    said = [
        f"at {needs(problem, one)} to hold still; it is "
        + _text(problem, one.joint, float(limits.effort[one.joint]) / limits.margin)
        for one in found
    ]
    what = "no motion keeps all limits" if certain else "no motion was found that keeps all limits"
    first = found[0]
    return [
        TimingError(
            f"{what}: {'; and '.join(said)}{limits.said_of_margin}",
            waypoint=first.waypoint,
            joint=problem.joint_names[first.joint],
            limit="effort",
            value=float(limits.effort[first.joint]),
            bound=first.effort,
        )
    ]


def needs(problem: TimingProblem, one: Overload) -> str:
    """Where a joint needs which limit of effort, in words."""
    name, waypoint = problem.joint_names[one.joint], problem.names[one.waypoint]
    least = _text(problem, one.joint, rounded_up(one.effort / problem.limits.margin, 4))
    return f"{waypoint!r} joint {name!r} needs a limit of effort above {least}"


def _text(problem: TimingProblem, joint: int, effort: float) -> str:
    unit = JOINT_QUANTITIES["effort"].units[problem.joint_units[joint]]
    return problem.units.text(effort, unit)
