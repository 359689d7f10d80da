"""Quantities of a joint over time: position, its derivatives, effort; and `JointLimits` on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from knotwork.arrays import FloatArray, ReadOnlyArrays, number_array
from knotwork.errors import ArrayError
from knotwork.errors.arguments import require_number
from knotwork.units import Units


@dataclass(frozen=True)
class JointQuantity:
    """One quantity of a joint.

    Attributes:
        name: Name in scenario files and reports, for example `"velocity"`.
        plural: Name in tables of many joints, for example `"velocities"`.
        order: Order of the derivative of position; `None` if it is not a derivative.
        units: SI unit for a revolute (`"rad"`) and for a prismatic (`"m"`) joint.
        limit: `"range"` has a lower and an upper limit, `"magnitude"` the same on both sides.
    """

    name: str
    plural: str
    order: int | None
    units: Mapping[str, str]
    limit: str


def _derivative(name: str, plural: str, order: int, limit: str = "magnitude") -> JointQuantity:
    units = {unit: rate_unit(unit, order) for unit in ("rad", "m")}
    return JointQuantity(name, plural, order, units, limit)


def rate_unit(unit: str, order: int) -> str:
    """Unit of a derivative with respect to time.

    >>> rate_unit("rad", 2)
    'rad/s²'
    """
    return unit + ("", "/s", "/s²", "/s³", "/s⁴")[order]


_ALL = (
    _derivative("position", "positions", 0, "range"),
    _derivative("velocity", "velocities", 1),
    _derivative("acceleration", "accelerations", 2),
    _derivative("jerk", "jerks", 3),
    JointQuantity("effort", "efforts", None, {"rad": "N m", "m": "N"}, "magnitude"),
)

JOINT_QUANTITIES: Mapping[str, JointQuantity] = MappingProxyType(
    {quantity.name: quantity for quantity in _ALL}
)
"""All quantities by name."""

MOTION_QUANTITIES = tuple(quantity.name for quantity in _ALL if quantity.order is not None)
"""Names of position and its derivatives; the index is the order."""

RATE_QUANTITIES = MOTION_QUANTITIES[1:]
"""Names of the derivatives of position, from order 1 on."""

MAGNITUDES = tuple(quantity.name for quantity in _ALL if quantity.limit == "magnitude")
"""Names of the quantities that are limited to the same magnitude on both sides."""

FRAME_ORDERS = MappingProxyType({"tool_speed": 1, "tool_acceleration": 2, "frame_speed": 1})
"""Order of the derivative of a position of tool or link, by the name of the limited quantity."""

_UNLIMITED: Any = None
"""Default of absent limits, which `JointLimits` replaces by infinite ones."""


@dataclass(frozen=True, eq=False)
class JointLimits(ReadOnlyArrays):
    """Limits of joints in SI; an absent limit is infinite.

    `limits[name]` are the limits of one of `MAGNITUDES`. All arrays have shape (d,).

    Attributes:
        velocity: Velocity limits [rad/s or m/s], positive.
        acceleration: Acceleration limits [rad/s² or m/s²], positive; by default infinite.
        jerk: Jerk limits [rad/s³ or m/s³], positive; by default infinite.
        effort: Effort limits [N m or N], positive; by default infinite.
        lower: Lower position limits [rad or m]; by default -infinite.
        upper: Upper position limits [rad or m]; by default infinite.
        used_fraction: Fraction of the full limits that is used: velocity, acceleration, jerk and
            effort are already reduced by it. Errors name it, and propose full limits.

    Raises:
        ArrayError: Values are not numbers, a magnitude is not positive, or a lower limit is above
            its upper one.
        InputError: The used fraction is not a positive number.

    >>> limits = JointLimits([2.0, 2.0], jerk=[40.0, 40.0])
    >>> limits.acceleration, limits["jerk"]
    (array([inf, inf]), array([40., 40.]))
    """

    velocity: FloatArray
    acceleration: FloatArray = _UNLIMITED
    jerk: FloatArray = _UNLIMITED
    effort: FloatArray = _UNLIMITED
    lower: FloatArray = _UNLIMITED
    upper: FloatArray = _UNLIMITED
    used_fraction: float = 1.0

    @classmethod
    def by_joint(cls, names: Sequence[str], tables: Mapping[str, Mapping[str, Any]]) -> JointLimits:
        """Make limits from a table by joint for each quantity; those of positions are pairs."""
        unlimited = {"range": (-np.inf, np.inf), "magnitude": np.inf}
        columns: dict[str, Any] = {
            name: np.array(
                [tables.get(name, {}).get(joint, unlimited[quantity.limit]) for joint in names]
            )
            for name, quantity in JOINT_QUANTITIES.items()
        }
        lower, upper = columns.pop("position").reshape(-1, 2).T
        return cls(**columns, lower=lower, upper=upper)

    def __post_init__(self) -> None:
        d = np.size(self.velocity)
        for name in (*MAGNITUDES, "lower", "upper"):
            limit = getattr(self, name)
            if limit is None:
                limit = np.full(d, -np.inf if name == "lower" else np.inf)
            array = number_array(limit, (d,), f"{name} limit")
            if name in MAGNITUDES and not (array > 0.0).all():
                raise ArrayError(f"{name} limits are {array.tolist()}; give positive ones")
            object.__setattr__(self, name, array)
        if not (self.lower <= self.upper).all():
            raise ArrayError(
                f"position limits run from {self.lower.tolist()} to {self.upper.tolist()}; "
                "each lower one must not be above its upper one"
            )
        require_number(self.used_fraction, "used_fraction", positive=True)

    def __getitem__(self, quantity: str) -> FloatArray:
        if quantity not in MAGNITUDES:
            raise KeyError(quantity)
        return np.asarray(getattr(self, quantity))

    def bounds(self, quantity: str) -> tuple[FloatArray, FloatArray]:
        """Lower and upper limit of a quantity of `JOINT_QUANTITIES`, shape (d,) each."""
        if JOINT_QUANTITIES[quantity].limit == "range":
            return self.lower, self.upper
        return -self[quantity], self[quantity]

    def scaled(self, fraction: float) -> JointLimits:
        """A fraction of the limits of magnitudes; `used_fraction` is multiplied by it, too.

        Raises:
            InputError: The fraction is not a positive number.
        """
        fraction = require_number(fraction, "used_fraction", positive=True)
        magnitudes: dict[str, Any] = {name: fraction * self[name] for name in MAGNITUDES}
        return replace(self, used_fraction=fraction * self.used_fraction, **magnitudes)

    @property
    def full_limits_note(self) -> str:
        """Clause after full limits in messages; empty where all of them are used."""
        if self.used_fraction == 1.0:
            return ""
        return f" (used_fraction is {self.used_fraction:g})"


def limit_text(limit: float, unit: str, units: Units, used_fraction: float) -> str:
    """Text of a limit, with the full limit that it is a fraction of.

    >>> limit_text(1.8, "rad/s", Units(), used_fraction=0.9)
    '1.8 rad/s, 0.9 of 2 rad/s (used_fraction)'
    """
    shown = units.text(limit, unit)
    if used_fraction == 1.0:
        return shown
    full = units.text(limit / used_fraction, unit)
    return f"{shown}, {used_fraction:g} of {full} (used_fraction)"
