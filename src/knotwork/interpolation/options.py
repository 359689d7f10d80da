"""What a caller may ask of a planner, and what a planner is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from knotwork.interpolation.hermite import EndAcceleration
from knotwork.interpolation.knots import BalancedKnots
from knotwork.trajectory import JointTrajectory
from knotwork.waypoints import JointWaypoints


@dataclass(frozen=True)
class PlannerOptions:
    """Options of the planners; one that a planner can't honour is an error.

    Attributes:
        knots: Where the rebuilt knots sit: `"paper"` for Eq. (39), `"balanced"`, a
            `BalancedKnots`, or the knot times [s] themselves.
        end_acceleration: `None` to leave the first and last acceleration to the planner,
            `"zero"`, or a pair (start, end) of scalars or arrays of shape (d,)
            [rad/s² or m/s²]. Arrays are kept as tuples, so that options can be compared.
    """

    knots: str | BalancedKnots | ArrayLike = "paper"
    end_acceleration: EndAcceleration = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "knots", _as_tuples(self.knots))
        object.__setattr__(self, "end_acceleration", _as_tuples(self.end_acceleration))

    @property
    def is_default(self) -> bool:
        """Whether nothing but the defaults is asked for."""
        return self == PlannerOptions()


def _as_tuples(value: Any) -> Any:
    """Turn arrays and lists into tuples, however nested; leave everything else as it is."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return tuple(_as_tuples(entry) for entry in value)
    return value


Planner = Callable[[JointWaypoints, PlannerOptions], JointTrajectory]
"""A planner: joint waypoints and options in, a trajectory through them out."""
