"""The options of planners, and the type of a planner."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from knotwork.curves.interpolation.knots import BalancedKnots
from knotwork.curves.interpolation.modified_hermite_spline import EndAccelerationLike
from knotwork.curves.trajectory import JointTrajectory
from knotwork.errors import OptionError, suggest_name
from knotwork.waypoints import ChosenSection, JointWaypoints

ACCELERATION_RULES = ("zero", "estimated")
"""Names that `PlannerOptions.accelerations` accepts."""


@dataclass(frozen=True)
class PlannerOptions:
    """Options of the planners. An option that a planner does not support is an error.

    Each planner's `PlannerSpec` names the options that it supports. Arrays are kept as tuples, so
    options can be compared.

    >>> options = kw.interpolation.PlannerOptions(knots="balanced", end_acceleration="zero")
    >>> options.requested
    ('knots', 'end_acceleration')

    Attributes:
        knots: Placement of the rebuilt knots: `"paper"` for Eq. (39), `"balanced"`, a
            `BalancedKnots`, or the knot times [s].
        end_acceleration: `None` to leave the first and last acceleration to the planner, `"zero"`,
            or a pair (start, end) of scalars or arrays of shape (d,) [rad/s² or m/s²].
        accelerations: Accelerations at the waypoints: `None` for the planner's default, `"zero"`,
            `"estimated"` from the neighbouring waypoints, or an array of shape (n, d) [rad/s² or
            m/s²].
        chosen: Sections whose motion was chosen beforehand, in order of time, or `None`.

    Raises:
        OptionError: `accelerations` is neither an accepted name nor finite numbers.
    """

    knots: str | BalancedKnots | ArrayLike = "paper"
    end_acceleration: EndAccelerationLike = None
    accelerations: str | ArrayLike | None = None
    chosen: tuple[ChosenSection, ...] | None = None

    def __post_init__(self) -> None:
        def put(field: str, value: Any) -> None:
            object.__setattr__(self, field, value)

        put("knots", _as_tuples(self.knots))
        put("end_acceleration", _as_tuples(self.end_acceleration))
        if isinstance(self.accelerations, str):
            if self.accelerations not in ACCELERATION_RULES:
                raise OptionError(
                    "accelerations",
                    f"is {self.accelerations!r}; "
                    + suggest_name(self.accelerations, (*ACCELERATION_RULES, "an array")),
                )
        else:
            put("accelerations", _as_tuples(_require_numbers("accelerations", self.accelerations)))

    @property
    def requested(self) -> tuple[str, ...]:
        """Names of the options that differ from the default."""
        return tuple(f.name for f in fields(self) if getattr(self, f.name) != f.default)


def _as_tuples(value: Any) -> Any:
    """Convert nested arrays and lists to tuples, leaving other values unchanged."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return tuple(_as_tuples(entry) for entry in value)
    return value


def _require_numbers(option: str, values: Any) -> Any:
    """Return numbers as an array, and `None` as it is.

    Raises:
        OptionError: Values are not real numbers, or not finite.
    """
    if values is None:
        return None
    try:
        array = np.array(values)
    except ValueError as error:
        raise OptionError(option, f"is {values!r}; its rows differ in length") from error
    if array.dtype.kind not in "iuf":
        raise OptionError(option, f"is {values!r}; it must be real numbers")
    array = array.astype(float)
    bad = np.argwhere(~np.isfinite(array))
    if bad.size:
        index = tuple(int(i) for i in bad[0])
        raise OptionError(option, f"at {list(index)} is {array[index]}; it must be finite")
    return array


class Planner(Protocol):
    """A planner: a function from joint waypoints and options to a trajectory."""

    def __call__(
        self, waypoints: JointWaypoints, options: PlannerOptions | None = None
    ) -> JointTrajectory:
        """Plan a motion.

        Args:
            waypoints: Times [s], shape (n,), positions and velocities [rad or m, per second], shape
                (n, d).
            options: Further options; the defaults for `None`.

        Raises:
            InputError: The planner can't plan these waypoints, or does not support an option.
        """
