"""Quantities of a joint over time, with units and limits: position, its derivatives, effort."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


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

DERIVATIVES = tuple(quantity.name for quantity in _ALL if quantity.order is not None)
"""Names of position and its derivatives; the index is the order."""

MAGNITUDES = tuple(quantity.name for quantity in _ALL if quantity.limit == "magnitude")
"""Names of the quantities that are limited to the same magnitude on both sides."""
