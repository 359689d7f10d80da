"""Units stated in a mapping of points, which must be those of the joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from knotwork.documents import Document, Location
from knotwork.errors import did_you_mean
from knotwork.foreign.table import QUANTITIES
from knotwork.foreign.units import SECONDS, is_rate
from knotwork.joint_quantities import rate_unit

KEYS: dict[str, tuple[str, ...]] = {
    "time": ("time_from_start", "time", "times", "t"),
    "position": ("positions", "position", "q"),
    "velocity": ("velocities", "velocity", "qd"),
    "acceleration": ("accelerations", "acceleration", "qdd"),
}
"""Accepted keys of each quantity."""

UNUSED_IN_POINT = ("effort", "efforts", "jerk", "jerks")
_ORDERS = {"joints": 0} | {key: i for i, name in enumerate(QUANTITIES) for key in KEYS[name]}


def check_units(
    document: Document, data: Mapping[str, Any], at: Location, joints: Sequence[tuple[str, str]]
) -> None:
    """Refuse units other than the joints' own: values are read in s and rad or m, as in ROS.

    `units` may be the unit of all joints, a list with one for each, or a mapping: `time`, `joints`,
    a joint's name, or a quantity such as `velocities` to such units.

    Args:
        document: The document.
        data: The part with an optional key `units`.
        at: Location of that part.
        joints: Names and units of the joints as the file lists them.

    Raises:
        DocumentError: A unit differs, or is stated for an unknown name.
    """
    units = data.get("units")
    if units is None or units in ({}, []):
        return
    for key, stated in units.items() if isinstance(units, dict) else [(None, units)]:
        where = (*at, "units") if key is None else (*at, "units", key)
        if stated is None or key in UNUSED_IN_POINT:
            continue
        if key in KEYS["time"]:
            if not isinstance(stated, str) or stated.strip().lower() not in SECONDS:
                raise document.error(where, f"times are in {stated!r}", "'s'")
            continue
        own = [(name, unit) for name, unit in joints if name == key]
        of, order = own or joints, 0 if own or key is None else _ORDERS.get(key)
        if order is None:
            known = ("time", "joints", "positions", "velocities", "accelerations")
            raise document.error(where, "unknown key", did_you_mean(key, known))
        listed = stated if isinstance(stated, list) else [stated] * len(of)
        if len(listed) != len(of):
            raise document.error(where, f"has {len(listed)} entries", f"{len(of)}, as joint names")
        for (name, unit), one in zip(of, listed, strict=True):
            if not isinstance(one, str) or not is_rate(one, unit, order):
                wanted = rate_unit(unit, order)
                raise document.error(where, f"joint {name!r} is in {one!r}", f"{wanted!r}")
