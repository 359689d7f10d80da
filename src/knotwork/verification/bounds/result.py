"""`Bound`: the worst value of a quantity and its proved bound; common arguments of bounds."""

from __future__ import annotations

import math
from typing import NamedTuple

from knotwork.curves.polynomial import PiecewisePolynomial
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors.arguments import finite_number
from knotwork.robot import Robot


class Bound(NamedTuple):
    """The worst value of a quantity over a whole motion, and its proved bound.

    >>> plan = kw.plan("ur5_deburring")
    >>> bound = kw.verification.tool_speed_bound(plan.space.robot, plan.trajectory, limit=1.0)
    >>> bound.ok, bound.proved, bound.value <= bound.bound <= 1.0
    (True, True, True)

    Attributes:
        value: The worst sample; infinite if a sample is not finite.
        time: Time of that sample [s].
        bound: Upper bound of the magnitude at all times, or lower bound of the smallest singular
            value, including rounding.
        limit: The limit, or `None`.
        ok: Whether all samples keep the limit.
        proved: Whether `ok` is proved, because the bound keeps the limit or a sample violates it.
            Without a limit, whether the bound is as tight as requested. If false, the budget was
            exhausted, and only samples are known.
        evaluations: Number of evaluations of the quantity.
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
        """Difference between the bound and the worst sample."""
        return abs(self.bound - abs(self.value))


def checked_limit(limit: float | None, quantity: str) -> float:
    """Return a limit as a number, infinite for none.

    Raises:
        InputError: The limit is not a positive number.
    """
    if limit is None or (isinstance(limit, float) and limit == math.inf):
        return math.inf
    return finite_number(limit, f"the limit of the {quantity}", positive=True)


def curve_of(robot: Robot, trajectory: JointTrajectory) -> PiecewisePolynomial:
    """Return the motion of a robot's joints in the robot's order.

    Raises:
        InputError: The trajectory is not of the robot's joints.
    """
    owner = f"robot {robot.name!r}"
    return trajectory.reordered(robot.joint_names, robot.joint_units, owner=owner).polynomial
