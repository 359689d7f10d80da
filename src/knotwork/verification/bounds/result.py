"""`Bound`: a quantity as found and as proved; arguments that every public bound takes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from knotwork.errors.arguments import finite_number
from knotwork.polynomial import PiecewisePolynomial
from knotwork.robot import Robot
from knotwork.trajectory import JointTrajectory
from knotwork.verification.bounds.adaptive import Maximum


class Bound(NamedTuple):
    """The worst of a quantity over a whole motion: as found, and as proved.

    >>> plan = kw.plan("ur5_deburring")
    >>> bound = kw.verification.tool_speed_bound(plan.space.robot, plan.trajectory, limit=1.0)
    >>> bound.ok, bound.proved, bound.value <= bound.bound <= 1.0
    (True, True, True)

    Attributes:
        value: The worst value found; infinite if one is not a finite number.
        time: When [s].
        bound: What the quantity does not pass at any time: its magnitude is never above it, or, for
            the smallest singular value, it is never below it. Rounding is allowed for.
        limit: What it was compared with, or `None`.
        ok: No value found is beyond the limit.
        proved: `ok` is proved: either the bound keeps the limit, or a value breaks it. Without a
            limit: the bound is about as near to the value as it was asked to be. If not, the
            budget ran out, and only samples say so.
        evaluations: At how many times the quantity was computed.
    """

    value: float
    time: float
    bound: float
    limit: float | None
    ok: bool
    proved: bool
    evaluations: int

    @property
    def excess(self) -> float:
        """How far the bound lies beyond the worst value found."""
        return abs(self.bound - abs(self.value))


def upper_bounds(found: Maximum, limits: np.ndarray) -> tuple[Bound, ...]:
    """Say of every component what was proved against its limit (infinite: none)."""
    return tuple(
        Bound(
            float(found.value[i]),
            float(found.time[i]),
            float(found.bound[i]),
            float(limit) if math.isfinite(limit) else None,
            bool(abs(found.value[i]) <= limit),
            bool(found.proved[i]),
            found.evaluations,
        )
        for i, limit in enumerate(limits)
    )


def checked_limit(limit: float | None, what: str) -> float:
    """Return a limit as a number, infinite for none.

    Raises:
        InputError: It is no positive number.
    """
    if limit is None or (isinstance(limit, float) and limit == math.inf):
        return math.inf
    return finite_number(limit, f"the limit of the {what}", positive=True)


def curve_of(robot: Robot, trajectory: JointTrajectory) -> PiecewisePolynomial:
    """Return the motion of a robot's joints in the robot's order.

    Raises:
        InputError: The trajectory is not of the robot's joints.
    """
    owner = f"robot {robot.name!r}"
    return trajectory.reordered(robot.joint_names, robot.joint_units, owner=owner).polynomial
